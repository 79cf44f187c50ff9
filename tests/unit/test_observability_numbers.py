"""Numbers of the observability tests that are not zero or one: closed forms, exact fractions and what the tolerances decide."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from analysis import stabilizable
from analysis.errors import AnalysisError
from analysis.observability.detectability import detectable
from analysis.observability.gramians import sequence_controllability, sequence_observability
from analysis.observability.hidden_modes import undetectable_mode
from analysis.observability.real_roots import real_roots
from analysis.observability.stochastic import RANK_TOLERANCE, stochastic_observability
from analysis.observability.windows import uniform_detectability, uniform_stabilisability
from synthesis.lmi.result import Verdict
from tests.support.continuous_gramian import continuous_gramian
from tests.support.lmi_cases import small_model

x = sp.Symbol("x")


def held(matrix: object, count: int) -> np.ndarray:
    """The same matrix at every sample."""
    array = np.asarray(matrix, float)
    return np.broadcast_to(array, (count, *array.shape))


def test_roots_of_polynomials_with_irrational_coefficients_need_no_range() -> None:
    for expression, wanted in (
        (x**2 - sp.pi, [-sp.sqrt(sp.pi), sp.sqrt(sp.pi)]),
        (x**3 - sp.E * x, [-sp.sqrt(sp.E), 0, sp.sqrt(sp.E)]),
        (sp.sqrt(2) * x**2 - 1000 * sp.pi, [-sp.sqrt(500 * sp.sqrt(2) * sp.pi), sp.sqrt(500 * sp.sqrt(2) * sp.pi)]),
        (x**2 + sp.pi, []),
    ):
        found = real_roots(expression, x)
        assert len(found) == len(wanted)
        assert all(abs(sp.N(a - b, 40)) < 1e-25 for a, b in zip(found, wanted, strict=True))
    with pytest.raises(AnalysisError, match="give the range"):
        real_roots(sp.cos(x) - x, x)


@pytest.mark.parametrize("discrete", [False, True])
def test_gains_that_show_detectability_are_in_the_given_units(discrete: bool) -> None:
    draw = np.random.default_rng(2)
    units = np.diag([1e-4, 1.0, 1e3])
    for size in (1e-5, 1.0, 1e5):  # of the outputs
        A = units @ (draw.normal(size=(3, 3)) + 1.5 * np.eye(3)) @ np.linalg.inv(units)
        C = size * draw.normal(size=(2, 3)) @ np.linalg.inv(units)
        for found, closed in (
            (detectable(A, C, discrete), lambda L, A=A, C=C: A - L @ C),
            (stabilizable(A.T, C.T, discrete), lambda K, A=A, C=C: A.T - C.T @ K),
        ):
            assert found.verdict is Verdict.CERTIFIED and found.gain is not None
            poles = np.linalg.eigvals(closed(found.gain))
            assert (np.abs(poles) < 1.0).all() if discrete else (poles.real < 0.0).all()


def test_stochastic_records_that_overflow_or_do_not_fit_are_refused() -> None:
    seen, silent = [[1.0, 0.0]], np.zeros((2, 2))
    with pytest.raises(AnalysisError, match="overflows at sample 3"):  # M alone: without noise N stays finite
        A = np.stack([np.eye(2), np.eye(2), np.diag([1.0, 1e200])])
        stochastic_observability(A, held(seen, 3), silent, [[1.0]])
    with pytest.raises(AnalysisError, match="K, n, n"):
        stochastic_observability(np.ones((3, 3, 2, 2)), np.ones((3, 1, 2)), np.eye(2), [[1.0]])


def test_the_default_tolerance_of_the_stochastic_tests() -> None:
    """A direction is seen if it shows by more than 1e-9 of what it could show at most."""
    for tilt, needed in ((1e-7, 2), (1e-11, None)):
        C = np.array([[[1.0, -1.0]], [[1.0, -1.0 + tilt]]])
        found = stochastic_observability(held(np.eye(2), 2), C, np.zeros((2, 2)), [[1.0]])
        assert found.samples_needed == needed and found.rank_tolerance == RANK_TOLERANCE == 1e-9
    # units of the outputs and of one state decide nothing
    for unit in (1e-12, 1.0, 1e12):
        C = unit * np.array([[[1.0, 0.0]], [[1.0, 1.0]]])
        assert stochastic_observability(held(np.eye(2), 2), C, np.eye(2), [[1.0]]).samples_needed == 2


def test_window_constants_in_closed_form() -> None:
    """A = diag(a, b), C = [1, 0]: V = diag(sum a^(2k), 0), so c_2 is V_11 times the least share of e_1 among what lasts."""
    window, c, a, b = 4, 0.5, 1.1, 0.8  # |b|^4 = 0.41 < c, |a|^4 = 1.46
    energy = sum(a ** (2 * k) for k in range(window))
    A, C = held(np.diag([a, b]), 9), held([[1.0, 0.0]], 9)
    # a^8 s + b^8 (1 - s) = c^2 at the least share s of e_1
    share = (c**2 - b ** (2 * window)) / (a ** (2 * window) - b ** (2 * window))
    found = uniform_detectability(A, C, window, contraction=c)
    np.testing.assert_allclose(found.information, energy * share, rtol=1e-9)
    assert found.verdict is Verdict.CERTIFIED
    np.testing.assert_allclose(found.round_off, energy * 64.0 * np.finfo(float).eps, rtol=1e-9)
    least, slack = float(found.information[0]), float(found.round_off[0])
    for required, verdict in (
        (least * (1.0 - 1e-9), Verdict.CERTIFIED),
        (least - 2.0 * slack, Verdict.CERTIFIED),
        (least - 0.5 * slack, Verdict.INCONCLUSIVE),  # within round-off of what is required
        (least + 0.5 * slack, Verdict.INCONCLUSIVE),
        (least + 2.0 * slack, Verdict.REFUTED),
    ):
        assert uniform_detectability(A, C, window, contraction=c, required=required).verdict is verdict
    one_bad = np.concatenate([held(np.diag([a, b]), 9), held(np.diag([a, 0.99]), 9)])
    judged = uniform_detectability(one_bad, held([[1.0, 0.0]], 18), window, contraction=c)
    assert judged.verdict is Verdict.REFUTED and judged.information[0] > 0.1
    assert judged.worst == (6,)  # the first window in which e_2 lasts: 0.8^3 0.99 = 0.507
    # everything lasts: tau = 0 is best, and c_2 is the smallest eigenvalue of V
    both = uniform_detectability(held(np.eye(2), 5), held(np.diag([1.0, 0.3]), 5), 4, contraction=0.9)
    np.testing.assert_allclose(both.information, 4 * 0.09, rtol=1e-12)
    with pytest.raises(AnalysisError, match="required = -1"):
        uniform_detectability(A, C, window, required=-1.0)
    dual = uniform_stabilisability(np.swapaxes(A, -1, -2), np.swapaxes(C, -1, -2), window, contraction=c)
    np.testing.assert_allclose(dual.information, energy * share, rtol=1e-9)


def test_ranks_and_scales_of_sequences() -> None:
    """The rank is relative to the largest singular value of the factor, 1e-12 by default, in the units of `state_scale`."""
    for size in (1e-20, 1.0, 1e20):
        for least, rank in ((1e-10, 2), (1e-14, 1)):
            found = sequence_observability(np.eye(2)[None], size * np.diag([1.0, least])[None])
            assert found.rank() == rank
            np.testing.assert_allclose(found.singular_values, [size**2, (size * least) ** 2], rtol=1e-9)
    A, scale = held([[1.0, 0.5], [0.0, 0.9]], 3), np.array([2.0, 50.0])
    S = np.diag(scale)
    C = held([[1.0, 0.2]], 3)
    V, W = sequence_observability(A, C), sequence_controllability(A, np.swapaxes(C, -1, -2))
    np.testing.assert_allclose(sequence_observability(A, C, scale).gramian, S @ V.gramian @ S, rtol=1e-12)
    scaled = sequence_controllability(A, np.swapaxes(C, -1, -2), scale)
    np.testing.assert_allclose(scaled.gramian, np.linalg.inv(S) @ W.gramian @ np.linalg.inv(S), rtol=1e-12)
    for wrong in ([1.0, 0.0], [1.0, -1.0]):
        for function in (sequence_observability, sequence_controllability):
            with pytest.raises(AnalysisError, match="state_scale"):
                function(A, np.ones((3, 2, 2)), wrong)


def test_the_continuous_gramian_to_the_last_digits() -> None:
    """phi' = w J phi turns: with C = [1, 0] the gramian over a whole turn is T/2 I, and over time t in closed form."""
    w = 40.0
    J, C = w * np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([[1.0, 0.0]])
    for stop in (2.0 * np.pi / w, 1.7):
        found = continuous_gramian(lambda t: J, lambda t: C, 0.0, stop)
        s, c = np.sin(2.0 * w * stop) / (4.0 * w), np.sin(w * stop) ** 2 / (2.0 * w)
        np.testing.assert_allclose(found.gramian, [[stop / 2 + s, c], [c, stop / 2 - s]], atol=1e-9)
        turned = [[np.cos(w * stop), np.sin(w * stop)], [-np.sin(w * stop), np.cos(w * stop)]]
        np.testing.assert_allclose(found.transition, turned, atol=1e-8)
    # a sensor that works for a moment within a still plant: no step may jump over it
    blink = continuous_gramian(lambda t: np.zeros((1, 1)), lambda t: np.exp([[-((t - 0.6) ** 2) / 2e-4]]), 0.0, 1.0)
    np.testing.assert_allclose(blink.gramian, np.sqrt(np.pi * 1e-4), rtol=1e-6)
    # a plant that moves for a moment: x doubles once, between long rests
    kick = continuous_gramian(
        lambda t: np.log(2.0) * np.exp([[-((t - 50.0) ** 2) / 2e-2]]) / np.sqrt(2e-2 * np.pi),
        lambda t: np.eye(1), 0.0, 100.0,
    )  # fmt: skip
    np.testing.assert_allclose(kick.transition, 2.0, rtol=1e-8)
    with pytest.raises(AnalysisError, match="could not be integrated"):
        continuous_gramian(lambda t: np.array([[2e3]]), lambda t: np.eye(1), 0.0, 1.0)


def test_a_hidden_oscillation_keeps_its_frequency() -> None:
    """x2, x3 grow as e^(t/10) and turn at 2 rad/s, unseen; a hidden real mode has no imaginary part."""
    tenth = sp.Rational(1, 10)
    for block, wanted in (([[tenth, 2], [-2, tenth]], 0.1 + 2.0j), ([[tenth, 1], [0, -1]], 0.1 + 0.0j)):
        A = sp.diag(-2 - sp.Symbol("p"), sp.Matrix(block))
        found = undetectable_mode(small_model(A, [[1, 0, 0]]))
        assert found is not None
        value = complex(found.eigenvalue)
        assert complex(value.real, abs(value.imag)) == pytest.approx(wanted, abs=1e-9)
