"""Output feedback by linear inequalities: against Riccati equations, frequency responses and the proof of the table that runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest
import sympy as sp

from estimators.arrays import FloatArray
from synthesis.certificate.search import Search, Wish
from synthesis.design.feedback_channel import FeedbackChannel, feedback_names
from synthesis.design.law_table import deployed_loop
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.design.output_feedback_lmi import Still
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from tests.support.lmi_cases import parameter, small_model
from tests.support.output_loops import closed, frozen_gain

p = sp.Symbol("p")
WEIGHED = FeedbackChannel(("d1",), ("x1", "u1"))


def constant_model(**matrices: Any) -> LpvModel:
    """Without parameters; signals x1.., u1.., y1.., d1.."""
    sizes = {"states": ("x", "A", 0), "inputs": ("u", "B", 1), "outputs": ("y", "C", 0), "disturbances": ("d", "E", 1)}
    signals = {
        key: tuple(Signal(f"{letter}{i + 1}", "1") for i in range(np.shape(matrices[name])[axis]))
        for key, (letter, name, axis) in sizes.items()
    }
    exact = {key: sp.Matrix(value) for key, value in matrices.items()}
    given: dict[str, Any] = signals | exact
    return LpvModel(name="still", source="made for a test", parameters=(), **given)


SCHERER = constant_model(  # Scherer, Gahinet, Chilali 1997, example 7 (data in python-control's examples)
    A=[[0, 10, 2], [-1, 1, 0], [0, 2, -5]], B=[[0], [1], [0]], C=[[0, 1, 0]], E=[[1], [0], [1]], F=[[2]]
)
OSCILLATOR = small_model(  # the plant of MathWorks' gain-scheduled LQG example, with a force and noise on it
    [[0, 1], [-1 - p / 2, sp.Rational(-1, 5)]], [[1, 0]], [parameter(rate=0.2)], B=[[0], [1]], E=[[0, 0], [1, 0]],
    F=[[0, sp.Rational(1, 10)]],
)  # fmt: skip
NOISY = FeedbackChannel(("d1", "d2"), ("x1", "u1"))


STILL = np.zeros((1, 0))


@pytest.mark.parametrize("feedthrough", [None, False])
def test_constant_plant_reaches_the_least_norm_of_two_riccati_equations(feedthrough: bool | None) -> None:
    """SLICOT's sb10ad behind control.hinfsyn; printed 9.508. With noise on y and u weighed, Dk = 0 costs nothing."""
    A, B, C, E, F = (np.array(getattr(SCHERER, key), float) for key in "ABCEF")
    shown = np.vstack([np.eye(3)[:1], np.zeros((1, 3))])
    plant = control.ss(A, np.hstack([E, B]), np.vstack([shown, C]), [[0, 0], [0, 1], [F[0, 0], 0]])
    *_, gamma, _ = control.hinfsyn(plant, 1, 1)
    found = design_output_feedback(SCHERER, OutputFeedbackDesign((WEIGHED,), feedthrough=feedthrough))
    assert found.verdict is Verdict.CERTIFIED
    assert found.optimum.objective is not None
    assert found.optimum.objective * found.frame.unit == pytest.approx(gamma, rel=1e-3)
    assert found.gamma_lower is not None and gamma * (1 - 2e-3) < found.gamma_lower <= gamma * (1 + 1e-6)
    assert 0.99 * gamma < frozen_gain(found, WEIGHED, STILL) <= found.gamma
    assert feedthrough is None or not found.controller(STILL)[3].any()


def test_a_feedthrough_of_the_plant_is_taken_off_the_measurement() -> None:
    """y = C x + D u + F d: the same least gain with D, for a law without feedthrough; with one the loop would be algebraic."""
    acting = replace(SCHERER, D=sp.Matrix([[3]]))
    found = design_output_feedback(acting, OutputFeedbackDesign((WEIGHED,)))
    assert frozen_gain(found, WEIGHED, STILL) <= found.gamma < 9.509 * 1.012
    with pytest.raises(ProblemError, match="algebraic loop"):
        design_output_feedback(acting, OutputFeedbackDesign((WEIGHED,), feedthrough=True))


def test_units_change_nothing() -> None:
    """A state in thousandths, inputs in thousands, outputs in hundredths, time in minutes: the same gamma and the same law."""
    T, u, y, minute = sp.diag(1, 1000, 1), 1000, 100, 60
    A, B, C = (sp.Matrix(getattr(SCHERER, key)) for key in "ABC")
    E, F = sp.Matrix([[1, 0], [0, 0], [1, 0]]), sp.Matrix([[0, 2]])  # noise of its own: the best filter is not perfect
    plain = constant_model(A=A, B=B, C=C, E=E, F=F)
    other = constant_model(
        A=minute * T * A * T.inv(), B=minute * u * T * B, C=y * C * T.inv(), E=minute * T * E, F=y * F
    )
    weighed = replace(NOISY, sizes=(1.0, 1.0 / u))
    first, second = (
        design_output_feedback(model, OutputFeedbackDesign((channel,)))
        for model, channel in ((plain, NOISY), (other, weighed))
    )
    assert second.gamma == pytest.approx(first.gamma, rel=1e-3)
    there, back = (np.array(m, float) for m in (T, T.inv()))
    K, (Ak, Bk, Ck, Dk) = first.controller(STILL), second.controller(STILL)
    same = (back @ Ak @ there / minute, back @ Bk * y / minute, u * Ck @ there, u * Dk * y)
    for one, another in zip(K, same, strict=True):
        np.testing.assert_allclose(one, another, rtol=1e-3, atol=2e-3 * np.abs(one).max() + 1e-9)


