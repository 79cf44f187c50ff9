"""The claims of P2 as the study recomputes them: complete, fit for the report, and in line with the reference list."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from studies.papers.longitudinal_speed.inputs import PACKAGE, accelerating
from studies.papers.longitudinal_speed.stochastic_observability import both_tests
from studies.papers.longitudinal_speed.study import CLAIMS, STUDY
from studies.papers.published import published_claims
from studies.plots.draw import look
from studies.study import QUICK, PartResult
from tests.support.p2_findings import finding
from tests.support.study_checks import check_result, check_study, desk_parts
from tests.support.study_reference import reference_claims


@cache
def part(name: str) -> PartResult:
    (found,) = (p for p in desk_parts(STUDY) if p.name == name)
    with look():
        return found.run(QUICK)


def test_every_published_claim_is_computed_in_one_part() -> None:
    published = published_claims(PACKAGE)
    assert set(CLAIMS) == set(published)
    assert {entry.paper for entry in published.values()} == {"P2"}
    check_study(STUDY)
    homes = [claim.published.id for p in desk_parts(STUDY) for claim in part(p.name).claims]
    assert sorted(homes) == sorted(CLAIMS)


@pytest.mark.parametrize("name", [p.name for p in desk_parts(STUDY)])
def test_every_part_hands_over_what_the_report_needs(name: str) -> None:
    check_result(part(name))


@pytest.mark.shared
def test_claims_and_verdicts_are_those_of_the_reference() -> None:
    reference = reference_claims("P2")
    assert set(CLAIMS) == set(reference)
    for name, entry in reference.items():
        if entry["verdict"] != "yours to find":
            assert str(finding(name).verdict) == entry["verdict"], name


def test_numbers_agree_with_an_independent_recomputation() -> None:
    """The numbers of the reference list, which others computed."""
    first = finding("P2-test1").computed
    assert first["seconds_to_zero"] == {
        "three states, accelerating": 0.015, "three states, constant speed": "never", "two states": 0.01,
    }  # fmt: skip
    assert first["left_after_6_samples"]["40 rad/s"] == pytest.approx(0.00121, rel=5e-3)
    assert first["left_after_6_samples"]["100 rad/s"] == pytest.approx(5.1e-8, rel=1e-2)
    moving = both_tests(accelerating(40.0, 100.0, 13, 13)).largest_known
    np.testing.assert_allclose(moving[3:6], [3.5e8, 4.34e7, 8.18e6], rtol=2e-3)
    assert finding("P2-29").computed["printed"][0] == pytest.approx(-6.4667, abs=5e-5)
    assert finding("P2-kappa").computed["patch_length_m"]["7/(6 L)"] == pytest.approx(0.1458, abs=5e-5)
    table = finding("P2-tab2").computed
    assert (table["largest_ukf_percent"], table["largest_load_percent"]) == (6.23, 3.88)
    assert (len(table["uio_better"]), table["cells"]) == (3, 12)
    pairs = [4.02, 3.91, 5.32, 5.18, 5.04, 4.9]
    assert sorted(value for row in table["uio_better"] for value in row[2:]) == sorted(pairs)
    assert finding("P2-19M").computed["B"] == [0.0, 1.0, 1.0]
