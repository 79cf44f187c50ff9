"""From recorded signals to the inputs of the four corner observers, and the two velocities that any car has without one.

Pure functions of arrays: n samples, four corners in the order fl, fr, rl, rr, SI units, frame x forward, y left, z up.
Vertical load and force before friction: no road parameter enters anywhere. Source: P1 (1), (13)-(17) and section 6.
"""

from __future__ import annotations

import warnings

import numpy as np

from estimators.arrays import BoolArray, FloatArray


def derivative(value: FloatArray, sample_time: float, lag: float) -> FloatArray:
    """Causal first-order derivative of (n,) samples: y' = (x' - y)/lag, per second.

    Exact for piecewise linear x: y[k] = a y[k-1] + (1 - a) (x[k] - x[k-1])/Ts with a = exp(-Ts/lag); lag 0 is the
    backward difference. The derivative comes late by lag + Ts/2; the first difference is taken as it is. NaN where x or
    its predecessor is missing; the filter starts afresh behind.
    """
    slope = np.diff(value, prepend=np.nan) / sample_time
    a = float(np.exp(-sample_time / lag)) if lag > 0 else 0.0
    out = np.empty(value.shape)
    last = np.nan
    for k, new in enumerate(slope):
        last = new if np.isnan(last) else a * last + (1.0 - a) * new
        out[k] = last
    return out


def wheel_forces(
    torque: FloatArray,
    wheel_speed: FloatArray,
    wheel_acceleration: FloatArray,
    vertical_load: FloatArray,
    inertia: float,
    radius: FloatArray,
    rolling_resistance: float,
    stopped_below: float,
    bearing_friction: float = 0.0,
) -> FloatArray:
    """Longitudinal forces (n, 4), N, from wheel dynamics: F_x = (T - I_w dw/dt - C_b w)/R_e - c_rr F_z sign(w), P2 (1).

    ``torque`` N m (drive minus brake), ``wheel_acceleration`` rad/s^2, ``radius`` (4,) m, ``bearing_friction`` C_b N m s/rad.
    The papers neglect both losses (c_rr = C_b = 0). NaN where the torque is unknown and where the wheel stands still
    (|w| < ``stopped_below``, rad/s): a stopped brake holds whatever friction asks of it, so its commanded torque says nothing
    about the force.
    """
    push = torque - inertia * wheel_acceleration - bearing_friction * wheel_speed
    force = push / radius - rolling_resistance * vertical_load * np.sign(wheel_speed)
    stopped = np.abs(wheel_speed) < stopped_below
    stopped[1:] |= stopped[:-1]  # dw/dt behind a stop spans an interval with the wheel still held
    return np.where(stopped, np.nan, force)


def shared_forces(
    ax: FloatArray, vertical_load: FloatArray, mass: float, dynamics: FloatArray, known: BoolArray
) -> FloatArray:
    """Longitudinal forces (n, 4), N: what m a_x leaves, shared by load: F_i = (m a_x - sum of known) F_zi / sum F_z.

    ``dynamics`` (n, 4) counts at the corners marked in ``known`` (4,); the sum of loads runs over the others. With none
    known this is m a_x F_zi / sum F_z: right in sum, and at each corner only if all wheels use the same share of their
    load. Leaves out the drag of air and the steering angle (1 - cos delta).
    """
    forces = dynamics.copy()
    rest = mass * ax - dynamics[:, known].sum(axis=1)
    share = vertical_load[:, ~known] / vertical_load[:, ~known].sum(axis=1, keepdims=True)
    forces[:, ~known] = rest[:, None] * share
    return forces


def mean_over(values: FloatArray) -> FloatArray:
    """Mean of (n, k) over k, of what is not missing; NaN where all of a row is. Of R_e w: wrong by the mean slip velocity."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Mean of empty slice", category=RuntimeWarning)
        return np.asarray(np.nanmean(values, axis=1))


def integrated_acceleration(
    ax: FloatArray, yaw_rate: FloatArray, vy: FloatArray, sample_time: float, start: float
) -> FloatArray:
    """V_x(t) = V_x(0) + integral of (a_x + r V_y) dt, m/s, P1 notes 5, by the trapezoidal rule, where V_y is measured.

    Drifts with sensor bias and road grade; a missing sample keeps the last known acceleration.
    """
    return start + sample_time * _integral(held(ax + yaw_rate * vy))


def dead_reckoning(
    ax: FloatArray, ay: FloatArray, yaw_rate: FloatArray, sample_time: float, start: float
) -> tuple[FloatArray, FloatArray]:
    """V_x, V_y (n,), m/s, of V_x' = a_x + r V_y, V_y' = a_y - r V_x, P2 (15) without biases, from (start, 0).

    With the heading psi = integral of r, the velocity in axes that do not turn is the integral of R(psi) a: trapezoidal rule on
    both, no error of the turning itself. Drifts with sensor bias, grade and bank; a missing sample keeps the last known one.
    """
    ax, ay, turn = (held(value) for value in (ax, ay, yaw_rate))
    heading = sample_time * _integral(turn)
    cosine, sine = np.cos(heading), np.sin(heading)
    east = start + sample_time * _integral(cosine * ax - sine * ay)
    north = sample_time * _integral(sine * ax + cosine * ay)
    return cosine * east + sine * north, cosine * north - sine * east


def _integral(value: FloatArray) -> FloatArray:
    """Cumulative trapezoids (n,) of samples at a distance of 1, from 0."""
    return np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2)])


def held(value: FloatArray) -> FloatArray:
    """Missing samples replaced by the last known one (0 before the first)."""
    known = np.isfinite(value)
    last = np.maximum.accumulate(np.where(known, np.arange(value.size), -1))
    return np.where(last >= 0, value[np.maximum(last, 0)], 0.0)
