"""Designs whose answer is known in closed form, in any units: no gamma that does not hold, no gamma that hangs on a unit."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

from synthesis.design import three_solves
from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, design_observer
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.errors import ProblemError
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
BACKOFF = 0.01
DESIGN = ObserverDesign((Channel(("d1", "d2"), ("x1",)),), degree=0, backoff=BACKOFF)


def exact(x: float) -> sp.Rational:
    return sp.Rational(repr(float(x)))


def scalar(a: float, b: float, c: float) -> LpvModel:
    """x' = a x + b w, y = c x + v; without a parameter."""
    made = small_model([[exact(a) + p]], [[exact(c)]], E=[[exact(b), 0]], F=[[0, 1]])
    return replace(made, parameters=(), A=sp.Matrix([[exact(a)]]))


def least_gamma(a: float, b: float, c: float) -> float:
    """|b| / sqrt(a^2 + b^2 c^2) for a < 0; 1/|c|, approached with unbounded gains, for a >= 0."""
    return abs(b) / float(np.hypot(a, b * c)) if a < 0.0 else 1.0 / abs(c)


def gamma_of(gain: float, a: float, b: float, c: float) -> float:
    """What a gain achieves: the static gain of e' = (a - L c) e + b w - L v; infinite if that is not stable."""
    pole = a - gain * c
    return float(np.hypot(b, gain)) / abs(pole) if pole < 0.0 else np.inf


def few(x: float) -> float:
    return float(f"{x:.3g}")


@pytest.mark.parametrize("seed", [*range(40), 61, 91, 108, 208, 240, 249, 293, 344, 367, 379, 407, 418, 438, 504, 686])
def test_a_scalar_plant_gets_the_gamma_of_its_closed_form(seed: int) -> None:
    """Not less than is possible, not more than the back-off and the digits, and its gain keeps it; over ten decades each."""
    draw = np.random.default_rng(seed)
    a, b, c = (few(x * 10**k) for x, k in zip(draw.normal(size=3), draw.uniform(-5.0, 5.0, 3), strict=True))
    gains = design_observer(scalar(a, b, c), DESIGN)
    best = least_gamma(a, b, c)
    assert gains.verdict is Verdict.CERTIFIED
    assert best * (1.0 - 1e-6) <= gains.gamma <= best * (1.0 + BACKOFF) * (1.0 + 5e-3)
    assert gamma_of(float(gains.gain(np.zeros((1, 0)))[0, 0, 0]), a, b, c) <= gains.gamma * (1.0 + 1e-9)


