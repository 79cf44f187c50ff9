r"""Kalman filtering with intermittent measurements: critical arrival rates (Sinopoli et al. 2004).

x+ = A x + w, y = C x + v, measurements arriving independently with probability a. Two questions, two numbers:

* static gain: is there one K with mean-square stable error, radius of a S(A - K C) + (1 - a) S(A) < 1? The smallest such a is the
  lambda-bar of Sinopoli et al. (Theorem 5) and solves their LMI exactly: for 0 < Y <= I and Z,

      [Y, sqrt(a) (Y A + Z C), sqrt(1-a) Y A;  *, Y, 0;  *, 0, Y] > 0,    K = -Y^-1 Z.

* Kalman filter: is E P(k) bounded, with the gain that follows every realisation of the arrivals? Its critical rate lies between
  1 - 1/max|lambda|^2 and lambda-bar, and equals the lower bound where unstable eigenvalues of one modulus are told apart by one
  measurement (non-degenerate systems, Mo and Sinopoli 2012).

With one output the answer is known: a static gain exists exactly for a > 1 - 1/prod |lambda_u|^2 over the eigenvalues outside
the unit circle, because the least ||T||^2 of T = C (z I - A + K' C)^-1 K' is that product less one, and K = K'/a is mean-square
stable where (1 - a) ||T||^2 < a [Elia2005]. K' is the limit of Kalman gains for vanishing process noise.

Beside the LMI stands its nonlinear Perron problem, Phi_a(X) = min over K of (1-a) A X A' + a (A - K C) X (A - K C)'. A matrix
X >= 0, X != 0 with Phi_a(X) >= X shows that no gain whatever is stable at a: a refutation without a solver.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from analysis.checks import probability
from analysis.drops.arrival_gains import (
    checked_plant,
    limit_gain,
    lmi_gain,
    perron,
    refutes,
    static_gain_certain,
    static_gain_radius,
)
from analysis.errors import AnalysisError
from analysis.markov.enclosure import EPS
from analysis.markov.second_moment import lifted, spectral_radius
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Method = Literal["riccati", "lmi"]


@dataclass(frozen=True)
class StaticGain:
    """Verdict on one arrival rate. CERTIFIED: `gain` K (n, k) has the radius `radius` < 1 for all data
    that round to these. REFUTED: no gain is stable."""

    verdict: Verdict
    arrival: float
    gain: FloatArray
    radius: float


@dataclass(frozen=True, repr=False)
class CriticalArrival(Display):
    """Bracket of the critical arrival rate: `lower` is refuted, and the static `gain` K (n, k) has `radius` < 1 at `arrival`.

    `upper` is that rate, or with one output the same as `lower`: the answer is a theorem then. `verdict` is CERTIFIED if the
    bracket is as narrow as asked for.
    """

    verdict: Verdict
    lower: float
    upper: float
    gain: FloatArray
    radius: float
    arrival: float


@dataclass(frozen=True, repr=False)
class KalmanArrival(Display):
    """Bounds of the critical arrival rate of the Kalman filter; `exact` if a theorem makes the lower bound the answer."""

    lower: float
    upper: float
    exact: bool
    reason: str
    static: CriticalArrival


def certify_static_gain(
    A: ArrayLike, C: ArrayLike | None, arrival: float, method: Method = "riccati", settings: LmiSettings | None = None
) -> StaticGain:
    """Whether some static gain is mean-square stable at this arrival rate.

    The gain comes from the nonlinear Perron problem (method "riccati") or from the LMI (method "lmi"), and is checked by its
    radius alone; a refutation is one matrix inequality by either method. Raises AnalysisError for matrices that do not fit.
    """
    plant, output = checked_plant(A, C)
    a = float(probability("arrival", arrival))
    if method not in get_args(Method):
        raise AnalysisError(unknown("method", str(method), get_args(Method)))
    single = _single_output_rate(plant, output)
    if single is not None and method == "riccati":
        gain, radius = limit_gain(plant, output, a)
        if static_gain_certain(plant, output, gain, a):
            return StaticGain(Verdict.CERTIFIED, a, gain, radius)
        return StaticGain(Verdict.REFUTED if a <= _sure_rate(plant) else Verdict.INCONCLUSIVE, a, gain, radius)
    X, gain = perron(plant, output, a)
    candidate = gain if method == "riccati" else lmi_gain(plant, output, a, settings)
    if candidate is not None:
        gain, radius = candidate, float(static_gain_radius(plant, output, candidate, a))
        if static_gain_certain(plant, output, gain, a):
            return StaticGain(Verdict.CERTIFIED, a, gain, radius)
    else:
        radius = float(static_gain_radius(plant, output, gain, a))
    refuted = refutes(plant, output, a, X)
    return StaticGain(Verdict.REFUTED if refuted else Verdict.INCONCLUSIVE, a, gain, radius)


def static_critical_arrival(
    A: ArrayLike,
    C: ArrayLike | None = None,
    tolerance: float = 1e-9,
    method: Method = "riccati",
    settings: LmiSettings | None = None,
) -> CriticalArrival:
    """Bracket of the smallest arrival rate at which one static gain is mean-square stable (lambda-bar).

    0 for a stable A. Raises AnalysisError for matrices that do not fit, or a pair that no gain stabilises even if every
    measurement arrives (undetectable).

    >>> round(static_critical_arrival([[1.25]], [[1.0]]).upper, 6)  # 1 - 1/1.25^2
    0.36
    """
    plant, output = checked_plant(A, C)
    if not 0.0 < tolerance < 1.0:
        raise AnalysisError(f"tolerance = {tolerance} must lie between 0 and 1")
    none = np.zeros((plant.shape[0], output.shape[0]))
    open_radius = float(spectral_radius(lifted(plant)))
    if open_radius < 1.0:
        return CriticalArrival(Verdict.CERTIFIED, 0.0, 0.0, none, open_radius, 0.0)
    _require_detectable(plant, output)
    single = _single_output_rate(plant, output)
    if single is not None and method == "riccati":
        for arrival in (
            *(single + (1.0 - single) * tolerance * 10.0**k for k in range(12) if tolerance * 10.0**k < 1.0),
            1.0,
        ):
            best = certify_static_gain(plant, output, arrival)
            if best.verdict is Verdict.CERTIFIED:
                return CriticalArrival(Verdict.CERTIFIED, single, single, best.gain, best.radius, arrival)
        raise AnalysisError("no static gain was found that is stable with every measurement; scale the states")
    best = certify_static_gain(plant, output, 1.0, method, settings)
    if best.verdict is not Verdict.CERTIFIED:
        raise AnalysisError("no static gain was found that is stable with every measurement; scale the states")
    low, high, narrow = lower_bound(plant), 1.0, True
    while high - low > tolerance:
        answer = certify_static_gain(plant, output, 0.5 * (low + high), method, settings)
        if answer.verdict is Verdict.CERTIFIED:
            best, high = answer, answer.arrival
        elif answer.verdict is Verdict.REFUTED:
            low = answer.arrival
        else:
            narrow = False  # between the two proofs: report the bracket as it is
            break
    verdict = Verdict.CERTIFIED if narrow else Verdict.INCONCLUSIVE
    return CriticalArrival(verdict, low, high, best.gain, best.radius, high)


def kalman_critical_arrival(
    A: ArrayLike,
    C: ArrayLike | None = None,
    tolerance: float = 1e-9,
    method: Method = "riccati",
    settings: LmiSettings | None = None,
) -> KalmanArrival:
    """Bounds of the arrival rate below which the expected covariance of the Kalman filter grows without bound.

    Raises AnalysisError as `static_critical_arrival`. Noise covariances do not enter, as long as process noise reaches every
    unstable direction.

    >>> found = kalman_critical_arrival([[1.25]], [[1.0]])
    >>> round(found.upper, 6)  # 1 - 1/1.25^2
    0.36
    """
    plant, output = checked_plant(A, C)
    static = static_critical_arrival(plant, output, tolerance, method, settings)
    low = lower_bound(plant)
    exact, reason = _nondegenerate(plant, output)
    return KalmanArrival(low, low if exact else static.upper, exact, reason, static)


def lower_bound(A: FloatArray) -> float:
    """max(0, 1 - 1/max|lambda|^2): below it, the gaps between measurements alone make the second moment diverge."""
    return max(0.0, 1.0 - 1.0 / max(float(spectral_radius(A)) ** 2, 1.0))


def _require_detectable(A: FloatArray, C: FloatArray) -> None:
    n = A.shape[0]
    for value in np.linalg.eigvals(A):
        if abs(value) < 1.0:
            continue
        pencil = np.vstack([A - value * np.eye(n), C / max(float(np.linalg.norm(C)), np.finfo(float).tiny)])
        if np.linalg.svd(pencil, compute_uv=False)[-1] <= 1e-10 * max(1.0, float(np.linalg.norm(A))):
            raise AnalysisError(
                f"(A, C) is not detectable: the mode at eigenvalue {value:.6g} cannot be seen, so no arrival rate suffices"
            )


def _single_output_rate(A: FloatArray, C: FloatArray) -> float | None:
    """1 - 1/prod |lambda_u|^2 for one output, None for several."""
    size = np.abs(np.linalg.eigvals(A))
    return 1.0 - 1.0 / float(np.prod(size[size > 1.0] ** 2)) if C.shape[0] == 1 else None


def _sure_rate(A: FloatArray) -> float:
    """1 - 1/prod |lambda_u|^2 with every modulus made smaller by what rounding may move it: Wilkinson's condition, or
    [Elsner1985].
    """
    n, norm = len(A), float(np.linalg.norm(A))
    values, vectors = np.linalg.eig(A)
    error = 8.0 * n * EPS * norm
    moved = np.full(n, (2.1 * norm) ** (1.0 - 1.0 / n) * error ** (1.0 / n))
    if np.linalg.slogdet(vectors)[0] != 0.0:
        moved = np.minimum(moved, error * np.linalg.norm(np.linalg.inv(vectors), axis=1))
    size = np.abs(values) - moved
    return 1.0 - 1.0 / float(np.prod(size[size > 1.0] ** 2))


def _nondegenerate(A: FloatArray, C: FloatArray) -> tuple[bool, str]:
    """Whether one measurement tells apart all unstable eigenvalues of one modulus, with diagonalisable unstable part."""
    values, vectors = np.linalg.eig(A)
    if np.linalg.cond(vectors) > 1e8:
        return False, "A is (nearly) defective: no theorem gives the exact rate, the bounds stand"
    unstable = np.flatnonzero(np.abs(values) >= 1.0)
    seen = C @ vectors[:, unstable]
    moduli = np.abs(values[unstable])
    for modulus in moduli:
        block = np.abs(moduli - modulus) <= 1e-9 * modulus
        columns = seen[:, block]
        if np.linalg.matrix_rank(columns, tol=1e-9 * max(float(np.linalg.norm(C)), 1e-300)) < int(block.sum()):
            count = int(block.sum())
            return (
                False,
                f"{count} eigenvalues of modulus {modulus:.6g} are not told apart by one measurement: bounds only",
            )
    return True, "unstable eigenvalues of one modulus are told apart by one measurement (Mo and Sinopoli 2012)"
