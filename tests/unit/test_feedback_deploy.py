"""A feedback law as a schedule file: table, claims, proof from the file alone, and files that must be refused or refuted."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import solve_discrete_lyapunov

from analysis import hinf_norm
from estimators import GainSchedule, LpvObserver, ScheduleError
from estimators.arrays import FloatArray
from estimators.schedule import check_content
from studies.report.frozen_levels import frozen_levels
from studies.report.schedule_figures import gain_figure
from synthesis.certificate.claims import ClaimChannel
from synthesis.certificate.frozen import frozen_level
from synthesis.certificate.levels import best_gain
from synthesis.certificate.proof import certificate, prove
from synthesis.certificate.refute import refuting_place
from synthesis.certificate.search import Search, Wish
from synthesis.design.deploy import Deployment, deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import export, schedule_content
from synthesis.design.feedback_channel import FeedbackChannel, feedback_names
from synthesis.design.law_table import table_at
from synthesis.design.state_feedback import StateFeedbackDesign, StateFeedbackGains, design_state_feedback
from synthesis.errors import ProblemError
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
PERIOD = 0.05


def mass() -> LpvModel:
    """An unstable spring whose stiffness moves; the acceleration is measured, too."""
    A = [[0, 1], [1 + p, -sp.Rational(1, 2)]]
    return small_model(
        A, [[1, 0], [1 + p, -sp.Rational(1, 2)]], (parameter("p", 0.0, 2.0, 3.0),),
        B=[[0], [2]], D=[[0], [2]], E=[[0], [1]], F=[[0], [1]],
    )  # fmt: skip


@pytest.fixture(scope="module")
def deployment() -> Deployment:
    channel = FeedbackChannel(("d1",), ("x1", "y2", "u1"), weights=(2.0,), sizes=(0.5, 4.0, 1.0))
    gains = design_state_feedback(mass(), StateFeedbackDesign((channel,), decay_rate=0.5, fastest_pole=20.0))
    return deploy(gains, DeploySettings(sample_time=PERIOD, limits={"u1": (-3.0, 2.0)}))


@pytest.fixture(scope="module")
def content(deployment: Deployment) -> dict[str, Any]:
    return schedule_content(deployment, "mass-feedback")


def changed(content: dict[str, Any], change: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    other = copy.deepcopy(content)
    change(other)
    return other


def test_the_file_is_proved_from_itself_and_says_what(content: dict[str, Any], tmp_path: Path) -> None:
    assert content["update"] == {
        "kind": "feedback", "sample_time": PERIOD, "measured": "states", "order": 0, "limits": [[-3.0, 2.0]],
    }  # fmt: skip
    proofs = export(tmp_path / "law.json", content)
    assert [proof.claim for proof in proofs] == ["update: decay", "update: gain 2 1 d1 -> 0.5 1 x1 + 4 1 y2 + 1 1 u1"]
    assert all(proof.proved for proof in proofs)
    schedule = GainSchedule.load(tmp_path / "law.json")
    assert (schedule.update, schedule.measured, schedule.order, schedule.limits) == (
        "feedback",
        "states",
        0,
        ((-3.0, 2.0),),
    )
    assert schedule.gain(1.0).shape == (1, 2) and schedule.gain_units == (("1", "1"),)
    stored = certificate(json.loads((tmp_path / "law.json").read_text()))
    assert stored.feedback and stored.inside_sample and stored.inside_sample[0].startswith("x1 by at most")
    with pytest.raises(ScheduleError, match=r"'mass-feedback' is a feedback law.*take LpvController"):
        LpvObserver(schedule)


def test_claimed_levels_are_those_of_the_loop_written_out(content: dict[str, Any]) -> None:
    """Frozen loops by numpy: no claim is better than them, and each comes near."""
    schedule, model = GainSchedule.from_content(content), mass()
    points = np.linspace(0.0, 2.0, 41)
    m, K = model.on(points), schedule.gain(points)
    Phi, Gamma = zero_order_hold(m.A, np.concatenate([m.B, m.E], axis=-1), PERIOD)
    A, E = Phi + Gamma[..., :1] @ K, Gamma[..., 1:]
    shown = np.concatenate([np.broadcast_to(np.eye(1, 2), K.shape), m.C[:, 1:] + m.D[:, 1:] @ K, K], axis=1)
    through = np.concatenate([np.zeros((41, 1, 1)), m.F[:, 1:], np.zeros((41, 1, 1))], axis=1)
    sizes = np.array([0.5, 4.0, 1.0])[:, None]
    norm = float(hinf_norm(A, 2.0 * E, shown / sizes, 2.0 * through / sizes, discrete=True).norm.max())
    decay = float(-np.log(np.abs(np.linalg.eigvals(A)).max()) / PERIOD)
    levels = {claim["kind"]: claim["level"] for claim in content["claims"]}
    assert 0.8 * decay < levels["sampled error"] <= decay
    assert norm <= levels["sampled gain"] < 1.3 * norm
    for level in frozen_levels(content):
        assert level.slack >= 0.0
        best = level.values[level.tightest]
        assert best == pytest.approx(decay if level.kind == "sampled error" else norm, rel=1e-3)


def test_h2_and_peak_claims_about_a_law(deployment: Deployment) -> None:
    """Levels from Lyapunov equations at constant parameters; a little above them is proved, below them is not."""
    loop, model = deployment.loop, mass()
    search = Search(loop, feedback_names(model), model.parameters)
    channel = ClaimChannel({"d1": 1.0}, ("x1", "y2", "u1"), (0.5, 4.0, 1.0))
    claims = [
        best_gain(search, Wish(kind, None, channel), 0.005) for kind in ("sampled H2 norm", "sampled energy to peak")
    ]
    found = [claim for claim in claims if claim is not None]
    assert len(found) == 2
    content = schedule_content(replace(deployment, claims=(deployment.claims[0], *found)), "more")
    assert [proof.proved for proof in prove(content)] == [True, True, True]
    m, K = model.on(np.array([2.0])), GainSchedule.from_content(content).gain(np.array([2.0]))
    Phi, Gamma = zero_order_hold(m.A[0], np.hstack([m.B[0], m.E[0]]), PERIOD)
    A, B = Phi + Gamma[:, :1] @ K[0], Gamma[:, 1:]
    C = np.vstack([[1.0, 0.0], m.C[0, 1] + m.D[0, 1] @ K[0], K[0]]) / np.array([[0.5], [4.0], [1.0]])
    D = np.array([[0.0], [0.25], [0.0]])
    S = (C @ solve_discrete_lyapunov(A, B @ B.T) @ C.T + D @ D.T) / PERIOD  # of signals in continuous time
    for level, there in zip(frozen_levels(content)[1:], (np.trace(S), np.linalg.eigvalsh(S)[-1]), strict=True):
        assert level.slack >= 0.0 and level.values[-1] == pytest.approx(np.sqrt(there), rel=1e-6)
        assert level.level < 1.5 * level.values.max()
    for number, claim in enumerate(found):
        lower = replace(claim, level=0.7 * claim.level)
        assert not search.verifier.prove(lower).proved and refuting_place(search.verifier, lower) is not None
        assert refuting_place(search.verifier, claim) is None
        Z, W = np.eye(5)[[0, 3, 4]] / np.array([[0.5], [4.0], [1.0]]), np.ones((1, 1))
        frozen = frozen_level(loop, W, Z, claim.kind)
        assert frozen == pytest.approx(frozen_levels(content)[1 + number].values.max(), rel=1e-6)


def test_a_better_claim_and_a_wrong_sign_are_not_proved(content: dict[str, Any]) -> None:
    def better(c: dict[str, Any]) -> None:
        c["claims"][1]["level"] *= 0.5

    def wrong_sign(c: dict[str, Any]) -> None:
        c["gain"]["table"] = (-np.array(c["gain"]["table"])).tolist()

    def smaller_size(c: dict[str, Any]) -> None:
        c["claims"][1]["channel"]["errors"]["x1"] = 0.05

    for change in (better, wrong_sign, smaller_size):  # the first two by the loop itself, at a constant parameter
        proofs = prove(changed(content, change))
        assert not all(proof.proved for proof in proofs)
        assert change is smaller_size or any(proof.refuted for proof in proofs)


def _update(**new: Any) -> Callable[[dict[str, Any]], None]:
    return lambda c: c["update"].update(new)


def _channel(new: Any) -> Callable[[dict[str, Any]], None]:
    return lambda c: c["claims"][1]["channel"].update(errors=new)


BROKEN: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (_update(order=1), r"gain\.table\[0\]: has 1 entries, expected 2"),
    (_update(order=-1), r"update\.order: -1 is no number of states"),
    (_update(order=True), r"update\.order: True is no number of states"),
    (_update(measured="inputs"), r"update\.measured: 'inputs' is not known"),
    (_update(measured="outputs"), r"gain\.table: the law feeds output 2 straight to the input"),
    (_update(limits=[[2.0, -3.0]]), r"update\.limits\[0\]: \[2\.0, -3\.0\] is empty or reversed"),
    (_update(limits=[]), r"update\.limits: has 0 entries, expected 1"),
    (_update(more=1), r"update\.more: unknown key"),
    (_update(kind="held"), r"update\.(measured|order): unknown key"),
    (_update(kind="lead"), r"update\.(kind|measured).*(not known|unknown key)"),
    (_channel({"x9": 1.0}), r"channel: 'x9' is none of x1, x2, y1, y2, u1"),
    (_channel({"x1": 0.0}), r"channel\.errors\.x1: 0\.0 must be positive"),
    (_channel({}), r"channel\.errors: is empty"),
    (lambda c: c["claims"][0].update(kind="drop probability"), r"says nothing about the update 'feedback'"),
    (lambda c: c["claims"].pop(0), r"none about the update that the runtime performs"),
]


@pytest.mark.parametrize(("change", "words"), BROKEN)
def test_broken_files_are_refused(
    change: Callable[[dict[str, Any]], None], words: str, content: dict[str, Any]
) -> None:
    with pytest.raises(ScheduleError, match=words):
        prove(changed(content, change))


def test_an_observer_has_no_law(content: dict[str, Any]) -> None:
    other = changed(content, lambda c: c["update"].clear())
    other["update"] |= {"kind": "sampled", "sample_time": PERIOD, "limits": [None]}
    with pytest.raises(ScheduleError, match=r"update\.limits: unknown key"):
        check_content(other, "file")


def test_limits_of_an_input_that_there_is_not_are_refused(deployment: Deployment) -> None:
    with pytest.raises(ProblemError, match="'u2' is no input of model 'small'; inputs: u1"):
        deploy(deployment.gains, DeploySettings(sample_time=PERIOD, limits={"u2": (0.0, 1.0)}))
    with pytest.raises(ProblemError, match="empty, reversed or not finite"):
        DeploySettings(limits={"u1": (1.0, 1.0)})


class Lag:
    """A law as a design of dynamic feedback hands it over: xk' = a xk + b y + second y2, u = c xk + d y."""

    measured, order, second = "outputs", 1, 0.0

    def __init__(self, model: LpvModel, base: StateFeedbackGains, values: tuple[float, float, float, float]) -> None:
        self.model, self.design, self.result, self.verdict = model, base.design, base.result, base.verdict
        self.values = values

    def controller(self, points: FloatArray) -> tuple[FloatArray, ...]:
        shapes = ((1, 1), (1, len(self.model.outputs)), (1, 1), (1, len(self.model.outputs)))
        found = [np.zeros((len(points), *shape)) for shape in shapes]
        for array, value in zip(found, self.values, strict=True):
            array[:, 0, 0] = value
        found[1][:, 0, 1:] = self.second
        return tuple(found)


