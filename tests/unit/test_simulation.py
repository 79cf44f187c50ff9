"""Simulation against closed forms: matrix exponentials, integrals of scalars, dense operators, exact rationals."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from analysis import AnalysisError, ContinuousLoop, NonlinearPlant, random_trajectories, simulate
from analysis.simulation.closed_loop import closed_loop
from analysis.simulation.error_update import error_update
from analysis.simulation.flow import moving, phi_times
from analysis.simulation.plants import matrices_of
from analysis.simulation.trajectories import FAMILIES
from estimators.faults import Flag
from estimators.schedule import GainSchedule
from synthesis import LpvModel, NonlinearModel, SchedulingParameter, Signal
from tests.support.any_size import any_schedule

P, X = sp.Symbol("p"), sp.Symbol("x")


def scalar(rate: float = 3.0) -> LpvModel:
    """x' = -p x + d."""
    return LpvModel(
        name="scalar", source="closed form", states=(Signal("x", "1"),), outputs=(Signal("y", "1"),),
        parameters=(SchedulingParameter("p", "1", 1.0, 2.0, -rate, rate),), disturbances=(Signal("d", "1"),),
        A=sp.Matrix([[-P]]), C=sp.Matrix([[1]]), E=sp.Matrix([[1]]),
    )  # fmt: skip


def broken(path: np.ndarray, rates: tuple[float, float], period: float, ends: tuple[float, float]) -> bool:
    """Whether a trajectory (n,) leaves its box, in exact rationals of its floats."""
    exact = [Fraction(float(v)) for v in path]
    low, high = (Fraction(repr(r)) * Fraction(repr(period)) for r in rates)
    steps = [b - a for a, b in pairwise(exact)]
    return not all(ends[0] <= v <= ends[1] for v in exact) or not all(low <= s <= high for s in steps)


@pytest.mark.parametrize("family", FAMILIES)
def test_random_trajectories_are_admissible_to_the_last_bit(family: str) -> None:
    period = 0.003
    paths = random_trajectories(scalar(), 60, 8, period, seed=1, families=[family])[..., 0]
    assert not any(broken(path, (-3.0, 3.0), period, (1.0, 2.0)) for path in paths)
    assert np.ptp(paths, axis=1).max() > 0.15  # they move
    assert (random_trajectories(scalar(), 60, 8, period, seed=1, families=[family])[..., 0] == paths).all()
    fastest = paths[np.abs(np.diff(paths)).max(axis=1).argmax()]
    if family == "bang-bang":  # at its bounds: a rate bound a little lower is broken
        assert broken(fastest, (-2.999999, 2.999999), period, (1.0, 2.0))


def test_what_may_jump_jumps_and_what_stands_still_does_not() -> None:
    jumps = random_trajectories(scalar(np.inf), 50, 6, 0.01)
    assert np.abs(np.diff(jumps, axis=1)).max() == 1.0
    assert np.ptp(random_trajectories(scalar(0.0), 50, 6, 0.01), axis=1).max() == 0.0
    for wrong, words in (({"families": ["saw"]}, "saw"), ({"runs": 0}, "runs"), ({"sample_time": None}, "sample_time")):
        with pytest.raises(AnalysisError, match=words):
            random_trajectories(scalar(), **({"samples": 5, "runs": 2, "sample_time": 0.1} | wrong))  # type: ignore[arg-type]


def test_a_constant_parameter_gives_the_matrix_exponential() -> None:
    rng = np.random.default_rng(0)
    M, R = rng.normal(size=(5, 3, 3)) * 4.0, rng.normal(size=(5, 3, 2))
    for m, r, found in zip(M, R, phi_times(M, R), strict=True):
        block = expm(np.block([[m, r], [np.zeros((2, 5))]]))[:3, 3:]
        assert found == pytest.approx(block, rel=1e-11, abs=1e-11)
    path = np.full((2, 11, 1), 1.5)
    run = simulate(scalar(), None, path, sample_time=0.2, start=[[1.0], [0.0]], disturbances={"d": np.ones((2, 10))})
    decay = np.exp(-1.5 * run.time)
    assert run.of("x")[0] == pytest.approx(decay + (1.0 - decay) / 1.5, rel=1e-13)
    assert run.of("x")[1] == pytest.approx((1.0 - decay) / 1.5, rel=1e-12, abs=1e-15)


def test_a_moving_scalar_gives_the_integral() -> None:
    """x = exp(-int p dt): two Gauss points integrate a straight line exactly. Held over a sample it is another number."""
    path = np.array([1.0, 1.6, 1.1, 2.0, 1.9])[None, :, None]
    run = simulate(scalar(), None, path, sample_time=0.5, start=1.0, between="moving")
    middle = 0.5 * (path[0, 1:, 0] + path[0, :-1, 0])
    assert run.of("x")[0, 1:] == pytest.approx(np.exp(-0.5 * np.cumsum(middle)), rel=1e-14)
    held = simulate(scalar(), None, path, sample_time=0.5, start=1.0)
    assert held.of("x")[0, 1:] == pytest.approx(np.exp(-0.5 * np.cumsum(path[0, :-1, 0])), rel=1e-14)


