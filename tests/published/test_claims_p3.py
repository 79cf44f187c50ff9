"""The claims of P3: complete, recomputed a second way, against the reference list, and refutable.

They start from the printed decimals (`PRINT`) and from formulas written out here, and share no code with the study.
"""

from __future__ import annotations

import itertools
import json
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from scipy.linalg import expm

from studies.claim import Claim, ClaimVerdict
from studies.papers.published import published_claims
from studies.papers.resilient_velocity.inputs import PACKAGE
from studies.papers.resilient_velocity.study import STUDY
from studies.plots import Figure
from studies.plots.draw import draw
from studies.study import QUICK
from tests.support.study_checks import check_claim, desk_parts

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "claims.json"
PRINT: dict[str, dict[str, str]] = {
    "longitudinal": {"s0": "641", "s1": "0.85", "s2": "0.0016", "k": "8.1", "L1": "1.18", "L2": "387"},
    "lateral": {"s0": "131.5", "s1": "0.82", "s2": "0.001", "k": "13.4", "L1": "1.21", "L2": "16.8"},
}
RADIUS, STEP = "0.33", "0.005"


@cache
def results() -> dict[str, Any]:
    """Every part of the study, run once as a user would."""
    return {part.name: part.run(QUICK) for part in desk_parts(STUDY)}


@cache
def claims() -> dict[str, Claim]:
    return {c.published.id: c for result in results().values() for c in result.claims}


def found(name: str) -> Any:
    return claims()[name].finding.computed


def test_every_claim_is_computed_once_and_can_be_stored() -> None:
    listed = list(published_claims(PACKAGE))
    computed = [c.published.id for result in results().values() for c in result.claims]
    assert sorted(computed) == sorted(listed) and len(set(computed)) == len(computed) == 26
    for claim in claims().values():
        check_claim(claim)


