"""P1 (26)-(29), (40), (41): what the paper claims of its gains and matrices, recomputed.

Numbers "of the notes" (P1 notes 9 and 11) are those of an independent recomputation in exact arithmetic (Sturm sequences).
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.arrays import FloatArray
from studies.papers.corner_estimation.error_dynamics import Certificate, Reading, certificate, convexity
from studies.papers.corner_estimation.inputs import CORNERS
from synthesis.design.stability import Form, GainBox, affine_quadratic_stability
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.models.catalogue.corner import Direction
from synthesis.models.lpv import LpvModel
from synthesis.published_certificate import check_certificate
from tests.support.lmi_cases import corner

DIRECTIONS: tuple[Direction, ...] = ("longitudinal", "lateral")
FORMS: tuple[Form, ...] = ("primal", "dual")
Printed = list[list[list[str]]]


def half_digit(printed: float) -> float:
    """Half the last printed digit."""
    decimals = str(printed).partition(".")[2]
    return 0.5 * 10.0 ** -len(decimals) * (1.0 + 1e-9)


# ---- (26): poles ------------------------------------------------------------------------------------------------------

# P1 notes 9: eigenvalues of A_e [1/s] with the printed gains, (real, imaginary) or the two real ones.
POLES: dict[Direction, dict[int, tuple[complex, ...]]] = {
    "longitudinal": {
        0: (-284.6 + 186.3j,), 40: (-311.2 + 137.6j,), 90: (-396.9, -291.8), 140: (-540.8, -214.2), 180: (-621.7, -186.4)
    },
    "lateral": {
        0: (-199.8, -15.17), 40: (-218.2, -13.90), 90: (-240.9, -12.61), 140: (-263.3, -11.55), 180: (-281.1, -10.83)
    },
}  # fmt: skip
TEXT_DIGITS = {-13.9: 0.005}  # printed as -13.90


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_error_poles_are_those_of_the_table(direction: Direction) -> None:
    model, published = corner("corner-estimation", direction)
    gain = np.array(published.gains)[:, None]
    for omega, printed in POLES[direction].items():
        found = sorted(np.linalg.eigvals(model.on([float(omega)]).error_dynamics(gain)[0][0]), key=lambda x: x.real)
        for value, expected in zip(found if len(printed) == 2 else found[:1], printed, strict=True):
            real = complex(expected).real
            assert abs(value.real - real) <= TEXT_DIGITS.get(real, half_digit(real))
            assert abs(abs(value.imag) - complex(expected).imag) <= 0.05


def test_p3_example_1_slowest_pole() -> None:
    """Claim P3-ex1-eig: lambda_max(A_ex) = -327.1 at omega = 40 rad/s with L = [1.18, 387]."""
    model, published = corner("resilient-velocity", "longitudinal")
    A_e = model.on([40.0]).error_dynamics(np.array(published.gains)[:, None])[0][0]
    assert abs(np.linalg.eigvals(A_e).real.max() + 327.1) <= 0.05
    assert np.linalg.eigvals(A_e).real.max() == pytest.approx(-327.143005949, abs=1e-8)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_the_printed_26_without_its_one_proves_nothing(direction: Direction) -> None:
    """Claim P1-26: with the 1 of entry (1,2) left out, det A0 = 0, a zero eigenvalue at omega = 0."""
    model, published = corner("corner-estimation", direction)
    A_e = model.on([0.0]).error_dynamics(np.array(published.gains)[:, None])[0][0]
    printed = A_e - np.array([[0.0, 1.0], [0.0, 0.0]])
    assert abs(np.linalg.det(printed)) < 1e-9 * abs(np.linalg.det(A_e))
    assert np.linalg.det(A_e) > 0.0


# ---- (28), (40): feasibility ------------------------------------------------------------------------------------------

CASES = [(name, direction) for name in ("corner-estimation", "resilient-velocity") for direction in DIRECTIONS]
RELAXED: list[tuple[Relaxation, int]] = [
    *(("grid", d) for d in range(4)), *(("exact", d) for d in range(4)), ("vertex", 0), ("vertex", 1),
]  # fmt: skip


@pytest.mark.parametrize(("name", "direction"), CASES)
@pytest.mark.parametrize("form", FORMS)
def test_printed_gains_are_affinely_quadratically_stable(name: str, direction: Direction, form: Form) -> None:
    """Claim P1-aqs-feas, for every relaxation and degree; `vertex` includes multi-convexity, met as an equality."""
    model, published = corner(name, direction)
    gain = np.array(published.gains)[:, None]
    for relaxation, degree in RELAXED:
        result = affine_quadratic_stability(model, gain, degree, form, LmiSettings(relaxation=relaxation, points=20))
        assert result.verdict is Verdict.CERTIFIED, (relaxation, degree, result.message)
        assert min(margin.value for margin in result.margins) > 1e-2  # balanced states leave room
        assert dense_worst(model, gain, result.lyapunov, form, np.linspace(0.0, 180.0, 181)) < 0.0


@pytest.mark.parametrize(
    ("name", "direction", "weight"),
    [
        ("corner-estimation", "longitudinal", "169000"),
        ("corner-estimation", "lateral", "21000"),
        ("resilient-velocity", "longitudinal", "34560000"),
        ("resilient-velocity", "lateral", "497000"),
    ],
)
def test_a_constant_diagonal_matrix_is_enough(name: str, direction: Direction, weight: str) -> None:
    """Claim P1-aqs-feas, in exact arithmetic: P = diag(weight, 1) for any rate; one with z unweighted is none."""
    model, published = corner(name, direction)
    assert published.gains is not None
    gains = [[str(gain)] for gain in published.gains]
    assert check_certificate(model, gains, [[[weight, "0"], ["0", "1"]]]).everywhere
    assert check_certificate(model, gains, [[["1", "0"], ["0", "1"]]]).everywhere is False


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("form", FORMS)
def test_whole_boxes_of_gains_are_stable(direction: Direction, form: Form) -> None:
    """Claim P1-aqs-box: every gain in the published boxes, wheel speed 0..180 rad/s, rates +-800 rad/s^2."""
    model, box = gain_box(direction)
    for relaxation, degree in RELAXED:
        result = affine_quadratic_stability(model, box, degree, form, LmiSettings(relaxation=relaxation, points=20))
        assert result.verdict is Verdict.CERTIFIED, (relaxation, degree, result.message)
        assert len(result.margins) == 5  # P > 0 and four vertices of the box


@pytest.mark.parametrize(("direction", "slowest"), [("longitudinal", -52.9), ("lateral", -2.63)])
def test_slowest_pole_over_the_boxes(direction: Direction, slowest: float) -> None:
    """P1 notes 9. Decay rates up to it are consistent with the certificate, one beyond it is refused."""
    model, box = gain_box(direction)
    numeric = model.on(np.linspace(0.0, 180.0, 181))
    axes = [np.linspace(low, high, 21) for low, high in zip(box.lower.ravel(), box.upper.ravel(), strict=True)]
    gains = np.stack([g.ravel() for g in np.meshgrid(*axes)], axis=1)
    found = max(np.linalg.eigvals(numeric.error_dynamics(gain[:, None])[0]).real.max() for gain in gains)
    assert abs(found - slowest) <= half_digit(slowest)
    beyond = affine_quadratic_stability(model, box, 1, settings=LmiSettings(points=20), decay_rate=-1.01 * found)
    assert beyond.verdict is not Verdict.CERTIFIED


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_box_that_holds_an_unstable_gain_is_refused_by_name(direction: Direction) -> None:
    """Negative control: with L2 < 0 the frozen loop has a positive pole."""
    model, box = gain_box(direction)
    wider = GainBox(np.array([[box.lower[0, 0]], [-1.0]]), box.upper)
    for form in FORMS:
        result = affine_quadratic_stability(model, wider, 1, form, LmiSettings(points=20))
        assert result.verdict is Verdict.REFUTED
        assert f"L = [{box.lower[0, 0]}, -1.0]" in result.message or f"L = [{box.upper[0, 0]}, -1.0]" in result.message
        assert "wheel_speed = " in result.message


def gain_box(direction: Direction) -> tuple[LpvModel, GainBox]:
    model, published = corner("corner-estimation", direction)
    ends = np.array(published.gain_box)
    return model, GainBox(ends[:, :1], ends[:, 1:])


# ---- (29), (41): the printed matrices ---------------------------------------------------------------------------------


def printed(direction: Direction, reading: Reading) -> tuple[LpvModel, list[list[str]], Printed, Form]:
    """Model, gains and the printed matrix in one of four readings (P1 notes 11 item 2)."""
    offered = certificate(CORNERS[direction], reading)
    return offered.model, offered.gains, offered.matrix, offered.form


WHOLE = (0.0, 180.0)
VALID: dict[tuple[Direction, Reading], tuple[tuple[float, float], ...]] = {
    # reading: intervals on [0, 180] for (29) and (41); P1 notes 11 item 2, claims P1-29-*, P1-41-*
    ("longitudinal", "primal"): (),
    ("lateral", "primal"): ((52.8760, 52.9042),),
    ("longitudinal", "swapped"): ((39.4, 180.0),),
    ("lateral", "swapped"): (WHOLE,),
    ("longitudinal", "dual"): (WHOLE,),
    ("lateral", "dual"): ((0.0, 162.2),),
    ("longitudinal", "adjugate"): (WHOLE,),
    ("lateral", "adjugate"): ((0.0, 154.8),),
}


@pytest.mark.parametrize(("direction", "reading"), list(VALID))
def test_printed_matrices_hold_exactly_where_the_notes_say(direction: Direction, reading: Reading) -> None:
    model, gains, matrix, form = printed(direction, reading)
    found = check_certificate(model, gains, matrix, form)
    expected = VALID[direction, reading]
    assert len(found.intervals) == len(expected)
    for (low, high), ends in zip(found.intervals, expected, strict=True):
        for value, end in zip((low, high), ends, strict=True):
            assert abs(value - end) <= (0.0 if end in WHOLE else half_digit(end))
    assert found.everywhere is (expected == (WHOLE,))


def test_printed_longitudinal_matrix_in_the_primal_reading_far_outside() -> None:
    """Claim P1-29-primal: negative definite only for omega in (302.9196, 302.9330), outside the stated range."""
    model, gains, matrix, form = printed("longitudinal", "primal")
    ((low, high),) = check_certificate(model, gains, matrix, form, search=(0.0, 400.0)).intervals
    assert abs(low - 302.9196) <= 0.5e-4
    assert abs(high - 302.9330) <= 0.5e-4


def test_the_absolute_value_must_be_kept() -> None:
    """P1 notes 11 item 2: without |omega| the longitudinal dual test fails below -81 rad/s."""
    model, gains, matrix, form = printed("longitudinal", "dual")
    ((low, high),) = check_certificate(model, gains, matrix, form, search=(-180.0, 0.0)).intervals
    assert high == 0.0
    assert abs(low + 81.0) <= 0.5


@pytest.mark.parametrize(
    ("direction", "omega", "value"),
    [("longitudinal", 0.0, 9.278e9), ("lateral", 0.0, 2.278e8), ("lateral", 180.0, 5.511e8)],
)
def test_by_how_much_the_primal_reading_fails(direction: Direction, omega: float, value: float) -> None:
    """Claims P1-29-primal, P1-41-primal: the largest eigenvalue of (28) with the printed matrix."""
    model, gains, matrix, _ = printed(direction, "primal")
    worst = eigenvalues(model, gains, matrix, "primal", np.array([omega])).max()
    assert worst == pytest.approx(value, rel=5e-4)


@settings(deadline=None, max_examples=30)
@given(st.sampled_from(list(VALID)), st.floats(0.0, 180.0))
def test_validity_agrees_with_dense_eigenvalues(case: tuple[Direction, Reading], omega: float) -> None:
    """Independently: numpy eigenvalues at any wheel speed that is not right at an end of an interval."""
    model, gains, matrix, form = printed(*case)
    intervals = check_certificate(model, gains, matrix, form).intervals
    if any(abs(omega - end) < 1e-3 for interval in intervals for end in interval):
        return
    inside = any(low < omega < high for low, high in intervals)
    decreasing = eigenvalues(model, gains, matrix, form, np.array([omega])).max() < 0.0
    positive = np.linalg.eigvalsh(np.array(matrix[0], float) + omega * np.array(matrix[1], float)).min() > 0.0
    assert bool(decreasing and positive) is inside


def eigenvalues(model: LpvModel, gains: list[list[str]], matrix: Printed, form: Form, omega: FloatArray) -> FloatArray:
    """Eigenvalues of (28), (40) or their dual at both bounds of the rate, (g, 2 * nx)."""
    return np.concatenate(list(np.linalg.eigvalsh(Certificate(model, gains, matrix, form).at(omega)[1])), axis=1)


def dense_worst(model: LpvModel, gain: FloatArray, lyapunov: FloatArray, form: Form, omega: FloatArray) -> float:
    """Largest eigenvalue of -P and of the Lyapunov inequality over a dense grid, by numpy alone."""
    powers = omega[:, None, None]
    M = sum(c * powers**k for k, c in enumerate(lyapunov))
    slope = sum((k * c * powers ** (k - 1) for k, c in enumerate(lyapunov) if k), np.zeros((1, 2, 2)))
    A_e = model.on(omega).error_dynamics(gain)[0]
    product = M @ A_e if form == "primal" else A_e @ M
    total = product + np.swapaxes(product, 1, 2)
    decrease = max(float(np.linalg.eigvalsh(total + rate * slope).max()) for rate in (-800.0, 800.0))
    return max(decrease, -float(np.linalg.eigvalsh(M).min()))


# ---- multi-convexity, after (27) --------------------------------------------------------------------------------------


@pytest.mark.parametrize("reading", ["primal", "swapped", "adjugate"])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_printed_matrices_are_not_multi_convex(direction: Direction, reading: Reading) -> None:
    """Claim P1-mc: A1'P1 + P1 A1 >= 0 is said to hold; its eigenvalues have both signs in every reading."""
    model, gains, matrix, _ = printed(direction, reading)
    spread = np.linalg.eigvalsh(convexity(model, np.array(gains, float), np.array(matrix[1], float)))
    assert spread[0] < 0.0 < spread[1]


