"""The corner observers with and without the suspension compliance (14), (15), side by side on the same signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.forces import VerticalLoads
from estimators.pipeline import CornerObservers, CornerSample, CornerStep, ScheduledCorners
from estimators.schedule import GainSchedule
from estimators.vehicle import VehicleParameters
from estimators.velocity import SlipWeights, SuspensionCompliance
from estimators.velocity.corners import CornerVectors, tire_frame, vehicle_frame
from studies.papers.resilient_velocity.claims_suspension import table_of_estimator
from studies.papers.resilient_velocity.setting import PRINTED

Array = npt.NDArray[np.float64]


class CompliantStep(NamedTuple):
    """Per corner (..., 4, 2), x and y on the last axis, m/s."""

    vx: Array  # (...) of the observers without compliance; what the pipeline compares with its own
    relative: Array  # V_r in the tire frame, without compliance
    relative_inside: Array  # the same of the observers whose input knows how the wheel accelerates against the body
    seen: Array  # velocity of the centre of gravity as each corner sees it, without compliance
    seen_inside: Array  # the same from `relative_inside`: psi' is still in it
    give: Array  # psi' of (14), body frame


class KeptLoads:
    """Wheel loads whose last step can be read: the compliance needs forces in N, the corner observers get F/F_z."""

    def __init__(self, loads: VerticalLoads) -> None:
        self.loads, self.load = loads, loads.vehicle.static_loads

    def step(self, *signals: Any) -> Any:
        """As `VerticalLoads.step`."""
        found = self.loads.step(*signals)
        self.load = found.load
        return found


class WithWheelMotion(ScheduledCorners):
    """Corner observers whose input also has the acceleration of the wheel against the body: u_q - psi_q''."""

    def __init__(self, schedule: GainSchedule, batch_shape: tuple[int, ...]) -> None:
        super().__init__(schedule, batch_shape)
        self.acceleration = np.zeros(batch_shape)

    def step(self, sample: CornerSample) -> CornerStep:
        """As `ScheduledCorners.step`."""
        return super().step(sample._replace(relative_acceleration=sample.relative_acceleration - self.acceleration))


class CompliantCorners:
    """Two sets of corner observers and one compliance model at every wheel.

    The model runs on the estimated forces, turned into the body frame as (15) needs them (the paper leaves the frame
    open). psi' is that of the wheel against the body: V_xt of the wheel centre is that of the body plus psi'.
    """

    def __init__(
        self,
        vehicle: VehicleParameters,
        schedules: tuple[GainSchedule, GainSchedule],
        sample_time: float,
        batch_shape: tuple[int, ...],
        loads: KeptLoads,
    ) -> None:
        self.batch_shape, self.sample_time, self.loads = batch_shape, sample_time, loads
        four = (*batch_shape, 4)
        self.usual = [ScheduledCorners(schedule, four) for schedule in schedules]
        self.shifted = [WithWheelMotion(schedule, four) for schedule in schedules]
        self.plain, self.inside = (
            CornerObservers(vehicle, along, across, batch_shape, SlipWeights())
            for along, across in (self.usual, self.shifted)
        )
        self.compliance = SuspensionCompliance(table_of_estimator(PRINTED), sample_time, batch_shape)

    def step(
        self, wheel_speed: Any, steer: Any, ax: Any, ay: Any, yaw_rate: Any, use_x: Array, use_y: Array, vy: Any
    ) -> CompliantStep:
        """One sample, as `CornerObservers.step`."""
        load, total = self.loads.load, self.loads.load.sum(axis=-1, keepdims=True)
        shared = self.plain.vehicle.mass * np.asarray(ax)[..., None] / total  # as the pipeline does for a stopped wheel
        use_all = np.where(np.isfinite(use_x), use_x, shared)
        force = vehicle_frame(CornerVectors(use_all * load, use_y * load), steer)
        before = self.compliance.state[..., 1]
        give = self.compliance.step(force.x, force.y).velocity
        swing = (give - before) / self.sample_time
        for observer, value in zip(
            self.shifted, tire_frame(CornerVectors(swing[..., 0], swing[..., 1]), steer), strict=True
        ):
            observer.acceleration = value
        signals = wheel_speed, steer, ax, ay, yaw_rate, use_x, use_y, vy
        plain, inside = self.plain.step(*signals), self.inside.step(*signals)
        seen, seen_inside = (np.stack([step.corner_vx, step.corner_vy], axis=-1) for step in (plain, inside))
        return CompliantStep(plain.vx, _relative(self.usual), _relative(self.shifted), seen, seen_inside, give)


def _relative(kinds: Sequence[ScheduledCorners]) -> Array:
    return np.stack([kind.observer.state[..., 1] for kind in kinds], axis=-1)


def compliant_parts(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """Parts of the pipeline: the shipped schedules of P3's tire in both sets of observers."""
    along, across = (GainSchedule.shipped(f"resilient-velocity-{d}") for d in ("longitudinal", "lateral"))
    loads = KeptLoads(VerticalLoads(car, sample_time, shape))
    return {"loads": loads, "corner_observers": CompliantCorners(car, (along, across), sample_time, shape, loads)}
