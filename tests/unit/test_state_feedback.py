"""State feedback design: closed forms, the duality with observers, published values, pole regions, limits, and refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

from analysis import hinf_norm
from estimators.arrays import FloatArray
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.feedback_scale import feedback_scale
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.sampled_state_feedback import design_sampled_state_feedback
from synthesis.design.state_feedback import (
    GainLimits,
    StateFeedbackDesign,
    design_state_feedback,
    state_feedback_problem,
)
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.lmi.solve import solve
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")


def loops(model: LpvModel, K: FloatArray, points: FloatArray) -> FloatArray:
    """A + B K (g, n, n)."""
    m = model.on(points)
    return np.asarray(m.A + m.B @ K)


def scalar(low: float = 1.0, high: float = 2.0, rate: float = 1.0) -> LpvModel:
    """x' = p x + u + d."""
    return small_model([[p]], [[1]], (parameter("p", low, high, rate),), B=[[1]], E=[[1]])


@pytest.mark.parametrize("rate", [0.0, 1.0, np.inf])
def test_scalar_plant_in_closed_form(rate: float) -> None:
    """x' = p x + u + d with the cost of x and u: with u = k x the peak of the gain is sqrt(1 + k^2)/(-p - k), above 1 for all k.

    The infimum 1 is approached by unbounded gains only where p > 0; at p < 0 it is 1/sqrt(1 + p^2), at k = 1/p.
    """
    model = scalar(rate=rate)
    gains = design_state_feedback(model, StateFeedbackDesign((FeedbackChannel(("d1",), ("x1", "u1")),)))
    assert gains.verdict is Verdict.CERTIFIED
    points = np.linspace(1.0, 2.0, 9)
    K = gains.gain(points)
    norms = hinf_norm(loops(model, K, points), np.ones((9, 1, 1)), np.concatenate([np.ones((9, 1, 1)), K], axis=1)).norm
    np.testing.assert_allclose(norms, np.hypot(1.0, K[:, 0, 0]) / (-points - K[:, 0, 0]), rtol=1e-6)
    assert 1.0 <= norms.max() <= gains.gamma and gains.gamma_lower == pytest.approx(1.0, rel=1e-3)
    stable = design_state_feedback(
        scalar(-3.0, -2.0, rate), StateFeedbackDesign((FeedbackChannel(("d1",), ("x1", "u1")),))
    )
    assert stable.gamma == pytest.approx(1.0 / np.sqrt(5.0), rel=0.02)
    np.testing.assert_allclose(stable.gain(np.array([-2.0])), -0.5, atol=0.1)


def test_the_dual_observer_has_the_same_level() -> None:
    """Transposed plant, disturbances and errors exchanged: one number in two ways, with two parameters and their rates."""
    # What grows for the observer falls for the law: rates change their sign.
    there, back = (
        (SchedulingParameter("p", "1", -1.0, 3.0, *rates), parameter("q", 0.0, 1.0, 0.5))
        for rates in ((-30.0, 0.0), (0.0, 30.0))
    )
    shift = q - sp.Rational(1, 2)
    A = sp.Matrix([[-2 + p / 4 * shift, 1 + p], [-2 + shift, -3 + p / 2]])
    C, E, F = sp.Matrix([[1, shift / 2]]), sp.Matrix([[1, 0], [0, 0]]), sp.Matrix([[0, 1]])
    observed = small_model(A, C, there, E=E, F=F)
    dual = small_model(A.T, E.T, back, B=C.T, D=F.T, E=sp.eye(2))
    channel = Channel(("d1", "d2"), ("x2",), weights=(1.0, 0.2))
    law = FeedbackChannel(("d2",), ("y1", "y2"), sizes=(1.0, 5.0))
    left = design_observer(observed, ObserverDesign((channel,)))
    right = design_state_feedback(dual, StateFeedbackDesign((law,)))
    assert left.gamma_lower is not None and right.gamma_lower is not None
    assert right.gamma == pytest.approx(left.gamma, rel=2e-3)
    assert max(left.gamma_lower, right.gamma_lower) <= min(left.gamma, right.gamma)
    middle = np.array([[1.0, 0.5]])
    np.testing.assert_allclose(right.gain(middle)[0], -left.gain(middle)[0].T, atol=0.2)
    # Two channels, one of them bounded.
    several = (Channel(("d1",), ("x1",), bound=2.0 * left.gamma), Channel(("d2",), ("x2",)))
    laws = (FeedbackChannel(("d1",), ("y1",), bound=2.0 * left.gamma), FeedbackChannel(("d2",), ("y2",)))
    left = design_observer(observed, ObserverDesign(several, decay_rate=0.2))
    right = design_state_feedback(dual, StateFeedbackDesign(laws, decay_rate=0.2))
    assert right.gamma == pytest.approx(left.gamma, rel=2e-3)


