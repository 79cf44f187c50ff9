"""What P4 and P5 take from sensors before their observers begin: speed, steering, level accelerations and wheel loads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.forces import AttitudeObserver, VerticalLoads, levelled
from estimators.signals import FilteredDerivative
from studies.trials.play import believed
from studies.truth import Measured

Array = npt.NDArray[np.float64]
SAMPLE_TIME = 0.01
"""s, P4 and P5: 100 Hz."""
START = 1.0
"""s left out of every error: observers that start from nothing."""
LEAST_SPEED = 3.0
"""m/s below which sideslip is not judged."""
_LAG = 0.1  # s, of the derivative of the speed


class Levelled(NamedTuple):
    """Of S seeds x B runs over n samples."""

    loads: Array  # (S, B, n, 4) N
    ax: Array  # (S, B, n) m/s^2, along the road, gravity removed
    ay: Array  # (S, B, n) m/s^2


def rear_speed(drawn: Measured) -> Array:
    """V_g (S, B, n), m/s: mean of the rear wheel speeds times the radius, P4 section 4."""
    out: Array = (believed(drawn).radius * drawn.signals["wheel_speed"])[..., 2:].mean(axis=-1)
    return out


def front_steer(drawn: Measured) -> Array:
    """Steering angle of the front wheels (S, B, n), rad: mean of both."""
    out: Array = drawn.signals["steer"][..., :2].mean(axis=-1)
    return out


def counted(drawn: Measured, run: int) -> npt.NDArray[np.bool_]:
    """Samples (n,) of a run by which an observer is judged: from `START` on, and not below `LEAST_SPEED`."""
    truth = drawn.truth
    fast = np.absolute(truth["vx"][run]) >= LEAST_SPEED
    return np.asarray(truth.valid[run] & (truth.time >= START) & fast)


def level(drawn: Measured) -> Levelled:
    """Block 1 of P4: wheel loads and accelerations without their share of gravity.

    The paper's own (earlier work) uses suspension deflections; here roll and pitch come from gyros led back by
    accelerometers, with the motion of the car from `rear_speed` and the yaw rate.
    """
    time, shape = drawn.sample_time, drawn.batch_shape
    car, speed = believed(drawn), rear_speed(drawn)
    attitude, loads = AttitudeObserver(time, shape), VerticalLoads(car, time, shape)
    slope = FilteredDerivative(time, _LAG, shape)
    found = Levelled(np.empty((*shape, drawn.time.size, 4)), np.empty_like(speed), np.empty_like(speed))
    for k in range(drawn.time.size):
        v = speed[:, :, k]
        ax, ay, az, turn, rolling, pitching = (
            drawn.signals[name][:, :, k] for name in ("ax", "ay", "az", "yaw_rate", "roll_rate", "pitch_rate")
        )
        tilt = attitude.step(rolling, pitching, ax, ay, slope.step(v).derivative, v * turn, turn)
        found.loads[:, :, k] = loads.step(ax, ay, az, tilt.pitch, tilt.roll).load
        found.ax[:, :, k], found.ay[:, :, k], _ = levelled(ax, ay, az, tilt.pitch, tilt.roll)
    return found
