"""The claims of P1 as the study recomputes them: complete, fit for the report, and in line with the reference list."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from studies.papers.corner_estimation.inputs import PACKAGE
from studies.papers.corner_estimation.study import CLAIMS, STUDY
from studies.papers.published import published_claims
from studies.study import QUICK, PartResult
from tests.support.p1_findings import PRINT, finding
from tests.support.study_checks import check_result, check_study, desk_parts
from tests.support.study_reference import reference_claims


@cache
def part(name: str) -> PartResult:
    (found,) = (p for p in desk_parts(STUDY) if p.name == name)
    return found.run(QUICK)


def close(value: float, printed: str) -> bool:
    """Within half of the last digit of a number as it is written."""
    mantissa, _, exponent = printed.lower().partition("e")
    digits = len(mantissa.partition(".")[2])
    return abs(value - float(printed)) <= 0.5 * 10.0 ** (int(exponent or 0) - digits) * (1 + 1e-9)


def test_every_published_claim_is_computed_in_one_part() -> None:
    published = published_claims(PACKAGE)
    assert set(CLAIMS) == set(published)
    assert {entry.paper for entry in published.values()} == {"P1", "P1/P2"}
    check_study(STUDY)
    homes = [claim.published.id for p in desk_parts(STUDY) for claim in part(p.name).claims]
    assert sorted(homes) == sorted(CLAIMS)


@pytest.mark.parametrize("name", [p.name for p in desk_parts(STUDY)])
def test_every_part_hands_over_what_the_report_needs(name: str) -> None:
    check_result(part(name))


@pytest.mark.shared
def test_claims_and_verdicts_are_those_of_the_reference() -> None:
    reference = reference_claims("P1") | reference_claims("P1/P2")
    assert set(CLAIMS) == set(reference)
    for name, entry in reference.items():
        if entry["verdict"] != "yours to find":
            assert str(finding(name).verdict) == entry["verdict"], name


def test_numbers_agree_with_an_independent_recomputation() -> None:
    """The numbers of the reference list, which others computed; its "~" are two digits."""
    terms = {term.strip() for term in finding("P1-26").computed["entry"].replace("-", "+-").split("+")} - {""}
    assert terms == {"1", "-L1*p1"}
    primal = finding("P1-29-primal").computed
    assert close(primal["largest_eigenvalue_at_0_rad_s"], "9.278e9")
    np.testing.assert_allclose(primal["holds_on_up_to_400_rad_s"], [[302.9196, 302.933]], atol=5e-5)
    lateral = finding("P1-41-primal").computed
    assert lateral["largest_eigenvalue_at_0_rad_s"] == pytest.approx(2.278e8, rel=5e-4)
    assert lateral["largest_eigenvalue_at_180_rad_s"] == pytest.approx(5.511e8, rel=5e-4)
    np.testing.assert_allclose(lateral["holds_on_rad_s"][0], [52.876, 52.9042], atol=5e-5)
    weights = (169e3, 21e3, 34560e3, 497e3)
    for weight, entry in zip(weights, finding("P1-aqs-feas").computed.values(), strict=True):
        assert entry["weights_of_diag_w_1"][0] < weight < entry["weights_of_diag_w_1"][1]
    found = list(finding("P1-aqs-scale").computed.values())
    np.testing.assert_allclose([e["natural_condition_number"] for e in found], [1.7e5, 2.1e4, 3.5e7, 5e5], rtol=0.03)
    np.testing.assert_allclose(
        [found[0]["margin_unscaled"]["10000"], found[2]["margin_unscaled"]["10000"]], [-945.0, -2340.0], rtol=2e-3
    )
    np.testing.assert_allclose([e["scale_of_z"] for e in found], [411.0, 146.0, 5879.0, 705.0], atol=0.5)
    gamma = finding("P1-30-sign").computed["gamma"]
    assert abs(gamma["printed"]["lateral"] - 4.2808) <= 1e-3 and abs(gamma["corrected"]["lateral"] - 1.0) <= 1e-3
    x, y = (finding("P1-hinf-figs").computed[d] for d in PRINT)
    ours = [*x["intensities_of_friction_and_acceleration"], *x["Kalman filter"]["L1"], x["Kalman filter"]["L2"][0],
            *y["intensities_of_friction_and_acceleration"], *y["Kalman filter"]["L1"], y["Kalman filter"]["L2"][0]]  # fmt: skip
    kalman = [0.5165, 43527.0, 0.792, 0.588, 183.1, 14.79, 2984.0, 1.179, 1.056, 16.7]
    np.testing.assert_allclose(ours, kalman, rtol=1e-3)
    force = finding("P1-prop1").computed
    assert abs(force["bound_N"] - 1.97628458) < 5e-9
    assert force["largest_late_error_N"]["ramp"] == pytest.approx(1.97632, rel=1e-3)
    sums = finding("P1-ukf").computed
    assert sums["N=3"]["sum_of_mean_weights"] == {"printed": 9, "corrected": 1}
    assert sums["N=3"]["centre_weights"] == [0, 2]
    assert sums["N=1"]["sum_of_mean_weights"]["printed"] == pytest.approx(11 / 3, rel=1e-15)
    assert [row[3] for row in finding("P1-tab3").computed["above_the_limit"]] == [7.6, 7.15]
    assert finding("P1-34").computed["needed_for_both_axles"]["W_s"] == "1/2"