def test_size_of_the_violation_in_the_adjugate_reading() -> None:
    """P1 notes 11 item 3: -1.5e-3 and +350 longitudinally."""
    model, gains, matrix, _ = printed("longitudinal", "adjugate")
    spread = np.linalg.eigvalsh(convexity(model, np.array(gains, float), np.array(matrix[1], float)))
    assert spread[0] == pytest.approx(-1.5e-3, abs=0.05e-3)
    assert spread[1] == pytest.approx(350.0, abs=5.0)  # two digits; 350.52 here


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_multi_convexity_has_no_interior_and_is_met_as_an_equality(direction: Direction) -> None:
    """A1 has a zero column, so entry (2,2) is zero for every P1 and (1,2) must vanish exactly."""
    model, published = corner("corner-estimation", direction)
    gain = np.array(published.gains)[:, None]
    result = affine_quadratic_stability(model, gain, 1, settings=LmiSettings(relaxation="vertex"))
    assert result.verdict is Verdict.CERTIFIED
    found = convexity(model, gain, result.lyapunov[1])
    scale = np.abs(convexity(model, gain, result.lyapunov[0] / 180.0)).max()
    assert found[1, 1] == 0.0
    assert abs(found[0, 1]) <= 1e-9 * scale
    assert found[0, 0] >= -1e-9 * scale