@pytest.mark.parametrize("factor", [0.03, 0.19, 0.9, 1.0, 3.0])
@pytest.mark.parametrize(("a", "b", "c"), [(-0.5, 1.0, 2.48), (0.3, 2.0, 0.1)])
def test_a_first_solve_that_stalls_costs_time_and_no_truth(
    a: float, b: float, c: float, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever objective the stalled solve leaves behind, gamma is one that is certified, and near the least there is."""
    calls = []

    def stalling(problem: Any, settings: Any, memory: Any = None) -> LmiResult:
        found = solve(problem, settings, memory)
        calls.append(found)
        if len(calls) > 1:
            return found
        return replace(found, verdict=Verdict.INCONCLUSIVE, objective=found.objective * factor**2, message="stalled")  # type: ignore[operator]

    monkeypatch.setattr(three_solves, "solve", stalling)
    gains = design_observer(scalar(a, b, c), DESIGN)
    best = least_gamma(a, b, c)
    assert gains.verdict is Verdict.CERTIFIED
    assert best * (1.0 - 1e-6) <= gains.gamma <= best * (1.0 + BACKOFF) * 1.01
    assert gamma_of(float(gains.gain(np.zeros((1, 0)))[0, 0, 0]), a, b, c) <= gains.gamma * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("a", "b", "c"), [(-0.5, 1.0, 2.48), (0.0, 1.0, 1.0), (-1e3, 1e-2, 1e2), (0.3, 50.0, 1e-2), (-1e-4, 1.0, 1.0)]
)
@pytest.mark.parametrize("degree", [0, 1, 2])
def test_so_does_a_model_whose_parameter_says_nothing_about_the_error(
    a: float, b: float, c: float, degree: int
) -> None:
    """The parameter only drives an input: the same answer with P and X of any degree."""
    model = small_model([[exact(a)]], [[exact(c)]], (parameter(),), B=[[p]], E=[[exact(b), 0]], F=[[0, 1]])
    gains = design_observer(model, replace(DESIGN, degree=degree))
    best = least_gamma(a, b, c)
    assert best * (1.0 - 1e-6) <= gains.gamma <= best * (1.0 + BACKOFF) * (1.0 + 5e-3)


@pytest.mark.parametrize("seed", range(30))
def test_a_scalar_plant_sampled_gets_the_gamma_of_its_closed_form(seed: int) -> None:
    """e+ = f e + s w - K v, f = e^(aT) - K c: the largest gain over frequencies is hypot(s, K)/(1 - |f|), minimised over K."""
    draw = np.random.default_rng(seed)
    a, b, c = (few(x * 10**k) for x, k in zip(draw.normal(size=3), draw.uniform(-2.0, 2.0, 3), strict=True))
    T = few(min(0.9, 10 ** draw.uniform(-2.0, 0.0) / max(abs(a), abs(b * c))))
    coast = float(np.exp(a * T))
    s = (coast - 1.0) / a * b

    def size(K: float) -> float:
        f = abs(coast - K * c)
        return float(np.hypot(s, K)) / (1.0 - f) if f < 1.0 else np.inf

    # f >= 0 and f < 0 have one minimum each; a fine search finds them, K = 0 among its points if that is stable.
    kept = np.concatenate([np.linspace(-1.0, 1.0, 4001), coast - np.geomspace(1e-9, 1.0, 4000) * c * np.sign(c)])
    best = min((size((coast - f) / c) for f in kept[np.abs(kept) < 1.0]), default=np.inf)
    best = min(best, size(0.0))
    gains = design_sampled_observer(scalar(a, b, c), DESIGN, T)
    assert gains.gamma <= best * (1.0 + BACKOFF) * (1.0 + 5e-3)
    assert size(float(gains.gain(np.zeros((1, 0)))[0, 0, 0])) <= gains.gamma * (1.0 + 1e-9)


# ---- units ---------------------------------------------------------------------------------------------------------------


def mass_spring(size: float = 1.0, states: tuple[float, float] = (1.0, 1.0), time: float = 1.0) -> LpvModel:
    """Position and velocity; disturbances times `size`, states in other units, time counted in units of `time` seconds."""
    s = [exact(x) for x in states]
    A = sp.Matrix([[0, 1], [-p / 2, -sp.Rational(1, 2)]]) * exact(time)
    E = sp.Matrix([[0, 0], [sp.Rational(1, 2), 0]]) * exact(time) * exact(size)
    C, F = sp.Matrix([[1, 0]]), sp.Matrix([[0, 1]]) * exact(size)
    A = sp.Matrix(2, 2, lambda i, j: A[i, j] * s[i] / s[j])
    E = sp.Matrix(2, 2, lambda i, j: E[i, j] * s[i])
    return small_model(
        A, sp.Matrix(1, 2, lambda _, j: C[0, j] / s[j]), (parameter("p", 10.0, 40.0, 50.0 * time),), E=E, F=F
    )


def designed(kind: str, model: LpvModel, weights: float = 1.0, time: float = 1.0) -> float:
    """gamma with the disturbances in sizes (1, 0.2) times `weights`."""
    channel = Channel(("d1", "d2"), ("x1",), weights=(weights, 0.2 * weights))
    design = ObserverDesign((channel,), degree=1, decay_rate=2.0 * time, backoff=BACKOFF)
    if kind == "sampled":
        return design_sampled_observer(model, design, 0.01 / time).gamma
    return design_observer(model, replace(design, fastest_pole=40.0 * time)).gamma


@pytest.mark.parametrize(
    ("kind", "gamma", "size"),
    [
        *(("held", 0.2119, size) for size in (1e-6, 1e-3, 1e6)),
        *(("sampled", 0.2061, size) for size in (1e-6, 1e6)),
    ],
)
def test_units_of_disturbances_change_nothing(kind: str, gamma: float, size: float) -> None:
    """The size in the model or in the weights: gamma/size stays what it is within the digits of gamma and the back-off's tie."""
    assert designed(kind, mass_spring(size)) / size == pytest.approx(gamma, rel=1e-2)
    assert designed(kind, mass_spring(), weights=size) / size == pytest.approx(gamma, rel=1e-2)
    assert designed(kind, mass_spring(size), weights=1.0 / size) == pytest.approx(gamma, rel=1e-2)


@pytest.mark.parametrize(("kind", "gamma"), [("held", 0.2119), ("sampled", 0.2061)])
@pytest.mark.parametrize("states", [(1e3, 1e-3), (1e-4, 1e4), (1e5, 1e5)])
def test_units_of_states_change_nothing(kind: str, gamma: float, states: tuple[float, float]) -> None:
    assert designed(kind, mass_spring(states=states)) / states[0] == pytest.approx(gamma, rel=1e-2)


@cache
def in_seconds(kind: str) -> float:
    return designed(kind, mass_spring())


@pytest.mark.parametrize("kind", ["held", "sampled"])
@pytest.mark.parametrize("time", [1e-6, 1e3, 1e6])
def test_the_unit_of_time_changes_nothing(kind: str, time: float) -> None:
    """To three digits: a rate of the parameter that was off by such a factor would show."""
    assert designed(kind, mass_spring(time=time), time=time) == pytest.approx(in_seconds(kind), rel=2e-3)


@pytest.mark.parametrize("weights", [(1.0, 0.0), (np.nan, 1.0), (1.0, np.inf), (-1.0, 1.0)])
def test_sizes_of_disturbances_are_positive_numbers(weights: tuple[float, float]) -> None:
    design = ObserverDesign((Channel(("d1", "d2"), ("x1",), weights=weights),))
    for ask in (
        lambda: design_observer(mass_spring(), design),
        lambda: design_sampled_observer(mass_spring(), design, 0.01),
    ):
        with pytest.raises(ProblemError, match="give positive sizes"):
            ask()


# ---- detectability --------------------------------------------------------------------------------------------------------

HALF = sp.Rational(1, 2)
TURN = sp.Matrix([[1, 2], [0, 1]])
NOISY: dict[str, Any] = {"E": [[1, 0], [1, 0]], "F": [[0, 1]]}


def both(model: LpvModel) -> tuple[Any, Any]:
    return (lambda: design_observer(model, DESIGN)), (lambda: design_sampled_observer(model, DESIGN, 0.1))


@pytest.mark.parametrize(
    ("A", "C", "place"),
    [
        pytest.param(sp.diag(-1 + p / 10, HALF), [[1, 0]], "-1", id="everywhere"),
        pytest.param(sp.diag(-1 + p / 10, 0), [[1, 0]], "-1", id="an integrator, everywhere"),
        pytest.param(
            TURN * sp.diag(-1, HALF) * TURN.inv(), (sp.Matrix([[1, 0]]) * TURN.inv()) * (1 + p / 3), "-1", id="turned"
        ),
        pytest.param(sp.diag(-1, HALF), [[1, p]], "0", id="in the middle"),
        pytest.param(sp.diag(-1, HALF), [[1, p - 1]], "1", id="at an end"),
        pytest.param(sp.diag(-1, HALF), [[1, p - sp.Rational("0.37")]], "0.37", id="between the points of a grid"),
        pytest.param(sp.diag(-1, p - 1), [[1, 0]], "1", id="hidden everywhere, unstable at an end"),
    ],
)
def test_a_hidden_mode_that_does_not_decay_is_called_undetectable(A: Any, C: Any, place: str) -> None:
    model = small_model(A, C, (parameter(),), **NOISY)
    for design in both(model):
        with pytest.raises(ProblemError, match=rf"is undetectable at p = {place} 1: a mode that does not decay"):
            design()


@pytest.mark.parametrize(
    ("A", "C"),
    [
        pytest.param(sp.diag(1 + p / 10, -1), [[1, 0]], id="everywhere"),
        pytest.param(sp.diag(1, -HALF), [[1, p]], id="in the middle"),
        pytest.param(TURN * sp.diag(1, -1) * TURN.inv(), (sp.Matrix([[1, 0]]) * TURN.inv()) * (1 + p / 3), id="turned"),
        pytest.param(sp.Matrix([[0, 1], [0, 0]]), [[1 + p / 2, 0]], id="nothing is hidden"),
    ],
)
def test_a_hidden_mode_that_decays_is_no_obstacle(A: Any, C: Any) -> None:
    model = small_model(A, C, (parameter(),), **NOISY)
    for design in both(model):
        gains: ObserverGains = design()
        assert gains.verdict is Verdict.CERTIFIED


def test_a_hidden_mode_where_the_zero_is_no_rational_number_is_refused_all_the_same() -> None:
    """C = [1, p^2 - 1/2] hides the mode at +-sqrt(1/2), where nothing exact is at hand: no gains, and no claim of a reason."""
    model = small_model(sp.diag(-1, HALF), [[1, p**2 - HALF]], (parameter(),), **NOISY)
    for design in both(model):
        with pytest.raises(ProblemError, match="not certified"):
            design()
