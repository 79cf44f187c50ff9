"""Published problems of output feedback: what their sources say of them, and laws that must be refused."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from scipy.linalg import expm

from estimators import GainSchedule, LpvController
from estimators.arrays import FloatArray
from synthesis.certificate.search import Search, Wish
from synthesis.design.deploy import Deployment, deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.feedback_channel import FeedbackChannel, feedback_names
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.lmi.result import Verdict
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.from_model import plant_of
from synthesis.models.lpv import LpvModel
from synthesis.models.weighted import weighted
from synthesis.polynomials.rational import decimal
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")


def oscillator(rate: float) -> LpvModel:
    """MathWorks, Gain-Scheduled LQG Controller, after Shamma and Athans 1991: x'' + 0.2 x' + (1 + p/2) x = u, |p| <= 1."""
    tenth = sp.Rational(1, 10)
    return small_model(
        [[0, 1], [-1 - p / 2, -2 * tenth]], [[1, 0]], [parameter(rate=rate)], B=[[0], [1]], E=[[0, 0], [1, 0]],
        F=[[0, tenth]],
    )  # fmt: skip


def cancelling(place: float) -> FloatArray:
    """[[Ak, Bk], [Ck, 0]] of -(s^2 + 0.2 s + 1 + p/2) / (s (s + 2)^2): the loop is -1/(s (s + 2)^2) at every frozen p.

    The scheduled LQG controller of the source has integral action and comes to this where its loop is recovered: the page says
    that its loops are the same at all parameter values, and that it cancels the lightly damped poles.
    """
    return np.array(
        [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -4.0, -4.0, 1.0], [-1.0 - place / 2, -0.2, -1.0, 0.0]]
    )


