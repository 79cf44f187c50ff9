"""Laws, rational plants and jitter on a set of parameters that is no box: the cut-off corner carries the worst case of the box.

x' = a(p, q) x + u + d, z = (x, u), a < 0: for u = -k x the gain is ((1 + k^2)/(k - a)^2)^(1/2), least at k = -1/a, where it is
(1 + a^2)^(-1/2). A law of one gain has to do so at the largest a. Dynamic output feedback from y = x + noise/2 has the same level
there: of its two scalar Riccati equations that of the estimate asks for less.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import pytest
import sympy as sp
from flint import fmpq, fmpq_mat

from analysis.uncertainty.jitter import holds, jitter_claim
from synthesis.certificate.proof import prove
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.design.sampled_state_feedback import design_sampled_state_feedback
from synthesis.design.state_feedback import StateFeedbackDesign
from synthesis.design.static_feedback import design_static_feedback
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.errors import ProblemError
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.models.constraint import ParameterConstraint
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")
PLANTS = {
    "polynomial": (p + q - 3, -1.0, -3.0),
    "rational": (-8 / (4 + p + q), -8.0 / 6.0, -2.0),
}  # largest a: box, set
CHANNEL, NOISY = (FeedbackChannel(inputs, ("x1", "u1")) for inputs in (("d1",), ("d1", "d2")))


def plant(a: sp.Expr, *, cut: bool, noise: float | sp.Rational = 0) -> LpvModel:
    model = small_model(
        [[a]], [[1]], [parameter("p"), parameter("q")], B=[[1]], E=[[1, 0]], F=[[0, noise]]
    )  # fmt: skip
    return replace(model, constraints=(ParameterConstraint({"p": 1.0, "q": 1.0}, 0.0),)) if cut else model


def static(a: sp.Expr, cut: bool) -> Any:
    return design_static_feedback(plant(a, cut=cut), StaticFeedbackDesign((CHANNEL,), degree=0))


def dynamic(a: sp.Expr, cut: bool) -> Any:
    design = OutputFeedbackDesign((NOISY,), degree=0, fastest_pole=20.0)
    return design_output_feedback(plant(a, cut=cut, noise=sp.Rational(1, 2)), design)


def sampled(a: sp.Expr, cut: bool) -> Any:
    return design_sampled_state_feedback(plant(a, cut=cut), StateFeedbackDesign((CHANNEL,), degree=0), 0.05)


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("design", [static, dynamic, sampled])
def test_the_level_is_that_of_the_worst_corner_that_is_left(design: Callable[..., Any], name: str) -> None:
    a, box, cut = PLANTS[name]
    for worst, gains in ((box, design(a, False)), (cut, design(a, True))):
        level = (1.0 + worst**2) ** -0.5
        assert level <= gains.gamma < 1.025 * level


@pytest.mark.parametrize(("design", "name"), [(static, "rational"), (dynamic, "polynomial")])
def test_tables_are_proved_on_the_set_and_not_on_the_box(design: Callable[..., Any], name: str) -> None:
    """The level of the set is claimed; on the box, whose level is larger, the same claim is refuted."""
    a, box, cut = PLANTS[name]
    content = schedule_content(deploy(design(a, True), DeploySettings(sample_time=0.05)), "cut")
    found = next(proof for proof in prove(content) if proof.kind == "sampled gain")
    assert found.proved
    assert (1.0 + cut**2) ** -0.5 < found.level < 1.03 * (1.0 + cut**2) ** -0.5 < (1.0 + box**2) ** -0.5
    whole = copy.deepcopy(content)
    del whole["constraints"]
    assert next(proof for proof in prove(whole) if proof.kind == "sampled gain").refuted


@pytest.mark.parametrize(("most", "good"), [(0.4, True), (0.8, False)])
def test_jitter_on_a_set(most: float, good: bool) -> None:
    """e+ = (e^(a T) - 1) e with a = p + q and T up to 1 s: stable for a < ln 2, which the box (a up to 1) is not."""
    model = small_model([[p + q]], [[1]], [parameter("p", -0.5, 0.5), parameter("q", -0.5, 0.5)])
    cut = replace(model, constraints=(ParameterConstraint({"p": 1.0, "q": 1.0}, most),))
    lines = ((fmpq(-1, 2), fmpq(1, 2)),) * 2
    table = dict.fromkeys(product((0, 1), repeat=2), fmpq_mat([[1]]))
    observer = ObserverLoop(plant_of(cut), lines, table, "sampled", fmpq(1))
    claim = jitter_claim(observer, cut.parameters, 0.95, 1.0, degree=0)
    assert (claim is not None) == good
    if claim is not None:
        assert not holds(replace(observer, plant=plant_of(model), _systems={}), 0.95, 1.0, claim)


def test_a_table_that_would_be_too_large_is_made_coarser_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synthesis.design.deploy.MOST_ENTRIES", 4)
    with pytest.raises(ProblemError, match="no table with up to 1 x 1 segments keeps the guarantee"):
        deploy(dynamic(p + q - 3, True), DeploySettings(sample_time=0.05, interpolation_cost=1e-9))
