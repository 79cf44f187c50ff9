"""The bounded real lemma as a second opinion on H-infinity norms: whether the gain reaches a level."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.errors import AnalysisError
from analysis.norms.frequency_response import read_systems, sigma_max
from analysis.norms.hamiltonian import between, gain_at, near_axis, to_continuous
from analysis.norms.stability import require_stable
from estimators.arrays import BoolArray


def crosses_level(
    A: Any,
    B: ArrayLike | None = None,
    C: ArrayLike | None = None,
    D: ArrayLike | None = None,
    gamma: ArrayLike = np.nan,
    discrete: bool | None = None,
) -> BoolArray:
    r"""Whether sigma_max(G) reaches the level gamma > 0 at some frequency: boolean array over the leading axes.

    Stacks or a system object as in `hinf_norm`; gamma broadcasts to the leading axes.

    False is the bounded real lemma: the H-infinity norm is below gamma. Both answers rest on the Hamiltonian matrix, not on a
    sweep: its eigenvalues near the axis are candidates, and the gain is evaluated at and between them. Raises AnalysisError
    for unstable systems, which have no H-infinity norm to compare.
    """
    shape, systems = read_systems(A, B, C, D, discrete)
    level = np.broadcast_to(np.asarray(gamma, float), shape).reshape(-1)
    if not (np.isfinite(level) & (level > 0.0)).all():
        raise AnalysisError(f"level gamma = {level.min(initial=np.inf):g} must be finite and positive")
    require_stable(systems.A, systems.discrete)
    continuous = to_continuous(systems)
    above = sigma_max(continuous.D) < level
    safe = np.where(above, level, 2.0 * sigma_max(continuous.D) + 1.0)
    ends = np.zeros(len(level)), np.full(len(level), np.inf)
    seen = gain_at(systems, between(near_axis(continuous, safe), *ends)).max(axis=-1)
    static = gain_at(systems, np.zeros((len(level), 1)))[:, 0]
    return np.asarray((~above | (np.maximum(seen, static) >= level)).reshape(shape))
