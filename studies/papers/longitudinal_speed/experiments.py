"""The manoeuvres of Table II, driven on the truth vehicle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from estimators.forces import UnknownInputForceObserver, WheelForceFilter
from estimators.vehicle import CORNERS, VehicleParameters
from studies.papers.longitudinal_speed.driven_tests import driven_tests_part
from studies.papers.longitudinal_speed.speed_trial import Drive, speed_part
from studies.trials.driven import driven_part
from studies.trials.forces import Driven, force_part
from studies.trials.motion import Moved, motion_part


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

FIG_6 = (
    Driven("p2-throttle-brake-low", "alternating throttle and brake, friction 0.3 (Fig. 6a)"),
    Driven("p2-acceleration-in-turn-dry", "acceleration in a turn, dry (Fig. 6b)"),
    Driven("p2-acceleration-in-turn-low", "acceleration in a turn, friction 0.25 (Fig. 6c)"),
)
FIG_9 = (
    Drive("p2-step-steer-dry", "step steer, dry"),
    Drive("p2-turn-throttle-dry", "full throttle in a turn, dry"),
    Drive("p2-turn-throttle-low", "full throttle in a turn, friction 0.3"),
)
FIG_10 = (
    Drive("p2-launch-wet-dry", "launch, wet to dry, braking"),
    Drive("p2-acceleration-in-turn-wet-dry", "acceleration in a turn, wet to dry, braking"),
)
FIG_12 = (
    Drive("p2-brake-in-turn-snow", "braking in a turn and accelerating, snow"),
    Drive("p2-harsh-steering-ice", "harsh steering, snow and ice"),
)


def _unscented(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, WheelForceFilter]:
    """The same filter in its linear form: the model is linear, so both are equal to round-off, and this one is faster."""
    return {"longitudinal_force": WheelForceFilter(car, sample_time, (*shape, 4), method="linear")}


def _unknown_input(
    car: VehicleParameters, sample_time: float, shape: tuple[int, ...]
) -> Mapping[str, UnknownInputForceObserver]:
    return {"longitudinal_force": UnknownInputForceObserver(car, sample_time, (*shape, 4))}


MOTION = (
    Moved("p2-steer-wet-dry", "Harsh steering, wet and dry (Fig. 7)", rear=True),
    Moved("p2-double-lane-change-snow", "Double lane change, snow (Fig. 8)", rear=True),
    Moved("p2-launch-wet-dry", "Launch, wet to dry, braking (Fig. 10)"),
    Moved("p2-acceleration-in-turn-wet-dry", "Acceleration in a turn, wet to dry, braking (Fig. 10)"),
    Moved("p2-brake-in-turn-snow", "Braking in a turn and accelerating, snow (Fig. 12)"),
    Moved("p2-harsh-steering-ice", "Harsh steering, snow and ice (Fig. 12)"),
)

PARTS = (
    driven_part(
        "table-2-driven",
        "Table II on the truth vehicle",
        partial(force_part, "table-2", ROWS, {"UKF": _unscented, "UIO": _unknown_input}),
        cost=67.0,
    ),
    driven_part(
        "forces-fig-6",
        "Fig. 6 on the truth vehicle: forces under throttle and brake, and accelerating in a turn",
        partial(force_part, "fig-6", FIG_6, {"UKF": _unscented, "UIO": _unknown_input}),
        cost=79.0,
    ),
    driven_part(
        "speed-fig-9",
        "Fig. 9 on the truth vehicle: step steer, throttle in a turn",
        partial(speed_part, "fig-9", FIG_9),
        cost=79.0,
    ),
    driven_part(
        "speed-fig-10",
        "Figs. 10 and 11 on the truth vehicle: wet, then dry",
        partial(speed_part, "fig-10", FIG_10),
        cost=54.0,
        quick=True,
    ),
    driven_part(
        "speed-fig-12",
        "Figs. 12 and 13 on the truth vehicle: snow and ice",
        partial(speed_part, "fig-12", FIG_12),
        cost=69.0,
    ),
    driven_part(
        "tests-driven",
        "Figs. 1 to 3 on the truth vehicle: gramian and unknown start",
        driven_tests_part,
        cost=8.0,
    ),
    driven_part(
        "motion",
        "Figs. 7, 8, 10 and 12 on the truth vehicle: accelerations, yaw rate, rear wheels",
        partial(motion_part, "motion", MOTION),
        cost=5.0,
    ),
)
