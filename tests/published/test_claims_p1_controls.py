"""Negative controls of P1: another input, another verdict, for every claim."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from studies.claim import ClaimVerdict, Finding
from studies.papers.corner_estimation import (
    claims_accuracy,
    claims_conditioning,
    claims_error_matrix,
    claims_filter,
    claims_forces,
    claims_gains,
    claims_hinf,
    claims_loads,
    claims_lyapunov,
    claims_solve_size,
    claims_stability,
)
from studies.papers.corner_estimation.inputs import DESIGNS, parameters, printed_gains, printed_numbers
from studies.papers.corner_estimation.study import CLAIMS
from tests.unit.p1_findings import finding


def heavier() -> Finding:
    """Loads from a mass that is one part in a million too large."""
    car = parameters()
    mass = car.vehicle["mass"].model_copy(update={"value": 2270.0 * (1 + 1e-6)})
    return claims_loads.load_formulas(car.model_copy(update={"vehicle": {**car.vehicle, "mass": mass}}))


CONTROLS: dict[str, tuple[Callable[[], Finding], ClaimVerdict]] = {
    "P1-26": (
        lambda: claims_error_matrix.entry_of_the_error_matrix(1 - claims_error_matrix.L1 * claims_error_matrix.P1),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-C-abs": (lambda: claims_error_matrix.absolute_value(signed=False), ClaimVerdict.REPRODUCED),
    # the dual matrix turned round is a true primal one: P = adj(Q) of the longitudinal print
    "P1-29-primal": (
        lambda: claims_lyapunov.primal(
            "longitudinal",
            [[["80379.0", "-115.35"], ["-115.35", "1.2176"]], [["-67.969", "0.2227"], ["0.2227", "-0.0011"]]],
        ),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-41-primal": (
        lambda: claims_lyapunov.primal("lateral", [[["67000", "0"], ["0", "1"]], [["0", "0"], ["0", "0"]]]),
        ClaimVerdict.REPRODUCED,
    ),
    # not positive definite any more
    "P1-29-dual": (
        lambda: claims_lyapunov.dual(
            "longitudinal",
            [[["1.2176", "315.35"], ["315.35", "80379.0"]], [["-0.0011", "-0.2227"], ["-0.2227", "-67.969"]]],
        ),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    "P1-41-dual": (
        lambda: claims_lyapunov.dual("lateral", [[["1", "0"], ["0", "67000"]], [["0", "0"], ["0", "0"]]]),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-mc": (
        lambda: claims_lyapunov.printed_slopes_are_multi_convex(
            {d: [["0", "0"], ["0", "0"]] for d in ("longitudinal", "lateral")}
        ),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-aqs-feas": (
        lambda: claims_stability.printed_gains_are_stable(
            {key: (gains[0], -0.1) if key[1] == "lateral" else gains for key, gains in all_gains().items()}
        ),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    "P1-aqs-box": (
        lambda: claims_stability.printed_boxes_are_stable(
            {"longitudinal": ((0.5, 0.9), (-1.0, 210.0)), "lateral": ((0.8, 1.3), (6.0, 19.0))}
        ),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    "P1-aqs-scale": (lambda: claims_conditioning.conditioning(scaled=False), ClaimVerdict.NOT_REPRODUCED),
    "P1-30-sign": (lambda: claims_hinf.sign_of_the_disturbance(-1), ClaimVerdict.REPRODUCED),
    "P1-hinf-gamma": (lambda: claims_hinf.least_gamma_by_degree(20, tolerance=1e-9), ClaimVerdict.NOT_REPRODUCED),
    "P1-hinf-figs": (
        lambda: claims_gains.plotted_gains(0, {"C_e = I": claims_gains.STATES}),
        ClaimVerdict.NOT_REPRODUCED,
    ),
    # a count that does not grow with the points: the inequalities by name instead of one by one
    "P1-hinf-time": (lambda: claims_solve_size.solve_size(10, walked=lambda problem: 2), ClaimVerdict.NOT_REPRODUCED),
    "P1-ukf": (lambda: claims_filter.sigma_weights("corrected"), ClaimVerdict.REPRODUCED),
    "P1-loads": (heavier, ClaimVerdict.NOT_REPRODUCED),
    "P1-pid-K": (lambda: claims_forces.wheel_error((1.8, -11.4)), ClaimVerdict.NOT_REPRODUCED),
    "P1-prop1": (lambda: claims_forces.force_bound(eta3=20.0), ClaimVerdict.NOT_REPRODUCED),
    "P1-O3": (lambda: claims_filter.lateral_force_rank("none"), ClaimVerdict.NOT_REPRODUCED),
    "P1-tab3": (
        lambda: claims_accuracy.velocity_table([r for r in printed_numbers()["table_3"]["rows"] if r[0] == "AWD"]),
        ClaimVerdict.REPRODUCED,
    ),
    "P1-34": (lambda: claims_accuracy.weight_readings(names_axle=True), ClaimVerdict.REPRODUCED),
}


def all_gains() -> dict[Any, tuple[float, ...]]:
    return {(name, direction): printed_gains(direction, name) for name, direction in DESIGNS}


@pytest.mark.parametrize("name", CONTROLS)
def test_another_input_gives_another_verdict(name: str) -> None:
    run, expected = CONTROLS[name]
    assert run().verdict is expected
    assert finding(name).verdict is not expected


def test_every_claim_can_fall() -> None:
    assert set(CONTROLS) == set(CLAIMS)
