r"""H-infinity norm with its peak frequency, and stability margin, of stacks of systems.

The whole batch is treated at once by the two-step method (Bruinsma, Steinbuch 1990): a lower
bound gamma is raised to the largest gain found between the frequencies at which the level (1 + tolerance) gamma is
crossed; these are imaginary eigenvalues of a Hamiltonian matrix, so no peak can hide between the points of a grid.
Convergence is quadratic: three or four rounds, and only systems that are not finished take part in the next one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.checks import positive, square
from analysis.errors import AnalysisError
from analysis.norms.frequency_response import Systems, read_systems
from analysis.norms.hamiltonian import between, gain_at, near_axis, surely_clear, to_continuous
from analysis.norms.lower_bound import starting_bound
from analysis.state_space import given_system
from estimators.arrays import FloatArray

ROUNDS = 40
CHUNK = 4_000_000  # matrix entries treated at once, to bound memory


@dataclass(frozen=True)
class HinfNorm:
    """sup_w sigma_max(G(j w)) for each system; arrays over the leading axes.

    `norm` is attained at `frequency` (rad/s, or rad/sample for a discrete system; inf: approached as w grows; NaN:
    unstable, the norm is inf). No system exceeds `upper` = (1 + tolerance) norm: its Hamiltonian matrix has no imaginary
    eigenvalue at that level.
    """

    norm: FloatArray
    frequency: FloatArray
    upper: FloatArray


def hinf_norm(
    A: Any,
    B: ArrayLike | None = None,
    C: ArrayLike | None = None,
    D: ArrayLike | None = None,
    discrete: bool | None = None,
    tolerance: float = 1e-9,
) -> HinfNorm:
    r"""||G||_inf = sup_w sigma_max(C (s I - A)^-1 B + D), s = j w or z = e^{j w}, for stacks with any leading axes.

    A (..., n, n), B (..., n, m), C (..., p, n), D (..., p, m) or None for zero; leading axes broadcast; or a
    system object in the place of A (`analysis.state_space`). A pole that is not
    strictly stable gives inf, whether inputs and outputs see it or not (internal stability). `tolerance` is relative.
    Raises AnalysisError for matrices that are not finite, not square or do not fit, and if a search does not settle.
    """
    if not 1e-13 <= positive("tolerance", tolerance) < 1.0:
        raise AnalysisError(f"tolerance = {tolerance:g} must lie between 1e-13 and 1; rounding decides below")
    shape, systems = read_systems(A, B, C, D, discrete)
    norm, frequency, upper = (np.empty(len(systems)) for _ in range(3))
    step = max(1, CHUNK // (4 * systems.A.shape[-1] ** 2))
    for start in range(0, len(systems), step):
        part = slice(start, start + step)
        norm[part], frequency[part], upper[part] = _flat(systems.pick(part), tolerance)
    return HinfNorm(norm.reshape(shape), frequency.reshape(shape), upper.reshape(shape))


def stability_margin(A: Any, discrete: bool | None = None) -> FloatArray:
    """max_i Re lambda_i(A) in 1/s, or max_i |lambda_i(A)| - 1 per sample: negative is stable (P3 section IV, SM).

    A (..., n, n) gives an array over the leading axes, a system object its margin. Raises AnalysisError for matrices that are not
    square or finite.
    """
    A, *_, discrete = given_system(A, discrete=discrete)
    eigenvalues = np.linalg.eigvals(square("A", A))
    return np.asarray(np.abs(eigenvalues).max(axis=-1) - 1.0 if discrete else eigenvalues.real.max(axis=-1))


def _flat(systems: Systems, tolerance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    poles = systems.poles()
    stable = (np.abs(poles) < 1.0 if systems.discrete else poles.real < 0.0).all(axis=-1)
    norm, upper = np.full(len(systems), np.inf), np.full(len(systems), np.inf)
    frequency = np.full(len(systems), np.nan)
    if not stable.any():
        return norm, frequency, upper
    index = np.flatnonzero(stable)
    good = systems if len(index) == len(systems) else systems.pick(index)
    continuous = to_continuous(good)
    if systems.discrete:
        poles = np.zeros(poles.shape, complex)
        poles[index] = continuous.poles()
    norm[index], frequency[index] = starting_bound(good, continuous, poles[index])
    upper[index] = norm[index]
    active = index[norm[index] > 0.0]
    for _ in range(ROUNDS):
        if not len(active):
            break
        rows = np.searchsorted(index, active)
        level = norm[active] * (1.0 + tolerance)
        upper[active] = level
        unclear = ~surely_clear(continuous if len(rows) == len(good) else continuous.pick(rows), level)
        active, rows, level = active[unclear], rows[unclear], level[unclear]
        candidates = near_axis(continuous if len(rows) == len(good) else continuous.pick(rows), level)
        count = np.isfinite(candidates).sum(axis=-1)
        crossed = count > 0  # no eigenvalue near the axis: the level is an upper bound
        active, rows, level = active[crossed], rows[crossed], level[crossed]
        if not len(active):
            break
        tried = between(candidates[crossed, : count.max()])
        gain = gain_at(good.pick(rows), tried)
        best = gain.argmax(axis=-1)[:, None]
        peak, where = np.take_along_axis(gain, best, -1)[:, 0], np.take_along_axis(tried, best, -1)[:, 0]
        raised = peak > norm[active]
        norm[active[raised]], frequency[active[raised]] = peak[raised], where[raised]
        active = active[peak > level]  # a candidate with no gain above the level was none
    if len(active):
        raise AnalysisError(
            f"the peak search of {len(active)} of {len(systems)} systems did not settle in {ROUNDS} rounds; "
            "raise the tolerance or balance the states"
        )
    if systems.discrete:
        frequency = 2.0 * np.arctan(frequency)
    return norm, frequency, upper
