"""Stability of given gains and boxes of gains on small systems whose answer is known; the papers' are in published/."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from synthesis.design.stability import GainBox, StabilityResult, affine_quadratic_stability
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.polynomials.rational import polynomial_matrix
from synthesis.published_certificate import check_certificate, leading_minors
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")
EXACT = LmiSettings(relaxation="exact")
SCALAR = small_model([[p]], [[1]])  # e' = (p - L) e with p in [-1, 1]: stable iff L > 1
SPRING = small_model([[0, 1], [-4 - p, -1]], [[1, 0]], (parameter("p", -1.0, 3.0, 2.0),))


def values(result: StabilityResult, points: np.ndarray) -> np.ndarray:
    """The Lyapunov matrix at parameter values (g,)."""
    return np.asarray(np.sum([c * points[:, None, None] ** k for k, c in enumerate(result.lyapunov)], axis=0))


@pytest.mark.parametrize("form", ["primal", "dual"])
@pytest.mark.parametrize(("gain", "verdict"), [(1.01, Verdict.CERTIFIED), (0.99, Verdict.REFUTED)])
def test_scalar_loop_is_stable_exactly_above_its_largest_pole(form: str, gain: float, verdict: Verdict) -> None:
    for degree in (0, 1, 2):
        result = affine_quadratic_stability(SCALAR, np.array([[gain]]), degree, form, EXACT)  # type: ignore[arg-type]
        assert result.verdict is verdict
        if verdict is Verdict.REFUTED:
            assert "pole at +0.01 1/s, p = 1 1, L = [0.99]" in result.message


@pytest.mark.parametrize(("decay", "verdict"), [(0.99, Verdict.CERTIFIED), (1.01, Verdict.REFUTED)])
def test_a_decay_rate_is_proved_up_to_the_true_one(decay: float, verdict: Verdict) -> None:
    """e' = (p - 2) e decays at 1 at worst; faster is not shown, and not refuted either: the loop is stable."""
    result = affine_quadratic_stability(SCALAR, np.array([[2.0]]), 0, "primal", EXACT, decay_rate=decay)
    assert result.verdict is verdict


@pytest.mark.parametrize("form", ["primal", "dual"])
@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_lyapunov_function_falls_along_simulated_errors(form: str, degree: int) -> None:
    """Independent check: integrate e' = A_e(p(t)) e with p swinging at the largest allowed rate and watch V."""
    gain = np.array([[1.5], [0.5]])
    result = affine_quadratic_stability(SPRING, gain, degree, form, EXACT)  # type: ignore[arg-type]
    assert result.verdict is Verdict.CERTIFIED
    assert result.lyapunov.shape == (degree + 1, 2, 2)

    def swing(t: np.ndarray) -> np.ndarray:
        return 1.0 + 2.0 * (2.0 / np.pi) * np.arcsin(np.sin(np.pi * t / 2.0))  # triangle, slope +-2, range [-1, 3]

    def error(t: float, e: np.ndarray) -> np.ndarray:
        return np.asarray(np.array([[-1.5, 1.0], [-4.5 - swing(np.array(t)), -1.0]]) @ e)

    times = np.linspace(0.0, 6.0, 601)
    for start in ([1.0, 0.0], [0.0, 1.0], [1.0, -2.0]):
        path = solve_ivp(error, (0.0, 6.0), start, t_eval=times, rtol=1e-10, atol=1e-13).y.T
        matrices = values(result, swing(times))
        weight = matrices if form == "primal" else np.linalg.inv(matrices)
        V = np.einsum("ti,tij,tj->t", path, weight, path)
        assert (np.diff(V) < 0.0).all()


