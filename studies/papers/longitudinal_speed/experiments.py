"""The manoeuvres of Table II, driven on the truth vehicle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from estimators.forces import UnknownInputForceObserver, WheelForceFilter
from estimators.vehicle import CORNERS, VehicleParameters
from studies.experiments.forces import Driven, force_part
from studies.study import Part


def _printed(
    unscented: Sequence[float], unknown_input: Sequence[float], vertical: Sequence[float]
) -> dict[tuple[str, str, str], float]:
    """Columns of Table II by signal, corner and method."""
    columns = {("F_x", "UKF"): unscented, ("F_x", "UIO"): unknown_input, ("F_z", "pipeline"): vertical}
    return {(s, c, m): v for (s, m), values in columns.items() for c, v in zip(CORNERS, values, strict=True)}


ROWS = (
    Driven(
        "p2-steer-wet-dry",
        "steering, wet and dry",
        _printed((3.85, 4.02, 3.97, 4.51), (4.05, 3.91, 4.26, 4.71), (3.34, 2.72, 2.15, 1.93)),
    ),
    Driven(
        "p2-double-lane-change-snow",
        "double lane change, snow",
        _printed((4.87, 5.32, 4.76, 4.95), (6.11, 5.18, 5.22, 5.49), (3.65, 3.01, 2.74, 2.82)),
    ),
    Driven(
        "p2-brake-in-turn-snow",
        "braking in a turn and accelerating, snow",
        _printed((5.04, 6.23, 5.77, 5.64), (4.90, 6.28, 6.33, 7.10), (3.88, 3.03, 3.54, 2.92)),
    ),
)
"""Table II."""


def _unscented(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, WheelForceFilter]:
    """The same filter in its linear form: the model is linear, so both are equal to round-off, and this one is faster."""
    return {"longitudinal_force": WheelForceFilter(car, sample_time, (*shape, 4), method="linear")}


def _unknown_input(
    car: VehicleParameters, sample_time: float, shape: tuple[int, ...]
) -> Mapping[str, UnknownInputForceObserver]:
    return {"longitudinal_force": UnknownInputForceObserver(car, sample_time, (*shape, 4))}


PARTS = (
    Part(
        "table-2-driven",
        "Table II on the truth vehicle",
        partial(force_part, "table-2", ROWS, {"UKF": _unscented, "UIO": _unknown_input}),
        cost=120.0,
    ),
)
