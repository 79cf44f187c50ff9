"""The corner observers with and without the suspension compliance (14), (15), on truth vehicles with compliant suspensions.

psi' is the velocity of the wheel against the body: V_xt of the wheel centre is that of the body plus psi'. P3 notes 3, 9 item 11.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.forces import LoadStep, VerticalLoads
from estimators.pipeline import CornerObservers, CornerSample, CornerStep, ScheduledCorners
from estimators.schedule import GainSchedule
from estimators.vehicle import VehicleParameters
from estimators.velocity import SlipWeights, SuspensionCompliance, side_slip_angle, slip_ratio
from estimators.velocity.corners import CornerVectors, tire_frame, vehicle_frame
from studies.papers.resilient_velocity.inputs import DIRECTIONS, PRINTED
from studies.papers.resilient_velocity.vehicle import stribeck, table_of_estimator
from studies.trials.estimation import Reading, assumed_car, run_pipeline
from studies.truth import Measured
from studies.truth.stepper import stepped_deflection

WITHOUT, PRINTED_WAY, INSIDE = "without", "as (15) is printed", "in the observer's input"
WAYS = (WITHOUT, PRINTED_WAY, INSIDE)


class CompliantStep(NamedTuple):
    """Per corner (..., 4, 2), x and y on the last axis, m/s; inside: of observers whose input has the wheel's acceleration."""

    vx: FloatArray  # (...) of the observers without compliance; what the pipeline compares with its own
    compliance: FloatArray  # psi' of (14), body frame
    relative: FloatArray  # V_r in the tire frame, without compliance
    centre: FloatArray  # velocity of the centre of gravity by each corner, without compliance
    relative_inside: FloatArray
    centre_inside: FloatArray  # psi' is still in it


class RecordedLoads(VerticalLoads):
    """Wheel loads whose last step can be read: the compliance needs forces in N, the corner observers get F/F_z."""

    load: FloatArray

    def step(self, *signals: Any) -> LoadStep:
        """As `VerticalLoads.step`."""
        found = super().step(*signals)
        self.load = found.load
        return found


class WithWheelMotion(ScheduledCorners):
    """Corner observers whose input also has the acceleration of the wheel against the body: u_q - psi_q''."""

    acceleration: FloatArray

    def step(self, sample: CornerSample) -> CornerStep:
        """As `ScheduledCorners.step`."""
        return super().step(sample._replace(relative_acceleration=sample.relative_acceleration - self.acceleration))


class CompliantCorners:
    """Two sets of corner observers with the shipped schedules of P3's tire, and one compliance model at every wheel.

    The model runs on the estimated forces, turned into the body frame as (15) needs them (the paper leaves the frame
    open).
    """

    def __init__(self, car: VehicleParameters, time: float, shape: tuple[int, ...], loads: RecordedLoads) -> None:
        self.batch_shape, self.sample_time, self.loads = shape, time, loads
        schedules = [GainSchedule.shipped(f"resilient-velocity-{d}") for d in DIRECTIONS]
        self.shifted = [WithWheelMotion(schedule, (*shape, 4)) for schedule in schedules]
        usual = [ScheduledCorners(schedule, (*shape, 4)) for schedule in schedules]
        self.kinds: list[list[ScheduledCorners]] = [usual, [*self.shifted]]
        self.sets = [CornerObservers(car, along, across, shape, SlipWeights()) for along, across in self.kinds]
        self.compliance = SuspensionCompliance(table_of_estimator(PRINTED), time, shape)

    def step(self, *signals: Any) -> CompliantStep:
        """One sample, as `CornerObservers.step`."""
        _, steer, ax, _, _, use_x, use_y, _ = signals
        load, total = self.loads.load, self.loads.load.sum(axis=-1, keepdims=True)
        shared = (
            self.sets[0].vehicle.mass * np.asarray(ax)[..., None] / total
        )  # as the pipeline does for a stopped wheel
        use_all = np.where(np.isfinite(use_x), use_x, shared)
        force = vehicle_frame(CornerVectors(use_all * load, use_y * load), steer)
        before = self.compliance.state[..., 1]
        rate = self.compliance.step(force.x, force.y).velocity
        acceleration = turned((rate - before) / self.sample_time, steer)
        for k, observer in enumerate(self.shifted):
            observer.acceleration = acceleration[..., k]
        steps = [corners.step(*signals) for corners in self.sets]
        found = list[FloatArray]()
        for kinds, step in zip(self.kinds, steps, strict=True):
            found.append(np.stack([kind.observer.state[..., 1] for kind in kinds], axis=-1))
            found.append(np.stack([step.corner_vx, step.corner_vy], axis=-1))
        return CompliantStep(steps[0].vx, rate, *found)


