"""The chosen longitudinal observer at each corner, run over a drive, and the velocity at the centre of gravity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimators.arithmetic import ManyCars, OneCar
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
    """Run the four observers; V_x of the last step enters the corner accelerations of the next, P1 notes 6.

    They start at rest relative to the road (z = v_r = 0) with the first sample. Wheel accelerations are backward
    differences, so step k moves the estimate from sample k - 1 to k with what is known at k: nothing looks ahead.
    """
    n = inputs.time.size
    relative, innovation = np.zeros((n, 4)), np.full((n, 4), np.nan)
    flags = np.zeros((n, 4), dtype=np.int64)
    surface, dw = inputs.surface_speed, inputs.wheel_acceleration
    wheel_part = inputs.radius * dw - inputs.free
    gain, shift = centre_map(inputs)
    vx = float(held(mean_over(surface))[0])
    for k in range(1, n):
        u = wheel_part[k] - inputs.per_speed[k] * vx
        slip = slip_ratio(surface[k - 1], surface[k - 1] - relative[k - 1])
        measured = inputs.normalised_force[k], inputs.wheel_speed[k], dw[k]
        step = observer.step(CornerSample(u, *measured, slip, inputs.ax[k], inputs.ay[k]))
        relative[k], innovation[k], flags[k] = step.relative_velocity, step.innovation, step.flags
        seen = cg_velocity(gain[k] * (surface[k] - relative[k]) + shift[k])
        vx = float(seen) if np.isfinite(seen) else vx
        if k % max(1, n // PROGRESS_STEPS) == 0:
            progress(k / n)
    corner = gain * (surface - relative) + shift
    return Replay(cg_velocity(corner), corner, relative, innovation, flags)


def centre_map(inputs: CornerInputs) -> tuple[FloatArray, FloatArray]:
    """V_x = gain * v_xt + shift (n, 4): from wheel-centre velocity along the tyre to the centre of gravity, P1 (33).

    v_xc = v_xt cos d - v_yt sin d with v_yt from the rigid body becomes v_xc = (v_xt - (V_y + r x_c) sin d)/cos d;
    then V_x = v_xc + r y_c.
    """
    r = inputs.yaw_rate[:, None]
    across = inputs.vy[:, None] + r * inputs.x
    return 1.0 / np.cos(inputs.steer), r * inputs.y - across * np.tan(inputs.steer)


def cg_velocity(corner: FloatArray) -> FloatArray:
    """V_x (...,) from the corners (..., 4): axles weigh 0.5 each, wheels of an axle alike, missing ones left out."""
    if corner.ndim == 1:
        return np.asarray(weighed(OneCar(), corner.tolist(), 0.5)[0])
    return np.asarray(weighed(ManyCars(corner.shape[:-1]), np.moveaxis(corner, -1, 0), 0.5)[0])