def test_matrices_that_do_not_commute_are_integrated_with_order_four() -> None:
    A, B = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([[1.0, 0.0], [0.5, -1.0]])
    rates = lambda p: (A + p[..., None] * B, np.tile([[0.0, 1.0]], (len(p), 1)))  # noqa: E731
    ends = np.array([[-1.0]]), np.array([[2.0]])
    flow = lambda t, x: (A + (-1.0 + 3.0 * t) * B) @ x + [0.0, 1.0]  # noqa: E731
    exact = solve_ivp(flow, (0.0, 1.0), [1.0, 0.5], rtol=1e-11, atol=1e-12).y[:, -1]
    x = np.array([[1.0, 0.5]])
    errors = [np.abs(moving(rates, x, *ends, 1.0, parts)[0] - exact).max() for parts in (4, 8)]
    assert 12.0 < errors[0] / errors[1] < 20.0


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_the_runtime_follows_the_error_recursion(update: str) -> None:
    """Two ways: plant beside runtime, and the recursion of the error with the plant's motion as an input."""
    schedule = any_schedule(update=update, table=0.3 * any_schedule().table)
    paths = random_trajectories(schedule, 40, 5, seed=3)
    given = {schedule.disturbances[0].name: np.random.default_rng(1).normal(size=(5, 40))}
    run = simulate(schedule, schedule, paths, disturbances=given, start=0.5, estimate=-0.2)
    A, B = error_update(schedule, paths[:, :-1].reshape(-1, 2))
    plant = schedule.plant_at(paths[:, :-1])
    E = schedule.plant["E"].at(paths[:, :-1])
    motion = (plant.A @ run.state[:, :-1, :, None] + E @ run.disturbance[..., None])[..., 0]
    e = run.error[:, 0]
    for k in range(40):
        at = np.arange(5) * 40 + k
        driven = B["disturbances"][at] @ run.disturbance[:, k, :, None] + B["motion"][at] @ motion[:, k, :, None]
        e = (A[at] @ e[..., None] + driven)[..., 0]
        assert e == pytest.approx(run.error[:, k + 1], rel=1e-9, abs=1e-12)
    assert not (run.flags[:, 1:]).any()


@pytest.mark.parametrize(("measured", "order"), [("states", 0), ("outputs", 2)])
def test_the_runtime_of_a_feedback_law_follows_the_closed_loop(measured: str, order: int) -> None:
    """The plant's inputs act on its outputs at once: the runtime accounts for the command that was held while it measured."""
    rng = np.random.default_rng(2)
    table = 0.2 * rng.normal(size=(3, 3, order + 2, order + (3 if measured == "states" else 2)))
    if order:
        table[..., order:, order:] = 0.0
    law: dict[str, Any] = {"update": "feedback", "measured": measured, "order": order, "table": table}
    schedule = any_schedule(limits=(None, None), **law)
    paths = random_trajectories(schedule, 30, 4, seed=3)
    run = simulate(schedule, schedule, paths, disturbances={"d0": 0.7}, start=0.5)
    flat = paths[:, :-1].reshape(-1, 2)
    loop = closed_loop(
        matrices_of(schedule, flat), schedule.gain(flat), measured == "states", order, schedule.sample_time
    )
    state = np.concatenate([run.state[:, 0], np.zeros((4, order))], axis=1)
    for k in range(30):
        at = np.arange(4) * 30 + k
        d = run.disturbance[:, k, :, None]
        shown = (loop.C[at] @ state[..., None] + loop.D[at] @ d)[..., 0]
        assert shown[:, -2:] == pytest.approx(run.input[:, k], rel=1e-9, abs=1e-12)
        assert shown[:, 3:5] == pytest.approx(run.measurement[:, k], rel=1e-9, abs=1e-12)
        state = (loop.A[at] @ state[..., None] + loop.B[at] @ d)[..., 0]
        assert state[:, :3] == pytest.approx(run.state[:, k + 1], rel=1e-9, abs=1e-12)
    with pytest.raises(AnalysisError, match="nothing was estimated"):
        _ = run.error


