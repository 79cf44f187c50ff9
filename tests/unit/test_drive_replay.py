"""The replay of a log and the runtime's corner observers are one recursion, written for two kinds of input."""

from __future__ import annotations

import numpy as np
import pytest

from estimators import GainSchedule
from estimators.arrays import FloatArray
from estimators.pipeline import CornerObservers, ScheduledCorners
from estimators.velocity import corner_acceleration_by_speed
from studies.drives.corner_inputs import derivative
from studies.drives.prepare import CornerInputs
from studies.drives.replay import replay
from tests.support.pipeline_truth import CAR, TIME
from tests.support.schedule_content import schedule_content

SCHEDULE = GainSchedule.from_content(schedule_content("longitudinal"), "longitudinal")
N = 120


def log(steering: float) -> CornerInputs:
    """A launch with slip in a turn, of smooth signals that need not be those of a car."""
    t: FloatArray = np.arange(N, dtype=np.float64) * TIME
    wave = np.sin(np.outer(t, [7.0, 9.0, 11.0, 13.0]) + np.arange(4.0))
    w = (10.0 + 4.0 * t[:, None] + 0.3 * wave) / CAR.radius
    steer = steering * np.array([1.0, 1.0, 0.0, 0.0]) * np.sin(4.0 * t)[:, None]
    ax, ay, yaw_rate, vy = 4.0 + np.sin(3.0 * t), 2.0 * np.sin(4.0 * t), 0.3 * np.sin(4.0 * t), 0.4 * np.sin(5.0 * t)

    def rate(value: FloatArray) -> FloatArray:
        return np.stack([derivative(column, TIME, 0.0) for column in value.T], axis=-1)

    slope, turning = rate(w), (yaw_rate, derivative(yaw_rate, TIME, 0.0))
    free, per_speed = corner_acceleration_by_speed(CAR, ax, ay, *turning, vy, steer, rate(steer))
    nothing = np.zeros((N, 4))
    return CornerInputs(
        time=t, wheel_speed=w, radius=CAR.radius, wheel_acceleration=slope, vertical_load=nothing, force=nothing,
        normalised_force=0.4 + 0.1 * wave, free=free, per_speed=per_speed, steer=steer, yaw_rate=yaw_rate, ax=ax, ay=ay,
        vy=vy, x=CAR.corner_x, y=CAR.corner_y, force_sources=(), assumptions=(),
    )  # fmt: skip


def at_runtime(inputs: CornerInputs, vy: FloatArray) -> FloatArray:
    """V_x from the second sample on; the first one is where a replay starts, at rest relative to the road."""
    corners = CornerObservers(CAR, SCHEDULE, lag=0.0)
    corners.slope.step(np.concatenate((inputs.wheel_speed[0], inputs.steer[0], inputs.yaw_rate[:1])))
    corners.vx = float(inputs.surface_speed[0].mean())
    found = []
    for k in range(1, N):
        signals = inputs.wheel_speed[k], inputs.steer[k], inputs.ax[k], inputs.ay[k], inputs.yaw_rate[k]
        found.append(corners.step(*signals, inputs.normalised_force[k], 0.0, vy[k]).vx)
    return np.array(found)


@pytest.mark.parametrize(("steering", "apart"), [(0.0, 1e-9), (0.1, 1e-3)])
def test_a_replay_is_what_the_runtime_does(steering: float, apart: float) -> None:
    """With steered wheels the runtime turns v_xt into the frame of the car by V_x of the last sample: sin^2 of its change."""
    inputs = log(steering)
    replayed = replay(inputs, ScheduledCorners(SCHEDULE)).velocity[1:]
    assert np.abs(at_runtime(inputs, inputs.vy) - replayed).max() < apart
    assert np.abs(at_runtime(inputs, 0.0 * inputs.vy) - replayed).max() > 3.0 * apart  # without V_y it is not
    assert np.abs(replayed - inputs.surface_speed.mean(axis=1)[1:]).max() > 0.02  # and the observers do something