def test_bounded_rates_buy_gain_and_no_gain_needs_the_rate() -> None:
    """Both forms: X follows the parameter or Y does; free to jump neither may, and the least gain is larger."""
    line = np.linspace(-1.0, 1.0, 9)
    gammas = {}
    for form in ("X", "Y"):
        found = design_output_feedback(OSCILLATOR, OutputFeedbackDesign((NOISY,), still=form))
        assert found.verdict is Verdict.CERTIFIED
        assert found.gamma_lower is not None and found.gamma_lower <= found.gamma
        assert frozen_gain(found, NOISY, line) <= found.gamma
        assert len({len(np.unique(m.round(9), axis=0)) for m in found.controller(line)[:3]} - {1, 9}) == 0
        gammas[form] = found.gamma
    best = design_output_feedback(OSCILLATOR, OutputFeedbackDesign((NOISY,)))
    assert best.gamma == min(gammas.values())
    jumping = replace(OSCILLATOR, parameters=(parameter(rate=np.inf),))
    free = design_output_feedback(jumping, OutputFeedbackDesign((NOISY,)))
    assert free.gamma_lower is not None and free.gamma_lower > 1.05 * best.gamma


@pytest.mark.parametrize("form", ["X", "Y"])
def test_the_design_shows_its_gain_along_every_motion(form: Still) -> None:
    """P of the loop from X and Y, its slope from differences: dV/dt + |z|^2/gamma - gamma |w|^2 < 0 at both ends of the rate.

    The parameter rises fast and falls slowly, so that no sign of a slope can be wrong on both sides. With the slope the other way
    round the inequality does not hold: the test can see it.
    """
    rising = replace(OSCILLATOR, parameters=(SchedulingParameter("p", "1", -1.0, 1.0, -0.01, 1.5),))
    found = design_output_feedback(rising, OutputFeedbackDesign((NOISY,), degree=2, still=form))
    frame, n, gamma = found.frame, 2, found.gamma
    first, second = frame.regulator, frame.filter

    def lyapunov(line: FloatArray) -> FloatArray:
        u = np.stack([line, np.zeros_like(line)], axis=1)
        X, Y = (found.result.values[name].at(u)[..., 0] for name in "XY")
        X, inverse = second.T @ X @ second / frame.clock, first.T @ np.linalg.inv(Y) @ first / frame.clock
        if form == "Y":  # V = x'Y^-1 x + (x - xk)'(X - Y^-1)(x - xk)
            return np.block([[X, inverse - X], [inverse - X, X - inverse]])
        other = np.linalg.inv(
            np.linalg.inv(inverse) - np.linalg.inv(X)
        )  # V = (x - xk)'X (x - xk) + xk'(Y - X^-1)^-1 xk
        return np.block([[X, -X], [-X, X + other]])

    line = np.linspace(-0.99, 0.99, 23)
    A, B, C, D = closed(found, line)
    Z = np.eye(4)[[0, 3]]
    P, slope = lyapunov(line), (lyapunov(line + 1e-4) - lyapunov(line - 1e-4)) / 2e-4

    def worst(rates: tuple[float, float]) -> float:
        highest = -np.inf
        for rate in rates:
            fall = np.swapaxes(A, 1, 2) @ P + P @ A + rate * slope
            shown = Z @ C, Z @ D
            corner = np.swapaxes(shown[1], 1, 2) @ shown[1] / gamma - gamma * np.eye(2)
            side = P @ B + np.swapaxes(shown[0], 1, 2) @ shown[1] / gamma
            whole = np.block(
                [[fall + np.swapaxes(shown[0], 1, 2) @ shown[0] / gamma, side], [np.swapaxes(side, 1, 2), corner]]
            )
            highest = max(highest, float(np.linalg.eigvalsh(whole).max()))
        return highest

    assert P.shape == (23, 2 * n, 2 * n) and np.linalg.eigvalsh(P).min() > 0.0
    assert worst((-0.01, 1.5)) < 0.0
    assert worst((0.01, -1.5)) > 0.0


