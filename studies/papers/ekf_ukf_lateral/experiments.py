"""Table I and Figs. 5 to 9 on the truth vehicle."""

from __future__ import annotations

from functools import partial

from studies.papers.ekf_ukf_lateral.accuracy import TABLE_1
from studies.papers.ekf_ukf_lateral.bends import four_wheel_part
from studies.study import PartResult, Scope
from studies.trials.motion import MotionTest, motion_part
from studies.trials.simulations import MAGIC_FORMULA, trial_part

MANOEUVRE = "p4-bends-dry"
MOTION = (MotionTest(MANOEUVRE, "Right, left and right bend, dry (Fig. 5)", course=True),)


def _table_1(name: str, scope: Scope, tire: str) -> PartResult:
    return four_wheel_part(name, MANOEUVRE, TABLE_1, scope, tire)


PARTS = (
    trial_part("table-1-driven", "Table I on the truth vehicle", partial(_table_1, "bends"), 53.0, quick=True),
    trial_part("table-1-other-tire", "Table I on a tire with another shape: Magic Formula with slip lag",
                partial(_table_1, "bends-other-tire"), 53.0, MAGIC_FORMULA),
    trial_part("motion", "Fig. 5 on the truth vehicle: path, speed, steering, g-g diagram",
                partial(motion_part, "motion", MOTION), 5.0),
)  # fmt: skip