def test_published_lpv_state_feedback_of_yalmip() -> None:
    """Loefberg, YALMIP example "State feedback design for LPV system": the largest trace of Q is 2.294 for a fixed gain.

    x' = [0 1 a; 0 0 1; 0 0 0] x + [0 0 1]' u with |a| <= 0.1 and the cost of |x|^2 + u^2; a scheduled gain alone is no better.
    """
    A = sp.Matrix([[0, 1, p], [0, 0, 1], [0, 0, 0]])
    model = small_model(A, sp.eye(3), (parameter("p", -0.1, 0.1, np.inf),), B=[[0], [0], [1]], E=sp.eye(3))
    found = []
    for degree in (0, 1):  # of a disturbance that is as good as none, only the cost is left of the channel
        channel = FeedbackChannel(("d1", "d2", "d3"), ("x1", "x2", "x3", "u1"), weights=(1e-4,) * 3)
        scale = feedback_scale(model, (channel,))
        design = StateFeedbackDesign((channel,), degree=degree)
        problem = state_feedback_problem(model, design, scale, 1.0, maximise_margin=False)
        trace, Q = problem.scalar("trace"), problem.unknowns["Q"]
        shares = (problem.constant(np.eye(3)[i : i + 1] / scale.states[i]) for i in range(3))
        problem.require("trace", sum((row @ Q @ row.T for row in shares), -trace))
        problem.maximise("trace")
        found.append(float(solve(problem).objective or 0.0) * scale.disturbance**2)
    assert found == pytest.approx([2.294, 2.294], abs=5e-4)


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_level_does_not_depend_on_units(unit: float) -> None:
    parameters = (parameter("p", -1.0, 1.0, 2.0),)
    A, B = sp.Matrix([[0, 1], [p - 2, -sp.Rational(1, 2)]]), sp.Matrix([[0], [1]])
    T = sp.diag(1, sp.Rational(unit))
    design = StateFeedbackDesign((FeedbackChannel(("d1",), ("x1", "u1"), sizes=(1.0, 2.0)),), decay_rate=0.3)
    plain = small_model(A, sp.eye(2), parameters, B=B, E=[[0], [1]])
    moved = small_model(T * A * T.inv(), sp.eye(2), parameters, B=T * B * 1000, E=T * sp.Matrix([[0], [1]]))
    law = StateFeedbackDesign((FeedbackChannel(("d1",), ("x1", "u1"), sizes=(1.0, 0.002)),), decay_rate=0.3)
    first, second = design_state_feedback(plain, design), design_state_feedback(moved, law)
    assert second.gamma == pytest.approx(first.gamma, rel=1e-3)
    expected = first.gain(np.array([0.3]))[0] @ np.diag([1.0, 1.0 / unit]) / 1000
    np.testing.assert_allclose(second.gain(np.array([0.3]))[0], expected, rtol=2e-2)


def test_pole_regions_count_imaginary_parts() -> None:
    """An oscillator that is to be stiffened: without regions its poles leave the disc and the sector that are then asked for."""
    model = small_model(
        [[0, 1], [-4 - p, -sp.Rational(1, 10)]], [[1, 0]], (parameter("p", 0.0, 1.0, 1.0),), B=[[0], [1]], E=[[0], [1]]
    )
    channel = FeedbackChannel(("d1",), ("x1", "u1"), sizes=(0.05, 1.0))
    points = np.linspace(0.0, 1.0, 11)

    def poles(**more: Any) -> FloatArray:
        gains = design_state_feedback(model, StateFeedbackDesign((channel,), **more))
        return np.asarray(np.linalg.eigvals(loops(model, gains.gain(points), points)))

    free, loose = poles(), poles(fastest_pole=4.0)
    bound = poles(decay_rate=0.5, fastest_pole=4.0, damping=0.8)
    assert np.abs(free).max() > 4.0
    assert (-loose.real / np.abs(loose)).min() < 0.8
    assert np.abs(bound).max() < 4.0 and (-bound.real / np.abs(bound)).min() > 0.8 and bound.real.max() < -0.5
    with pytest.raises(ProblemError, match="loosen a bound"):
        poles(decay_rate=3.0, fastest_pole=3.0001)