def test_a_law_with_states_is_discretised_deployed_and_proved(deployment: Deployment) -> None:
    """A lead of the position on the mass: trapezoidal; with a use for its acceleration, on which the input acts: held."""
    plain = small_model(
        [[0, 1], [1 + p, -sp.Rational(1, 2)]], [[1, 0]], (parameter("p", 0.0, 2.0, 3.0),),
        B=[[0], [2]], E=[[0], [1]], F=[[0]],
    )  # fmt: skip
    assert isinstance(deployment.gains, StateFeedbackGains)
    channel = FeedbackChannel(("d1",), ("x1", "u1"), sizes=(0.5, 1.0))
    base = design_state_feedback(plain, StateFeedbackDesign((channel,)))
    law: Any = Lag(plain, base, (-20.0, 20.0, 12.0, -16.0))
    points = np.array([[0.0], [2.0]])
    found = table_at(law, points, PERIOD)
    z = np.exp(2j)  # at the frequency where s = 2 (z - 1)/(T (z + 1)) both laws answer alike
    s = 2.0 / PERIOD * (z - 1.0) / (z + 1.0)
    a, b, c, d = found[0].ravel()
    assert c / (z - a) * b + d == pytest.approx(12.0 * 20.0 / (s + 20.0) - 16.0)
    done = deploy(law, DeploySettings(sample_time=PERIOD))
    proofs = prove(schedule_content(done, "lag"))
    assert [proof.kind for proof in proofs] == ["sampled error", "sampled gain"] and all(
        proof.proved for proof in proofs
    )
    assert done.claims[0].P.shape == (3, 3)
    assert len(gain_figure(schedule_content(done, "lag")).rows) == 2
    acting: Any = Lag(mass(), base, (-20.0, 20.0, 12.0, -16.0))
    np.testing.assert_allclose(np.delete(table_at(acting, points, PERIOD), 2, axis=2), found)  # no use for it
    acting.second = 10.0
    a, b, second, c, d, none = table_at(acting, points, PERIOD)[0].ravel()
    kept = np.exp(-1.0)
    assert (a, b, second) == pytest.approx((kept, 1.0 - kept, 0.5 * (1.0 - kept))) and (c, d, none) == (
        12.0,
        -16.0,
        0.0,
    )
    wrong = schedule_content(done, "lag")
    wrong["gain"]["table"] = (np.array(wrong["gain"]["table"]) * np.array([[1.0, 1.0], [1.0, -1.0]])).tolist()
    assert prove(wrong)[0].refuted


def test_a_sample_time_that_no_table_can_mend_is_refused_at_once() -> None:
    """Designed in continuous time with poles near -20 1/s: sampled five times a second it oscillates and grows."""
    channel = FeedbackChannel(("d1",), ("x1",))
    gains = design_state_feedback(mass(), StateFeedbackDesign((channel,), fastest_pole=20.0))
    tried: list[str] = []
    with pytest.raises(
        ProblemError, match=r"run every 0\.2 s the loop is unstable while parameters stand still \(it grows"
    ):
        deploy(gains, DeploySettings(sample_time=0.2), tried.append)
    assert len(tried) == 1
    assert deploy(gains, DeploySettings(sample_time=0.002)).cost < 0.01  # the control
