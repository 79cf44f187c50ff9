"""Feedback laws of rational plants: as good as those of the same plant where it is polynomial; files, proofs, runs."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from scipy.linalg import expm

from analysis.simulation.amplification import amplification
from estimators import GainSchedule, LpvController, ScheduleError
from estimators.arrays import FloatArray
from synthesis.certificate.proof import certificate
from synthesis.certificate.search import Search, Wish
from synthesis.design.deploy import deploy, lyapunov_degrees
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import export, schedule_content
from synthesis.design.feedback_channel import FeedbackChannel, feedback_names
from synthesis.design.feedback_scale import FeedbackScale
from synthesis.design.fitted_update import fitted_update
from synthesis.design.generalised_plant import generalised_plant
from synthesis.design.hinf_observer import Channel, ObserverDesign
from synthesis.design.law_table import FeedbackLaw
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.sampled_state_feedback import _problem, design_sampled_state_feedback
from synthesis.design.state_feedback import StateFeedbackDesign
from synthesis.design.static_feedback import design_static_feedback
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.design.static_feedback_lmi import StaticLoop
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import Verdict
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.from_model import plant_of
from synthesis.loop.system import Region
from synthesis.models.lpv import LpvModel
from synthesis.models.numeric import values
from tests.support.disguised import twins
from tests.support.lmi_cases import parameter, small_model

PERIOD = 0.02
NOISY = FeedbackChannel(("d1", "d2", "d3"), ("x1", "y2", "u1"))
PLACES = np.linspace(0.25, 1.0, 5)


def sampled(model: LpvModel, degree: int = 0) -> FeedbackLaw:
    return design_sampled_state_feedback(model, StateFeedbackDesign((NOISY,), degree, decay_rate=0.2), PERIOD)


def output(model: LpvModel, degree: int = 1, feedthrough: bool | None = None) -> FeedbackLaw:
    design = OutputFeedbackDesign((NOISY,), degree, fastest_pole=8.0, feedthrough=feedthrough)
    return design_output_feedback(model, design)


def static(model: LpvModel, degree: int = 0) -> FeedbackLaw:
    return design_static_feedback(model, StaticFeedbackDesign((NOISY,), degree, fastest_pole=8.0, steps=8))


LAWS: dict[str, Callable[..., FeedbackLaw]] = {"sampled": sampled, "output": output, "static": static}


def peak(law: FeedbackLaw, channel: FeedbackChannel, p: float) -> float:
    """A lower bound of the frozen H-infinity norm at a place, from frequency responses of the loop written out in floats."""
    at = law.model.on(np.array([p]))
    A, B, C, E, F = (getattr(at, key)[0] for key in "ABCEF")
    Ak, Bk, Ck, Dk = (m[0] for m in law.controller(np.array([p])))
    n, period = len(A), getattr(law, "sample_time", None)
    points = 1j * np.concatenate([[0.0], np.geomspace(1e-2, 1e2, 200)])
    if period is not None:
        whole = expm(period * np.block([[A, B, E], [np.zeros((4, 6))]]))
        A, B, E, points = whole[:n, :n], whole[:n, n : n + 1], whole[:n, n + 1 :], np.exp(points[np.abs(points) < 3.0])
        C, F = (np.eye(n), np.zeros((n, 3))) if law.measured == "states" else (C, F)
    shown, noise = at.C[0], at.F[0]
    loop = np.block([[A + B @ Dk @ C, B @ Ck], [Bk @ C, Ak]])
    driven = np.vstack([E + B @ Dk @ F, Bk @ F])[:, : len(channel.disturbances)]
    seen = np.vstack([np.eye(1, len(loop)), [*shown[1], *np.zeros(len(Ak))], np.hstack([Dk @ C, Ck])])
    direct = np.vstack([np.zeros((1, 3)), noise[1:], Dk @ F])[:, : len(channel.disturbances)]
    poles = np.linalg.eigvals(loop)
    assert (poles.real.max() if period is None else np.abs(poles).max()) < (0.0 if period is None else 1.0)
    answer = seen @ np.linalg.solve(points[:, None, None] * np.eye(len(loop)) - loop, driven.astype(complex)) + direct
    return float(np.linalg.norm(answer, 2, axis=(1, 2)).max())


@pytest.mark.parametrize("name", LAWS)
def test_the_same_plant_in_another_parameter_has_the_same_gamma(name: str) -> None:
    """No frozen loop has more. (Of the output feedback with poles in a disc the unknowns differ: 1 and p, or 1 and q.)"""
    found = [LAWS[name](model) for model in twins()]
    gammas = [law.gamma for law in found]  # type: ignore[attr-defined]
    assert [law.verdict for law in found] == [Verdict.CERTIFIED] * 2
    assert gammas[1] == pytest.approx(gammas[0], rel=5e-3)
    channel = found[1].design.channels[0]
    assert 0.7 * gammas[1] < max(peak(found[1], channel, p) for p in PLACES) <= gammas[1]


def test_the_inequality_of_a_sampled_law_is_over_the_cube_of_the_denominator() -> None:
    """For any Q, G and Y, against the update by a matrix exponential, at places with rates; no scaling."""
    model, rng = twins(rate=0.5)[1], np.random.default_rng(6)
    scale = FeedbackScale(np.ones(2), np.ones(1), disturbance=1.0, clock=1.0)
    fitted = fitted_update(model, model.pieces[0], scale.states, PERIOD)
    problem = _problem(model, StateFeedbackDesign((NOISY,)), scale, PERIOD, [fitted], 1.7, False, 0.0)
    decisions = rng.normal(size=problem.decisions)
    Q, G, Y = (problem.unknowns[key].substitute(decisions) for key in "QGY")
    for u, r in rng.uniform(-1.0, 1.0, (4, 2)):
        place, at = np.array([[u, r]]), model.on(np.array([0.625 + 0.375 * u]))
        A, B, C, E, F = (getattr(at, key)[0] for key in "ABCEF")
        whole = expm(PERIOD * np.block([[A, B, E], [np.zeros((4, 6))]]))
        q, g, y = (m.at(place)[0, ..., 0] for m in (Q, G, Y))
        later = Q.at(place + np.array([PERIOD * 0.5 * r / 0.375, 0.0]))[0, ..., 0]
        closed, slack = whole[:2, :2] @ g + whole[:2, 2:3] @ y, g + g.T - q
        seen, through = np.vstack([g[:1], C[1:] @ g, y]), np.vstack([np.zeros((1, 3)), F[1:], np.zeros((1, 3))])
        wanted = np.block([
            [later, closed, whole[:2, 3:], np.zeros((2, 3))], [closed.T, slack, np.zeros((2, 3)), seen.T],
            [whole[:2, 3:].T, np.zeros((3, 2)), np.eye(3), through.T],
            [np.zeros((3, 2)), seen, through, 1.7**2 * np.eye(3)],
        ])  # fmt: skip
        found = problem.inequalities[-1].matrix.substitute(decisions).at(place)[0, ..., 0]
        below = float(values(model.polynomial.denominator, place[:, :1])[0, 0, 0])
        np.testing.assert_allclose(found / below**3, wanted, atol=1e-5)


def test_a_sampled_observer_of_the_twins_has_the_same_gamma() -> None:
    found = [
        design_sampled_observer(model, ObserverDesign((Channel(("d1", "d2", "d3"), ("x2",)),), degree=0), PERIOD).gamma
        for model in twins()
    ]
    assert found[1] == pytest.approx(found[0], rel=2e-3)


def test_a_feedthrough_is_worth_something_and_is_used() -> None:
    """Poles in a small disc: without Dk a tenth is lost, as for the polynomial twin."""
    rational = twins()[1]
    free, without = output(rational), output(rational, feedthrough=False)
    assert without.gamma > 1.05 * free.gamma  # type: ignore[attr-defined]
    assert free.controller(PLACES)[3].any() and not without.controller(PLACES)[3].any()


def test_the_inequalities_of_a_static_law_are_over_the_square_of_the_denominator() -> None:
    """For any P and K: gain, decay and disc, worked out from the closed loop in floats, at places with rates."""
    model = twins(rate=0.5)[1]
    plant, problem, rng = generalised_plant(model, (NOISY,)), LmiProblem(model.parameters), np.random.default_rng(5)
    gain = problem.constant(rng.normal(size=(1, 2)))
    loop = StaticLoop(problem, plant, 1.0, 1, gain)
    loop.require_decay(0.3)
    loop.require_disc(7.0)
    loop.require_gain(plant.channels[0], problem.constant(np.array([[1.7]])))
    decisions = rng.normal(size=problem.decisions)
    for u, r in rng.uniform(-1.0, 1.0, (4, 2)):
        place, at = np.array([[u, r]]), model.on(np.array([0.625 + 0.375 * u]))
        A, B, C, E, F = (getattr(at, key)[0] for key in "ABCEF")
        K, P = gain.at(place)[0, ..., 0], loop.P.substitute(decisions).at(place)[0, ..., 0]
        slope = loop.P.substitute(decisions).derivative(0).at(place)[0, ..., 0] * (0.5 * r / 0.375)
        closed, driven = A + B @ K @ C, E + B @ K @ F
        shown = np.vstack([np.eye(1, 2), C[1:], K @ C])
        direct = np.vstack([np.zeros((1, 3)), F[1:], K @ F])
        falls = P @ closed + closed.T @ P + slope
        wanted = {
            "decay rate": -(falls + 0.6 * P),
            "fastest pole": np.block([[7.0 * P, P @ closed], [closed.T @ P, 7.0 * P]]),
            f"gain {NOISY.name}": -np.block([
                [falls, P @ driven, shown.T], [driven.T @ P, -1.7 * np.eye(3), direct.T], [shown, direct, -1.7 * np.eye(3)]
            ]),
        }  # fmt: skip
        below = float(values(plant.denominator, place[:, :1])[0, 0, 0])
        found = {one.name: one.matrix.substitute(decisions).at(place)[0, ..., 0] for one in problem.inequalities}
        for name, matrix in wanted.items():
            np.testing.assert_allclose(found[name] / below**2, matrix, rtol=1e-9, atol=1e-9)


@pytest.fixture(scope="module")
def contents() -> dict[str, dict[str, Any]]:
    moving, jumping = twins(rate=0.5)[1], twins()[1]
    laws = {"sampled": sampled(moving), "output": output(jumping), "static": static(jumping)}
    settings = DeploySettings(sample_time=PERIOD)
    return {name: schedule_content(deploy(law, settings), f"rational-{name}") for name, law in laws.items()}


def test_degrees_of_P_that_are_tried() -> None:
    """Of a rational plant that of the gains and one more, of a polynomial one its own alone; none where a parameter may jump."""
    asked: Any = SimpleNamespace(design=SimpleNamespace(degree=1), rational=2)
    polynomial, rational = twins(rate=0.5)
    assert lyapunov_degrees(rational, asked) == [(1,), (2,)] and lyapunov_degrees(polynomial, asked) == [(3,)]
    assert lyapunov_degrees(twins()[1], asked) == [(0,)]


@pytest.mark.parametrize("name", LAWS)
def test_files_are_proved_and_run(name: str, contents: dict[str, dict[str, Any]], tmp_path: Path) -> None:
    """From the file alone; trajectories and frozen places that know nothing of the proof stay below it, and come near."""
    export(tmp_path / "file.json", contents[name])
    content = json.loads((tmp_path / "file.json").read_text())
    assert "denominator" in content["plant"] and all(proof.proved for proof in certificate(content).proofs)
    found = amplification(content, runs=1, samples=40)
    assert all(not one.beaten for one in found) and max(one.share for one in found if not one.is_decay) > 0.4
    schedule = GainSchedule.load(tmp_path / "file.json")
    rows = schedule.table[0].shape[1] - schedule.order
    v = np.linspace(0.5, -1.0, rows)
    step = LpvController(schedule).step(v, 0.25)
    np.testing.assert_allclose(step.command, schedule.table[0][schedule.order :, schedule.order :] @ v, rtol=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_what_is_not_so_is_not_proved(name: str, contents: dict[str, dict[str, Any]]) -> None:
    turned, better, other = (copy.deepcopy(contents[name]) for _ in range(3))
    turned["gain"]["table"] = (-np.array(turned["gain"]["table"])).tolist()  # pushes the unstable plant away
    assert not any(proof.proved for proof in certificate(turned).proofs)
    for claim in better["claims"]:
        claim["level"] *= 0.6 if "gain" in claim["kind"] else 2.5
    assert not any(proof.proved for proof in certificate(better).proofs)
    other["plant"]["A"]["coefficients"][0][1][0] *= 1.0 + 1e-12
    with pytest.raises(ScheduleError, match=r"plant\.A: entry \[1\]\[0\]"):
        certificate(other)


def test_a_denominator_that_vanishes_in_the_range_is_refused(contents: dict[str, dict[str, Any]]) -> None:
    bad = copy.deepcopy(contents["static"])
    for rows in bad["model"]["matrices"].values():
        for row in rows:
            row[:] = [text.replace("p + 1", "2*p - 1") for text in row]
    with pytest.raises(ScheduleError, match=r"divides by zero inside the range, at or near p = 0\.5"):
        certificate(bad)


def floats(matrix: Any) -> FloatArray:
    values = matrix.at((fmpq(0), fmpq(0)))
    return np.array([[float(x.mid()) for x in row] for row in values.tolist()])


@pytest.mark.parametrize("measured", ["outputs", "states"])
def test_a_law_in_continuous_time_against_plain_products(measured: Any) -> None:
    """With a state of its own, an output that the input acts on, and noise: every matrix over the denominator that it says."""
    p = parameter("p", 0.25, 1.0, 1.0)
    q = 1 / (1 + twins()[1].A.free_symbols.pop())
    model = small_model(
        [[-1, q], [-2 * q, -3]],
        [[1, q], [q, 0]],
        [p],
        B=[[q], [1]],
        D=[[0], [q]],
        E=[[q, 0], [1, 0]],
        F=[[0, q], [0, 1]],
    )
    rows = np.array([[-4.0, 0.5, -0.25], [0.75, 0.5, 0.0]])
    gain = fmpq_mat([[fmpq(*float(x).as_integer_ratio()) for x in row] for row in rows])
    ends = ((fmpq(1, 4), fmpq(1)),)
    loop = FeedbackLoop(plant_of(model), ends, {(0,): gain, (1,): gain}, measured, 1)
    Ak, Bk, Ck, Dk = rows[:1, :1], rows[:1, 1:], rows[1:, :1], rows[1:, 1:]
    slowest = np.inf
    for u in np.linspace(-1.0, 1.0, 41):
        at = model.on(np.array([0.625 + 0.375 * u]))
        A, B, C, D, E, F = (getattr(at, key)[0] for key in "ABCDEF")
        H, G = (C, F) if measured == "outputs" else (np.eye(2), np.zeros((2, 2)))
        K, W = np.hstack([Dk @ H, Ck]), Dk @ G
        y, y_d = np.hstack([C, np.zeros((2, 1))]) + D @ K, F + D @ W
        v, v_d = (y, y_d) if measured == "outputs" else (np.eye(2, 3), G)
        closed = np.vstack([np.hstack([A, np.zeros((2, 1))]) + B @ K, Bk @ v + [0.0, 0.0, Ak[0, 0]]])
        slowest = min(slowest, -np.linalg.eigvals(closed).real.max())
        if u in (-1.0, 0.0, 1.0):
            place = (fmpq(*float(u).as_integer_ratio()), fmpq(0))
            system = loop.system(Region(place, (fmpq(0), fmpq(0))), "continuous")
            assert system is not None and system.shared
            below = floats(system.denominator)[0, 0]
            wanted = {
                "A": closed, "B": np.vstack([E + B @ W, Bk @ v_d]), "C": np.vstack([np.eye(2, 3), y, K]),
                "D": np.vstack([np.zeros((2, 2)), y_d, W]),
            }  # fmt: skip
            for key, matrix in wanted.items():
                one = getattr(system, key)
                one = one["disturbances"] if key in "BD" else one
                np.testing.assert_allclose(floats(one) / below, matrix, rtol=1e-12, atol=1e-13)
    search = Search(loop, feedback_names(model), model.parameters, 2)
    assert search.prove(Wish("decay rate", 0.97 * slowest))[0] is not None
    assert search.prove(Wish("decay rate", 1.01 * slowest))[0] is None


def test_an_update_that_no_polynomial_fits_is_refused() -> None:
    p = parameter("p", 0.001, 1.0)
    steep = small_model([[1 / (p_symbol := twins()[1].A.free_symbols.pop())]], [[1]], [p], B=[[1]], E=[[1 / p_symbol]])
    design = StateFeedbackDesign((FeedbackChannel(("d1",), ("x1", "u1")),))
    with pytest.raises(ProblemError, match=r"no polynomial of degree 24 .* shrink the range"):
        design_sampled_state_feedback(steep, design, 0.05)
