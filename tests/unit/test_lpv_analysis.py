"""Given LPV systems: bounds against closed forms, simulation and negative controls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from flint import fmpq
from scipy.integrate import solve_ivp
from scipy.linalg import solve_discrete_lyapunov

from analysis.errors import AnalysisError
from analysis.lpv import proved_step
from analysis.lpv.h2_path import h2_of, proved_along
from analysis.lpv.lifted import lift, worst_input
from analysis.lpv.norms import lpv_decay_rate, lpv_h2_norm, lpv_l2_gain
from analysis.lpv.proved_path import ProvedPath
from analysis.lpv.proved_step import Line
from analysis.lpv.question import ask
from analysis.lpv.trajectory import Path, admissible, check_admissible
from analysis.norms.h2 import h2_norm
from synthesis.certificate.verify import Verifier
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")


def delta(rate: float) -> LpvModel:
    """Peni and Seiler's delta/(s+1) - 1/(s+1) delta."""
    return small_model([[-1, 0], [0, -1]], [[p, -1]], [parameter(rate=rate)], E=[[1], [p]])


def spring(rate: float, low: float = 0.0, high: float = 3.0) -> LpvModel:
    return small_model([[0, 1], [-2 - p, -1]], [[1, 0]], [parameter("p", low, high, rate)], E=[[0], [1]])


@pytest.mark.parametrize("rate", [0.0, 0.3, np.inf])
def test_a_scalar_gain_is_that_of_the_worst_place_at_any_rate(rate: float) -> None:
    """x' = -(2 + p) x + w: |x|_2 <= |w|_2/(2 + min p), whatever p does; the proof beside it is refused below that."""
    model = small_model([[-2 - p]], [[1]], [parameter(rate=rate)], E=[[3]])
    found = lpv_l2_gain(model, degree=0)
    assert found.lower <= 3.0 * (1 + 1e-12) and found.lower == pytest.approx(3.0, rel=1e-6)
    assert 3.0 <= found.upper < 3.0 * 1.002
    assert found.below(3.1) is Verdict.CERTIFIED and found.below(2.9) is Verdict.REFUTED
    assert found.claim is not None
    question = ask(model)
    verifier = Verifier(question.loop, question.names)
    assert verifier.prove(found.claim).proved
    assert not verifier.prove(replace(found.claim, level=2.99)).proved


def test_discrete_bounds_are_those_of_closed_forms() -> None:
    """x+ = 0.9 p x + w, |p| <= 1: gain 10 and decay -log 0.9; two modes that grow together are found as a product."""
    model = small_model([[0.9 * p]], [[1]], [parameter(rate=np.inf)], E=[[1]])
    gain, decay = lpv_l2_gain(model, discrete=True), lpv_decay_rate(model, discrete=True)
    assert gain.lower == pytest.approx(10.0, rel=1e-6) and 10.0 <= gain.upper < 10.02
    assert decay.lower <= -np.log(0.9) <= decay.upper * (1 + 1e-9)
    assert decay.gap < 0.01
    assert decay.unit == "1/sample"
    modes = sp.Matrix([[0.6, 1], [0, 0.6]]), sp.Matrix([[0.6, 0], [1, 0.6]])  # alone 0.6, A1 A2 has radius 2.1
    pair = small_model(modes[0] * (1 + p) / 2 + modes[1] * (1 - p) / 2, [[1, 0]], [parameter(rate=np.inf)])
    assert lpv_decay_rate(pair, discrete=True).upper == 0.0
    slow = replace(pair, parameters=(parameter(rate=0.0),))
    assert lpv_decay_rate(slow, discrete=True).upper == 0.0  # at p = 0, too: eigenvalue 1.1


