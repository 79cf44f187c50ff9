"""P2's time-varying Kalman filter at every corner, with its high-slip detector, and its mapping to the car."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.signals import FilteredDerivative
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, HighSlipDetector, LtvKalmanObserver, slip_ratio, to_centre
from estimators.velocity.corners import CornerVectors, corner_acceleration, corner_velocity, tire_frame, vehicle_frame
from synthesis.models.parameter_set import load_parameter_set

Array = npt.NDArray[np.float64]


class LtvCornerStep(NamedTuple):
    """What the pipeline keeps of a step."""

    vx: Array  # (...) m/s at the centre of gravity
    relative_velocity: Array  # (..., 4) m/s
    high_slip: npt.NDArray[np.bool_]  # (..., 4) the detector's word


class LtvCornerObservers:
    """P2 (19)-(23), (28), (29): the filter of `states` states at each corner; axles weigh a half each; V_y is told.

    u = R_e w' - v_xt' with the velocities of the last step in the accelerations, as `CornerObservers` has it; the detector
    judges the slip ratios of the last step, the wheels' accelerations, and the car's.
    """

    def __init__(
        self,
        vehicle: VehicleParameters,
        tire: BristleTire,
        sample_time: float,
        batch_shape: tuple[int, ...],
        states: Literal[2, 3],
        lag: float = 0.01,
    ) -> None:
        self.vehicle, self.batch_shape, self.sample_time = vehicle, batch_shape, sample_time
        self.filter = LtvKalmanObserver(tire, sample_time, (*batch_shape, 4), states)
        self.detector = HighSlipDetector(batch_shape=batch_shape)
        self.slope = FilteredDerivative(sample_time, lag, (*batch_shape, 9))
        self.vx: Array | None = None
        self.slip: Array = np.zeros((*batch_shape, 4))

    def step(
        self,
        wheel_speed: Any,
        steer: Any,
        ax: Array,
        ay: Array,
        yaw_rate: Any,
        longitudinal_use: Array,
        _: Array,
        vy: Array,
    ) -> LtvCornerStep:
        """One sample, as `CornerObservers.step`; the lateral use is not needed."""
        rate = self.slope.step(np.concatenate([wheel_speed, steer, np.asarray(yaw_rate)[..., None]], axis=-1))
        speed, angle, turn = rate.value[..., :4], rate.value[..., 4:8], rate.value[..., 8]
        spin, surface = rate.derivative[..., :4], self.vehicle.radius * speed
        vx = surface.mean(axis=-1) if self.vx is None else self.vx
        pull = corner_acceleration(
            self.vehicle, ax, ay, turn, rate.derivative[..., 8], vx, vy, angle, rate.derivative[..., 4:8]
        )
        high = self.detector.step(ax, ay, self.slip, spin).high
        found = self.filter.step(self.vehicle.radius * spin - pull.x, longitudinal_use, speed, spin, high)
        forward = surface - found.relative_velocity
        beside = tire_frame(corner_velocity(self.vehicle, vx, vy, turn), angle).y
        centre = to_centre(self.vehicle, vehicle_frame(CornerVectors(forward, beside), angle), turn)
        self.vx, self.slip = centre.vx, slip_ratio(surface, forward)
        return LtvCornerStep(centre.vx, found.relative_velocity, high)


class Compared(NamedTuple):
    """Steps by name."""

    vx: Array
    steps: Mapping[str, Any]


class SideBySide:
    """Several corner observers on the same signals, one after the other; ``vx`` is that of the first."""

    def __init__(self, observers: Mapping[str, Any]) -> None:
        self.observers = observers

    def step(self, *signals: Any) -> Compared:
        """What each of them says of one sample."""
        found = {name: observer.step(*signals) for name, observer in self.observers.items()}
        return Compared(next(iter(found.values())).vx, found)


def bristle_tire(parameters: str, radius: float) -> BristleTire:
    """Longitudinal constants of a shipped parameter set with the car's own radius, m."""
    tire = load_parameter_set(parameters).tire["longitudinal"]
    return BristleTire(tire.sigma0.value, tire.sigma1.value, tire.sigma2.value, tire.kappa.value, radius)