def test_limits_of_gains_hold_on_the_ellipsoid_of_sizes() -> None:
    model = scalar(-2.0, 1.0)
    channel = FeedbackChannel(("d1",), ("x1",))
    loose = StateFeedbackDesign((channel,), fastest_pole=50.0)
    tight = StateFeedbackDesign((channel,), limits=GainLimits({"u1": 3.0}, {"x1": 0.5}))
    points = np.linspace(-2.0, 1.0, 7)
    free, kept = (design_state_feedback(model, design) for design in (loose, tight))
    assert np.abs(free.gain(points)).max() * 0.5 > 3.0
    assert np.abs(kept.gain(points)).max() * 0.5 <= 3.0
    assert kept.gamma > free.gamma
    with pytest.raises(ProblemError):  # x' = p x + u needs |K| > 1
        design_state_feedback(model, StateFeedbackDesign((channel,), limits=GainLimits({"u1": 0.4}, {"x1": 0.5})))


def test_rational_model() -> None:
    """x' = x/p + u + d: the same level as x' = q x + u + d with q = 1/p, which may move as far."""
    gains = [
        design_state_feedback(model, StateFeedbackDesign((FeedbackChannel(("d1",), ("x1", "u1")),), degree=0))
        for model in (
            small_model([[1 / p]], [[1]], (parameter("p", 0.5, 1.0, np.inf),), B=[[1]], E=[[1]]),
            scalar(1.0, 2.0, np.inf),
        )
    ]
    assert gains[0].gamma == pytest.approx(gains[1].gamma, rel=1e-3)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"channels": (FeedbackChannel(("d9",), ("x1",)),)}, "unknown disturbance 'd9'; known: d1"),
    ({"channels": (FeedbackChannel(("d1",), ("z1",)),)}, "unknown performance signal 'z1'"),
    ({"channels": (FeedbackChannel(("d1",), ("x1", "x1")),)}, "performance signal 'x1' twice"),
    ({"channels": (FeedbackChannel(("d1",), ("x1",), sizes=(1.0, 2.0)),)}, r"2 sizes for 1 performance signal"),
    ({"channels": (FeedbackChannel(("d1",), ("x1",), sizes=(0.0,)),)}, "positive numbers"),
    ({"channels": (FeedbackChannel(("d1",), ("x1",), bound=1.0),)}, "exactly one channel must have no bound"),
    ({"limits": GainLimits({"u2": 1.0}, {"x1": 1.0})}, "unknown input 'u2'; known: u1"),
    ({"limits": GainLimits({"u1": 1.0}, {})}, r"state\(s\) x1 have no size"),
    ({"damping": 1.0}, "damping ratio between 0 and 1"),
    ({"decay_rate": 2.0, "fastest_pole": 1.0}, "must exceed the decay rate"),
]


@pytest.mark.parametrize(("change", "words"), REFUSED)
def test_what_means_nothing_is_refused(change: dict[str, Any], words: str) -> None:
    wanted = {"channels": (FeedbackChannel(("d1",), ("x1", "u1")),)} | change
    with pytest.raises(ProblemError, match=words):
        design_state_feedback(scalar(), StateFeedbackDesign(**wanted))


def test_a_mode_that_no_input_moves_is_refused_with_its_place() -> None:
    """x1 grows for p > 0 and is moved only through x2, with a strength that vanishes at p = 1/2."""
    model = small_model([[p, 2 * p - 1], [0, -1]], [[1, 0]], (parameter("p", -1.0, 1.0),), B=[[0], [1]], E=[[1], [0]])
    design = StateFeedbackDesign((FeedbackChannel(("d1",), ("x1",)),))
    with pytest.raises(ProblemError, match=r"not stabilisable at p = 0\.5 1: a mode .* none of the input\(s\) u1"):
        design_state_feedback(model, design)
    with pytest.raises(ProblemError, match="has no input"):
        design_state_feedback(small_model([[p]], [[1]], E=[[1]]), design)


