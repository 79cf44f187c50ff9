"""What is asked of a feedback law: channels from disturbances to performance signals of the closed loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.certificate.claims import ClaimChannel
from synthesis.certificate.verify import Names
from synthesis.design.asked import check_channels
from synthesis.design.norms import Norm
from synthesis.errors import ProblemError
from synthesis.models.lpv import LpvModel


@dataclass(frozen=True, repr=False)
class FeedbackChannel(Display):
    """The gain from some disturbances to some performance signals: bounded by `bound`, or minimised if None.

    `performance` are names of states, outputs or inputs of the model. `weights` are the sizes of the disturbances that count as
    one, `sizes` those of the performance signals, in their order; None: one each. `norm` says what is meant by gain
    (`synthesis.design.norms`): "H-infinity" (the L2 gain), "generalised H2" (the largest signal by energy) or "H2".

    >>> FeedbackChannel(("road",), ("body_acceleration", "force"), sizes=(1.0, 500.0)).name
    'road -> body_acceleration+force'
    """

    disturbances: tuple[str, ...]
    performance: tuple[str, ...]
    bound: float | None = None
    weights: tuple[float, ...] | None = None
    sizes: tuple[float, ...] | None = None
    norm: Norm = "H-infinity"

    @property
    def name(self) -> str:
        """Disturbances and performance signals in words."""
        return f"{'+'.join(self.disturbances)} -> {'+'.join(self.performance)}"

    @property
    def claim(self) -> ClaimChannel:
        """As claims name it."""
        weights = self.weights or (1.0,) * len(self.disturbances)
        return ClaimChannel(dict(zip(self.disturbances, weights, strict=True)), self.performance, self.sizes or ())


def feedback_names(model: LpvModel) -> Names:
    """The signals of a feedback loop (`synthesis.loop.feedback`): its outputs are the plant's states, outputs and inputs."""
    states, outputs, inputs, disturbances = (
        tuple(s.name for s in signals) for signals in (model.states, model.outputs, model.inputs, model.disturbances)
    )
    return Names(states, disturbances, states + outputs + inputs)


def feedback_channel_matrices(model: LpvModel, channel: FeedbackChannel) -> tuple[FloatArray, FloatArray]:
    """W (nd, k) with the sizes of the disturbances, and Z (m, nx + ny + nu) that reads performance signals in theirs.

    Raises ProblemError for names that are unknown or stand twice, and sizes that are too few, too many or not positive.
    """
    names, where = feedback_names(model), f"channel '{channel.name}'"
    places = []
    for what, chosen, known, given in (
        ("disturbance", channel.disturbances, names.disturbances, channel.weights),
        ("performance signal", channel.performance, names.errors, channel.sizes),
    ):
        for name in chosen:
            if name not in known:
                raise ProblemError(f"{where}: {unknown(what, name, known)}")
        twice = next((name for name in chosen if chosen.count(name) > 1), None)
        if twice is not None:
            raise ProblemError(f"{where} has the {what} '{twice}' twice; remove one")
        if given is not None and len(given) != len(chosen):
            raise ProblemError(f"{where} has {len(given)} sizes for {len(chosen)} {what}(s); give one each")
        if not all(0.0 < size < np.inf for size in given or ()):
            raise ProblemError(f"{where} has the sizes {list(given or ())} of its {what}(s); give positive numbers")
        places.append([list(known).index(name) for name in chosen])
    W = np.eye(len(names.disturbances))[:, places[0]] * np.array(channel.weights or (1.0,) * len(places[0]))
    Z = np.eye(len(names.errors))[places[1]] / np.array(channel.sizes or (1.0,) * len(places[1]))[:, None]
    return np.asarray(W), np.asarray(Z)


def check_feedback_channels(channels: tuple[FeedbackChannel, ...]) -> None:
    """As `synthesis.design.asked.check_channels`."""
    check_channels(channels, [channel.performance for channel in channels], "performance signal")
