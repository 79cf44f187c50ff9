"""Independent recomputations of what the study of P2 says of observability, unknown starts, bounds and recursions."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from analysis.observability.gramians import sequence_observability
from studies.papers.longitudinal_speed.inputs import (
    TYPICAL,
    accelerating,
    constant,
    launch,
    noise,
    speed_model,
    structures,
)
from studies.papers.longitudinal_speed.model import gramian_rank, histories, speed_observability
from studies.papers.longitudinal_speed.steady_filter import filter_response
from studies.papers.longitudinal_speed.stochastic_observability import STRUCTURES, both_tests
from studies.papers.longitudinal_speed.unknown_input_observer import bounds, worst_runs
from tests.support.p2_findings import finding


def test_determinant_in_closed_form() -> None:
    """b s1^2 [j (s0 + s2 b w) + b a^2 (s1 - s2) - b w a (s0 + s2 b w)], b = kappa R_e, a = w', j = w''."""
    computed = finding("P2-O3").computed
    s0, s1, s2, k, R = sp.symbols("sigma0 sigma1 sigma2 kappa effective_radius")
    w, a, j = sp.symbols("wheel_speed wheel_acceleration wheel_acceleration_rate")
    b = k * R
    expected = b * s1**2 * (j * (s0 + s2 * b * w) + b * a**2 * (s1 - s2) - b * w * a * (s0 + s2 * b * w))
    (determinant,) = speed_observability().minors(symbolic=True)
    assert sp.expand(determinant - expected) == 0 and str(determinant) == computed["determinant"]
    assert computed["lost_while_accelerating_below_rad_s"] == pytest.approx(800 * (0.87 - 0.0016) / 612, rel=1e-4)


def test_rank_by_outputs_of_integrated_motions() -> None:
    """The output of three initial states, integrated without matrices: dependent at constant speed, independent when spun up."""
    s0, s1, s2, b = 612.0, 0.87, 0.0016, 8.0 * 0.35
    time = np.linspace(0.0, 0.02, 9)

    def outputs(acceleration: float) -> np.ndarray:
        columns = []
        for start in np.diag(TYPICAL):
            speed = lambda t: 40.0 + acceleration * t  # noqa: E731

            def rate(t: float, x: np.ndarray, speed: Callable[[float], float] = speed) -> list[float]:
                return [-b * speed(t) * x[0] + x[1], 0.0, -b * acceleration * x[0] - b * speed(t) * x[2]]

            path = solve_ivp(rate, (0.0, 0.02), start, t_eval=time, rtol=1e-11, atol=1e-14).y
            columns.append(np.array([s0, s2, s1]) @ path)
        return np.array(columns).T

    still, moving = (np.linalg.svd(outputs(a), compute_uv=False) for a in (0.0, 400.0))
    assert still[2] < 1e-9 * still[0] < 1e-3 * moving[2]
    assert moving[2] > 1e-5 * moving[0]


def test_rank_of_the_gramian_of_fig_1() -> None:
    ranks = {record.name: gramian_rank(record) for record in histories()}
    t = histories()[0].time
    assert set(ranks["launch after 2 s"][(t > 0.0) & (t < 2.0)]) == {2} and set(
        ranks["launch after 2 s"][t > 2.05]
    ) == {3}
    assert set(ranks["constant 40 rad/s"][1:]) == {2}
    for name in ("slalom at 45 rad/s", "braking from 80 to 25 rad/s"):
        assert ranks[name][-1] == 3
    # the same by the sum itself
    record = accelerating(40.0, 100.0, 20, 20)
    scale = np.array(TYPICAL)
    total, phi = np.zeros((3, 3)), np.eye(3)
    for A, C in zip(record.sequence.A, record.sequence.C, strict=True):
        total += (C @ phi * scale).T @ (C @ phi * scale)
        phi = A @ phi
    whole = sequence_observability(record.sequence.A, record.sequence.C, TYPICAL).gramian
    np.testing.assert_allclose(whole, total, rtol=1e-9, atol=1e-12 * np.abs(total).max())


# ---- tests 1 and 2 -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("structure", STRUCTURES)
def test_peaks_by_a_riccati_recursion_in_60_digits(structure: str) -> None:
    """psi = 1e30: once M is zero the covariance itself is N, to psi^-1; before that its leading part is psi M."""
    record = accelerating(40.0, 100.0, 60, 12)
    q, R = noise()
    sequence = record.sequence
    Q = q * structures(sequence)[structure]
    found = both_tests(record, structure)
    with mp.workdps(60):
        psi = mp.mpf(10) ** 30
        P = psi * mp.eye(3)
        for k in range(12):
            A, C = (mp.matrix(m[k].tolist()) for m in (sequence.A, sequence.C))
            gain = P * C.T * (C * P * C.T + mp.matrix(R.tolist())) ** -1
            P = A * (P - gain * C * P) * A.T + mp.matrix(Q[k].tolist())
            exact = np.array(P.tolist(), dtype=float)
            if found.directions[k + 1]:
                np.testing.assert_allclose(exact / 1e30, found.M[k + 1], atol=1e-9)
            else:
                top = float(np.linalg.eigvalsh(exact)[-1])
                assert found.largest_known[k + 1] == pytest.approx(top, rel=5e-4)
    settled = finding("P2-test2").computed[f"accelerating, Q = {q:g} {structure}"]
    assert settled["peak"] == pytest.approx(float(found.largest_known.max()), rel=1e-5)