def test_sampled_design_is_the_norm_of_the_discretised_loop() -> None:
    """A double integrator at T = 0.5 s: near the optimum of discrete time, which a Riccati equation of the game finds."""
    period = 0.5
    model = small_model(
        [[0, 1], [0, p - 1]], [[1, 0]], (parameter("p", 0.999, 1.001, 0.0),), B=[[0], [1]], E=[[0], [1]]
    )
    channel = FeedbackChannel(("d1",), ("y1", "u1"), weights=(0.5,), sizes=(2.0, 1.0))
    gains = design_sampled_state_feedback(model, StateFeedbackDesign((channel,)), period)
    assert gains.verdict is Verdict.CERTIFIED and gains.gamma_lower is not None
    A, B = np.array([[1.0, period], [0.0, 1.0]]), np.array([[period**2 / 2], [period]])
    K = gains.gain(np.array([1.0]))[0]
    norm = float(hinf_norm(A + B @ K, 0.5 * B, np.array([[0.5, 0.0], K[0]]), discrete=True).norm)
    assert norm <= gains.gamma

    def possible(level: float) -> bool:
        """The value iteration of the game with u unlimited and d weighed by level^2 stays bounded."""
        X, both = np.zeros((2, 2)), np.hstack([B, 0.5 * B])
        for _ in range(3000):
            weight = np.diag([1.0, -(level**2)]) + both.T @ X @ both
            if weight[1, 1] >= 0.0:
                return False
            last, X = X, np.diag([0.25, 0.0]) + A.T @ (X - X @ both @ np.linalg.solve(weight, both.T @ X)) @ A
            if np.abs(X - last).max() < 1e-10 * np.abs(X).max():
                return True
        return False

    assert possible(gains.gamma) and not possible(0.97 * gains.gamma)
    with pytest.raises(ProblemError, match="has no fastest_pole"):
        design_sampled_state_feedback(model, StateFeedbackDesign((channel,), fastest_pole=5.0), period)


def test_sampled_design_where_the_continuous_one_is_too_fast_for_the_samples() -> None:
    """x' = p x + u + d at T = 0.4 s: decay and limit hold for the loop over a sample, with the rates of p."""
    model, period = scalar(1.0, 2.0, 0.5), 0.4
    channel = FeedbackChannel(("d1",), ("x1", "u1"))
    limits = GainLimits({"u1": 3.1}, {"x1": 1.0})
    design = StateFeedbackDesign((channel,), decay_rate=0.2, limits=limits)
    points = np.linspace(1.0, 2.0, 11)
    gains = design_sampled_state_feedback(model, design, period)
    K = gains.gain(points)[:, 0, 0]
    update = np.exp(points * period) + (np.exp(points * period) - 1.0) / points * K
    assert np.abs(update).max() < np.exp(-0.2 * period) and np.abs(K).max() < 3.1
    fast = design_state_feedback(model, StateFeedbackDesign((channel,))).gain(points)[:, 0, 0]
    assert np.abs(np.exp(points * period) + (np.exp(points * period) - 1.0) / points * fast).max() > 1.0
    done = deploy(gains, DeploySettings(sample_time=period))
    assert [claim.kind for claim in done.claims] == ["sampled error", "sampled gain"]
    assert done.claims[1].level < 1.15 * gains.gamma
    stricter = replace(gains, design=replace(design, limits=GainLimits({"u1": 2.9}, {"x1": 1.0})))
    with pytest.raises(ProblemError, match=r"commands up to .* of u1 for states of their sizes, its limit is 2\.9"):
        deploy(stricter, DeploySettings(sample_time=period))
    with pytest.raises(ProblemError, match=r"designed for a sample time of 0\.4 s are not run at 0\.1 s"):
        deploy(gains, DeploySettings(sample_time=0.1))


def test_sampled_design_pays_for_rates_and_for_decay() -> None:
    """A spring of moving stiffness: parameters that move cost more than ones that stand, faster decay more than none."""

    def spring(rate: float) -> LpvModel:
        A = [[0, 1], [-3 - 2 * p, -sp.Rational(1, 5)]]
        return small_model(A, [[1, 0]], (parameter("p", -1.0, 1.0, rate),), B=[[0], [1]], E=[[0], [1]])

    channel = FeedbackChannel(("d1",), ("x1", "u1"), sizes=(0.3, 1.0))
    points, period = np.linspace(-1.0, 1.0, 9), 0.1
    still, moving, decaying = (
        design_sampled_state_feedback(spring(rate), StateFeedbackDesign((channel,), decay_rate=decay), period)
        for rate, decay in ((0.0, 0.0), (20.0, 0.0), (0.0, 1.5))
    )
    assert moving.gamma > 1.05 * still.gamma and decaying.gamma > 1.02 * still.gamma
    radii = []
    for gains in (still, decaying):
        m = gains.model.on(points)
        Phi, Gamma = zero_order_hold(m.A, m.B, period)
        radii.append(np.abs(np.linalg.eigvals(Phi + Gamma @ gains.gain(points))).max())
    assert radii[1] < np.exp(-1.5 * period) < radii[0]