def test_every_figure_and_table_stands_alone() -> None:
    drawings = [d for result in results().values() for d in result.figures]
    for prefix in ("fig-2-", "figs-3-4-", "fig-5-", "fig-6-", "fig-7-", "fig-8-"):
        assert any(d.name.startswith(prefix) for d in drawings), prefix
    for drawing in drawings:
        assert len(drawing.caption) > 100 and drawing.alternative
        assert isinstance(drawing, Figure)
        labels = [text for axes in draw(drawing).axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
        assert len(labels) >= 2 and all(text.endswith("]") for text in labels)  # a unit in every label
    for table in (t for result in results().values() for t in result.tables):
        assert table.rows and all(len(row) == len(table.columns) for row in table.rows)
        assert len(table.caption) > 80


# --- the reference list -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def reference() -> dict[str, dict[str, Any]]:
    if not REFERENCE.is_file():
        pytest.skip("the reference list (shared/reference/claims.json beside the checkout) is absent")
    data = json.loads(REFERENCE.read_text(encoding="utf-8"))
    return {c["id"]: c for c in (data["claims"] if isinstance(data, dict) else data) if c["paper"] == "P3"}


@pytest.mark.shared
def test_ids_places_and_verdicts_are_those_of_the_list(reference: dict[str, dict[str, Any]]) -> None:
    assert set(reference) == set(claims())
    for name, entry in reference.items():
        if entry["verdict"] != "yours to find":
            assert str(claims()[name].finding.verdict) == entry["verdict"], name
        if isinstance(entry["published"], int | float):
            assert claims()[name].published.published == entry["published"]


READINGS_LISTED = {  # of the discretisation: our name, the list's name
    "innovation_held": "xP3 rho innovation-hold w=0,40,140",
    "correction_added": "exp(A Ts)-Ts L C",
    "gains_of_P1_innovation_held": "xP1 innovation-hold",
    "closed_loop": "exp(Ae Ts) xP3",
}
# Ours and the list's numbers, in one order, with what the list's digits are worth.
SAME: dict[str, Any] = {
    "P3-ex1-eig": (lambda f: [f], lambda r: [r], 1e-9),
    "P3-ex1-T": (lambda f: [f["at_40_rad_per_s"]], lambda r: [r], 1e-7),
    "P3-ex1-Topt": (lambda f: [f["gamma_star"], f["lmax_sym"]], lambda r: [r["gamma_star"], r["lmax_sym"]], 1e-6),
    "P3-fig2-x": (lambda f: [f[k] for k in ("0", "40", "80", "140")], lambda r: [r[k] for k in ("0", "40", "80", "140")], 5e-9),
    "P3-fig8": (
        lambda f: [f[k][w] for k in ("longitudinal_p_0.2", "lateral_p_0.2", "longitudinal_p_0.5") for w in ("0", "40", "140")],
        lambda r: [*r["x p=.2 w=0,40,140"], *r["y p=.2"], *r["x p=.5"]],
        1e-6,
    ),
    "P3-ex3": (
        lambda f: [*(f["longitudinal"][w] for w in ("0", "10", "40", "140")), f["tustin_range_over_0_to_140"][1]],
        lambda r: [r["w=0"], r["w=10"], r["w=40"], r["w=140"], r["Tustin w=0"]],
        5e-6,
    ),
    "P3-zoh": (
        lambda f: [f[k][w] for k in READINGS_LISTED for w in ("0", "40", "140")],
        lambda r: [v for k in READINGS_LISTED.values() for v in r[k]],
        6e-5,
    ),
    # the list's "@40" is not the square of its own radius there: see the test below
    "P3-ex2-arb": (
        lambda f: [*(f["second_moment_radius"][w] for w in ("8", "9", "10")), f["radius"]["40"]],
        lambda r: [r["rho(A2)^2@w=8"], r["@9"], r["@10"], r["rho(A2)@40"]],
        1e-8,
    ),
}  # fmt: skip


@pytest.mark.shared
@pytest.mark.parametrize("name", SAME)
def test_numbers_agree_with_the_list(name: str, reference: dict[str, dict[str, Any]]) -> None:
    ours, theirs, tolerance = SAME[name]
    np.testing.assert_allclose(ours(found(name)), theirs(reference[name]["computed"]), rtol=0, atol=tolerance)


@pytest.mark.shared
def test_one_number_of_the_list_is_not_the_square_that_it_claims_to_be(reference: dict[str, dict[str, Any]]) -> None:
    entry = reference["P3-ex2-arb"]["computed"]
    assert abs(entry["rho(A2)@40"] ** 2 - entry["@40"]) > 1e-7
    assert found("P3-ex2-arb")["second_moment_radius"]["40"] == pytest.approx(entry["rho(A2)@40"] ** 2, abs=4e-8)


# Digits that the list gives in sentences: where they stand with us, the digits, half of the last one.
QUOTED: list[tuple[tuple[Any, ...], float, float]] = [
    (("P3-ex1-sym", "speeds_that_round_to_print_rad_per_s", 0), 33.529, 1.5e-3),
    (("P3-ex1-T", "at_the_speed_that_gives_108750"), -326.854, 5e-4),
    (("P3-ex1-T", "speeds_that_round_to_print_rad_per_s", 0), 20.09, 5e-3),
    (("P3-ex1-T", "speeds_that_round_to_print_rad_per_s", 1), 33.007, 5e-4),
    (("P3-fig2-nonexp", "longitudinal", "crosses_1_at_rad_per_s", 0), 0.697, 5e-4),
    (("P3-fig2-nonexp", "lateral", "crosses_1_at_rad_per_s", 0), 79.71, 5e-3),
    (("P3-fig2-nonexp", "lateral", "at_0_rad_per_s"), 1.00259, 5e-6),
    (("P3-obs", "longitudinal", "root_at_constant_speed_rad_per_s", 0), 282.124, 5e-4),
    (("P3-obs", "lateral", "root_at_constant_speed_rad_per_s", 0), 36.26546, 5e-6),
    (("P3-obs", "longitudinal", "over_wheel_accelerations_of_800_rad_per_s2", 0, 0), 281.063, 5e-4),
    (("P3-obs", "lateral", "over_wheel_accelerations_of_800_rad_per_s2", 0, 1), 41.253, 5e-4),
    (("P3-kron", "two_modes"), 0.655295850240, 5e-13),
    (("P3-kron", "three_modes"), 0.351207347, 5e-10),
    (("P3-kron", "three_modes_transposed"), 0.324340790, 5e-10),
    (("P3-ex3", "with_p_0.8_met_at_rad_per_s"), 29.5153, 5e-5),
    (("P3-ex3", "lateral_met_at_rad_per_s"), 51.384, 5e-4),
    (("P3-ex2-arb", "speeds_where_square_rounds_to_print", 0), 7.94, 5e-3),
    (("P3-ex2-arb", "speeds_where_square_rounds_to_print", 1), 9.78, 5e-3),
    (("P3-susp", "longitudinal", "natural_frequency_rad_per_s"), 80.757, 5e-4),
    (("P3-susp", "longitudinal", "damping_ratio"), 0.50204, 5e-6),
    (("P3-susp", "lateral", "natural_frequency_rad_per_s"), 123.359, 5e-4),
    (("P3-susp", "lateral", "damping_ratio"), 0.32866, 5e-6),
    (("P3-lugre", "slip_stiffness", "longitudinal"), 79.1358, 5e-5),
    (("P3-lugre", "contact_patch_m", "longitudinal"), 0.1440, 5e-5),
    (("P3-lugre", "contact_patch_m", "lateral"), 0.0871, 5e-5),
    (("P3-lugre", "peak_velocity_and_force_by_road", "1", 0), 3.899, 5e-4),
    (("P3-lugre", "peak_velocity_and_force_by_road", "1", 1), 0.92226, 5e-6),
    (("P3-lugre", "peak_velocity_and_force_by_road", "0.3", 0), 1.585, 5e-4),
    (("P3-lugre", "peak_velocity_and_force_by_road", "0.3", 1), 0.29120, 5e-6),
    (("P3-rem4", "growth_of_second_moment_at_p_0.6_and_10_rad_per_s"), 0.9051404806, 5e-11),
    (("P3-prop1-young", "left_over_epsilon"), 1.0, 0.0),
    (("P3-prop1-young", "printed_right_over_epsilon"), 0.5, 0.0),
]


@pytest.mark.parametrize(("path", "digits", "half"), QUOTED, ids=["-".join(map(str, row[0])) for row in QUOTED])
def test_numbers_that_the_list_gives_in_words(path: tuple[Any, ...], digits: float, half: float) -> None:
    value = found(path[0])
    for key in path[1:]:
        value = value[key]
    assert value == pytest.approx(digits, abs=half * (1 + 1e-9))


# --- second calculations of what the list leaves to find ---------------------------------------------------------------


def error_matrix(
    direction: str, speed: Any, number: Any = mp.mpf, gain: tuple[str, str] | None = None
) -> list[list[Any]]:
    """A - L C of (8), (13) from the printed decimals, in any arithmetic."""
    p = {k: number(v) for k, v in PRINT[direction].items()}
    L1, L2 = (number(g) for g in gain) if gain else (p["L1"], p["L2"])
    a = p["k"] * number(RADIUS) * speed
    c1, c2 = p["s0"] - p["s1"] * a, p["s1"] + p["s2"]
    return [[-a - L1 * c1, 1 - L1 * c2], [-L2 * c1, -L2 * c2]]


def test_symmetric_part_from_the_quadratic_formula() -> None:
    """P3-ex1-sym: trace/2 + root of ((a - d)^2 + (b + c)^2)/2, in 40 digits."""
    with mp.workdps(40):

        def largest(speed: Any) -> Any:
            (a, b), (c, d) = error_matrix("longitudinal", mp.mpf(speed))
            return (a + d + mp.sqrt((a - d) ** 2 + (b + c) ** 2)) / 2

        assert float(largest(40)) == pytest.approx(found("P3-ex1-sym")["at_40_rad_per_s"], rel=1e-13)
        root = mp.findroot(lambda w: largest(w) - 108750, (30, 36), solver="anderson")
        low, high = found("P3-ex1-sym")["speeds_that_round_to_print_rad_per_s"]
        assert low < root < high
    assert claims()["P3-ex1-sym"].finding.verdict is ClaimVerdict.NOT_REPRODUCED


@pytest.mark.parametrize("direction", PRINT)
def test_norm_from_the_static_gain_in_40_digits_and_from_a_sweep(direction: str) -> None:
    """P3-fig2-y: the norm is the largest singular value at zero frequency, and nothing above it on a dense sweep."""
    published = found("P3-fig2-x") if direction == "longitudinal" else found("P3-fig2-y")["both_disturbances"]
    p = PRINT[direction]
    for speed, value in published.items():
        with mp.workdps(40):
            A = mp.matrix(error_matrix(direction, mp.mpf(speed)))
            s1 = mp.mpf(p["s1"])
            B = mp.matrix([[1 - mp.mpf(p["L1"]) * s1, 0], [-mp.mpf(p["L2"]) * s1, 1]])
            G = A**-1 * B
            (q11, q12), (_, q22) = (G.T * G).tolist()
            exact = mp.sqrt((q11 + q22) / 2 + mp.sqrt((q11 - q22) ** 2 / 4 + q12**2))
        assert value == pytest.approx(float(exact), rel=1e-12)
        s = 1j * np.concatenate([[0.0], np.geomspace(1e-3, 1e5, 4000)])[:, None, None]
        Af, Bf = np.array(A.tolist(), float), np.array(B.tolist(), float)
        response = np.linalg.svd(np.linalg.solve(s * np.eye(2) - Af, Bf + 0j), compute_uv=False)[:, 0]
        assert response.max() == pytest.approx(value, rel=1e-9) and response.argmax() == 0


def test_no_gain_goes_below_the_floor() -> None:
    """P3-hinf-floor: at rest (s0 - s1 a) e_z + (s1 + s2) e_v + s1 rho = 0 and e_z' = 0: two equations without a gain."""
    for direction, p in PRINT.items():
        n = {k: Fraction(v) for k, v in p.items()}
        for speed, value in found("P3-hinf-floor")[direction].items():
            a = n["k"] * Fraction(RADIUS) * int(speed)
            # 0 = -a z + v + 1, 0 = (s0 - s1 a) z + (s1 + s2) v + s1 -> v by Cramer
            det = -a * (n["s1"] + n["s2"]) - (n["s0"] - n["s1"] * a)
            v = (a * n["s1"] + (n["s0"] - n["s1"] * a)) / det
            assert -float(v) == pytest.approx(value, abs=1e-15)
    assert claims()["P3-hinf-floor"].finding.verdict is ClaimVerdict.DERIVED


def test_deviations_from_the_quadratic_formula() -> None:
    """P3-fig345: eigenvalues of a 2 x 2 matrix in closed form, constants scaled by hand."""
    for direction, p in PRINT.items():

        def margin(speed: float, p: dict[str, str] = p, **factor: float) -> float:
            s0, s1, s2, k = (float(p[name]) * factor.get(name, 1.0) for name in ("s0", "s1", "s2", "k"))
            a, L1, L2 = k * 0.33 * speed, float(p["L1"]), float(p["L2"])
            c1, c2 = s0 - s1 * a, s1 + s2
            trace, det = -a - L1 * c1 - L2 * c2, (a + L1 * c1) * L2 * c2 + (1 - L1 * c2) * L2 * c1
            disc = trace * trace / 4 - det
            return trace / 2 + (np.sqrt(disc) if disc > 0 else 0.0)

        ours = found("P3-fig345")[direction]
        names = {"sigma0": "s0", "sigma1": "s1", "sigma2": "s2", "kappa": "k"}
        for constant, pair in ours["margin_deviation_at_40_per_s"].items():
            expected = [margin(40.0, **{names[constant]: f}) - margin(40.0) for f in (0.8, 1.2)]
            np.testing.assert_allclose(pair, expected, rtol=1e-6, atol=1e-9)
            worst = max(abs(margin(w, **{names[constant]: f}) / margin(w) - 1) for w in range(141) for f in (0.8, 1.2))
            assert ours["largest_relative_margin_deviation"][constant] == pytest.approx(worst, rel=1e-6)
    assert claims()["P3-fig345"].finding.verdict is ClaimVerdict.PARTLY


def test_common_decay_fails_in_exact_rationals() -> None:
    """P3-20: det of the symmetric part of T A2 T^-1 is negative, so one eigenvalue is positive, whatever rounding does."""
    gamma, high = Fraction(9000), ("0.22", "0.1")
    for speed in range(0, 141, 5):
        (a, b), (c, d) = error_matrix("longitudinal", Fraction(speed), Fraction, high)
        off = (gamma * b + c / gamma) / 2
        assert a * d - off * off < 0
        if speed in (0, 40):
            value = float(a + d) + float(np.sqrt(float((a - d) ** 2 + 4 * off**2)))
            name = "lambda_bar_over_0_to_140_rad_per_s" if speed == 0 else "lambda_bar_at_40_rad_per_s"
            assert found("P3-20")[name] == pytest.approx(value, rel=1e-12)
    # A common quadratic function: trace(A1 A2)^2 against 4 det on both sides of the threshold, exactly.
    threshold = Fraction(found("P3-20")["common_quadratic_function_from_rad_per_s"])
    for shift, exists in ((Fraction(-1, 10**6), False), (Fraction(1, 10**6), True)):
        A1, A2 = (error_matrix("longitudinal", threshold + shift, Fraction, g) for g in (None, high))
        det1, det2 = (M[0][0] * M[1][1] - M[0][1] * M[1][0] for M in (A1, A2))
        trace = sum(A1[i][j] * A2[j][i] for i in (0, 1) for j in (0, 1))
        assert (trace < 0 and trace**2 >= 4 * det1 * det2) is not exists
    assert claims()["P3-20"].finding.verdict is ClaimVerdict.NOT_REPRODUCED


def sampled(direction: str, speed: float, gain: tuple[str, str] | None = None) -> np.ndarray:
    return np.asarray(expm(float(STEP) * np.array(error_matrix(direction, speed, float, gain), float)))


def test_markov_margins_by_the_printed_operator_and_by_all_paths() -> None:
    """P3-fig6: (22) word for word, 8 x 8, to 1e-6 and better; and the operator against all paths of the chain."""
    ours = found("P3-fig6")
    for (i, stay), (j, speed) in itertools.product(
        enumerate(ours["stay_probability"]), enumerate(ours["wheel_speed_rad_per_s"])
    ):
        D = np.zeros((8, 8))
        for k, gain in enumerate((None, ("0.22", "0.1"))):
            A = sampled("longitudinal", speed, gain)
            D[4 * k : 4 * k + 4, 4 * k : 4 * k + 4] = np.kron(A, A)
        P = np.array([[0.9, 0.1], [1 - stay, stay]])
        rho = np.abs(np.linalg.eigvals(np.kron(P.T, np.eye(4)) @ D)).max()
        assert ours["margin"][i][j] == pytest.approx(1 - rho, abs=1e-10)
    # (22) itself, by the mean of e e' over all 2^8 paths of the chain
    A = [sampled("longitudinal", 20.0), sampled("longitudinal", 20.0, ("0.22", "0.1"))]
    P, start, steps = np.array([[0.9, 0.1], [0.3, 0.7]]), np.array([1e-3, 1.0]), 8
    moments = np.zeros((2, 2, 2))  # by the mode after the last step
    for path in itertools.product((0, 1), repeat=steps + 1):
        weight, x = 0.5, start
        for now, after in itertools.pairwise(path):
            weight, x = weight * P[now, after], A[now] @ x
        moments[path[-1]] += weight * np.outer(x, x)
    D = np.zeros((8, 8))
    for k in (0, 1):
        D[4 * k : 4 * k + 4, 4 * k : 4 * k + 4] = np.kron(A[k], A[k])
    vector = np.concatenate([0.5 * np.outer(start, start).ravel()] * 2)
    vector = np.linalg.matrix_power(np.kron(P.T, np.eye(4)) @ D, steps) @ vector
    np.testing.assert_allclose(moments.ravel(), vector, rtol=1e-10)
    assert claims()["P3-fig6"].finding.verdict is ClaimVerdict.REPRODUCED


def test_critical_probability_in_40_digits() -> None:
    """P3-pcr: the smallest p with det(I - p A0 x A0 - (1-p) A1 x A1) = 0, by Newton in 40 digits on the 4 x 4 operator."""
    with mp.workdps(40):
        for direction in PRINT:
            for speed, value in found("P3-pcr")[direction].items():
                if value == 1.0:
                    continue
                w, step = mp.mpf(speed), mp.mpf(STEP)
                a = mp.mpf(PRINT[direction]["k"]) * mp.mpf(RADIUS) * w
                A0 = mp.expm(step * mp.matrix([[-a, 1], [0, 0]]))
                A1 = mp.expm(step * mp.matrix(error_matrix(direction, w)))
                K0, K1 = (mp.matrix(4, 4) for _ in range(2))
                for i, j, k, m in itertools.product(range(2), repeat=4):
                    K0[2 * i + k, 2 * j + m], K1[2 * i + k, 2 * j + m] = A0[i, j] * A0[k, m], A1[i, j] * A1[k, m]

                def determinant(p: Any, K0: Any = K0, K1: Any = K1) -> Any:
                    return mp.det(mp.eye(4) - p * K0 - (1 - p) * K1)

                root = mp.findroot(determinant, mp.mpf(value))
                assert abs(float(root) - value) < 1e-9
                assert all(determinant(root * mp.mpf(k) / 20) > 0 for k in range(20))  # the first root


def test_any_pattern_by_all_products_up_to_length_11() -> None:
    """P3-ex3-arb: no product beats the bracket; the growing ones are found by brute force; at 40 rad/s and above none grows."""
    brackets = found("P3-ex3-arb")["joint_spectral_radius"]
    for speed, (low, high) in brackets.items():
        A1, a = sampled("longitudinal", float(speed)), 8.1 * 0.33 * float(speed)
        A0 = expm(float(STEP) * np.array([[-a, 1.0], [0.0, 0.0]]))
        products = np.stack([A0, A1])
        best = 1.0
        for length in range(2, 12):
            products = (np.stack([A0, A1])[:, None] @ products[None]).reshape(-1, 2, 2)
            rate = float(np.abs(np.linalg.eigvals(products)).max()) ** (1.0 / length)
            best = max(best, rate)
            assert rate <= high * (1 + 1e-9)
        assert low == 1.0 or best == pytest.approx(low, rel=3e-3)
    start = found("P3-ex3-arb")["marginal_from_rad_per_s"]
    for speed, grows in ((start - 0.01, True), (start + 0.01, False)):  # A0^n -> [1/a, 1]' e2'
        a = 8.1 * 0.33 * speed
        assert (abs(float(sampled("longitudinal", speed)[1] @ [1 / a, 1.0])) > 1.0) is grows
    assert claims()["P3-ex3-arb"].finding.verdict is ClaimVerdict.PARTLY


def test_loads_of_a_leaning_car_by_numbers() -> None:
    """P3-26: moments about the middle of the track with numbers; the printed formula misses, the corrected one meets them."""
    roll, g, m, h, h_rc, track = np.deg2rad(3.0), 9.81, 11468.750526315791 / 9.81, 0.65, 0.54, 1.62
    y, n = g * np.sin(roll), g * np.cos(roll)  # what the inertial unit reads, left side up
    left, _ = np.linalg.solve([[1.0, 1.0], [-track / 2, track / 2]], [m * g, m * g * (h - h_rc) * np.sin(roll)])
    outcome = {}
    for sign, arm in ((1.0, h_rc), (-1.0, h - h_rc)):
        across, up = y * np.cos(roll) + sign * n * np.sin(roll), n * np.cos(roll) - sign * y * np.sin(roll)
        outcome[sign] = m / track * (up * (track / 2 - arm * np.sin(roll)) - across * h)
    assert outcome[-1.0] == pytest.approx(left, rel=1e-12)
    assert found("P3-26")["front_left_load_error_at_rest_leaning_3_deg_N"] == pytest.approx(
        outcome[1.0] - left, rel=1e-9
    )
    assert found("P3-26")["static_front_rear_N"][0] == pytest.approx(2330 * 9.81 * 1.43 / 2.85, rel=1e-13)
    assert claims()["P3-26"].finding.verdict is ClaimVerdict.ERRATUM
