"""The chosen longitudinal observer at each corner, run over a drive, and the velocity at the centre of gravity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimators.arithmetic import ManyCars
from estimators.arrays import FloatArray, IntArray
from estimators.pipeline import CornerSample
from estimators.pipeline.corner_kinds import CornerKind
from estimators.velocity import slip_ratio
from estimators.velocity.mapping import weighed
from studies.drives.corner_inputs import held, mean_over
from studies.drives.prepare import CornerInputs

Progress = Callable[[float], None]  # called with the fraction done
PROGRESS_STEPS = 50


@dataclass(frozen=True)
class Replay:
    """What four corner observers made of n samples; corner order fl, fr, rl, rr, SI.

    ``velocity`` (n,) is V_x at the centre of gravity, ``corner_velocity`` (n, 4) the same seen from each corner;
    ``relative_velocity`` v_r and ``innovation`` (n, 4); ``flags`` (n, 4) are the observer's flags.
    """

    velocity: FloatArray
    corner_velocity: FloatArray
    relative_velocity: FloatArray
    innovation: FloatArray
    flags: IntArray


def replay(inputs: CornerInputs, observer: CornerKind, progress: Progress = lambda _done: None) -> Replay:
    """Run the four observers over a drive."""
    n = inputs.time.size
    innovation, flags = np.full((n, 4), np.nan), np.zeros((n, 4), dtype=np.int64)
    surface, dw = inputs.surface_speed, inputs.wheel_acceleration

    def observe(k: int, u: FloatArray, last: FloatArray) -> FloatArray:
        slip = slip_ratio(surface[k - 1], surface[k - 1] - last)
        measured = inputs.normalised_force[k], inputs.wheel_speed[k], dw[k]
        step = observer.step(CornerSample(u, *measured, slip, inputs.ax[k], inputs.ay[k]))
        innovation[k], flags[k] = step.innovation, step.flags
        if k % max(1, n // PROGRESS_STEPS) == 0:
            progress(k / n)
        return step.relative_velocity

    velocity, relative = march(inputs, observe, np.array(1.0))
    gain, shift = centre_map(inputs)
    return Replay(velocity, gain * (surface - relative) + shift, relative, innovation, flags)


Observe = Callable[[int, FloatArray, FloatArray], FloatArray]
"""(sample k, u (..., 4) m/s^2, v_r of sample k - 1) -> v_r (..., 4), m/s."""


def march(inputs: CornerInputs, observe: Observe, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """V_x (n, ...) and v_r (n, ..., 4) of four observers, or of many sets of them, over a drive.

    ``share`` (...): effective radius of each set over that of the inputs. V_x of the last step enters the corner accelerations
    of the next, P1 notes 6. They start at rest relative to the road (z = v_r = 0) with the first sample. Wheel accelerations are
    backward differences, so step k moves the estimate from sample k - 1 to k with what is known at k: nothing looks ahead.

    The recursion is that of `estimators.pipeline.CornerObservers`, and a test holds them against each other. They are two because
    the runtime takes each sample as it comes, bridges gaps, and estimates V_y or is given it; a log has V_y, must not use a
    derivative across a gap, and lets everything that does not depend on the estimate be worked out for all samples and designs
    at once.
    """
    gain, shift = centre_map(inputs)
    weights = centre_weights(inputs)
    # V_x = share rolled + offset - slipped v_r
    rolled = (weights * np.nan_to_num(gain * inputs.surface_speed)).sum(axis=1)
    offset, slipped = (weights * np.nan_to_num(shift)).sum(axis=1), weights * np.nan_to_num(gain)
    spin, n = inputs.radius * inputs.wheel_acceleration, inputs.time.size
    velocity, relative = np.empty((n, *share.shape)), np.zeros((n, *share.shape, 4))
    seen = share * float(held(mean_over(inputs.surface_speed))[0])
    for k in range(n):
        if k:
            u = share[..., None] * spin[k] - inputs.free[k] - inputs.per_speed[k] * seen[..., None]
            relative[k] = observe(k, u, relative[k - 1])
        velocity[k] = share * rolled[k] + offset[k] - (slipped[k] * relative[k]).sum(axis=-1)
        if k and np.isfinite(rolled[k]):
            seen = velocity[k]
    return velocity, relative


def centre_weights(inputs: CornerInputs) -> FloatArray:
    """What every corner counts in V_x (n, 4): missing ones 0, and NaN where none has a speed.

    Axles weigh 0.5 each, wheels of an axle alike.
    """
    gain, shift = centre_map(inputs)
    known = np.isfinite(gain * inputs.surface_speed + shift)
    units = (np.where(known, unit, np.nan) for unit in np.eye(4))
    mean = (weighed(ManyCars(known.shape[:1]), corner.T, 0.5)[0] for corner in units)
    return np.stack([np.asarray(value) for value in mean], axis=-1)


def centre_map(inputs: CornerInputs) -> tuple[FloatArray, FloatArray]:
    """V_x = gain * v_xt + shift (n, 4): from wheel-centre velocity along the tyre to the centre of gravity, P1 (33).

    v_xc = v_xt cos d - v_yt sin d with v_yt from the rigid body becomes v_xc = (v_xt - (V_y + r x_c) sin d)/cos d;
    then V_x = v_xc + r y_c.
    """
    r = inputs.yaw_rate[:, None]
    across = inputs.vy[:, None] + r * inputs.x
    return 1.0 / np.cos(inputs.steer), r * inputs.y - across * np.tan(inputs.steer)
