"""The runtime observers, fed with resting tires of known slip: what they do miss."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from estimators.schedule import GainSchedule
from estimators.velocity import LpvVelocityObserver
from studies.beyond.friction_floor.theory import missed_share, resting_force
from synthesis.models.parameter_set import load_parameter_set

Array = npt.NDArray[np.float64]
Direction = Literal["longitudinal", "lateral"]
SCHEDULES: dict[str, tuple[str, Direction]] = {
    "corner-estimation-longitudinal": ("corner-estimation", "longitudinal"),
    "corner-estimation-lateral": ("corner-estimation", "lateral"),
    "longitudinal-speed": ("longitudinal-speed", "longitudinal"),
    "resilient-velocity-longitudinal": ("resilient-velocity", "longitudinal"),
    "resilient-velocity-lateral": ("resilient-velocity", "lateral"),
}
"""Every shipped schedule with the parameter set and direction of its tire."""
WHEEL_SPEEDS = (15.0, 40.0, 90.0)  # rad/s
SETTLED = 6.0
"""s: sixty time constants of the slowest shipped observer."""


@dataclass(frozen=True)
class Missed:
    """Shares (wheel speeds, friction, slip), predicted and missed by the observer of one shipped schedule."""

    schedule: str
    predicted: Array
    simulated: Array

    @property
    def largest_gap(self) -> float:
        """Largest difference of both [1]."""
        return float(np.max(np.abs(self.predicted - self.simulated)))


def missed_by(schedule_name: str, friction: Array, slip: Array) -> Missed:
    """Hold each resting tire for ``SETTLED`` s before the observer of the shipped schedule, all in one batch."""
    schedule = GainSchedule.shipped(schedule_name)
    values, direction = SCHEDULES[schedule_name]
    parameters = load_parameter_set(values)
    tire, radius = parameters.tire[direction], parameters.vehicle["effective_radius"].value
    speed, theta, ratio = (np.ravel(x) for x in np.meshgrid(WHEEL_SPEEDS, friction, slip, indexing="ij"))
    measured = resting_force(tire, radius, speed, ratio, theta)
    observer = LpvVelocityObserver(schedule, speed.shape, stale_after=None)
    still = np.zeros_like(speed)
    step = observer.step(still, measured, speed)
    for _ in range(round(SETTLED / schedule.sample_time)):
        step = observer.step(still, measured, speed)
    true = ratio * radius * speed
    shape = (len(WHEEL_SPEEDS), friction.size, slip.size)
    simulated = (true - step.estimate[:, 1]) / true
    predicted = missed_share(tire, radius, speed, ratio, theta)
    return Missed(schedule_name, predicted.reshape(shape), simulated.reshape(shape))
