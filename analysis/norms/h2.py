r"""H2 norm of stacks of systems: trace(C X C')^(1/2) with the controllability gramian X, by doubling."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.norms.frequency_response import read_systems
from analysis.norms.gramians import gramian_matrix
from analysis.norms.stability import stability
from estimators.arrays import FloatArray


def h2_norm(
    A: Any,
    B: ArrayLike | None = None,
    C: ArrayLike | None = None,
    D: ArrayLike | None = None,
    discrete: bool | None = None,
) -> FloatArray:
    r"""||G||_2^2 = trace(C X C') with A X + X A' + B B' = 0, or trace(C X C' + D D') with X = A X A' + B B'.

    Stacks or a system object as in `hinf_norm`; an array over the leading axes. Unstable systems give inf, and so does a
    continuous system with D != 0 (white noise passes straight through); NaN where a pole lies on the stability boundary
    within the precision of the data. Raises AnalysisError for matrices that do not fit or are not finite.

    >>> round(float(h2_norm([[-2.0]], [[1.0]], [[1.0]])), 12)  # 1/(s + 2): sqrt(1/4)
    0.5
    """
    shape, systems = read_systems(A, B, C, D, discrete)
    discrete, found = systems.discrete, stability(systems.A, systems.discrete)
    feedthrough = systems.D.any(axis=(-2, -1)) & (not discrete)
    index = np.flatnonzero(found.stable & ~feedthrough)
    out = np.where(found.undecided, np.nan, np.inf)
    part = systems.pick(index)
    energy = np.einsum("gij,gjk,gik->g", part.C, gramian_matrix(part.A, part.B, discrete), part.C)
    if discrete:
        energy = energy + (part.D**2).sum(axis=(-2, -1))
    out[index] = np.sqrt(np.maximum(energy, 0.0))
    return out.reshape(shape)
