"""The study of P1: its topics in the order of the paper, and its manoeuvres, simulated on the truth vehicle."""

from __future__ import annotations

from functools import partial

from studies.papers.corner_estimation import (
    accuracy,
    error_dynamics,
    force_observers,
    hinf_design,
    loads,
    observability,
    quadratic_stability,
    solve_size,
)
from studies.papers.corner_estimation.inputs import PARAMETERS
from studies.papers.topic import constants_part
from studies.study import Study
from studies.trials.forces import ForceTest, differentiated_pid, force_part
from studies.trials.motion import MotionTest, motion_part
from studies.trials.simulations import MAGIC_FORMULA, trial_part
from studies.trials.velocities import VelocityTest, corner_observers, velocity_part

TOPICS = [topic.TOPIC for topic in (
    error_dynamics, quadratic_stability, hinf_design, solve_size, force_observers, observability, loads, accuracy,
)]  # fmt: skip
CLAIMS = {name: compute for topic in TOPICS for name, compute in topic.claims.items()}  # by the id of the claim
OBSERVERS = corner_observers(PARAMETERS)
# Table III: NRMS in % and peaks in m/s of V_x and V_y.
ALL_WHEEL = (
    VelocityTest("p1-launch-split", "launch, ice and dry", 2.64, 4.14, 0.2, 0.08),
    VelocityTest("p1-acceleration-in-turn-dry", "acceleration in a turn, dry", 4.61, 9.1, 6.3, 0.83),
    VelocityTest("p1-steering-accel-decel-snow", "steering, accelerating, braking, snow", 3.38, 9.98, 4.11, 4.04),
    VelocityTest("p1-lane-change-snow", "lane change, snow", 1.6, 11.86, 3.29, 2.02),
)
REAR_WHEEL = (
    VelocityTest("p1-acceleration-left-turn-wet-dry", "acceleration and left turn, wet to dry", 2.07, 9.06, 5.91, 0.95),
    VelocityTest("p1-full-turn-dry", "full turn, dry", 0.65, 9.01, 7.15, 0.52),
    VelocityTest("p1-full-turn-dry-wet", "full turn, dry to wet", 0.79, 7.51, 6.21, 0.74),
)
OVAL = (VelocityTest("p1-oval-dry", "oval, dry", 3.15, 8.38, 7.6, 1.24),)
FORCES = (  # Table II is lost; the text gives 7.4 % for F_x, 7.1 % for F_y, 4 % for F_z at most
    ForceTest("p1-lane-change-brake-wet", "lane change and braking, wet (Fig. 6a)"),
    ForceTest("p1-brake-in-turn-snow", "brake in turn, packed snow (Fig. 6b)"),
    ForceTest("p1-lane-change-dry", "lane change, dry (Fig. 7)"),
    ForceTest("p1-steering-ice-snow", "steering, ice to snow (Fig. 8)"),
)
MOTION = (
    MotionTest("p1-lane-change-dry", "Lane change, dry (Fig. 7)"),
    MotionTest("p1-launch-split", "Launch, ice and dry (Fig. 9)"),
    MotionTest("p1-lane-change-snow", "Lane change, snow and ice (Fig. 10)"),
    MotionTest("p1-oval-dry", "Oval, dry (Fig. 11)"),
    MotionTest("p1-acceleration-in-turn-dry", "Acceleration in a turn, dry (Fig. 12)"),
    MotionTest("p1-acceleration-left-turn-wet-dry", "Acceleration and left turn, wet to dry (Fig. 13)"),
)

CONSTANTS = constants_part(PARAMETERS, "Vehicle and tire constants of P1, as every result of this study uses them.")
EXPERIMENTS = (
    trial_part("table-3-all-wheel-drive", "Table III on the truth vehicle: all-wheel drive",
                partial(velocity_part, "all-wheel-drive", ALL_WHEEL, OBSERVERS), cost=55.0, quick=True),
    trial_part("table-3-rear-wheel-drive", "Table III on the truth vehicle: rear-wheel drive",
                partial(velocity_part, "rear-wheel-drive", REAR_WHEEL, OBSERVERS), cost=70.0),
    trial_part("table-3-oval", "Table III on the truth vehicle: oval", partial(velocity_part, "oval", OVAL, OBSERVERS), 50.0),
    trial_part("table-3-other-tire", "Table III on a tire that no estimator knows: Magic Formula with slip lag",
                partial(velocity_part, "other-tire", ALL_WHEEL, OBSERVERS), cost=58.0, tire=MAGIC_FORMULA),
    trial_part("forces", "Figs. 6 to 8 on the truth vehicle: forces",
                partial(force_part, "forces", FORCES, {"PID": differentiated_pid}), cost=58.0),
    trial_part("motion", "Figs. 7 and 9 to 13 on the truth vehicle: accelerations and yaw rate",
                partial(motion_part, "motion", MOTION), cost=5.0),
)  # fmt: skip

STUDY = Study(
    PARAMETERS, "Corner-based estimation of tire forces and vehicle velocities", "P1",
    "Forces at each wheel from spin and planar dynamics, normalised and fed to a two-state bristle observer at each "
    "corner, with gains scheduled over wheel speed. Recomputed: the error dynamics and their Lyapunov proofs, the "
    "H-infinity design and its gains, the force observers, loads, observability and the accuracy that the text claims.",
    (CONSTANTS, *(part for topic in TOPICS for part in topic.parts), *EXPERIMENTS),
)  # fmt: skip
