"""Error bounds that the papers state for the force observers: exponential decay to a residual."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.optimize import minimize_scalar

from analysis.checks import as_stack, positive
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, repr=False)
class ExponentialBound(Display):
    """|e(t)| <= initial exp(-decay_rate t) + ultimate, decay_rate in 1/s, the others in the unit of e."""

    shown_units: ClassVar = {"decay_rate": "1/s"}

    initial: float
    decay_rate: float
    ultimate: float

    def at(self, time: ArrayLike) -> FloatArray:
        """The bound at times in s since the start, any shape; raises AnalysisError for negative times."""
        t = as_stack("time [s]", time, ndim=0)
        if t.size and t.min() < 0.0:
            raise AnalysisError(f"time = {t.min():g} s is before the start; give times >= 0")
        return np.asarray(self.initial * np.exp(-self.decay_rate * t) + self.ultimate)


def wheel_error_matrix(eta1: float, eta2: float, wheel_inertia: float, radius: float) -> FloatArray:
    r"""K of [e_omega'; e_omega''] = K [e_omega; e_omega'] (P1 (7)); eta1 in N*s, eta2 in N*m, inertia in kg*m^2, radius in m.

    I_w s^2 + R_e eta1 s + eta2 has both roots in the left half-plane exactly when both gains are positive.
    """
    inertia, arm = positive("wheel_inertia [kg*m^2]", wheel_inertia), positive("radius [m]", radius)
    gains = as_stack("[eta1, eta2]", [eta1, eta2], ndim=1)
    return np.array([[0.0, 1.0], [-gains[1] / inertia, -arm * gains[0] / inertia]])


def wheel_error_is_hurwitz(eta1: float, eta2: float, wheel_inertia: float, radius: float) -> bool:
    """Whether K of P1 (7) is Hurwitz, by Routh-Hurwitz: trace below zero and determinant above it, no tolerance.

    >>> wheel_error_is_hurwitz(50.0, 300.0, wheel_inertia=1.7, radius=0.33)
    True
    """
    K = wheel_error_matrix(eta1, eta2, wheel_inertia, radius)
    return bool(K[1, 1] < 0.0 and K[1, 0] < 0.0)


def force_observer_bound(eta3: float, disturbance_rate: float, initial_error: float = 0.0) -> ExponentialBound:
    r"""P1 Proposition 1: |e_F(t)| <= e^{-eta3 t} |e_F(0)| + sup|Omega_f'| / eta3 [N], after e_omega has died out.

    e_F' = -eta3 e_F + Omega_f' (P1 (8)); eta3 in 1/s, `disturbance_rate` = sup|Omega_f'| in N/s. Attained: a ramp of that
    slope leads to exactly the ultimate value. Raises AnalysisError unless eta3 > 0.

    >>> force_observer_bound(20.0, disturbance_rate=4000.0).ultimate  # N
    200.0
    """
    rate = positive("eta3 [1/s]", eta3)
    return ExponentialBound(
        _size("initial_error [N]", initial_error), rate, _size("disturbance_rate [N/s]", disturbance_rate) / rate
    )


def unknown_input_bound(
    gain: float, disturbance: float, initial_error: float = 0.0, split: float = 0.5
) -> ExponentialBound:
    r"""P2 Theorem 1: |e(t)| <= |e(0)| e^{-K (1 - xi) t} + b / (2 K sqrt(xi (1 - xi))), 0 < xi < 1 (P2 (6)-(9)).

    e' = -K e - B, |B| <= b; `gain` K = K_p / I_w in 1/s, `disturbance` b in (rad/s)/s, `split` xi. xi = 1/2 gives the smallest
    ultimate value, b / K, which a constant B attains. The best xi at a given time: `best_split`.

    >>> float(unknown_input_bound(5.0, disturbance=2.0).ultimate)  # b / K
    0.4
    """
    rate = positive("gain [1/s]", gain)
    if not 0.0 < split < 1.0:
        raise AnalysisError(f"split = {split} must lie between 0 and 1 (xi of Theorem 1); 0.5 is best in the long run")
    b = _size("disturbance [rad/s^2]", disturbance)
    return ExponentialBound(
        _size("initial_error [rad/s]", initial_error),
        rate * (1.0 - split),
        b / (2.0 * rate * np.sqrt(split * (1.0 - split))),
    )


def best_split(gain: float, disturbance: float, initial_error: float = 0.0, time: float = np.inf) -> float:
    """The xi with the smallest bound of Theorem 1 at a time: 1/2 in the limit, smaller while the start still counts.

    >>> best_split(5.0, 2.0)  # in the limit
    0.5
    """
    if np.isnan(time) or time < 0.0:
        raise AnalysisError(f"time = {time} s must be >= 0 (inf for the ultimate bound)")
    if np.isinf(time) or not initial_error or not time:
        return 0.5
    found = minimize_scalar(
        lambda xi: float(unknown_input_bound(gain, disturbance, initial_error, xi).at(time)),
        bounds=(1e-9, 0.5),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return float(found.x)


def sharp_unknown_input_bound(gain: float, disturbance: float, initial_error: float, time: ArrayLike) -> FloatArray:
    r"""e^{-K t} |e(0)| + (b / K)(1 - e^{-K t}): the exact worst case of e' = -K e - B, below Theorem 1 for every xi.

    By the comparison lemma; B = -b sign(e(0)) attains it.
    """
    rate = positive("gain [1/s]", gain)
    fade = np.exp(-rate * as_stack("time [s]", time, ndim=0))
    level = _size("disturbance [rad/s^2]", disturbance) / rate
    return np.asarray(_size("initial_error [rad/s]", initial_error) * fade + level * (1.0 - fade))


def _size(name: str, value: float) -> float:
    number = float(as_stack(name, value, ndim=0))
    if number < 0.0:
        raise AnalysisError(f"{name} = {number:g} is a magnitude and must be >= 0")
    return number