def turned(vector: FloatArray, steer: FloatArray) -> FloatArray:
    """(..., 4, 2) from the body frame into that of the tires."""
    return np.stack(tire_frame(CornerVectors(vector[..., 0], vector[..., 1]), steer), axis=-1)


def compliant_parts(car: VehicleParameters, time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """Parts of the pipeline."""
    loads = RecordedLoads(car, time, shape)
    return {"loads": loads, "corner_observers": CompliantCorners(car, time, shape, loads)}


@dataclass(frozen=True)
class ComplianceTrial:
    """S sensor draws x B runs over n samples; x and y of the tire frame on the last axis of what is per corner."""

    drawn: Measured
    slip: FloatArray  # V_r without compliance (S, B, n, 4, 2), m/s
    residual: Mapping[str, FloatArray]  # by way: measured minus calculated F/F_z (S, B, n, 4, 2)
    centre: Mapping[str, FloatArray]  # by way: V_x, V_y (S, B, n, 2), m/s
    compliance: FloatArray  # estimated psi' (S, B, n, 4, 2), m/s
    true_compliance: FloatArray  # (B, n, 4, 2) m/s


def run_trial(drawn: Measured) -> ComplianceTrial:
    """Estimate all runs of ``drawn`` and calculate the forces of every way: V_r = R_e w - V_xt - psi' with compliance."""
    forces = ("force_x", "force_y", "force_z")
    readings: dict[str, Reading] = {name: attrgetter(f"corners.{name}") for name in CompliantStep._fields[1:]}
    found = run_pipeline(drawn, readings | {name: attrgetter(name) for name in forces}, compliant_parts)
    relative, rate, truth = found["relative"], found["compliance"], drawn.truth
    rate_tire = turned(rate, drawn.signals["steer"])
    true_rate = np.stack([truth["compliance_x_rate"], truth["compliance_y_rate"]], axis=-1)
    slip = {WITHOUT: relative, PRINTED_WAY: relative - rate_tire, INSIDE: found["relative_inside"]}
    centre = {WITHOUT: found["centre"], PRINTED_WAY: found["centre"] + rate, INSIDE: found["centre_inside"] - rate}
    measured = np.stack([found["force_x"], found["force_y"]], axis=-1) / np.maximum(found["force_z"], 1.0)[..., None]
    calculated = model_force(drawn, np.stack([slip[way] for way in WAYS]))
    residual = {way: measured - force for way, force in zip(WAYS, calculated, strict=True)}
    # What each corner counts: the axle that slips less counts more, each wheel half of it.
    surface = assumed_car(drawn).radius * drawn.signals["wheel_speed"]
    along, across = surface - relative[..., 0], -relative[..., 1]
    slips = slip_ratio(surface, along), side_slip_angle(along, across)
    front = np.stack([SlipWeights().front(slip) for slip in slips], axis=-1)[..., None, :]
    shares = 0.5 * np.concatenate([front, front, 1.0 - front, 1.0 - front], axis=-2)
    mean = {way: np.einsum("...cd,...cd->...d", shares, value) for way, value in centre.items()}
    return ComplianceTrial(drawn, relative, residual, mean, rate_tire, turned(true_rate, truth["steer"]))


def model_force(drawn: Measured, slip: FloatArray) -> FloatArray:
    """F/F_z of the LuGre tire (1), (2) with Table I at slip velocities (..., S, B, n, 4, 2), m/s, each direction by itself.

    The road parameter is that of the truth: the paper does not say which one its tire model gets on ice and on dry road.
    Bristles are stepped exactly for slips held over a sample.
    """
    names, tires = ("sigma0", "sigma1", "sigma2", "kappa"), [PRINTED.parameters.tire[d] for d in DIRECTIONS]
    sigma0, sigma1, sigma2, kappa = (np.array([getattr(tire, name).value for tire in tires]) for name in names)
    road = drawn.truth["friction"][..., None]
    rolling = PRINTED.vehicle["effective_radius"] * np.abs(drawn.signals["wheel_speed"])[..., None]
    rate = kappa * rolling + sigma0 * np.abs(slip) / (road * stribeck(PRINTED, slip))
    out, z = np.empty_like(slip), np.zeros_like(slip[..., 0, :, :])
    for k in range(slip.shape[-3]):
        z, mean, speed = stepped_deflection(z, slip[..., k, :, :], rate[..., k, :, :], drawn.sample_time)
        out[..., k, :, :] = sigma0 * mean + sigma1 * speed
    return np.asarray(out + sigma2 * slip)
