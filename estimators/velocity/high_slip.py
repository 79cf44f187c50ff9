"""High-slip detection: an adaptive limit on the slip ratio, and a limit on the wheel acceleration, P2 notes 7.

    lambda_th = lambda_u - (lambda_u - lambda_l) exp(-pi beta_e sigma_e (lambda_u - lambda_l)^2)          (29), corrected

sigma_e variance of |a| = sqrt(a_x^2 + a_y^2) over the last N_a + 1 samples, beta_e transition rate in (m/s^2)^-2. Low
excitation gives lambda_l, high excitation lambda_u. As printed, phi_e is the reciprocal of what it must be: the limit
would start far below zero (P2 notes 7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, entries, mask
from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.memory import Memory


@dataclass(frozen=True)
class HighSlipSettings:
    """The paper publishes none of these numbers.

    Raises:
        EstimatorError: limits that are not 0 < lower < upper, or another value that is not above zero.
    """

    lower: float = 0.05  # lambda_l: calm driving stays below
    upper: float = 0.15  # lambda_u: P3's limit between its two gains
    rate: float = 100.0  # beta_e, (m/s^2)^-2: a variance of 1 (m/s^2)^2 is nearly full excitation
    window: int = 40  # N_a + 1 samples: 0.2 s at 200 Hz
    wheel_acceleration: float = 100.0  # |dw/dt| in rad/s^2: 33 m/s^2 at the surface, far above any car's own

    def __post_init__(self) -> None:
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and 0 < self.lower < self.upper):
            raise EstimatorError(f"slip limits {self.lower!r} and {self.upper!r}: give 0 < lower < upper")
        for name, unit in (("rate", "(m/s^2)^-2"), ("wheel_acceleration", "rad/s^2")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise EstimatorError(f"{name} = {value!r} {unit} must be finite and above zero")
        if self.window < 2:
            raise EstimatorError(f"window = {self.window!r} samples; a variance needs two at least")


def adaptive_threshold(variance: npt.ArrayLike, lower: float, upper: float, rate: float) -> FloatArray:
    """lambda_th of (29), corrected, for `variance` sigma_e in (m/s^2)^2."""
    span = upper - lower
    out: FloatArray = upper - span * np.exp(-math.pi * rate * span**2 * np.asarray(variance, dtype=np.float64))
    return out


class HighSlipStep(NamedTuple):
    """Leading axes of the batch."""

    high: BoolArray  # (..., 4) by_slip or by_acceleration
    by_slip: BoolArray  # (..., 4) |lambda| >= lambda_th
    by_acceleration: BoolArray  # (..., 4) |dw/dt| >= its limit
    threshold: FloatArray  # (...) lambda_th
    variance: FloatArray  # (...) sigma_e, (m/s^2)^2


class HighSlipDetector(Memory):
    """Remembers the last accelerations of every entry.

    Raises:
        EstimatorError: a batch without entries.
    """

    memory = ("window", "position")
    unknowns = ("window",)

    def __init__(self, settings: HighSlipSettings | None = None, batch_shape: tuple[int, ...] = ()) -> None:
        self.settings = settings if settings is not None else HighSlipSettings()
        self.batch_shape = batch(batch_shape)
        self.window: FloatArray = np.full((*self.batch_shape, self.settings.window), np.nan)
        self.position = np.array(0)

    def step(
        self, ax: npt.ArrayLike, ay: npt.ArrayLike, slip: npt.ArrayLike, wheel_acceleration: npt.ArrayLike
    ) -> HighSlipStep:
        """`ax`, `ay` (...) m/s^2 as measured; `slip` (..., 4); `wheel_acceleration` (..., 4) rad/s^2.

        A missing acceleration repeats the last one; a missing slip or wheel acceleration decides nothing.

        Raises:
            EstimatorError: another shape.
        """
        s, corners = self.settings, (*self.batch_shape, 4)
        size = np.hypot(entries(ax, self.batch_shape, "ax"), entries(ay, self.batch_shape, "ay"))
        ratio, spin = entries(slip, corners, "slip"), entries(wheel_acceleration, corners, "wheel_acceleration")
        place = int(self.position)
        self.window[..., place] = np.where(np.isfinite(size), size, self.window[..., place - 1])
        self.position = np.array((place + 1) % s.window)
        known = np.isfinite(self.window)
        full = np.count_nonzero(known) == known.size  # as it is after the first samples: half the time
        count = s.window if full else np.maximum(known.sum(axis=-1), 1)
        filled = self.window if full else np.where(known, self.window, 0.0)
        off = filled - (np.add.reduce(filled, -1) / count)[..., None]
        variance = np.add.reduce(off * off if full else np.where(known, off * off, 0.0), -1) / count
        threshold = adaptive_threshold(variance, s.lower, s.upper, s.rate)
        by_slip: BoolArray = np.absolute(ratio) >= threshold[..., None]
        by_acceleration: BoolArray = np.absolute(spin) >= s.wheel_acceleration
        return HighSlipStep(by_slip | by_acceleration, by_slip, by_acceleration, threshold, variance)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Forgets the accelerations of the entries `where` (mask of the batch shape; None: all).

        Raises:
            EstimatorError: a mask of another shape.
        """
        self.window[mask(where, self.batch_shape, "where")] = np.nan
