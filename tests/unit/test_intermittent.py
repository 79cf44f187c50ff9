"""Critical arrival rates: closed forms, the two methods for the static gain, and the Kalman filter beyond it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from analysis.drops.intermittent import (
    certify_static_gain,
    kalman_critical_arrival,
    lmi_gain,
    static_critical_arrival,
    static_gain_radius,
)
from analysis.errors import AnalysisError
from synthesis.lmi.result import Verdict

TWO = (np.diag([1.3, 1.2]), np.array([[1.0, 1.0]]))


@pytest.mark.parametrize("a", [1.05, -1.25, 3.0])
def test_scalar_rate_is_one_minus_inverse_square(a: float) -> None:
    found = kalman_critical_arrival([[a]], [[2.0]])
    expected = 1 - 1 / a**2
    assert found.exact and found.lower == pytest.approx(expected, rel=1e-14)
    assert found.static.verdict is Verdict.CERTIFIED
    assert found.static.lower - 1e-9 <= expected <= found.static.upper <= expected + 2e-9


@pytest.mark.parametrize("method", ["riccati", "lmi"])
def test_one_output_needs_the_product_of_unstable_eigenvalues(method: str) -> None:
    """Static gain, one output: 1 - prod |lambda_u|^-2 (Elia 2005; Schenato et al. 2007), by both methods."""
    A = np.array([[1.3, 0.3, 0.3], [0.0, 1.2, 0.3], [0.0, 0.0, 0.5]])
    expected = 1 - 1 / (1.3 * 1.2) ** 2
    found = static_critical_arrival(A, [[1.0, 0.4, 0.2]], tolerance=1e-5, method=method)  # type: ignore[arg-type]
    assert found.lower <= expected + 1e-8 and expected <= found.upper + 1e-8
    assert found.upper - found.lower < 1e-4
    assert static_gain_radius(A, [[1.0, 0.4, 0.2]], found.gain, found.arrival) < 1.0
    assert found.arrival - found.upper < 1e-4


def test_invertible_output_closes_the_gap() -> None:
    """C invertible: a measurement reveals the whole state, and both rates are 1 - 1/max|lambda|^2."""
    found = kalman_critical_arrival([[1.3, 0.4], [-0.2, 1.1]], np.eye(2))
    assert found.exact
    assert found.static.lower <= found.lower + 1e-8 and found.lower <= found.static.upper + 1e-8


def test_static_and_kalman_rates_are_two_numbers() -> None:
    found = kalman_critical_arrival(*TWO)
    assert found.exact and found.lower == found.upper == pytest.approx(1 - 1 / 1.69)
    assert found.static.upper == pytest.approx(1 - 1 / 1.56**2, abs=1e-8)
    assert found.static.lower > found.upper + 0.1


def test_between_the_two_rates_the_kalman_covariance_stays_and_a_static_one_grows() -> None:
    """Arrival rate 0.5, between 0.408 and 0.589, seeded: mean covariance of 20,000 filters, against any static gain."""
    A, C = TWO
    rate, runs = 0.5, 20_000
    draw = np.random.default_rng(4)
    P = np.tile(np.eye(2), (runs, 1, 1))
    levels = []
    for _ in range(80):
        seen = draw.random(runs) < rate
        gain = P @ C.T / (C @ P @ C.T + 1.0)
        P = np.where(seen[:, None, None], P - gain @ C @ P, P)
        P = A @ P @ A.T + np.eye(2)
        levels.append(np.trace(P, axis1=1, axis2=2).mean())
    assert np.mean(levels[60:]) < 10.0 * np.mean(levels[20:40])  # heavy tails: the mean settles slowly
    refused = certify_static_gain(A, C, rate)
    assert refused.verdict is Verdict.REFUTED
    best = minimize(
        lambda K: float(static_gain_radius(A, C, K[:, None], rate)), refused.gain[:, 0], method="Nelder-Mead"
    )
    assert best.fun**40 > 40.0  # what the best static gain makes of 40 more samples
    # Below the lower bound the gaps alone diverge.
    assert 0.7 * 1.69 > 1.0 and certify_static_gain(A, C, 0.3).verdict is Verdict.REFUTED


@pytest.mark.parametrize("method", ["riccati", "lmi"])
def test_verdicts_turn_at_the_rate(method: str) -> None:
    exact = 1 - 1 / 1.56**2
    above, below = (certify_static_gain(*TWO, exact + d, method) for d in (1e-3, -1e-3))  # type: ignore[arg-type]
    assert above.verdict is Verdict.CERTIFIED and above.radius < 1.0
    assert below.verdict is Verdict.REFUTED
    # No gain does it below the rate: random ones, and the best of both methods.
    draw = np.random.default_rng(0)
    gains = above.gain + draw.normal(0, 0.5, (500, 2, 1))
    assert (static_gain_radius(*TWO, gains, exact - 1e-3) >= 1.0).all()


def test_lmi_gain_is_stable_where_it_should_be() -> None:
    gain = lmi_gain(*TWO, 0.7)
    assert gain is not None and static_gain_radius(*TWO, gain, 0.7) < 1.0
    S = np.diag([1.0, 1e4])
    gain = lmi_gain(S @ TWO[0] @ np.linalg.inv(S), TWO[1] @ np.linalg.inv(S), 0.7)
    assert gain is not None
    assert static_gain_radius(S @ TWO[0] @ np.linalg.inv(S), TWO[1] @ np.linalg.inv(S), gain, 0.7) < 1.0


def test_complex_pair_seen_once_has_bounds_only() -> None:
    A = np.array([[1.1, 0.5], [-0.5, 1.1]])
    found = kalman_critical_arrival(A, [[1.0, 0.0]])
    assert not found.exact and "bounds only" in found.reason
    assert found.lower == pytest.approx(1 - 1 / 1.46) and found.upper == pytest.approx(1 - 1 / 1.46**2, abs=1e-8)
    assert kalman_critical_arrival(A, np.eye(2)).exact


def test_stable_plants_need_no_measurement() -> None:
    found = kalman_critical_arrival([[0.9, 1.0], [0.0, 0.5]], [[0.0, 1.0]])
    assert (found.lower, found.upper, found.static.upper) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("A", "C", "words"),
    [
        (np.diag([1.2, 0.5]), [[0.0, 1.0]], "not detectable: the mode at eigenvalue 1.2"),
        (np.eye(2), [[1.0]], "columns"),
        (np.zeros((2, 3)), [[1.0, 0.0]], "square"),
        ([[np.inf]], [[1.0]], "not finite"),
        (np.zeros((3, 2, 2)), [[1.0, 0.0]], "stacks"),
    ],
)
def test_bad_plants_are_refused(A: object, C: object, words: str) -> None:
    with pytest.raises(AnalysisError, match=words):
        kalman_critical_arrival(A, C)  # type: ignore[arg-type]


def test_bad_rates_and_methods_are_refused() -> None:
    with pytest.raises(AnalysisError, match="outside"):
        certify_static_gain(*TWO, 1.2)
    with pytest.raises(AnalysisError, match="unknown method 'lmy'; did you mean lmi"):
        certify_static_gain(*TWO, 0.5, "lmy")  # type: ignore[arg-type]
    with pytest.raises(AnalysisError, match="tolerance"):
        static_critical_arrival(*TWO, tolerance=0.0)
    with pytest.raises(AnalysisError, match="gain has the shape"):
        static_gain_radius(*TWO, [[1.0]], 0.5)