def closed(place: float) -> FloatArray:
    K = cancelling(place)
    A, B, C = np.array([[0.0, 1.0], [-1.0 - place / 2, -0.2]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    return np.block([[A, B @ K[3:, :3]], [K[:3, 3:] @ C, K[:3, :3]]])


def table_loop(rate: float) -> tuple[FeedbackLoop, LpvModel]:
    """Ck is straight in p: two breakpoints hold the law exactly."""
    model = oscillator(rate)
    table: dict[tuple[int, ...], fmpq_mat] = {
        (i,): fmpq_mat([[decimal(float(x)) for x in row] for row in cancelling(place)])
        for i, place in enumerate((-1.0, 1.0))
    }
    return FeedbackLoop(plant_of(model), ((fmpq(-1), fmpq(1)),), table, "outputs", 3), model


def decays(rate: float, degree: int) -> bool:
    loop, model = table_loop(rate)
    claim, _ = Search(loop, feedback_names(model), model.parameters, degree).prove(Wish("decay rate", 1e-3))
    return claim is not None


def two_parameters() -> LpvModel:
    """fdbianchi/LPVtools, demos/BasicExample: affine in two parameters in [0, 1], also the output; they may jump.

    The error r - y is measured, weighed by 10/(s + 0.01), the input by (0.04 s + 0.1)/(0.004 s + 1).
    """
    a, b, tenth = sp.symbols("a"), sp.symbols("b"), sp.Rational(1, 10)
    model = small_model(
        sp.Matrix([[-2, 1], [-1, -2]]) + a * tenth * sp.Matrix([[-13, 1], [-1, -13]]) - b * sp.eye(2) / 2,
        [[-10 - a * 2 * tenth, -10 - b * 3 * tenth]],
        [parameter("a", 0.0, 1.0, np.inf), parameter("b", 0.0, 1.0, np.inf)], B=[[1], [1]], E=[[0], [0]], F=[[1]],
    )  # fmt: skip
    return weighted(model, {"y1": control.tf([10], [1, 0.01]), "u1": control.tf([0.04, 0.1], [0.004, 1])})


def test_two_parameters_with_dynamic_weights_come_near_the_best_law_of_every_frozen_corner() -> None:
    """The source compares with hinfsyn at the corners: no scheduled law beats the worst of those, and ours is within 1.05."""
    model = two_parameters()
    corners = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    at, frozen = model.on(corners), []
    for i in range(4):
        D = np.hstack([at.F[i], at.D[i]])
        plant = control.ss(at.A[i], np.hstack([at.E[i], at.B[i]]), at.C[i][[1, 2, 0]], D[[1, 2, 0]])
        frozen.append(control.hinfsyn(plant, 1, 1)[2])
    channel = FeedbackChannel(("d1",), ("y1_weighted", "u1_weighted"))
    found = design_output_feedback(model, OutputFeedbackDesign((channel,), measured=("y1",)))
    assert found.verdict is Verdict.CERTIFIED and found.gamma_lower is not None
    assert max(frozen) <= found.gamma_lower <= found.gamma <= 1.05 * max(frozen)


def test_a_scheduled_law_that_is_stable_frozen_and_unstable_when_the_parameter_moves_is_refused() -> None:
    """Every frozen loop decays at 0.1 1/s; along p = cos 2t it grows. Refused without a rate bound and with |p'| <= 2."""
    assert max(np.linalg.eigvals(closed(x)).real.max() for x in np.linspace(-1.0, 1.0, 21)) == pytest.approx(-0.1)
    steps, turn = 400, np.eye(5)
    for k in range(steps):
        turn = expm(closed(np.cos(2.0 * np.pi * (k + 0.5) / steps)) * np.pi / steps) @ turn
    growth = np.log(np.abs(np.linalg.eigvals(turn)).max()) / np.pi
    assert growth > 0.01
    assert not decays(np.inf, 0)
    assert not decays(2.0, 3)
    assert decays(0.05, 2)


def run(deployed: Deployment) -> float:
    """The gain that the runtime shows on the sampled plant for random disturbances, p jumping from sample to sample."""
    controller = LpvController(GainSchedule.from_content(schedule_content(deployed, "oscillator-feedback")))
    random, period, steps = np.random.default_rng(7), 0.01, 3000
    d = np.cumsum(random.standard_normal((steps, 2)), axis=0) * np.array([0.1, 0.02])
    places = random.uniform(-1.0, 1.0, steps)
    at, x, seen = deployed.gains.model.on(places), np.zeros(2), []
    both = np.concatenate([at.A, at.B, at.E[:, :, :1]], axis=2)
    exact = expm(period * np.concatenate([both, np.zeros((steps, 2, 4))], axis=1))[:, :2]
    for k in range(steps):
        u = controller.step(at.C[k] @ x + at.F[k] @ d[k], places[k]).command
        seen.append([x[0], u[0]])
        x = exact[k] @ np.concatenate([x, u, d[k, :1]])
    return float(np.linalg.norm(seen) / np.linalg.norm(d))


def test_a_designed_law_for_the_same_plant_holds_whatever_the_rate() -> None:
    """With p free to jump: table over a sample, its claims proved; the same table with its output turned round is refused."""
    channel = FeedbackChannel(("d1", "d2"), ("x1", "u1"))
    found = design_output_feedback(oscillator(np.inf), OutputFeedbackDesign((channel,), fastest_pole=20.0))
    deployed = deploy(found, DeploySettings(sample_time=0.01))
    levels = {claim.kind: claim.level for claim in deployed.claims}
    assert levels["sampled error"] > 0.3
    assert levels["sampled gain"] <= 1.02 * found.gamma
    assert run(deployed) < levels["sampled gain"]
    loop = deployed.loop
    assert isinstance(loop, FeedbackLoop) and loop.order == 2
    wrong = {
        index: fmpq_mat([[-x if i == 2 else x for x in row] for i, row in enumerate(gain.tolist())])
        for index, gain in loop.table.items()
    }
    search = Search(replace(loop, table=wrong, _systems={}), feedback_names(found.model), found.model.parameters, 0)
    assert search.prove(Wish("sampled error", 1e-3))[0] is None
