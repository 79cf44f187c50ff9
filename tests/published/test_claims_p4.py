"""The claims of P4 as the study recomputes them: complete, in line with the reference, and recomputed independently."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from estimators.sideslip import FourWheelModel
from studies.claim import ClaimVerdict, Finding
from studies.papers.ekf_ukf_lateral.accuracy import TABLE_1, below_eight_percent
from studies.papers.ekf_ukf_lateral.inputs import CAR, PACKAGE, STATES, WHEEL_LOADS, Outputs, model_with
from studies.papers.ekf_ukf_lateral.observability import (
    SPLIT,
    STEP,
    motion_pair,
    rank_of_the_model,
    rear_split_is_hidden,
    singular_values,
)
from studies.papers.ekf_ukf_lateral.output_equation import lateral_output
from studies.papers.ekf_ukf_lateral.study import CLAIMS, STUDY
from studies.papers.ekf_ukf_lateral.tire import SPEED, single_track, single_track_poles, straight_poles, tire_sign
from studies.papers.published import published_claims
from studies.study import QUICK
from tests.support.study_checks import check_result, check_study, desk_parts
from tests.support.study_reference import reference_claims


@cache
def finding(name: str) -> Finding:
    return CLAIMS[name]()


def test_every_published_claim_is_computed() -> None:
    assert set(CLAIMS) == set(published_claims(PACKAGE))
    assert all(entry.paper == "P4" for entry in published_claims(PACKAGE).values())


@pytest.mark.shared
def test_claims_are_those_of_the_reference() -> None:
    reference = reference_claims("P4")
    assert set(CLAIMS) == set(reference)
    for name, entry in reference.items():
        if entry["verdict"] != "yours to find":
            assert str(finding(name).verdict) == entry["verdict"], name
    table = finding("P4-tab1").computed
    better_means, rows, better_deviations = 4, 5, 4
    assert table["ukf_means_percent"] == [5.02, 9.32, 7.55, 5.07, 10.2]
    assert (better_means, better_deviations, rows) == (
        table["ukf_better_means"],
        table["ukf_better_deviations"],
        table["rows"],
    )
    assert reference["P4-y4"]["computed"].startswith("x8 sin u1") and finding("P4-y4").computed["term"] == "x8 sin(u1)"


class TestObservability:
    def test_rank_seven_and_six(self) -> None:
        found = finding("P4-obs")
        assert found.verdict is ClaimVerdict.NOT_REPRODUCED
        assert (found.computed["rank"], found.computed["rank_upper_bound"]) == (7, 7)
        assert (found.computed["rank_at_zero_steering"], found.computed["rank_steering_through_zero"]) == (6, 7)
        assert found.computed["hidden_directions"] == ["force_rl - force_rr"]
        assert found.computed["singular_at_zero_speed"] is True

    def test_rank_eight_belongs_to_the_misprint(self) -> None:
        """With x_6 sin(u_1) in y_4 the statement of the paper is exactly true, exception included."""
        computed = finding("P4-obs").computed
        assert (computed["rank_with_y4_as_printed"], computed["rank_with_y4_as_printed_at_zero_steering"]) == (8, 6)
        assert not rear_split_is_hidden(model_with("y4 as printed"))

    @pytest.mark.parametrize("outputs", ["y4 as printed", "y4 corrected, F_y22 measured as well"])
    def test_verdict_flips_when_the_rear_split_is_seen(self, outputs: Outputs) -> None:
        found = rank_of_the_model(outputs)
        assert (found.computed["rank"], found.verdict) == (8, ClaimVerdict.REPRODUCED)

    def test_two_integrated_motions_measure_the_same(self) -> None:
        """Recomputed: the symbolic model by an adaptive integrator, two rear splits; the split decays with the distance."""
        model = model_with()
        f, h = model.with_constants_inserted()
        arguments = [*model.state_symbols, *model.input_symbols]
        field, output = (sp.lambdify(arguments, expression, "numpy") for expression in (f, h))
        inputs = WHEEL_LOADS.tolist()

        def run(split: float) -> np.ndarray:
            start = STATES + split * np.array([0, 0, 0, 0, 0, 1, -1, 0])
            steer = lambda t: 0.06 * np.sin(5.0 * t)  # noqa: E731
            rate = lambda t, x: np.ravel(field(*x, steer(t), *inputs))  # noqa: E731
            return solve_ivp(rate, (0.0, 0.2), start, rtol=1e-10, atol=1e-9, t_eval=np.linspace(0.0, 0.2, 21)).y

        one, two = run(0.0), run(700.0)
        seen = [np.ravel(output(*path[:, 10], 0.05, *inputs)) for path in (one, two)]
        np.testing.assert_allclose(seen[0], seen[1], atol=1e-7)
        distance = np.trapezoid(one[1], np.linspace(0.0, 0.2, 21))
        assert (two - one)[5, -1] == pytest.approx(700.0 * np.exp(-distance / 0.5), rel=1e-5)

    def test_motions_of_the_figure(self) -> None:
        (_, states, outputs), lag = motion_pair(0.3), CAR.rear_relaxation
        np.testing.assert_allclose(outputs[:, 0], outputs[:, 1], atol=1e-13)
        decay = np.prod(1.0 - STEP * states[:-1, 0, 1] / lag)
        assert (states[-1, 1] - states[-1, 0])[5] == pytest.approx(SPLIT * decay, rel=1e-9)
        _, _, outputs = motion_pair(0.3, front=True)
        assert np.abs(np.diff(outputs, axis=1)).max() > 1e-4  # the front split is seen in a bend
        _, _, outputs = motion_pair(0.3, front=True, steered=False)
        np.testing.assert_allclose(outputs[:, 0], outputs[:, 1], atol=1e-13)

    def test_singular_values_of_the_map(self) -> None:
        """The numeric gradients behind the map have the ranks that the exact ones have."""
        bend, ahead = np.array(0.05), np.array(0.0)
        for angle, printed, rank in ((bend, False, 7), (ahead, False, 6), (bend, True, 8), (ahead, True, 6)):
            assert (singular_values(angle, np.array(20.0), printed) > 1e-10).sum() == rank


class TestEquations:
    def test_output_equation_on_a_motion(self) -> None:
        """Recomputed: V (beta' + r) cos(beta) + V' sin(beta) by differences along the runtime's own motion."""
        x, step = STATES, 1e-6
        model = FourWheelModel.at(CAR, step, np.array(0.08), WHEEL_LOADS, 1.0)
        moved = model.transition(x)
        velocity = [state[1] * np.array([np.cos(state[2]), np.sin(state[2])]) for state in (x, moved)]
        lateral = (velocity[1][1] - velocity[0][1]) / step + x[0] * velocity[0][0]
        right = model.measurement(x)[3]
        assert lateral == pytest.approx(right, abs=1e-4)
        printed = right + (x[5] - x[7]) * np.sin(0.08) / CAR.mass
        assert abs(printed - lateral) > 0.02
        assert finding("P4-y4").verdict is ClaimVerdict.ERRATUM

    def test_output_verdict_follows_from_the_form(self) -> None:
        assert lateral_output("y4 corrected").verdict is ClaimVerdict.REPRODUCED

    def test_sign_of_the_tire_force(self) -> None:
        found = finding("P4-dugoff")
        assert found.verdict is ClaimVerdict.ERRATUM
        np.testing.assert_allclose(found.computed["poles_printed_1_s"], [3.0621, 4.0469], atol=1e-4)
        np.testing.assert_allclose(found.computed["poles_corrected_1_s"], [-3.8848, -3.2242], atol=1e-4)
        assert tire_sign(printed_sign=1).verdict is ClaimVerdict.REPRODUCED

    @pytest.mark.parametrize("sign", [1, -1])
    def test_poles_in_exact_numbers(self, sign: int) -> None:
        """Recomputed: s^2 - tr s + det in rationals; the eliminated eight-state model has the same two roots."""
        c1, c2 = sign * Fraction(65000), sign * Fraction(50000)
        l1, l2, m, inertia, v = (Fraction(text) for text in ("1.12", "1.46", "1447", "3000", "20"))
        moment = l1 * c1 - l2 * c2
        trace = -(c1 + c2) / (m * v) - (l1**2 * c1 + l2**2 * c2) / (inertia * v)
        det = (c1 + c2) * (l1**2 * c1 + l2**2 * c2) / (m * inertia * v**2) - (
            1 + moment / (m * v**2)
        ) * moment / inertia
        assert det > 0 and (trace < 0) == (
            sign == 1
        )  # Routh: both poles on one side, the side by the sign of the trace
        roots = np.sort(np.roots([1.0, -float(trace), float(det)]).real)
        np.testing.assert_allclose(straight_poles(sign)[0], roots, rtol=1e-9)
        np.testing.assert_allclose(single_track_poles(sign, SPEED), roots, rtol=1e-9)

    def test_relaxation_changes_no_sign(self) -> None:
        assert straight_poles(1)[1].max() == pytest.approx(-3.5263, abs=1e-4)
        assert straight_poles(-1)[1].max() == pytest.approx(3.7092, abs=1e-4)

    def test_printed_sign_is_unstable_at_every_speed(self) -> None:
        speeds = np.linspace(1.0, 80.0, 80)
        assert (single_track_poles(-1, speeds)[:, 1] > 0.0).all()
        assert (np.trace(single_track(1, speeds)[0], axis1=-2, axis2=-1) < 0.0).all()


class TestTable1:
    def test_two_rows_exceed_the_limit(self) -> None:
        found = finding("P4-tab1")
        assert found.verdict is ClaimVerdict.NOT_REPRODUCED
        assert found.computed["rows_above_limit"] == ["F_y12 front right", "sideslip"]
        exact = sum(Fraction(text) for text in ("5.02", "9.32", "7.55", "5.07", "10.20")) / 5
        assert exact == Fraction(3716, 500) and found.computed["ukf_average_percent"] == pytest.approx(float(exact))
        assert found.computed["ekf_average_percent"] == pytest.approx(10.01, abs=0.005)

    def test_verdict_flips_when_every_row_is_below(self) -> None:
        rows = [replace(row, mean={**row.mean, "ukf": min(row.mean["ukf"], 7.9)}) for row in TABLE_1]
        assert below_eight_percent(rows).verdict is ClaimVerdict.REPRODUCED


def test_study_is_complete() -> None:
    check_study(STUDY)
    assert (STUDY.id, STUDY.paper) == ("ekf-ukf-lateral", "P4")


@pytest.mark.parametrize("part", desk_parts(STUDY), ids=lambda part: part.name)
def test_parts_stand_on_their_own(part) -> None:  # type: ignore[no-untyped-def]
    check_result(part.run(QUICK))