def test_jumps_between_samples_may_use_a_lyapunov_function_of_the_parameter() -> None:
    """0.8 times A1, A2 of the ROLMIP manual, section 7.1: a constant P proves less than P(p), none more than a product."""
    modes = sp.Matrix([[0.1, 0.9], [0, 0.1]]), sp.Matrix([[0.5, 0], [1, 0.5]])
    A = sp.Rational(4, 5) * (modes[0] * (1 + p) / 2 + modes[1] * (1 - p) / 2)
    model = small_model(A, [[1, 0]], [parameter(rate=np.inf)])
    loose, *tight = (lpv_decay_rate(model, degree=k, discrete=True) for k in (0, 1, 3))
    for found in tight:
        assert 1.4 * loose.lower < found.lower <= found.upper
        assert found.gap < 0.1
    standing = lpv_decay_rate(replace(model, parameters=(parameter(rate=0.0),)), degree=3, discrete=True)
    assert standing.lower > 1.5 * loose.upper and standing.claim is not None
    question = ask(model, discrete=True)  # what is proved of a constant parameter must not be proved of one that jumps
    assert not Verifier(question.loop, question.names).prove(replace(standing.claim, level=1.01 * loose.upper)).proved


def test_h2_norms_without_parameters_are_those_of_matrices() -> None:
    A, B, C = [[-1.0, 2.0], [-3.0, -4.0]], [[1.0], [0.5]], [[1.0, 1.0]]
    model = small_model(A, C, [parameter(rate=0.0)], E=sp.Matrix(B) + sp.Matrix([[0], [p * 1e-9]]))
    expected = float(h2_norm(np.array(A), np.array(B), np.array(C)))
    for generalised in (False, True):  # one output: the two agree
        found = lpv_h2_norm(model, degree=0, generalised=generalised)
        assert found.lower == pytest.approx(expected, rel=1e-6)
        assert expected <= found.upper * (1 + 1e-7) and found.upper < expected * 1.02


def test_h2_norms_of_moving_parameters() -> None:
    """x' = -(2 + p) x + w: energy of the impulse answer 1/(2 (2 + p)) while p stands still, and no more than 1/2 ever."""
    model = small_model([[-2 - p]], [[1]], [parameter(rate=1.0)], E=[[1]])
    found = lpv_h2_norm(model, degree=2)
    assert found.lower == pytest.approx(np.sqrt(0.5), rel=1e-6) and found.lower <= np.sqrt(0.5)
    assert np.sqrt(0.5) <= found.upper < 1.02 * np.sqrt(0.5)
    assert found.claim is not None
    question = ask(model)
    assert not Verifier(question.loop, question.names).prove(replace(found.claim, level=0.7)).proved
    direct = small_model([[-2 - p]], [[1]], [parameter(rate=1.0)], E=[[1]], F=[[1]])
    with pytest.raises(AnalysisError, match="infinite"):
        lpv_h2_norm(direct)


@pytest.mark.parametrize("generalised", [False, True])
def test_h2_norms_along_a_path(generalised: bool) -> None:
    """A discrete path of two places against Lyapunov equations; the bounds of a family that has room for both."""
    A = [[[0.1, 0.9], [0.0, 0.1]], [[0.5, 0.0], [1.0, 0.5]]]
    model = small_model(
        sp.Matrix(A[1]) * (1 + p) / 2 + sp.Matrix(A[0]) * (1 - p) / 2,
        [[1, 0]],
        [parameter(rate=np.inf)],
        E=[[0], [1 + p / 2]],
        F=[[p]],
    )
    question = ask(model, discrete=True)
    path = Path(np.array([[-1.0], [1.0]]), np.ones(2), (True,))
    first, second = ((np.array(a), np.array([[0.0], [b]])) for a, b in zip(A, (0.5, 1.5), strict=True))
    C, values = np.array([[1.0, 0.0]]), []
    for (here, B), (there, other) in ((first, second), (second, first)):
        if generalised:  # all inputs of the past that end where `here` begins
            X = solve_discrete_lyapunov(there @ here, there @ B @ B.T @ there.T + other @ other.T)
            values.append((C @ X @ C.T)[0, 0] + 1.0)
        else:  # an impulse at `here`
            W = solve_discrete_lyapunov((here @ there).T, C.T @ C + there.T @ C.T @ C @ there)
            values.append((B.T @ W @ B)[0, 0] + 1.0)
    proved = proved_along(question, path, generalised)
    assert proved == pytest.approx(np.sqrt(max(values)), rel=1e-9)
    assert h2_of(question, generalised)(path, 0.0) == pytest.approx(max(values), rel=1e-9)
    slower = small_model(sp.Matrix(model.A) * sp.Rational(4, 5), model.C, model.parameters, E=model.E, F=model.F)
    found = lpv_h2_norm(slower, degree=2, discrete=True, generalised=generalised)
    assert found.lower <= found.upper < 1.6 * found.lower


