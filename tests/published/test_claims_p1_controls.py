"""Negative controls of P1: another input, another verdict, for every claim."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from studies.claim import ClaimVerdict, Finding
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
from studies.papers.corner_estimation.inputs import DESIGNS, PACKAGE, parameters
from studies.papers.corner_estimation.study import CLAIMS
from studies.papers.published import printed_numbers
from tests.support.p1_findings import finding


def heavier() -> Finding:
    """Loads from a mass that is one part in a million too large."""
    car = parameters()
    mass = car.vehicle["mass"].model_copy(update={"value": 2270.0 * (1 + 1e-6)})
    return loads.load_formulas(car.model_copy(update={"vehicle": {**car.vehicle, "mass": mass}}))


CONTROLS: dict[str, tuple[Callable[[], Finding], ClaimVerdict]] = {
    "P1-26": (
        lambda: error_dynamics.entry_of_the_error_matrix(1 - error_dynamics.L1 * error_dynamics.P1),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-C-abs": (lambda: error_dynamics.absolute_value(signed=False), ClaimVerdict.REPRODUCED),
    # the dual matrix turned round is a true primal one: P = adj(Q) of the longitudinal print
    "P1-29-primal": (
        lambda: error_dynamics.primal(
            "longitudinal",
            [[["80379.0", "-115.35"], ["-115.35", "1.2176"]], [["-67.969", "0.2227"], ["0.2227", "-0.0011"]]],
        ),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-41-primal": (
        lambda: error_dynamics.primal("lateral", [[["67000", "0"], ["0", "1"]], [["0", "0"], ["0", "0"]]]),
        ClaimVerdict.REPRODUCED,
    ),
    # not positive definite any more
    "P1-29-dual": (
        lambda: error_dynamics.dual(
            "longitudinal",
            [[["1.2176", "315.35"], ["315.35", "80379.0"]], [["-0.0011", "-0.2227"], ["-0.2227", "-67.969"]]],
        ),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    "P1-41-dual": (
        lambda: error_dynamics.dual("lateral", [[["1", "0"], ["0", "67000"]], [["0", "0"], ["0", "0"]]]),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-mc": (
        lambda: error_dynamics.printed_slopes_are_multi_convex(
            {d: [["0", "0"], ["0", "0"]] for d in ("longitudinal", "lateral")}
        ),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-aqs-feas": (
        lambda: quadratic_stability.printed_gains_are_stable(
            {c: (c.gains[0], -0.1) if c.direction == "lateral" else c.gains for c in DESIGNS}
        ),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    "P1-aqs-box": (
        lambda: quadratic_stability.printed_boxes_are_stable(
            {"longitudinal": ((0.5, 0.9), (-1.0, 210.0)), "lateral": ((0.8, 1.3), (6.0, 19.0))}
        ),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    "P1-aqs-scale": (lambda: quadratic_stability.scaling(scaled=False), ClaimVerdict.NOT_REPRODUCED),
    "P1-30-sign": (lambda: hinf_design.sign_of_the_disturbance(-1), ClaimVerdict.REPRODUCED),
    "P1-hinf-gamma": (lambda: hinf_design.least_gamma_by_degree(20, tolerance=1e-9), ClaimVerdict.NOT_REPRODUCED),
    "P1-hinf-figs": (
        lambda: hinf_design.plotted_gains(0, {"C_e = I": hinf_design.STATES}),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    # a count that does not grow with the points: the inequalities by name instead of one by one
    "P1-hinf-time": (lambda: solve_size.solve_size(10, walked=lambda problem: 2), ClaimVerdict.NOT_REPRODUCED),
    "P1-ukf": (lambda: force_observers.sums_of_the_weights("corrected"), ClaimVerdict.REPRODUCED),
    "P1-loads": (heavier, ClaimVerdict.NOT_REPRODUCED),
    "P1-pid-K": (lambda: force_observers.wheel_error((1.8, -11.4)), ClaimVerdict.NOT_REPRODUCED),
    "P1-prop1": (lambda: force_observers.force_bound(eta3=20.0), ClaimVerdict.NOT_REPRODUCED),
    "P1-O3": (lambda: observability.lateral_force_rank("none"), ClaimVerdict.NOT_REPRODUCED),
    "P1-tab3": (
        lambda: accuracy.velocity_table([r for r in printed_numbers(PACKAGE)["table_3"]["rows"] if r[0] == "AWD"]),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-34": (lambda: accuracy.weight_readings(names_axle=True), ClaimVerdict.REPRODUCED),
}


@pytest.mark.parametrize("name", CONTROLS)
def test_another_input_gives_another_verdict(name: str) -> None:
    run, expected = CONTROLS[name]
    assert run().verdict is expected
    assert finding(name).verdict is not expected


def test_every_claim_can_fall() -> None:
    assert set(CONTROLS) == set(CLAIMS)
