"""The study of P2: its topics in the order of the paper, and its manoeuvres, simulated on the truth vehicle."""

from __future__ import annotations

from functools import partial

from estimators.forces import UnknownInputForceObserver, WheelForceFilter
from estimators.vehicle import CORNERS
from studies.papers.longitudinal_speed import (
    accuracy,
    model,
    observability,
    slip_threshold,
    steady_filter,
    stochastic_observability,
    unknown_input_observer,
)
from studies.papers.longitudinal_speed.accuracy import FORCES, LOADS
from studies.papers.longitudinal_speed.inputs import PARAMETERS
from studies.papers.longitudinal_speed.speed_trial import speed_part
from studies.papers.longitudinal_speed.truth_records import truth_part
from studies.papers.topic import constants_part
from studies.study import Study
from studies.trials.estimation import Parts
from studies.trials.forces import ForceTest, force_part
from studies.trials.motion import MotionTest, motion_part
from studies.trials.simulations import trial_part

CONSTANTS = constants_part(
    PARAMETERS,
    "Vehicle and tire constants of P2, as every result of this study uses them; of the two radii that it prints, 0.35 m in "
    "the text and 0.33 m in Table I, that of the text.",
)
TOPICS = [topic.TOPIC for topic in (
    model, observability, stochastic_observability, steady_filter, unknown_input_observer, slip_threshold, accuracy,
)]  # fmt: skip
CLAIMS = {name: compute for topic in TOPICS for name, compute in topic.claims.items()}  # by the id of the claim


def _printed(k: int) -> dict[tuple[str, str, str], float]:
    """Table II of the test ``k`` by signal, corner and method."""
    columns = (("F_x", "UKF", FORCES, 1), ("F_x", "UIO", FORCES, 2), ("F_z", "pipeline", LOADS, 1))
    return {(signal, corner, method): row[first + 2 * k] for signal, method, rows, first in columns
            for corner, row in zip(CORNERS, rows, strict=True)}  # fmt: skip


TABLE_2 = (
    ForceTest("p2-steer-wet-dry", "steering, wet and dry", _printed(0)),
    ForceTest("p2-double-lane-change-snow", "double lane change, snow", _printed(1)),
    ForceTest("p2-brake-in-turn-snow", "braking in a turn and accelerating, snow", _printed(2)),
)
FIG_6 = (
    ForceTest("p2-throttle-brake-low", "alternating throttle and brake, friction 0.3 (Fig. 6a)"),
    ForceTest("p2-acceleration-in-turn-dry", "acceleration in a turn, dry (Fig. 6b)"),
    ForceTest("p2-acceleration-in-turn-low", "acceleration in a turn, friction 0.25 (Fig. 6c)"),
)
FIG_9 = (
    MotionTest("p2-step-steer-dry", "step steer, dry"),
    MotionTest("p2-turn-throttle-dry", "full throttle in a turn, dry"),
    MotionTest("p2-turn-throttle-low", "full throttle in a turn, friction 0.3"),
)
FIG_10 = (
    MotionTest("p2-launch-wet-dry", "launch, wet to dry, braking"),
    MotionTest("p2-acceleration-in-turn-wet-dry", "acceleration in a turn, wet to dry, braking"),
)
FIG_12 = (
    MotionTest("p2-brake-in-turn-snow", "braking in a turn and accelerating, snow"),
    MotionTest("p2-harsh-steering-ice", "harsh steering, snow and ice"),
)
MOTION = (
    MotionTest("p2-steer-wet-dry", "Harsh steering, wet and dry (Fig. 7)", rear=True),
    MotionTest("p2-double-lane-change-snow", "Double lane change, snow (Fig. 8)", rear=True),
    MotionTest("p2-launch-wet-dry", "Launch, wet to dry, braking (Fig. 10)"),
    MotionTest("p2-acceleration-in-turn-wet-dry", "Acceleration in a turn, wet to dry, braking (Fig. 10)"),
    MotionTest("p2-brake-in-turn-snow", "Braking in a turn and accelerating, snow (Fig. 12)"),
    MotionTest("p2-harsh-steering-ice", "Harsh steering, snow and ice (Fig. 12)"),
)
OBSERVERS: dict[str, Parts] = {
    # in its linear form: the model is linear, so both are equal to round-off, and this one is faster
    "UKF": lambda car, step, shape: {"longitudinal_force": WheelForceFilter(car, step, (*shape, 4), method="linear")},
    "UIO": lambda car, step, shape: {"longitudinal_force": UnknownInputForceObserver(car, step, (*shape, 4))},
}
EXPERIMENTS = (
    trial_part("table-2-driven", "Table II on the truth vehicle", partial(force_part, "table-2", TABLE_2, OBSERVERS), 67.0),
    trial_part("forces-fig-6", "Fig. 6 on the truth vehicle: forces under throttle and brake, and accelerating in a turn",
                partial(force_part, "fig-6", FIG_6, OBSERVERS), 79.0),
    trial_part("speed-fig-9", "Fig. 9 on the truth vehicle: step steer, throttle in a turn",
                partial(speed_part, "fig-9", FIG_9), 79.0),
    trial_part("speed-fig-10", "Figs. 10 and 11 on the truth vehicle: wet, then dry",
                partial(speed_part, "fig-10", FIG_10), 54.0, quick=True),
    trial_part("speed-fig-12", "Figs. 12 and 13 on the truth vehicle: snow and ice", partial(speed_part, "fig-12", FIG_12), 69.0),
    trial_part("tests-driven", "Figs. 1 to 3 on the truth vehicle: gramian and unknown start", truth_part, 8.0),
    trial_part("motion", "Figs. 7, 8, 10 and 12 on the truth vehicle: accelerations, yaw rate, rear wheels",
                partial(motion_part, "motion", MOTION), 5.0),
)  # fmt: skip

STUDY = Study(
    PARAMETERS,
    "Longitudinal speed estimation robust to road conditions",
    "P2",
    "Wheel forces from a simple unknown-input observer or a UKF, normalised and fed to a three-state time-varying Kalman "
    "filter at each wheel. Recomputed: the model, its observability, what an unknown initial state does to the filter, the "
    "recursions of the appendix, the bound of the force observer, the slip threshold and the accuracy that the text claims.",
    (CONSTANTS, *(part for topic in TOPICS for part in topic.parts), *EXPERIMENTS),
)