def test_the_ratio_of_a_path_is_what_a_simulation_gives() -> None:
    """An independent integrator (Runge-Kutta of order 8) with the same input over 12 periods, the last one compared."""
    question = ask(delta(2.0))
    knots = np.array([-1.0, -0.5, 0.0, 0.5, 1.0, 0.5, 0.0, -0.5])[:, None]
    path = admissible(knots, np.full(8, 0.5), question.axes)
    lifted = lift(question, path, 0.0, 4)
    assert lifted is not None
    value, v = worst_input(lifted)
    v = v.real / np.abs(v).max()  # any input is a lower bound; this one is real
    proved = ProvedPath(question, path, 0.0, 4).ratio(v.astype(complex))
    assert proved <= value * (1 + 1e-12)
    period, length = path.period, path.period / len(v)

    def at(t: float) -> float:
        return float(np.interp(t % period, np.arange(9) * 0.5, [*path.knots[:, 0], path.knots[0, 0]]))

    state, energy = np.zeros(2), 0.0
    for number in range(12 * len(v)):
        w, start = float(v[number % len(v), 0]), number * length

        def flow(t: float, x: np.ndarray, w: float = w) -> list[float]:
            d = at(t)
            return [-x[0] + w, -x[1] + d * w, (d * x[0] - x[1]) ** 2]

        inside = (start + 1e-12, start + length - 1e-12)
        end = solve_ivp(flow, inside, [*state, 0.0], method="DOP853", rtol=1e-9, atol=1e-12).y[:, -1]
        state = end[:2]
        energy += float(end[2]) if number >= 11 * len(v) else 0.0
    assert proved == pytest.approx(np.sqrt(energy / (length * float((v**2).sum()))), rel=1e-6)


def test_rational_models_are_enclosed_along_a_path() -> None:
    """The same path with p in a denominator, and written as a polynomial in another parameter where it stands still."""
    rational = small_model([[0, 1], [-4 / (3 + p), -0.4]], [[1, 0]], [parameter(rate=1.0)], E=[[0], [1 / (3 + p)]])
    question = ask(rational)
    path = admissible(np.sin(np.arange(8) * np.pi / 4)[:, None], np.ones(8), question.axes)
    lifted = lift(question, path, 0.3, 4)
    assert lifted is not None
    value, v = worst_input(lifted)
    assert ProvedPath(question, path, 0.3, 4).ratio(v) == pytest.approx(value, rel=1e-6)
    gain = lpv_l2_gain(replace(rational, parameters=(parameter(rate=0.0),)), degree=2)
    assert 1.0 < gain.upper / gain.lower < 1.05


@pytest.mark.parametrize(("denominator", "name", "terms"), [(1, "TERMS", 4), (3 + p, "TERMS", 4), (3 + p, "BELOW", 2)])
def test_short_series_are_enclosed(
    monkeypatch: pytest.MonkeyPatch, denominator: sp.Expr, name: str, terms: int
) -> None:
    """With few terms of the series, or of that of 1/d, the balls are wide and hold what 24 and 16 terms give."""
    A = [[sp.Rational(-1, 2), 1 / denominator], [-3 / denominator, -1]]
    question = ask(small_model(A, [[1 / denominator, p]], [parameter()], E=[[0], [1 / denominator]]))
    line = Line(question, [fmpq(-1, 5)], [fmpq(2, 5)], fmpq(1, 4), 0.7, fmpq(1))
    exact = line.step()
    monkeypatch.setattr(proved_step, name, terms)
    short = line.step()
    assert exact is not None and short is not None
    for wide, narrow in ((short.step, exact.step), (short.energy, exact.energy)):
        for ball, inner in zip(wide.entries(), narrow.entries(), strict=True):
            assert ball.contains(inner)
    assert 1e-9 < max(float(x.real.rad()) for x in short.step.entries()[:2]) < 0.5


