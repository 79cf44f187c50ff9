"""Tables 1 to 5 and Figs. 7, 8, 12 to 18, driven on the truth vehicle: slalom and roundabout."""

from __future__ import annotations

from functools import partial

from studies.papers.smo_ekf_sideslip.published_tables import MASS_SETTINGS, STIFFNESS_SETTINGS, printed
from studies.study import PartResult, Scope
from studies.trials.axle_report import AxleTest, axle_part
from studies.trials.driven import MAGIC_FORMULA, driven_part
from studies.trials.motion import Moved, motion_part


def slalom(name: str, title: str, scope: Scope, tire: str) -> PartResult:
    """Tables 1, 3 and 5."""
    test = AxleTest("p5-slalom", title, printed()["slalom"], 5.7, STIFFNESS_SETTINGS, MASS_SETTINGS)
    return axle_part(name, test, scope, tire)


def roundabout(scope: Scope, tire: str) -> PartResult:
    """Tables 2 and 4."""
    return axle_part(
        "roundabout",
        AxleTest("p5-roundabout", "Roundabout", printed()["roundabout"], 5.4, STIFFNESS_SETTINGS),
        scope,
        tire,
    )


MOTION = (
    Moved("p5-slalom", "Slalom, dry (Fig. 5)", course=True),
    Moved("p5-roundabout", "Roundabout, dry (Fig. 6)", course=True),
)

PARTS = (
    driven_part(
        "slalom-driven",
        "Tables 1, 3 and 5 on the truth vehicle: slalom",
        partial(slalom, "slalom", "Slalom"),
        cost=43.0,
        quick=True,
    ),
    driven_part(
        "slalom-other-tire",
        "Tables 1, 3 and 5 on a tire with another shape: Magic Formula with slip lag",
        partial(slalom, "slalom-other-tire", "Slalom, other tire"),
        cost=45.0,
        tire=MAGIC_FORMULA,
    ),
    driven_part("roundabout-driven", "Tables 2 and 4 on the truth vehicle: roundabout", roundabout, cost=43.0),
    driven_part(
        "motion",
        "Figs. 5 and 6 on the truth vehicle: path and accelerations",
        partial(motion_part, "motion", MOTION),
        cost=5.0,
    ),
)
