"""Exchange, Bernstein coefficients and the interior-point method, against grids, exact relaxations and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer, observer_problem, timed_scale
from synthesis.lmi import exchange as exchanges
from synthesis.lmi.clarabel_backend import solve_with_clarabel
from synthesis.lmi.conic import assemble
from synthesis.lmi.exchange import exchange, families_of
from synthesis.lmi.interior import solve_with_interior
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import relax, relaxation_of
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import corner, lyapunov_problem, parameter, small_model

p, q = sp.symbols("p q")
DESIGN = ObserverDesign(
    (Channel(("d1", "d2"), ("x1", "x2")),), degree=1, decay_rate=0.05, fastest_pole=60.0, backoff=0.0
)


def two_parameters(rate: float = 2.0) -> LpvModel:
    """A damped spring whose stiffness and damping move."""
    return small_model(
        [[0, 1], [-10 - 2 * p, -(sp.Rational(1, 2) + q / 5)]], [[1, 0]],
        (parameter("p", rate=rate), parameter("q", rate=rate)), E=[[0, 0], [1, 0]], F=[[0, sp.Rational(1, 10)]],
    )  # fmt: skip


def blocks_of(problem: LmiProblem, settings: LmiSettings) -> list[np.ndarray]:
    found = []
    for part in relax(problem, settings).sampled:
        values = part.values.copy()
        values[..., 0] -= part.margin * np.eye(values.shape[1])
        found.append(values)
    return found


@pytest.mark.parametrize("gamma", [None, 0.5])
def test_the_interior_point_method_and_clarabel_agree(gamma: float | None) -> None:
    """Two methods without a common line; both bounds are below both optima."""
    model, settings = two_parameters(), LmiSettings(relaxation="grid", points=3)
    scale, clock = timed_scale(model, DESIGN)
    problem = observer_problem(model, DESIGN, scale, gamma, clock=clock)
    ours = solve_with_interior(blocks_of(problem, settings), problem.cost, problem.weights, 1e-8)
    theirs = solve_with_clarabel(assemble(relax(problem, settings)), problem.decisions, settings)
    value = float(problem.cost @ theirs.decisions)
    assert float(problem.cost @ ours.decisions) == pytest.approx(value, rel=1e-5, abs=1e-9)
    assert ours.dual_bound <= value + 1e-9
    assert ours.dual_bound == pytest.approx(value, rel=1e-4)


def test_least_norms_agree_too() -> None:
    model, settings = two_parameters(), LmiSettings(relaxation="grid", points=3)
    scale, clock = timed_scale(model, DESIGN)
    problem = observer_problem(model, DESIGN, scale, 0.6, False, 1e-4, clock)
    ours = solve_with_interior(blocks_of(problem, settings), problem.cost, problem.weights, 1e-8)
    theirs = solve_with_clarabel(assemble(relax(problem, settings)), problem.decisions, settings)
    np.testing.assert_allclose(problem.weights @ ours.decisions**2, problem.weights @ theirs.decisions**2, rtol=1e-5)


def test_an_infeasible_problem_comes_with_evidence_and_a_feasible_one_without() -> None:
    """A = diag(a, -1): no P for a >= 0, the margin of the stable one is positive."""
    for a, possible in ((0.3, False), (-0.3, True)):
        problem = lyapunov_problem((), np.diag([a, -1.0]))
        feasible = LmiProblem(())
        P = feasible.symmetric("P", 2)
        A = feasible.constant(np.diag([a, -1.0]))
        feasible.require("P > 1", P - feasible.constant(np.eye(2)))
        feasible.require("decay", -(P @ A + A.T @ P))
        found = solve_with_interior(
            blocks_of(feasible, LmiSettings(relaxation="grid")), feasible.cost, feasible.weights, 1e-6
        )
        assert found.infeasible is not possible
        assert (found.excluded > 1e6) is not possible
        verdict = solve(feasible, LmiSettings(relaxation="exchange")).verdict
        assert verdict is (Verdict.CERTIFIED if possible else Verdict.REFUTED)
        assert (solve(problem, LmiSettings(relaxation="exchange")).verdict is Verdict.CERTIFIED) is possible


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_exchange_finds_the_optimum_of_the_exact_relaxation(degree: int) -> None:
    """The reference problem of the papers, 1.0441868 for degrees 1 to 3, from a handful of places."""
    model, _ = corner("corner-estimation", "longitudinal", 140.0)
    channel = Channel(
        ("friction", "acceleration_error", "force_noise"),
        ("bristle_deflection", "relative_velocity"),
        weights=(1.0, 1.0, 0.5),
    )
    design = ObserverDesign((channel,), degree=degree, backoff=0.0)
    exact = design_observer(model, design)
    found = design_observer(model, replace(design, settings=LmiSettings(relaxation="exchange")))
    assert found.verdict is Verdict.CERTIFIED
    assert found.gamma == pytest.approx(exact.gamma, rel=1e-4)
    assert found.gamma_lower is not None and found.gamma_lower <= exact.gamma * (1 + 1e-6)


def test_two_parameters_exchange_against_a_dense_grid_with_clarabel() -> None:
    model = two_parameters()
    grid = LmiSettings(relaxation="grid", points=9)
    scale, clock = timed_scale(model, DESIGN)
    problem = observer_problem(model, DESIGN, scale, clock=clock)
    dense, few = solve(problem, replace(grid, verify=False)), solve(problem, LmiSettings())
    assert few.report.relaxation == "exchange" == relaxation_of(problem, LmiSettings())
    assert few.verdict is Verdict.CERTIFIED
    assert few.objective is not None and dense.objective is not None
    assert few.objective == pytest.approx(dense.objective, rel=1e-4)
    families = families_of(problem)
    exchange(problem, families, LmiSettings())
    assert sum(len(family.active) for family in families) < 0.2 * sum(len(family.places) for family in families)


def test_the_place_where_a_proof_fails_joins_the_places_that_are_solved_for() -> None:
    """1 + x ((u - 1/3)^2 - 1/4) > 0 and x largest: looked at on nine places only, proved on the continuum: x = 4."""
    problem = LmiProblem((parameter(),))
    x = problem.scalar("x")
    bump = problem.known(np.array([1.0 / 9.0 - 0.25, -2.0 / 3.0, 1.0]).reshape(3, 1, 1))
    problem.require("bump", problem.constant(np.eye(1)) + bump.scaled_by(x))
    problem.maximise("x")
    found = solve(problem, LmiSettings(relaxation="exchange"))
    assert found.verdict is Verdict.CERTIFIED
    assert found.objective == pytest.approx(4.0, rel=1e-4)
    assert found.objective is not None and found.objective < 4.0


@pytest.mark.parametrize("cells", [1, 4])
def test_bernstein_coefficients_only_suffice(cells: int) -> None:
    """Never below the true optimum, nearer with more cells, and certified without any look at the continuum."""
    model = two_parameters()
    scale, clock = timed_scale(model, DESIGN)
    problem = observer_problem(model, DESIGN, scale, clock=clock)
    true = solve(problem, LmiSettings()).objective
    found = solve(problem, LmiSettings(relaxation="bernstein", cells=cells))
    assert found.verdict is Verdict.CERTIFIED
    assert found.lower_bound is None  # it bounds nothing from below
    assert true is not None and found.objective is not None
    assert true * (1.0 - 1e-5) <= found.objective <= true * (1.1 if cells == 1 else 1.01)


def test_what_no_lyapunov_function_proves_is_certified_by_no_relaxation() -> None:
    """x' = [[-1, 9(1+p)], [-9(1-p), -1]] x with a parameter that jumps: switching makes it grow."""
    A = np.array([[[-1.0, 9.0], [-9.0, -1.0]], [[0.0, 9.0], [9.0, 0.0]]])[:, None]
    for relaxation in ("exchange", "bernstein"):
        problem = lyapunov_problem((parameter("p", rate=np.inf), parameter("q", rate=np.inf)), A, 0)
        assert solve(problem, LmiSettings(relaxation=relaxation)).verdict is not Verdict.CERTIFIED


def test_rates_decide_with_two_parameters_as_with_one() -> None:
    slow, fast = (design_observer(two_parameters(rate), DESIGN).gamma for rate in (0.0, 50.0))
    jumping = design_observer(two_parameters(np.inf), DESIGN)  # P without the parameters, the gains with them
    constant = design_observer(two_parameters(np.inf), replace(DESIGN, degree=0))
    assert slow < fast <= jumping.gamma * (1.0 + 1e-4)
    assert jumping.gamma <= constant.gamma * (1.0 + 1e-4)
    assert jumping.result.values["P"].degrees == (0, 0, 0, 0)
    assert max(jumping.result.values["X"].degrees) == 1


def test_places_are_looked_at_in_pieces_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    model = two_parameters()
    scale, clock = timed_scale(model, DESIGN)
    families = families_of(problem := observer_problem(model, DESIGN, scale, clock=clock))
    decisions = np.random.default_rng(0).standard_normal(problem.decisions)
    at_once = [family.least(decisions) for family in families]
    monkeypatch.setattr(exchanges, "AT_ONCE", 3)
    assert max(len(family.places) for family in families) > 3
    for family, wanted in zip(families, at_once, strict=True):
        np.testing.assert_allclose(family.least(decisions), wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max())
