"""A design does not depend on the units in which its plant is written: the same levels, and the same gains in other numbers."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from estimators.arrays import FloatArray
from studies.spec import any_model
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, design_observer
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model
from tests.support.units import Units, in_units, random_units, same_units

PERIOD = 0.05
DIGITS = 3e-6  # relative: the accuracy that is asked of the solver is 1e-6
p = sp.Symbol("p")

Answer = tuple[
    float, FloatArray
]  # least level that the solver sees, and gains, in the units of the plant as first written


def plant() -> LpvModel:
    """Three states of which one is unstable, two inputs, two outputs of which one has no noise."""
    return small_model(
        [[-1 + p / 2, 1 + p / 4, 0], [0, sp.Rational(1, 5), 1], [0, -2, -1]], [[1, 0, 0], [0, 1, 0]], [parameter(rate=2.0)],
        B=[[0, 1], [0, p / 4], [1, 0]], E=[[1, 0, 0], [1, 0, 0], [0, 1, 0]], F=[[0, 0, sp.Rational(1, 10)], [0, 0, 0]],
    )  # fmt: skip


def of_observer(found: ObserverGains, units: Units, error: int) -> Answer:
    assert found.verdict is Verdict.CERTIFIED and found.gamma_lower is not None
    points = np.array([0.7 * q.maximum + 0.3 * q.minimum for q in found.model.parameters]).reshape(1, -1)
    return found.gamma_lower / units.states[error], found.gain(points)[0] * units.outputs / units.states[:, None]


def turbine(update: str, units: Units) -> Answer:
    weights = np.array([0.5, 0.02, 0.5, 0.002]) * units.disturbances  # MN m/s, rad/s, rad/s, rad
    model = in_units(any_model("wind-turbine"), units)
    names = tuple(signal.name for signal in model.disturbances)
    design = ObserverDesign((Channel(names, ("wind_torque",), weights=tuple(weights)),), backoff=0.02)
    found = design_observer(model, design) if update == "held" else design_sampled_observer(model, design, PERIOD)
    return of_observer(found, units, 2)


def feedback_channel(units: Units) -> FeedbackChannel:
    sizes = *units.states[:2], *units.inputs
    return FeedbackChannel(("d1", "d2", "d3"), ("x1", "x2", "u1", "u2"), weights=tuple(units.disturbances), sizes=sizes)


def by_state(units: Units) -> Answer:
    found = design_state_feedback(in_units(plant(), units), StateFeedbackDesign((feedback_channel(units),)))
    assert found.verdict is Verdict.CERTIFIED and found.gamma_lower is not None
    return found.gamma_lower, found.gain(np.array([0.4]))[0] * units.states / units.inputs[:, None]


def by_output(units: Units) -> Answer:
    model, channels = in_units(plant(), units), (feedback_channel(units),)
    found = design_output_feedback(model, OutputFeedbackDesign(channels, decay_rate=0.1, still="Y"))
    assert found.verdict is Verdict.CERTIFIED and found.gamma_lower is not None
    A, B, C, D = (matrix[0] for matrix in found.controller(np.array([0.4])))
    x, u, y = units.states, units.inputs, units.outputs
    top = np.hstack([A * x / x[:, None], B * y / x[:, None]])
    return found.gamma_lower, np.vstack([top, np.hstack([C * x / u[:, None], D * y / u[:, None]])])


WAYS = {
    "held observer": lambda units: turbine("held", units),
    "sampled observer": lambda units: turbine("sampled", units),
    "state feedback": by_state,
    "output feedback": by_output,
}


def test_the_turbine_in_newton_metres_and_in_meganewton_metres() -> None:
    mega = same_units(any_model("wind-turbine"))
    newton = Units(np.array([1.0, 1.0, 1e6]), mega.inputs, mega.outputs, np.array([1e6, 1.0, 1.0, 1.0]))
    (gamma, gains), (other, others) = turbine("sampled", mega), turbine("sampled", newton)
    assert other == pytest.approx(gamma, rel=DIGITS)
    np.testing.assert_allclose(others, gains, rtol=1e-3, atol=1e-6 * np.abs(gains).max())


@pytest.mark.parametrize("way", WAYS)
def test_units_of_every_signal_from_a_millionth_to_a_million(way: str) -> None:
    """Levels to what the solver is asked for; gains of least norm are found to a thousandth of that norm."""
    model, design = (any_model("wind-turbine") if "observer" in way else plant()), WAYS[way]
    gamma, gains = design(same_units(model))
    other, others = design(random_units(model, np.random.default_rng(1)))
    assert other == pytest.approx(gamma, rel=DIGITS)
    np.testing.assert_allclose(others, gains, rtol=1e-3, atol=1e-3 * np.abs(gains).max())


def test_a_size_that_keeps_its_number_in_another_unit_is_another_question() -> None:
    model = any_model("wind-turbine")
    mega = same_units(model)
    louder = Units(mega.states, mega.inputs, mega.outputs, np.array([1.0, 1.0, 2.0, 1.0]))
    quiet = turbine("sampled", mega)[0]
    names = tuple(signal.name for signal in model.disturbances)
    same_numbers = Channel(names, ("wind_torque",), weights=(0.5, 0.02, 0.5, 0.002))
    found = design_sampled_observer(in_units(model, louder), ObserverDesign((same_numbers,), backoff=0.02), PERIOD)
    assert found.gamma_lower is not None and abs(found.gamma_lower / quiet - 1.0) > 0.01