def test_lost_measurements_are_flagged_and_the_law_closes_the_loop() -> None:
    schedule = GainSchedule.shipped("corner-estimation-longitudinal")
    paths = random_trajectories(schedule, 30, 4)
    inputs = {"relative_acceleration": 1.0}
    one, other = (
        simulate(schedule, schedule, paths, inputs=inputs, observer=kind) for kind in ("any size", "velocity")
    )  # type: ignore[arg-type]
    assert one.estimate == pytest.approx(other.estimate, rel=1e-9, abs=1e-13)
    lost = simulate(schedule, schedule, paths, drops=1.0)
    assert ((lost.flags & int(Flag.MISSING_MEASUREMENT)) > 0).all()
    fed = simulate(schedule, schedule, paths, inputs=lambda k, x, guess, p: -2.0 * guess[:, 1:], start=0.1)
    assert fed.of("relative_acceleration") == pytest.approx(-2.0 * fed.estimate[:, :-1, 1])  # type: ignore[index]
    for wrong, words in (
        ({"disturbances": {"frction": 1.0}}, "friction"), ({"inputs": {"relative_acceleration": np.ones(7)}}, "runs, samples"),
        ({"sample_time": 0.1}, "leave it out"), ({"parameters": paths + 1e3}, "is outside"), ({"start": np.nan}, "not finite"),
    ):  # fmt: skip
        with pytest.raises(AnalysisError, match=words):
            simulate(**({"plant": schedule, "schedule": schedule, "parameters": paths} | wrong))  # type: ignore[arg-type]


def test_a_continuous_law_has_the_error_of_the_error_equation() -> None:
    """At a constant parameter e(t) = e^((A - LC) t) e(0) + the integral of constant d; the input has no part in it."""
    schedule = any_schedule(parameters=1)
    path = np.full((1, 31, 1), 0.9)
    given: dict[str, Any] = {
        "disturbances": {"d0": np.ones(30)},
        "inputs": {"i0": 2.0, "i1": -1.0},
        "start": np.arange(6.0),
    }
    run = simulate(ContinuousLoop(schedule), None, path, **given)
    plant, L = schedule.plant_at(np.array(0.9)), schedule.gain(0.9)
    E, F = (schedule.plant[key].at(np.array(0.9)) for key in "EF")
    closed, driven = plant.A - L @ plant.C, E - L @ F
    flow = expm(np.block([[closed, driven], [np.zeros((1, 4))]]) * run.time[-1])
    wanted = flow[:3, :3] @ [-3.0, -3.0, -3.0] + flow[:3, 3]
    assert run.state[0, -1, :3] - run.state[0, -1, 3:] == pytest.approx(wanted, rel=1e-9)
    held = simulate(schedule, schedule, path, disturbances=given["disturbances"], start=[0, 1, 2], estimate=[3, 4, 5])
    assert np.abs(held.error[0, -1] - wanted).max() > 1e-4  # the runtime sees y once a sample only
    with pytest.raises(AnalysisError, match="once a sample"):
        ContinuousLoop(any_schedule(update="sampled"))


def test_the_nonlinear_truth_is_integrated_and_schedules_itself() -> None:
    """x' = -x^3 is x0/sqrt(1 + 2 x0^2 t); as x' = -p x with p = x^2 the observer sees it."""
    model = NonlinearModel(
        "cubic", "closed form", (Signal("x", "1"),), (Signal("y", "1"),), sp.Matrix([-(X**3)]), sp.Matrix([X])
    )
    run = simulate(NonlinearPlant(model, {"p": X**2}), runs=2, samples=20, sample_time=0.1, start=[[1.0], [0.5]])
    x0 = np.array([[1.0], [0.5]])
    assert run.of("x") == pytest.approx(x0 / np.sqrt(1.0 + 2.0 * x0**2 * run.time), rel=1e-7)
    assert run.of("p") == pytest.approx(run.of("x") ** 2, rel=1e-15)
    with pytest.raises(AnalysisError, match="neither a state nor an input"):
        NonlinearPlant(model, {"p": P})


@pytest.mark.parametrize("by_states", [True, False])
def test_a_feedback_loop_is_what_its_parts_do(by_states: bool) -> None:
    """Three samples of plant and law, step by step with scipy's exponential, against the matrices of the loop."""
    rng, T, nk = np.random.default_rng(5), 0.3, 2
    A, B, C, E, F = (rng.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3), (3, 1), (2, 1)))
    D = np.array([[0.0, 0.0], [0.4, -0.7]])
    K = rng.normal(size=(nk + 2, nk + (3 if by_states else 2)))
    if not by_states:
        K[nk:, nk + 1] = 0.0  # the output that the input acts on at once
    loop = closed_loop(tuple(m[None] for m in (A, B, C, D, E, F)), K[None], by_states, nk, T)
    whole = expm(T * np.block([[A, B, E], [np.zeros((3, 6))]]))[:3]
    x, own = rng.normal(size=3), rng.normal(size=nk)
    state = np.concatenate([x, own])
    for _ in range(3):
        d = rng.normal(size=1)
        free = C @ x + F @ d  # outputs without the input
        u = K[nk:, :nk] @ own + K[nk:, nk:] @ (x if by_states else free)
        y = free + D @ u
        assert (loop.C[0] @ state + loop.D[0] @ d) == pytest.approx(np.concatenate([x, y, u]), rel=1e-10)
        own = K[:nk, :nk] @ own + K[:nk, nk:] @ (x if by_states else y)
        x = whole @ np.concatenate([x, u, d])
        state = loop.A[0] @ state + loop.B[0] @ d
        assert state == pytest.approx(np.concatenate([x, own]), rel=1e-10)