def test_the_certificate_holds_in_physical_units_at_every_vertex_of_the_rate() -> None:
    gain = np.array([[1.5], [0.5]])
    result = affine_quadratic_stability(SPRING, gain, 2, "primal", EXACT)
    points = np.linspace(-1.0, 3.0, 401)
    A_e = SPRING.on(points).error_dynamics(gain)[0]
    P = values(result, points)
    slope = sum(k * c * points[:, None, None] ** (k - 1) for k, c in enumerate(result.lyapunov) if k)
    assert np.linalg.eigvalsh(P).min() > 0.0
    for rate in (-2.0, 2.0):
        decrease = P @ A_e + np.swapaxes(P @ A_e, 1, 2) + rate * slope
        assert np.linalg.eigvalsh(decrease).max() < 0.0


@pytest.mark.parametrize("form", ["primal", "dual"])
def test_a_box_of_gains_is_proved_by_its_vertices(form: str) -> None:
    box = GainBox(np.array([[1.1], [-0.5]]), np.array([[3.0], [4.0]]))
    result = affine_quadratic_stability(SPRING, box, 1, form, EXACT)  # type: ignore[arg-type]
    assert result.verdict is Verdict.CERTIFIED
    assert len(result.margins) == 1 + 4
    assert {margin.name for margin in result.margins} >= {
        "dV/dt < 0 with L = [1.1, -0.5]",
        "dV/dt < 0 with L = [3.0, 4.0]",
    }


def test_a_box_with_one_unstable_vertex_is_refuted_and_the_vertex_named() -> None:
    """A_e = [[-L1, 1], [-4 - p - L2, -1]]: determinant L1 + 4 + p + L2 < 0 at p = -1, L2 = -6 for L1 < 3."""
    box = GainBox(np.array([[1.1], [-6.0]]), np.array([[3.5], [4.0]]))
    result = affine_quadratic_stability(SPRING, box, 1, "primal", EXACT)
    assert result.verdict is Verdict.REFUTED
    assert "L = [1.1, -6.0]" in result.message
    assert "p = -1 1" in result.message


def test_gain_boxes_list_their_vertices_and_refuse_reversed_ones() -> None:
    box = GainBox(np.array([[1.0], [2.0]]), np.array([[1.0], [5.0]]))
    assert box.vertices().tolist() == [[[1.0], [2.0]], [[1.0], [5.0]]]
    assert box.middle.tolist() == [[1.0], [3.5]]
    for lower, upper in (([[2.0]], [[1.0]]), ([[np.nan]], [[1.0]]), ([[0.0]], [[1.0], [2.0]])):
        with pytest.raises(ProblemError, match="gain box: lower"):
            GainBox(np.array(lower), np.array(upper)).vertices()


def test_gains_of_a_wrong_shape_are_refused() -> None:
    with pytest.raises(ProblemError, match=r"gains of shape \(1, 2\) do not fit \(2, 1\)"):
        affine_quadratic_stability(SPRING, np.array([[1.0, 2.0]]))


def test_an_unbounded_rate_allows_constant_matrices_only() -> None:
    jumping = small_model([[0, 1], [-4 - p, -1]], [[1, 0]], (parameter("p", -1.0, 3.0, np.inf),))
    gain = np.array([[1.5], [0.5]])
    assert affine_quadratic_stability(jumping, gain, 0, settings=EXACT).verdict is Verdict.CERTIFIED
    with pytest.raises(ProblemError, match="unbounded rate"):
        affine_quadratic_stability(jumping, gain, 1, settings=EXACT)


@pytest.mark.parametrize("kind", ["grid", "exact"])
def test_rational_models_are_multiplied_by_their_denominator(kind: Relaxation) -> None:
    """e' = (-1/(2 + p) + 1 - L) e with p in [-1, 1]: the pole is largest at p = 1, 2/3 - L."""
    model = small_model([[1 - 1 / (2 + p)]], [[1]])
    settings = LmiSettings(relaxation=kind)
    assert affine_quadratic_stability(model, np.array([[0.67]]), 0, settings=settings).verdict is Verdict.CERTIFIED
    refuted = affine_quadratic_stability(model, np.array([[0.66]]), 1, settings=settings)
    assert refuted.verdict is Verdict.REFUTED
    assert "p = 1 1" in refuted.message
    decay = affine_quadratic_stability(model, np.array([[1.0]]), 0, settings=settings, decay_rate=0.33)
    assert decay.verdict is Verdict.CERTIFIED  # 1/3 is the true rate
    too_fast = affine_quadratic_stability(model, np.array([[1.0]]), 0, settings=settings, decay_rate=0.34)
    assert too_fast.verdict is Verdict.REFUTED


