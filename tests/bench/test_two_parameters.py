"""Output feedback over two parameters, from the model to the table with its claims: processor time and memory."""

from __future__ import annotations

import resource
from typing import Any

import numpy as np
import pytest
import sympy as sp

from synthesis.design.deploy import deploy
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.output_feedback import OutputFeedback, OutputFeedbackDesign, design_output_feedback
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model
from tests.support.output_loops import frozen_gain

p, q = sp.symbols("p q")
PAIR = (parameter("p"), parameter("q"))
TENTH, HALF = sp.Rational(1, 10), sp.Rational(1, 2)
SMALL = small_model([[0, 1], [-4 - p, -HALF - q / 4]], [[1, 0]], PAIR, B=[[0], [1]], E=[[0, 0], [1, 0]], F=[[0, TENTH]])
LARGE = small_model(  # two masses, of which one is pushed: eight states of the closed loop
    [[0, 1, 0, 0], [-4 - p, -HALF, 2, 0], [0, 0, 0, 1], [2, 0, -6 - q, -4 * TENTH]], [[1, 0, 0, 0], [0, 0, 1, 0]], PAIR,
    B=[[0], [1], [0], [0]], E=[[0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]], F=[[0, TENTH, 0], [0, 0, TENTH]],
)  # fmt: skip
CHANNELS = {
    2: FeedbackChannel(("d1", "d2"), ("x1", "u1")),
    4: FeedbackChannel(("d1", "d2", "d3"), ("x1", "x3", "u1")),
}
MOST = 2e6  # kB


def designed(model: LpvModel) -> OutputFeedback:
    """With its level checked by frequency responses in the corners and the middle."""
    channel = CHANNELS[len(model.states)]
    found = design_output_feedback(model, OutputFeedbackDesign((channel,), still="Y"))
    places = np.array([(x, y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])
    assert found.verdict is Verdict.CERTIFIED
    assert 0.8 * found.gamma < frozen_gain(found, channel, places) <= found.gamma
    return found


def test_four_states_of_the_closed_loop_and_what_rates_cost() -> None:
    """Parameters that jump leave no Lyapunov matrix that follows them: that costs something, and takes nothing off."""
    jumping = small_model(
        SMALL.A, SMALL.C, (parameter("p", rate=np.inf), parameter("q", rate=np.inf)), B=SMALL.B, E=SMALL.E, F=SMALL.F
    )
    assert designed(SMALL).gamma < designed(jumping).gamma


def test_eight_states_of_the_closed_loop(benchmark: Any) -> None:
    if benchmark.disabled:
        pytest.skip("long; runs when benchmarks are enabled")
    found = benchmark.pedantic(lambda: deploy(designed(LARGE)), rounds=1)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    benchmark.extra_info |= {"GB at most": round(peak / 1e6, 2), "table": found.table.shape}
    assert found.claims and peak < MOST
