"""Units in which a feedback design is solved: states by what they cost, inputs by what they move, time by the loop's speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.feedback_channel import FeedbackChannel, feedback_channel_matrices
from synthesis.lmi.scaling import HEAVY, error_scale, regular_riccati
from synthesis.models.extract import PolynomialModel
from synthesis.models.lpv import LpvModel


@dataclass(frozen=True)
class FeedbackScale:
    """The states diag(states) x, the inputs u / inputs, disturbances d / disturbance, and time counted in units of 1/clock s."""

    states: FloatArray
    inputs: FloatArray
    disturbance: float
    clock: float

    def applied(self, model: PolynomialModel) -> PolynomialModel:
        """The matrices in scaled states and inputs; outputs, disturbances and time as they are."""
        scaled = model.with_states_scaled(self.states)
        return replace(scaled, B=scaled.B * self.inputs, D=scaled.D * self.inputs)


def feedback_scale(model: LpvModel, channels: Sequence[FeedbackChannel]) -> FeedbackScale:
    """The dual of the scaling of observers (`synthesis.lmi.scaling`), in the middle of the range.

    A state is scaled by the square root of what one of it costs under the best feedback, where every performance signal counts in
    the smallest size that a channel gives it. An input is scaled by what the best feedback commands for a scaled state, over
    `HEAVY`: decisions of least norm are gains of least norm first. The clock is a power of 1e6, and one for speeds from 0.01 to
    1e4 1/s.
    """
    count = len(model.parameters)
    middle = model.on(np.array([[p.middle for p in model.parameters]]).reshape(1, count))
    A, B, C, D, E = (getattr(middle, key)[0] for key in "ABCDE")
    pairs = [feedback_channel_matrices(model, channel) for channel in channels]
    weights = np.max([np.abs(Z).max(axis=0) for _, Z in pairs], axis=0)
    used = weights > 0.0
    shown = (weights[:, None] * np.vstack([np.eye(len(A)), C, np.zeros((B.shape[1], len(A)))]))[used]
    driven = (weights[:, None] * np.vstack([np.zeros_like(B), D, np.eye(B.shape[1])]))[used]
    found = regular_riccati(A.T, B.T, shown.T, driven.T)
    states = np.sqrt(np.diag(found[0])) if found is not None else 1.0 / error_scale(A.T)
    speed = max(float(np.linalg.norm(A * states[:, None] / states, 2)), float(np.linalg.norm(shown / states, 2)) ** 2)
    clock = 10.0 ** (6 * round((np.log10(speed) - 1.0) / 6)) if 0.0 < speed < np.inf else 1.0
    states = states / np.sqrt(clock)
    # Without a best feedback: an input that moves scaled states at the speed of the loop.
    gain = found[1].T / states if found is not None else speed / np.where(B.T * states, B.T * states, np.inf)
    size = np.linalg.norm(gain, axis=1)
    inputs = np.where(size > 0.0, size, 1.0) / HEAVY
    unit = max(float(np.abs((E @ W) * states[:, None]).max(initial=0.0)) for W, _ in pairs)
    return FeedbackScale(states, inputs, unit or 1.0, clock)
