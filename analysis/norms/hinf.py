r"""H-infinity and L-infinity norms of stacks of systems with their peak frequency, over all frequencies or a band, and
stability margin.

A level is proved, not sampled: systems with two states by the parabola of `analysis.norms.two_states`, others by Taylor
bounds of the modal form (`analysis.norms.level_proof`), what that leaves open by Hamiltonian matrices (Boyd, Balakrishnan,
Kabamba 1989; Bruinsma, Steinbuch 1990), and matrices on which rounding would decide by exact rationals
(`analysis.norms.exact_peak`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.checks import positive, square
from analysis.errors import AnalysisError
from analysis.norms.frequency_response import Systems, read_systems
from analysis.norms.modal import modal_form
from analysis.norms.peaks import modal_peaks
from analysis.norms.stability import from_poles, stability
from analysis.norms.two_states import handles, planar_peaks
from analysis.norms.zero import is_zero
from analysis.state_space import given_system
from estimators.arrays import BoolArray, FloatArray
from estimators.display import Display

CHUNK = 500_000  # matrix entries treated at once, to bound memory
SMALL = 4_096  # and systems of two states: what fits a cache


@dataclass(frozen=True, repr=False)
class HinfNorm(Display):
    r"""sup_w sigma_max(G(j w)) for each system; arrays over the leading axes.

    `norm` is attained at `frequency` (rad/s, or rad/sample for a discrete system; inf: approached as w grows). No gain
    exceeds `upper`, which is (1 + tolerance + what rounding does to the gain) norm; inf where that is not shown (more
    than twelve states with nearly dependent eigenvectors). Rounding is bounded to first order, as a backward error of
    the eigenvalues; with three or more inputs and outputs a level rests on computed eigenvalues of a Hamiltonian
    matrix. A system that is not stable has the norm inf and the frequency NaN. One that is `undecided`, with a pole on
    the stability boundary within the precision of its entries, has the norm NaN and the upper bound inf.
    """

    norm: FloatArray
    frequency: FloatArray
    upper: FloatArray
    undecided: BoolArray


def hinf_norm(
    A: Any,
    B: ArrayLike | None = None,
    C: ArrayLike | None = None,
    D: ArrayLike | None = None,
    discrete: bool | None = None,
    tolerance: float = 1e-9,
    band: tuple[float, float] | None = None,
) -> HinfNorm:
    r"""||G||_inf = sup_w sigma_max(C (s I - A)^-1 B + D), s = j w or z = e^{j w}, for stacks with any leading axes.

    A (..., n, n), B (..., n, m), C (..., p, n), D (..., p, m) or None for zero; leading axes broadcast; or a system object in
    the place of A (`analysis.state_space`). A pole that is not strictly stable gives inf, whether inputs and outputs see it
    or not (internal stability). `tolerance` is relative. `band` = (w1, w2) asks for the largest gain between two frequencies
    in rad/s (rad/sample up to pi; inf is allowed), of stable systems. Raises AnalysisError for matrices that are not finite,
    not square or do not fit.

    >>> found = hinf_norm([[0.0, 1.0], [-1.0, -0.1]], [[0.0], [1.0]], [[1.0, 0.0]])  # 1/(s^2 + 0.1 s + 1)
    >>> round(float(found.norm), 6), round(float(found.frequency), 4)
    (10.012523, 0.9975)
    >>> import control
    >>> bool(hinf_norm(control.tf([1], [1, 1])).upper < 1.0 + 1e-8)
    True
    """
    return _norm((A, B, C, D, discrete), tolerance, band, stable=True)


def linf_norm(
    A: Any,
    B: ArrayLike | None = None,
    C: ArrayLike | None = None,
    D: ArrayLike | None = None,
    discrete: bool | None = None,
    tolerance: float = 1e-9,
    band: tuple[float, float] | None = None,
) -> HinfNorm:
    r"""||G||_Linf = sup_w sigma_max(G(j w)) of systems that may be unstable; everything else as in `hinf_norm`.

    Only a pole on the boundary itself gives inf (also one that inputs and outputs do not see), or `undecided` where precision
    ends.

    >>> float(linf_norm([[1.0]], [[1.0]], [[1.0]]).norm)  # 1/(s - 1)
    1.0
    """
    return _norm((A, B, C, D, discrete), tolerance, band, stable=False)


def stability_margin(A: Any, discrete: bool | None = None) -> FloatArray:
    """max_i Re lambda_i(A) in 1/s, or max_i |lambda_i(A)| - 1 per sample: negative is stable (P3 section IV, SM).

    A (..., n, n) gives an array over the leading axes, a system object its margin. Raises AnalysisError for matrices that are
    not square or finite.

    >>> float(stability_margin([[-3.0, 1.0], [0.0, -0.5]]))
    -0.5
    """
    A, *_, discrete = given_system(A, discrete=discrete)
    eigenvalues = np.linalg.eigvals(square("A", A))
    return np.asarray(np.abs(eigenvalues).max(axis=-1) - 1.0 if discrete else eigenvalues.real.max(axis=-1))


def _norm(given: tuple[Any, ...], tolerance: float, band: tuple[float, float] | None, stable: bool) -> HinfNorm:
    if not 1e-13 <= positive("tolerance", tolerance) < 1.0:
        raise AnalysisError(f"tolerance = {tolerance:g} must lie between 1e-13 and 1; rounding decides below")
    shape, systems = read_systems(*given)
    ends = _band(band, systems.discrete)
    norm, frequency, upper = (np.empty(len(systems)) for _ in range(3))
    undecided = np.empty(len(systems), bool)
    step = SMALL if handles(systems) else max(1, CHUNK // (16 * systems.A.shape[-1] ** 2))
    for start in range(0, len(systems), step):
        part = slice(start, start + step)
        with np.errstate(all="ignore"):  # what overflows is not finite, is not proved, and goes on to the next method
            norm[part], frequency[part], upper[part], undecided[part] = _flat(
                systems.pick(part), tolerance, ends, stable
            )
    if systems.discrete:
        frequency = 2.0 * np.arctan(frequency)
    return HinfNorm(norm.reshape(shape), frequency.reshape(shape), upper.reshape(shape), undecided.reshape(shape))


def _band(band: tuple[float, float] | None, discrete: bool) -> tuple[float, float]:
    """Ends as frequencies of continuous systems."""
    if band is None:
        return 0.0, np.inf
    try:
        low, high = (float(w) for w in band)
    except (TypeError, ValueError):
        raise AnalysisError(f"band = {band!r} must be two frequencies (w1, w2)") from None
    most = np.pi if discrete else np.inf
    if not 0.0 <= low < high <= most:
        raise AnalysisError(
            f"band = ({low:g}, {high:g}) must rise between 0 and {'pi rad/sample' if discrete else 'infinity (rad/s)'}"
        )
    if not discrete:
        return low, high
    return float(np.tan(0.5 * low)), np.inf if high == np.pi else float(np.tan(0.5 * high))


def _flat(
    systems: Systems, tolerance: float, ends: tuple[float, float], stable: bool
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    small = handles(systems)
    modal = None if small else modal_form(systems, ends)
    found = stability(systems.A, systems.discrete) if modal is None else from_poles(
        systems.A, modal.given, modal.sizes, systems.discrete
    )  # fmt: skip
    good, bad = (found.stable, found.unstable) if stable else (found.clear, found.on_edge)
    g = len(systems)
    norm, frequency, upper = np.where(bad, np.inf, np.nan), np.full(g, np.nan), np.full(g, np.inf)
    undecided = ~(good | bad)
    zero, exact = is_zero(systems)
    upper[good & exact] = 0.0
    index = np.flatnonzero(good & ~exact)
    whole = len(index) == g
    band = np.empty((2, len(index)))
    band[0], band[1] = ends
    some = systems if whole else systems.pick(index)
    if modal is None:
        norm[index], frequency[index], upper[index], proved = planar_peaks(some, band, tolerance)
        index, band = index[~proved], band[:, ~proved]
        some = systems.pick(index)
        modal = modal_form(some, ends) if len(index) else None
    elif not whole:
        modal = modal.pick(index)
    if modal is not None and len(index):
        norm[index], frequency[index], upper[index] = modal_peaks(some, modal, band, tolerance)
    faint = good & zero
    norm[faint] = frequency[faint] = 0.0  # what is left is rounding; `upper` bounds it
    return norm, frequency, upper, undecided
