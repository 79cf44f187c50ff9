"""Wu's problem: stiff (poles from 0.2 to 1000 1/s), with noise that costs nothing to steer and weights that nothing steers."""

from __future__ import annotations

import numpy as np

from synthesis.design.generalised_plant import frame_of, generalised_plant
from synthesis.design.halves import halves_of
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.lmi.result import Verdict
from tests.support.output_loops import frozen_gain
from tests.support.wu import CHANNEL, wu_plant


def test_an_eighth_of_the_circle_is_solved_in_few_steps() -> None:
    """The whole circle, with laws that follow the angle, is `tests/bench/test_wu.py`: the same numerics with more unknowns."""
    model = wu_plant(np.pi / 4, 3)
    found = design_output_feedback(model, OutputFeedbackDesign((CHANNEL,), degree=0))
    assert found.verdict is Verdict.CERTIFIED and found.gamma_lower is not None
    assert found.gamma_lower <= found.gamma <= 1.012 * found.gamma_lower
    line = np.linspace(-np.pi / 4, np.pi / 4, 9)
    assert 0.98 * found.gamma < frozen_gain(found, CHANNEL, line) <= found.gamma
    assert found.optimum.report.iterations < 35  # 43 in one coordinate system for both halves


def test_both_halves_are_near_one_in_their_coordinates() -> None:
    """J = T_r T_f^-1, both of its halves being those of two Riccati equations; one system of coordinates spreads them by 1e8."""
    plant = generalised_plant(wu_plant(np.pi / 4, 5), (CHANNEL,))
    frame = frame_of(plant)
    halves = halves_of(plant, frame)
    J = frame.regulator @ np.linalg.inv(frame.filter)
    np.testing.assert_allclose(halves.joint, J, rtol=1e-6, atol=1e-9)
    spread = np.linalg.eigvalsh(J)
    assert spread[0] < 1e-4 and 0.99 < spread[-1] < 1.01
    for half in "YX":
        speed = np.abs(np.diag(halves.half(half).A[0])) * halves.weights[half] ** 2
        assert 0.0 < speed.max() <= 1.0
