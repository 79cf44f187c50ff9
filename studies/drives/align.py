"""The clock offset between two logs, from what they both felt: velocity in one, acceleration in the other.

Over a window of width 2h the increment of a velocity and the integral of the acceleration are the same number, so

    dv(t) = (v(t + h) - v(t - h)) / 2h    and    da(t) = (I(t + h) - I(t - h)) / 2h,   I = integral of a dt,

are compared instead of a numerical derivative: neither is noisier than its signal. The offset is where their
correlation is largest; both are continuous in time, so the optimum is not tied to the sample grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from studies.errors import LogError

HALF_WINDOW = 0.05  # h in s: long enough for 100 Hz logs, short against a brake application
LEAST_CORRELATION = 0.9  # below this the two logs do not show the same drive


@dataclass(frozen=True)
class Offset:
    """``seconds`` are added to the time of the velocity log to read the clock of the acceleration log.

    ``correlation`` is the largest one found, ``slope`` the regression of dv on da (1 if units and sign are right).
    """

    seconds: float
    correlation: float
    slope: float


def find_offset(
    velocity_time: FloatArray,
    velocity: FloatArray,
    acceleration_time: FloatArray,
    acceleration: FloatArray,
    search: float | None = None,
    step: float = 0.01,
) -> Offset:
    """Maximise the correlation of dv(t) and da(t + offset) over |offset| <= ``search``; else wherever half overlaps.

    Raises LogError when no offset reaches a correlation of 0.9: constant speed, other signals, or another drive.
    """
    from scipy.optimize import minimize_scalar  # a refused log must not wait for it

    velocity_time, velocity = _finite(velocity_time, velocity)
    acceleration_time, acceleration = _finite(acceleration_time, acceleration)
    steps = np.diff(acceleration_time) * (acceleration[1:] + acceleration[:-1]) / 2
    integral = np.concatenate([[0.0], np.cumsum(steps)])
    t = np.arange(velocity_time[0] + HALF_WINDOW, velocity_time[-1] - HALF_WINDOW, step)
    dv = _increment(velocity_time, velocity, t)

    def compare(offset: float) -> tuple[float, float]:
        da = _increment(acceleration_time, integral, t + offset)
        both = np.isfinite(dv) & np.isfinite(da)
        if 2 * np.count_nonzero(both) < t.size or np.ptp(da[both]) < 1e-6 or np.ptp(dv[both]) < 1e-6:
            return -1.0, np.nan
        a, b = da[both] - da[both].mean(), dv[both] - dv[both].mean()
        return float(a @ b / np.sqrt((a @ a) * (b @ b))), float(a @ b / (a @ a))

    low, high = acceleration_time[0] - velocity_time[-1], acceleration_time[-1] - velocity_time[0]
    if search is not None:
        low, high = max(low, -search), min(high, search)
    coarse = np.arange(low, high + HALF_WINDOW, HALF_WINDOW / 2)
    quality = [compare(float(offset))[0] for offset in coarse]
    best = float(coarse[int(np.argmax(quality))]) if quality else 0.0
    near = (best - HALF_WINDOW / 2, best + HALF_WINDOW / 2)
    fine = minimize_scalar(lambda t: -compare(float(t))[0], bounds=near, method="bounded", options={"xatol": 1e-5})
    seconds = float(fine.x)
    correlation, slope = compare(seconds)
    if correlation < LEAST_CORRELATION:
        raise LogError(
            f"the logs cannot be aligned: best correlation {correlation:.2f}, needed {LEAST_CORRELATION}; "
            "check the signs and units of velocity and acceleration, or give clock_offset"
        )
    return Offset(seconds=seconds, correlation=correlation, slope=slope)


def _finite(time: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    keep = np.isfinite(value)
    if np.count_nonzero(keep) < 2 or np.ptp(time[keep]) <= 4 * HALF_WINDOW:
        raise LogError("the logs cannot be aligned: one of the signals is shorter than 0.2 s; give clock_offset")
    return time[keep], value[keep]


def _increment(time: FloatArray, value: FloatArray, t: FloatArray) -> FloatArray:
    ends = [np.interp(t + side, time, value, left=np.nan, right=np.nan) for side in (HALF_WINDOW, -HALF_WINDOW)]
    return np.asarray((ends[0] - ends[1]) / (2 * HALF_WINDOW))