def test_outputs_over_a_denominator_are_enclosed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A state that stands still, seen through 1/(3 + p): all that is uncertain is 1/d."""
    line = Line(
        ask(small_model([[0]], [[1 / (3 + p)]], [parameter()], E=[[0]])), [fmpq(-1)], [fmpq(1)], fmpq(1), 0.0, fmpq(1)
    )
    monkeypatch.setattr(proved_step, "BELOW", 4)
    short = line.step()
    assert short is not None
    ball = short.energy[0, 0].real  # the integral of 1/(2 + s)^2 over s in [0, 1]
    assert ball.contains(fmpq(1, 6)) and 1e-6 < float(ball.rad()) < 10.0


def test_growth_along_a_path_is_refused_a_little_above() -> None:
    """A frozen pole pair at -0.2 +- 2i: no faster than 0.2001 is certain, no faster than 0.1999 is not claimed."""
    question = ask(small_model([[0, 1], [-4.04, -0.4 + 0 * p]], [[p, 0]], [parameter(rate=0.0)], E=[[0], [1]]))
    proved = ProvedPath(question, Path(np.zeros((1, 1)), np.ones(1), (False,)), 0.0, 1)
    assert proved.decays_no_faster(0.2001)
    assert not proved.decays_no_faster(0.1999)


def test_paths_that_break_a_bound_bound_nothing() -> None:
    question = ask(delta(1.0))
    fast = Path(np.array([[-1.0], [1.0]]), np.array([1.0, 1.0]), (False,))
    with pytest.raises(AnalysisError, match="rate bound"):
        ProvedPath(question, fast, 0.0, 1).ratio(np.ones((2, 1), complex))
    outside = Path(np.array([[1.5]]), np.ones(1), (False,))
    with pytest.raises(AnalysisError, match="leaves the range"):
        ProvedPath(question, outside, 0.0, 1).decays_no_faster(1.0)
    check_admissible(admissible(np.array([[-1.0], [1.0]]), np.array([1.0, 1.0]), question.axes), question.axes)


def test_units_of_states_and_inputs_do_not_matter() -> None:
    """The spring with a position in 1e-4 m and an input of size 100."""
    model = spring(0.0)
    T = sp.diag(10000, 1)
    scaled = small_model(T * sp.Matrix(model.A) * T.inv(), sp.Matrix(model.C) * T.inv(), model.parameters, E=[[0], [1]])
    plain, other = lpv_l2_gain(model, degree=2), lpv_l2_gain(scaled, {"d1": 100.0}, degree=2)
    assert other.lower == pytest.approx(100.0 * plain.lower, rel=1e-9)
    assert other.upper == pytest.approx(100.0 * plain.upper, rel=2e-2)


def test_bad_questions_are_refused() -> None:
    with pytest.raises(AnalysisError, match="unknown input 'd2'"):
        lpv_l2_gain(spring(1.0), ["d2"])
    with pytest.raises(AnalysisError, match="unknown output"):
        lpv_l2_gain(spring(1.0), outputs=["z"])
    with pytest.raises(AnalysisError, match="neither inputs nor disturbances"):
        lpv_l2_gain(small_model([[-2 - p]], [[1]], [parameter()]))
    with pytest.raises(AnalysisError, match="degree"):
        lpv_l2_gain(spring(1.0), degree=(1, 1))
    with pytest.raises(AnalysisError, match="LpvModel"):
        lpv_l2_gain(np.eye(2))  # type: ignore[arg-type]
    with pytest.raises(AnalysisError, match="not a truth value"):
        lpv_decay_rate(spring(1.0), discrete="continuous")  # type: ignore[arg-type]


def test_an_unstable_place_makes_the_gain_infinite() -> None:
    found = lpv_l2_gain(small_model([[p - sp.Rational(9, 10)]], [[1]], [parameter(rate=0.1)], E=[[1]]))
    assert found.lower == np.inf and found.below(1e9) is Verdict.REFUTED
    assert found.witness is not None and found.witness.start[0, 0] > 0.9
    decay = lpv_decay_rate(small_model([[p - sp.Rational(9, 10)]], [[1]], [parameter(rate=0.1)]))
    assert decay.upper == 0.0 and decay.above(1e-9) is Verdict.REFUTED
