"""Negative controls of P2: another input, another verdict, for every claim."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from studies.claim import ClaimVerdict, Finding
from studies.papers.longitudinal_speed import (
    model,
    slip_threshold,
    steady_filter,
    stochastic_observability,
    study,
    unknown_input_observer,
)
from studies.papers.longitudinal_speed.inputs import constant
from tests.support.p2_findings import finding


def without_the_worse_cells() -> Finding:
    rows = [list(row) for row in study.FORCES]
    for row in rows:
        for k in (1, 3, 5):
            row[k + 1] = max(row[k + 1], row[k] + 0.01)
    return study.force_table(rows)


CONTROLS: dict[str, tuple[Callable[[], Finding], ClaimVerdict]] = {
    "P2-19M": (lambda: model.descriptor_form(((1, 0, 0), (0, 1, 0), (0, 1, 1))), ClaimVerdict.NOT_REPRODUCED),
    "P2-kappa": (lambda: model.patch_constant("7/(6 L)"), ClaimVerdict.REPRODUCED),
    "P2-Re": (lambda: model.effective_radius({"table": 0.33, "text": 0.33}), ClaimVerdict.REPRODUCED),
    "P2-O3": (lambda: model.rank_over_the_region((1, "-5")), ClaimVerdict.REPRODUCED),
    "P2-test1": (lambda: stochastic_observability.time_of_test_1({"one reading": 0.015}), ClaimVerdict.NOT_REPRODUCED),
    # a wheel at rest leaves an integrator that no sample sees
    "P2-test2": (
        lambda: stochastic_observability.bound_of_test_2({"standing": constant(0.0, 60)}), ClaimVerdict.NOT_REPRODUCED,
    ),
    "P2-A": (lambda: steady_filter.appendix(noise_share=0.5), ClaimVerdict.NOT_REPRODUCED),
    "P2-uio": (lambda: unknown_input_observer.theorem_1(claimed_gain=1.5), ClaimVerdict.NOT_REPRODUCED),
    "P2-29": (
        lambda: slip_threshold.slip_threshold(slip_threshold.CORRECTED_WIDTH), ClaimVerdict.REPRODUCED,
    ),
    "P2-tab2": (without_the_worse_cells, ClaimVerdict.REPRODUCED),
}  # fmt: skip


def test_every_claim_can_fall() -> None:
    assert set(CONTROLS) == set(study.CLAIMS)


@pytest.mark.parametrize("name", CONTROLS)
def test_another_input_gives_another_verdict(name: str) -> None:
    run, expected = CONTROLS[name]
    assert run().verdict is expected
    assert finding(name).verdict is not expected
