"""The longitudinal observer at each corner, run over a drive, and the velocity at the centre of gravity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from estimators import EstimatorError, GainSchedule, LpvVelocityObserver
from estimators.schedule import SHIPPED, read_content
from studies.drives.baselines import held, mean_over
from studies.drives.prepare import CornerInputs
from synthesis.errors import SpecError

Array = npt.NDArray[np.float64]
PROGRESS_STEPS = 50
MODEL = "corner-velocity-{}"


@dataclass(frozen=True)
class Replay:
    """What four corner observers made of n samples; corner order fl, fr, rl, rr, SI.

    ``velocity`` (n,) is V_x at the centre of gravity, ``corner_velocity`` (n, 4) the same seen from each corner;
    ``relative_velocity`` v_r and ``innovation`` (n, 4); ``flags`` (n, 4) are the observer's flags.
    """

    velocity: Array
    corner_velocity: Array
    relative_velocity: Array
    innovation: Array
    flags: npt.NDArray[np.int64]


def load_schedule(
    name: str, folder: Path, sample_time: float, direction: Literal["longitudinal", "lateral"] = "longitudinal"
) -> GainSchedule:
    """The schedule of a direction by shipped name, or by path relative to ``folder`` when the name ends in .json.

    Raises SpecError, before anything runs: unreadable or edited, another model or direction, another sample time.
    """
    try:
        if name.endswith(".json"):
            path = folder / name
        else:
            GainSchedule.shipped(name)  # refuses an unknown name with a list of those there are
            path = SHIPPED / f"{name}.json"
        content = read_content(path)
        schedule = GainSchedule.from_content(content, path.name)
    except EstimatorError as error:
        raise SpecError(f"schedules.{direction}: {error}") from error
    model = content["model"]["id"]
    wanted = MODEL.format(direction)
    if model != wanted:
        raise SpecError(f"schedules.{direction}: '{name}' is a schedule of {model}; this run needs one of {wanted}")
    if abs(schedule.sample_time - sample_time) > 1e-9 * sample_time:
        raise SpecError(
            f"schedules.{direction}: '{name}' was proved at sample_time = {schedule.sample_time:g} s, the drive file "
            f'asks for {sample_time:g} s; set sample_time = "{schedule.sample_time * 1e3:g} ms" or synthesise another'
        )
    return schedule


def replay(inputs: CornerInputs, schedule: GainSchedule, progress: Callable[[float], None] | None = None) -> Replay:
    """Run the four observers; V_x of the last step enters the corner accelerations of the next, P1 section 6.

    They start at rest relative to the road (z = v_r = 0) with the first sample. Wheel accelerations are backward
    differences, so step k moves the estimate from sample k - 1 to k with what is known at k: nothing looks ahead.
    """
    n = inputs.time.size
    observer = LpvVelocityObserver(schedule, batch_shape=(4,), outside="flag")
    relative, innovation = np.zeros((n, 4)), np.full((n, 4), np.nan)
    flags = np.zeros((n, 4), dtype=np.int64)
    wheel_part = inputs.radius * inputs.wheel_acceleration - inputs.free
    gain, shift = centre_map(inputs)
    vx = float(held(mean_over(inputs.surface_speed))[0])
    for k in range(1, n):
        u = wheel_part[k] - inputs.per_speed[k] * vx
        step = observer.step(u, inputs.normalised_force[k], inputs.wheel_speed[k])
        relative[k], innovation[k], flags[k] = step.estimate[:, 1], step.innovation, step.flags
        seen = cg_velocity(gain[k] * (inputs.surface_speed[k] - relative[k]) + shift[k])
        vx = float(seen) if np.isfinite(seen) else vx
        if progress is not None and k % max(1, n // PROGRESS_STEPS) == 0:
            progress(k / n)
    corner = gain * (inputs.surface_speed - relative) + shift
    return Replay(cg_velocity(corner), corner, relative, innovation, flags)


def centre_map(inputs: CornerInputs) -> tuple[Array, Array]:
    """V_x = gain * v_xt + shift (n, 4): from wheel-centre velocity along the tyre to the centre of gravity, P1 (33).

    v_xc = v_xt cos d - v_yt sin d with v_yt from the rigid body becomes v_xc = (v_xt - (V_y + r x_c) sin d)/cos d;
    then V_x = v_xc + r y_c.
    """
    r = inputs.yaw_rate[:, None]
    across = inputs.vy[:, None] + r * inputs.x
    return 1.0 / np.cos(inputs.steer), r * inputs.y - across * np.tan(inputs.steer)


def cg_velocity(corner: Array) -> Array:
    """V_x (...,) from the corners (..., 4): axles weigh 0.5 each, wheels of an axle alike, missing ones left out."""
    if np.isfinite(corner).all():
        return np.asarray(corner.mean(axis=-1))
    rows = corner.reshape(-1, 4)
    axles = np.stack([mean_over(rows[:, :2]), mean_over(rows[:, 2:])], axis=-1)
    return mean_over(axles).reshape(corner.shape[:-1])