def test_several_channels_with_decay_and_a_disc_of_poles() -> None:
    """Every frozen pole within the disc and left of the decay rate; every channel at most its bound; mixed costs more."""
    force, noise = FeedbackChannel(("d1",), ("x1", "u1"), bound=1.6), FeedbackChannel(("d2",), ("u1",))
    design = OutputFeedbackDesign((force, noise), decay_rate=0.3, fastest_pole=12.0)
    found = design_output_feedback(OSCILLATOR, design)
    line = np.linspace(-1.0, 1.0, 9)
    poles = np.linalg.eigvals(closed(found, line)[0])
    assert found.verdict is Verdict.CERTIFIED
    assert poles.real.max() < -0.3 and np.abs(poles).max() < 12.0
    assert frozen_gain(found, force, line) <= 1.6
    assert frozen_gain(found, noise, line) <= found.gamma
    alone = design_output_feedback(OSCILLATOR, OutputFeedbackDesign((noise,)))
    assert alone.gamma < found.gamma


def test_singular_plants() -> None:
    """No noise on y and no weight on u: nothing bounds the gains but the disc of the poles."""
    bare = small_model(
        [[0, 1], [-1 - p / 2, sp.Rational(-1, 5)]], [[1, 0]], [parameter(rate=0.2)], B=[[0], [1]], E=[[0], [1]]
    )
    channel = FeedbackChannel(("d1",), ("x1",))
    found = design_output_feedback(bare, OutputFeedbackDesign((channel,), fastest_pole=10.0))
    line = np.linspace(-1.0, 1.0, 5)
    assert found.verdict is Verdict.CERTIFIED
    assert frozen_gain(found, channel, line) <= found.gamma
    assert np.abs(np.linalg.eigvals(closed(found, line)[0])).max() < 10.0


def test_hidden_modes_are_refused_before_anything_is_solved() -> None:
    """An unstable mode that the input does not move, or that the output does not show, with its place."""
    channel = FeedbackChannel(("d1",), ("x1", "u1"))
    A = [[p, 0], [0, -1]]
    deaf = small_model(A, [[1, 1]], [parameter()], B=[[0], [1]], E=[[1], [0]], F=[[1]])
    blind = small_model(A, [[0, 1]], [parameter()], B=[[1], [1]], E=[[1], [0]], F=[[1]])
    with pytest.raises(ProblemError, match=r"not stabilisable at p = \S+ 1: .* u1"):
        design_output_feedback(deaf, OutputFeedbackDesign((channel,)))
    with pytest.raises(ProblemError, match=r"undetectable at p = \S+ 1: .* y1"):
        design_output_feedback(blind, OutputFeedbackDesign((channel,)))
    both = small_model(A, [[1, 0], [0, 1]], [parameter()], B=[[1], [1]], E=[[1], [0]], F=[[1], [1]])
    with pytest.raises(ProblemError, match="undetectable"):
        design_output_feedback(both, OutputFeedbackDesign((channel,), measured=("y2",)))
    assert design_output_feedback(both, OutputFeedbackDesign((channel,), measured=("y1",))).verdict is Verdict.CERTIFIED


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"channels": (replace(NOISY, performance=("x3",)),)}, "x3"),
        ({"channels": (replace(NOISY, bound=1.0),)}, "exactly one channel"),
        ({"channels": (replace(NOISY, weights=(1.0,)),)}, "weights|sizes"),
        ({"channels": (NOISY,), "fastest_pole": 0.1, "decay_rate": 0.2}, "fastest pole"),
        ({"channels": (NOISY,), "measured": ("y7",)}, "y7"),
        ({"channels": (NOISY,), "degree": 9}, "degree 9"),
    ],
)
def test_bad_designs_are_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        design_output_feedback(OSCILLATOR, OutputFeedbackDesign(**change))


def test_a_search_whose_multipliers_are_large_is_solved() -> None:
    """P of degree 3 for a law whose own P is rational: large multipliers leave 1e-6 of the dual equations, which costs nothing.

    Without an eye for that cost the solve ends nowhere, and takes the problem for infeasible.
    """
    found = design_output_feedback(OSCILLATOR, OutputFeedbackDesign((NOISY,), still="X"))
    lines = (np.linspace(-1.0, 1.0, 9),)
    Ak, Bk, Ck, Dk = found.controller(lines[0])
    table = np.concatenate([np.concatenate([Ak, Bk], axis=2), np.concatenate([Ck, Dk], axis=2)], axis=1).round(4)
    loop = replace(deployed_loop(found, lines, table, 0.01), sample_time=None)
    search = Search(loop, feedback_names(OSCILLATOR), OSCILLATOR.parameters, 3)
    wish = Wish("gain", None, NOISY.claim)
    asked = search._asked(wish)
    assert asked is not None
    answer = search._solved(asked, wish)
    assert answer.status == "Solved"
    level = np.sqrt(answer.decisions[np.flatnonzero(asked.problem.cost)[0]]) * search._unit(wish)
    assert frozen_gain(found, NOISY, lines[0]) <= level < 1.2 * found.gamma
