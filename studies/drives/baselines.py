"""What any car has without an observer: the two velocities that an estimate must beat."""

from __future__ import annotations

import warnings

import numpy as np

from estimators.arrays import FloatArray


def mean_over(values: FloatArray) -> FloatArray:
    """Mean of (n, k) over k, of what is not missing; NaN where all of a row is. Of R_e w: wrong by the mean slip velocity."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Mean of empty slice", category=RuntimeWarning)
        return np.asarray(np.nanmean(values, axis=1))


def integrated_acceleration(
    ax: FloatArray, yaw_rate: FloatArray, vy: FloatArray, sample_time: float, start: float
) -> FloatArray:
    """V_x(t) = V_x(0) + integral of (a_x + r V_y) dt, m/s, P1 notes 5, by the trapezoidal rule.

    Drifts with sensor bias and road grade; a missing sample keeps the last known acceleration.
    """
    rate = held(ax + yaw_rate * vy)
    steps = (rate[1:] + rate[:-1]) / 2 * sample_time
    return start + np.concatenate([[0.0], np.cumsum(steps)])


def held(value: FloatArray) -> FloatArray:
    """Missing samples replaced by the last known one (0 before the first)."""
    known = np.isfinite(value)
    last = np.maximum.accumulate(np.where(known, np.arange(value.size), -1))
    return np.where(last >= 0, value[np.maximum(last, 0)], 0.0)
