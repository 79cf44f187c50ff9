"""P2's Kalman filters beside other corner observers, on the same signals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.pipeline import CornerObservers, KalmanCorners
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire
from synthesis.models.parameter_set import load_parameter_set

Array = npt.NDArray[np.float64]


def kalman_corners(
    vehicle: VehicleParameters,
    tire: BristleTire,
    sample_time: float,
    batch_shape: tuple[int, ...],
    states: Literal[2, 3],
) -> CornerObservers:
    """P2 (19)-(23), (28), (29): the filter of ``states`` states at each corner; axles weigh a half each; V_y is told."""
    return CornerObservers(vehicle, KalmanCorners(tire, sample_time, (*batch_shape, 4), states), None, batch_shape)


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