def test_limits_by_iterating_from_certainty() -> None:
    """From P = 0 the Riccati recursion rises to the same limit that N falls to."""
    q, R = noise()
    sequence = constant(40.0, 1).sequence
    A, C, P = sequence.A[0], sequence.C[0], np.zeros((3, 3))
    for _ in range(6000):
        gain = A @ P @ C.T / (C @ P @ C.T + R)
        P = A @ P @ A.T - gain @ C @ P @ A.T + q * np.eye(3)
    computed = finding("P2-test2").computed[f"constant, Q = {q:g} I"]
    assert computed["riccati"] == pytest.approx(float(np.linalg.eigvalsh(P)[-1]), rel=1e-7)
    assert computed["last"] == pytest.approx(computed["riccati"], rel=1e-3)
    assert (computed["peak"], computed["at_sample"]) == (pytest.approx(170.5, abs=0.05), 2)


def test_readings_of_the_scalar_covariance() -> None:
    """P2 notes 10: the unit matrix barely corrects the velocity, B B' within milliseconds."""
    weak, strong, held = (filter_response(40.0, s, "normal") for s in ("I", "B B'", "B_k B_k'"))
    assert weak[0] == pytest.approx(1.6e-3, abs=5e-5) and weak[1] == pytest.approx(1.3, abs=0.05)
    assert strong[0] == pytest.approx(0.47, abs=0.01) and strong[1] == pytest.approx(3.4e-3, abs=1e-4)
    assert held[0] == pytest.approx(0.0077, abs=1e-4)
    assert filter_response(40.0, "B B'", "high_slip")[0] == pytest.approx(0.036, abs=5e-4)


# ---- Theorem 1 and appendix ------------------------------------------------------------------------------------


def test_theorem_1_by_the_solution_of_the_scalar_equation() -> None:
    time, size, runs = worst_runs()
    gain, push, start, xi = runs.T
    np.testing.assert_array_equal(start, size[0])
    t = time[:, None]
    fade = np.exp(-gain * t)
    np.testing.assert_allclose(size, fade * start + push / gain * (1 - fade), rtol=1e-10)
    bound = start * np.exp(-gain * (1 - xi) * t) + push / (2 * gain * np.sqrt(xi * (1 - xi)))
    np.testing.assert_allclose(bounds(time, runs), bound, rtol=1e-12)
    assert (size <= bound + 1e-12).all() and finding("P2-uio").computed["violations"] == 0
    k = int(np.argmax(start))
    path = solve_ivp(lambda _, e: -gain[k] * e + push[k], (0.0, 0.8), [start[k]], rtol=1e-10, atol=1e-10)
    assert size[-1, k] == pytest.approx(path.y[0, -1], rel=1e-8)


def test_appendix_numbers() -> None:
    computed = finding("P2-A").computed
    assert computed["A4_printed_over_filter_covariance"] < 1e-3
    assert computed["A4_with_Q_over_filter_covariance"] == pytest.approx(1.0, abs=1e-3)
    assert computed["M1_of_A7_as_printed"] > 0.1 and computed["M1_of_A7_with_later_transition"] < 1e-12
    assert computed["A8_error_with_printed_sign"] > 1.0 and computed["A8_error_with_corrected_sign"] < 1e-5


def test_patch_and_threshold_in_fractions() -> None:
    assert (
        finding("P2-kappa").computed["patch_length_m"]["7/(6 L)"] == float(Fraction(7, 6) / 8) == float(Fraction(7, 48))
    )
    low, high = Fraction("0.05"), Fraction("0.2")
    assert finding("P2-29").computed["printed"] == [float(high - 1 / (high - low)), 0.2]
    assert finding("P2-29").computed["corrected"] == [0.05, 0.2]


def test_launch_starts_standing_and_accelerations_are_derivatives() -> None:
    for record in (*histories(), launch(0.0, 4.0)):
        slope = np.gradient(record.speed, record.time)
        np.testing.assert_allclose(slope[2:-2], record.acceleration[2:-2], atol=0.5)
    assert not launch(2.0, 4.0).speed[:400].any()
    assert speed_model().on(np.array([[40.0, 0.0]])).A.shape == (1, 3, 3)
