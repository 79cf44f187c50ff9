"""Static output feedback in steps: against searches over one gain, state feedback, and the proof of the table that runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import minimize_scalar

from analysis import hinf_norm
from synthesis.certificate.search import Search, Wish
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.feedback_channel import FeedbackChannel, feedback_names
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback
from synthesis.design.static_feedback import design_static_feedback
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.loop.feedback import FeedbackLoop
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
LEVEL = FeedbackChannel(("d1",), ("x1", "u1"))


def third_order(stiffness: Any = 1, **more: Any) -> LpvModel:
    """x''' + 2 x'' + (3 + p) x' + s x = u + d, x measured; |p| <= 1/20."""
    return small_model(
        [[0, 1, 0], [0, 0, 1], [-stiffness, -3 - p, -2]], [[1, 0, 0]], [parameter("p", -0.05, 0.05, 0.5)],
        B=[[0], [0], [1]], E=[[0], [0], [1]], **more,
    )  # fmt: skip


def peak(k: float) -> float:
    """Of the loop with u = k x at p = 0, its own frequency response."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [k - 1.0, -3.0, -2.0]])
    if np.linalg.eigvals(A).real.max() >= 0.0:
        return 1e6
    return float(hinf_norm(A, np.eye(3)[:, 2:], np.array([[1.0, 0.0, 0.0], [k, 0.0, 0.0]])).norm)


def test_one_gain_ends_near_the_best_of_all_gains() -> None:
    """The parameter hardly moves the plant: the best constant gain is known from a search over it."""
    best = minimize_scalar(peak, bounds=(-4.0, 1.0), method="bounded")
    found = design_static_feedback(third_order(), StaticFeedbackDesign((LEVEL,), degree=0))
    assert found.verdict is Verdict.CERTIFIED
    assert 0.98 * best.fun < found.gamma < 1.04 * best.fun
    assert peak(float(found.gain(np.zeros(1))[0, 0, 0])) < 1.06 * best.fun
    assert all(after <= before * (1 + 1e-4) for before, after in zip(found.levels, found.levels[1:], strict=False))
    assert found.levels[0] == pytest.approx(peak(0.0), rel=0.1)  # the start is no feedback at all


def test_an_unstable_plant_is_brought_to_stability_first() -> None:
    """x'' = (1 + p/2) x + u with both states measured: no better than state feedback, and not far above it."""
    model = small_model([[0, 1], [1 + p / 2, 0]], [[1, 0], [0, 1]], [parameter(rate=0.2)], B=[[0], [1]], E=[[0], [1]])
    least = design_state_feedback(model, StateFeedbackDesign((LEVEL,))).gamma_lower
    found = design_static_feedback(model, StaticFeedbackDesign((LEVEL,), decay_rate=0.2, steps=8))
    assert found.verdict is Verdict.CERTIFIED and least is not None
    assert least < found.gamma < 1.15 * least
    line = np.linspace(-1.0, 1.0, 5)
    at = model.on(line)
    assert np.linalg.eigvals(at.A + at.B @ found.gain(line) @ at.C).real.max() < -0.2


def test_a_table_of_pi_gains_is_proved_and_its_mirror_image_refused() -> None:
    """A lag whose gain moves, its error integrated by the model: u = -(kp e + ki int e), no use of the second output."""
    model = small_model(
        [[-1, 0], [1, 0]], [[1, 0], [1, sp.Rational(1, 2)], [0, 1]], [parameter("p", 0.5, 2.0, 1.0)], B=[[p], [0]],
        E=[[1], [0]],
    )  # fmt: skip
    channel = FeedbackChannel(("d1",), ("x2", "u1"))
    design = StaticFeedbackDesign(
        (channel,), fastest_pole=20.0, start=((-1.0, 0.0, -1.0),), uses=(("u1", "y1"), ("u1", "y3")), steps=6
    )
    found = design_static_feedback(model, design)
    gains = found.gain(np.array([0.5, 2.0]))
    assert not gains[..., 1].any() and gains[..., [0, 2]].all()
    deployed = deploy(found, DeploySettings(sample_time=0.02))
    levels = {claim.kind: claim.level for claim in deployed.claims}
    assert levels["sampled gain"] < 1.1 * found.gamma and levels["sampled error"] > 0.0
    loop = deployed.loop
    assert isinstance(loop, FeedbackLoop)
    turned = replace(loop, table={index: gain * -1 for index, gain in loop.table.items()}, _systems={})
    search = Search(turned, feedback_names(model), model.parameters, 1)
    assert search.prove(Wish("sampled error", 1e-3))[0] is None


@pytest.mark.parametrize(
    ("model", "design", "words"),
    [
        (third_order(D=[[1]]), {}, "algebraic loop"),
        (third_order(), {"start": ((1.0, 2.0),)}, "shape"),
        (third_order(), {"uses": (("u1", "y2"),)}, "y2"),
        (third_order(), {"uses": (("d1", "y1"),)}, "d1"),
        (third_order(), {"steps": 0}, "0 steps"),
        (small_model([[p, 0], [0, -1]], [[1, 1]], [parameter()], B=[[0], [1]], E=[[1], [0]]), {}, "not stabilisable"),
    ],
)
def test_what_cannot_work_is_refused(model: LpvModel, design: dict[str, Any], words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        design_static_feedback(model, StaticFeedbackDesign((LEVEL,), **design))


def test_an_output_that_the_input_acts_on_may_stay_unused() -> None:
    """The same law as for the model without it; used, it would close an algebraic loop."""
    model = small_model(
        [[0, 1], [1 + p / 2, -1]], [[1, 0], [1, 1]], [parameter(rate=0.2)], B=[[0], [1]], D=[[0], [1]], E=[[0], [1]]
    )
    alone = replace(model, outputs=model.outputs[:1], C=model.C[:1, :], D=model.D[:1, :], F=model.F[:1, :])
    used = StaticFeedbackDesign((LEVEL,), degree=0, start=((-3.0, 0.0),), uses=(("u1", "y1"),), steps=2)
    first = design_static_feedback(model, used)
    second = design_static_feedback(alone, replace(used, start=((-3.0,),)))
    assert first.verdict is Verdict.CERTIFIED and first.gamma == pytest.approx(second.gamma, rel=1e-3)
    np.testing.assert_allclose(first.gain(np.zeros(1))[..., :1], second.gain(np.zeros(1)), rtol=1e-2)
    with pytest.raises(ProblemError, match="algebraic loop"):
        design_static_feedback(model, replace(used, uses=None))


def test_a_plant_that_no_static_law_stabilises() -> None:
    """x'' = u with x alone measured: u = k x leaves both poles on the imaginary axis or sends one to the right."""
    plant = small_model([[0, 1], [0, p / 100]], [[1, 0]], [parameter()], B=[[0], [1]], E=[[0], [1]])
    with pytest.raises(ProblemError, match="another start"):
        design_static_feedback(plant, StaticFeedbackDesign((LEVEL,), degree=0, steps=4))
