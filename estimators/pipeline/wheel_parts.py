"""The force observer that needs a wheel acceleration, behind the interface of those that do not."""

from __future__ import annotations

import numpy.typing as npt

from estimators.arguments import batch
from estimators.forces.pid import PUBLISHED_GAINS, PidForceObserver
from estimators.forces.wheel import WheelForceStep
from estimators.memory import Memory
from estimators.signals import FilteredDerivative
from estimators.vehicle import VehicleParameters


class DifferentiatedPid(Memory):
    """`PidForceObserver` behind a `FilteredDerivative` of the wheel speeds.

    Args:
        vehicle: radii, wheel inertia, rolling resistance.
        sample_time: s.
        batch_shape: ends with the four corners.
        lag: s, of the derivative.
        gains: eta_1 N s, eta_2 N m, eta_3 1/s.

    Raises:
        EstimatorError: as `PidForceObserver` and `FilteredDerivative`.
    """

    parts = ("slope", "observer")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        lag: float = 0.005,
        gains: tuple[float, float, float] = PUBLISHED_GAINS,
    ) -> None:
        self.batch_shape = batch(batch_shape, corners=True)
        self.observer = PidForceObserver(vehicle, sample_time, self.batch_shape, gains)
        self.slope = FilteredDerivative(sample_time, lag, self.batch_shape)

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        torque: npt.ArrayLike,
        vertical_load: npt.ArrayLike | None = None,
        fresh: npt.ArrayLike | None = None,
    ) -> WheelForceStep:
        """Takes one sample of the batch shape: rad/s, N m, N; `fresh` marks new wheel speeds, None: all.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        rate = self.slope.step(wheel_speed).derivative
        return self.observer.step(wheel_speed, rate, torque, vertical_load, fresh=fresh)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh."""
        self.slope.reset(where)
        self.observer.reset(where)