@pytest.mark.parametrize("kind", ["grid", "vertex"])
def test_two_parameters(kind: Relaxation) -> None:
    """e' = (p + q - L) e with both in [-1, 1]: stable iff L > 2."""
    model = small_model([[p + q]], [[1]], (parameter("p"), parameter("q", rate=0.5)))
    settings = LmiSettings(relaxation=kind, points=5)
    good = affine_quadratic_stability(model, np.array([[2.05]]), 0, settings=settings)
    assert good.verdict is Verdict.CERTIFIED
    assert good.lyapunov.shape == (1, 1, 1, 1)
    bad = affine_quadratic_stability(model, np.array([[1.95]]), 1, settings=settings)
    assert bad.verdict is Verdict.REFUTED
    assert "p = 1 1, q = 1 1" in bad.message


# ---- judging a matrix that somebody printed ---------------------------------------------------------------------------


def test_judge_finds_the_exact_end_of_validity() -> None:
    """e' = (p - 2) e, M = 1 + m p with |rate| <= 1: M > 0 for p > -1/m, and 2 (2 - p)(1 + m p) > |m|."""
    m = 0.5
    found = check_certificate(SCALAR, [[2]], [[["1"]], [["0.5"]]], "primal", search=(-4.0, 4.0))
    roots = np.sort(np.roots([-2 * m, 4 * m - 2, 4 - m]).real)  # where it becomes an equality
    assert not found.everywhere
    (interval,) = found.intervals
    assert interval == pytest.approx((max(roots[0], -1 / m), roots[1]), abs=1e-9)
    inside = check_certificate(SCALAR, [[2]], [[["1"]], [["0.5"]]], "primal")
    assert inside.everywhere
    assert inside.intervals == ((-1.0, 1.0),)


def test_judge_tells_primal_from_dual() -> None:
    """A_e = [[-1, 10], [0, -1]]: P = diag(1, 30) proves it, its inverse diag(30, 1) (scaled) is the dual matrix."""
    model = small_model([[0, 10], [0, 0]], [[1, 0], [0, 1]], (parameter("p"),), E=[[p], [0]])
    gains = [["1", "0"], ["0", "1"]]
    P, Q = [[["1", "0"], ["0", "30"]]], [[["30", "0"], ["0", "1"]]]
    assert check_certificate(model, gains, P, "primal").everywhere
    assert check_certificate(model, gains, Q, "dual").everywhere
    assert check_certificate(model, gains, P, "dual").intervals == ()
    assert check_certificate(model, gains, Q, "primal").intervals == ()


def test_judge_refuses_indefinite_matrices_and_unsuitable_models() -> None:
    assert check_certificate(SCALAR, [[2]], [[["-1"]]]).intervals == ()
    assert check_certificate(SCALAR, [["1"]], [[["1"]]]).everywhere is False  # on the boundary at p = 1: not strict
    with pytest.raises(ProblemError, match="only polynomial models of one parameter"):
        check_certificate(small_model([[1 / (2 + p)]], [[1]]), [[2]], [[["1"]]])
    with pytest.raises(ProblemError, match="only polynomial models of one parameter"):
        check_certificate(small_model([[p + q]], [[1]], (parameter("p"), parameter("q"))), [[2]], [[["1"]]])


def test_leading_minors_are_determinants() -> None:
    rng = np.random.default_rng(5)
    matrix = rng.integers(-5, 6, (4, 4)).astype(float)
    minors = leading_minors(polynomial_matrix([[0]], [matrix.tolist()]))
    for size, minor in enumerate(minors, start=1):
        assert float(minor(0)) == pytest.approx(np.linalg.det(matrix[:size, :size]), abs=1e-9)
