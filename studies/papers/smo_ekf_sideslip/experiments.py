"""Tables 1 to 5 and Figs. 7, 8, 12 to 18, driven on the truth vehicle: slalom and roundabout."""

from __future__ import annotations

from studies.experiments.axle_report import AxleTest, axle_part
from studies.papers.smo_ekf_sideslip.published_tables import MASS_SETTINGS, STIFFNESS_SETTINGS, printed
from studies.study import Part, PartResult, Scope


def slalom(scope: Scope) -> PartResult:
    """Tables 1, 3 and 5."""
    test = AxleTest("p5-slalom", "Slalom", printed()["slalom"], 5.7, STIFFNESS_SETTINGS, MASS_SETTINGS)
    return axle_part("slalom", test, scope)


def slalom_other_tire(scope: Scope) -> PartResult:
    """Tables 1, 3 and 5 on the Magic Formula."""
    test = AxleTest("p5-slalom", "Slalom, other tire", printed()["slalom"], 5.7, STIFFNESS_SETTINGS, MASS_SETTINGS)
    return axle_part("slalom-other-tire", test, scope, "magic-formula")


def roundabout(scope: Scope) -> PartResult:
    """Tables 2 and 4."""
    return axle_part(
        "roundabout", AxleTest("p5-roundabout", "Roundabout", printed()["roundabout"], 5.4, STIFFNESS_SETTINGS), scope
    )


PARTS = (
    Part("slalom-driven", "Tables 1, 3 and 5 on the truth vehicle: slalom", slalom, cost=60.0),
    Part(
        "slalom-other-tire",
        "Tables 1, 3 and 5 on a tire with another shape: Magic Formula with slip lag",
        slalom_other_tire,
        cost=65.0,
    ),
    Part("roundabout-driven", "Tables 2 and 4 on the truth vehicle: roundabout", roundabout, cost=70.0),
)
