r"""A feedback law as the table that is deployed: run once a sample, its continuous-time form discretised where it has states.

A law that was designed in continuous time, xk' = Ak xk + Bk v, u = Ck xk + Dk v, is run by the trapezoidal rule,

    xk+ = (I - T Ak/2)^-1 ((I + T Ak/2) xk + T Bk v),    u = Ck (I - T Ak/2)^-1 (xk + T/2 Bk v) + Dk v

or, where the plant's inputs act on a measured output at once (D), by holding v over the sample: then u stays without feedthrough.
Its states stay those of the design (up to terms of order T), so that the table may be interpolated. State feedback with dynamic
weights has an update of its own (`synthesis.design.weighted_state_feedback`). What sampling and interpolation cost is in the
claims.
"""

from __future__ import annotations

from typing import Any, Literal, Protocol, cast

import numpy as np
from flint import fmpq_mat

from estimators.arrays import FloatArray
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.feedback_channel import FeedbackChannel, feedback_channel_matrices
from synthesis.design.hinf_observer import Channel, ObserverGains, channel_matrices
from synthesis.design.state_feedback import GainLimits
from synthesis.design.weighted_state_feedback import Law, WeightedStateFeedback
from synthesis.errors import ProblemError
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.feedback import FeedbackLoop, Measured
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.rational import decimal

OF_STATES = 3  # digits more for a law with states: its slow modes are differences of its entries from one


class LawDesign(Protocol):
    """What was asked of a feedback law."""

    @property
    def channels(self) -> tuple[FeedbackChannel, ...]: ...  # noqa: D102
    @property
    def degree(self) -> int: ...  # noqa: D102
    @property
    def settings(self) -> LmiSettings: ...  # noqa: D102


class FeedbackLaw(Protocol):
    """Gains of a feedback law: of every design of one."""

    @property
    def model(self) -> LpvModel: ...  # noqa: D102
    @property
    def design(self) -> LawDesign: ...  # noqa: D102
    @property
    def result(self) -> LmiResult: ...  # noqa: D102
    @property
    def verdict(self) -> Verdict: ...  # noqa: D102
    @property
    def measured(self) -> Measured: ...  # noqa: D102
    @property
    def order(self) -> int: ...  # noqa: D102
    def controller(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Ak (g, nk, nk), Bk (g, nk, nv), Ck (g, nu, nk), Dk (g, nu, nv) in continuous time."""


Gains = ObserverGains | FeedbackLaw


def update_of(gains: Gains) -> Literal["held", "sampled", "feedback"]:
    """How gains are run; those of an observer say it themselves."""
    update: Literal["held", "sampled", "feedback"] = getattr(gains, "update", "feedback")
    return update


def table_at(gains: Gains, points: FloatArray, sample_time: float) -> FloatArray:
    """What stands in the table at parameter values (g, p): L or K of an observer, [[Ak, Bk], [Ck, Dk]] over a sample of a law."""
    if isinstance(gains, ObserverGains):
        return gains.gain(points)
    if isinstance(gains, WeightedStateFeedback):
        Ak, Bk, Ck, Dk = gains.over_sample(points, sample_time)
        return np.block([[Ak, Bk], [Ck, Dk]])
    Ak, Bk, Ck, Dk = gains.controller(points)
    if gains.order:
        D = gains.model.on(points).D
        used = (Bk.any(axis=(0, 1)) | Dk.any(axis=(0, 1))) if gains.measured == "outputs" else np.zeros(0, dtype=bool)
        through = gains.measured == "outputs" and bool(D[:, used].any())
        Ak, Bk, Ck, Dk = (_held if through else _trapezoidal)(Ak, Bk, Ck, Dk, sample_time)
    return np.block([[Ak, Bk], [Ck, Dk]])


def refuse_beyond_limits(gains: Gains, table: FloatArray) -> None:
    """Raise ProblemError where a deployed gain breaks a limit of its design: |K_i S|, convex in K, is largest at a breakpoint."""
    limits = getattr(gains.design, "limits", None)
    if not isinstance(limits, GainLimits):
        return
    sizes = np.array([limits.sizes[s.name] for s in gains.model.states])
    order = 0 if isinstance(gains, ObserverGains) else gains.order
    rows = table.reshape(-1, *table.shape[-2:])[:, order:, : len(sizes)]  # first of the law's own states, which weigh
    largest = np.linalg.norm(rows * np.roll(sizes, order), axis=-1).max(axis=0)
    for signal, found in zip(gains.model.inputs, largest, strict=True):
        if signal.name in limits.inputs and not found <= limits.inputs[signal.name]:
            raise ProblemError(
                f"the table commands up to {found:.6g} {signal.unit} of {signal.name} for states of their sizes, its limit is "
                f"{limits.inputs[signal.name]:g} {signal.unit}; give the design more reserve"
            )


def extra_digits(gains: Gains) -> int:
    """How many digits more than those of an observer's gains are kept."""
    return OF_STATES if not isinstance(gains, ObserverGains) and gains.order else 0


def deployed_loop(
    gains: Gains, breakpoints: tuple[FloatArray, ...], table: FloatArray, sample_time: float
) -> ObserverLoop | FeedbackLoop:
    """A table in closed loop with its model, run with the update of its design."""
    entries: dict[tuple[int, ...], fmpq_mat] = {
        index: fmpq_mat([[decimal(float(x)) for x in row] for row in table[index]])
        for index in np.ndindex(table.shape[:-2])
    }
    points = tuple(tuple(decimal(float(value)) for value in line) for line in breakpoints)
    plant, period = plant_of(gains.model), decimal(sample_time)
    if isinstance(gains, ObserverGains):
        return ObserverLoop(plant, points, entries, gains.update, period)
    return FeedbackLoop(plant, points, entries, gains.measured, gains.order, period)


def update_section(gains: Gains, settings: DeploySettings) -> dict[str, Any]:
    """The section `update` of a schedule file. Raises ProblemError for limits of an input that the model does not have."""
    section: dict[str, Any] = {"kind": update_of(gains), "sample_time": settings.sample_time}
    if update_of(gains) == "feedback":
        law = cast(FeedbackLaw, gains)
        section |= {"measured": law.measured, "order": law.order}
        names = [signal.name for signal in law.model.inputs]
        stray = next((name for name in settings.limits if name not in names), None)
        if stray is not None:
            raise ProblemError(f"limits: '{stray}' is no input of model '{law.model.name}'; inputs: {', '.join(names)}")
        if settings.limits:
            section["limits"] = [list(settings.limits[name]) if name in settings.limits else None for name in names]
    return section


def matrices_of(model: LpvModel, channel: Channel | FeedbackChannel) -> tuple[FloatArray, FloatArray]:
    """W of the disturbances and Z of the errors or performance signals of a channel (`synthesis.certificate.frozen`)."""
    if isinstance(channel, FeedbackChannel):
        return feedback_channel_matrices(model, channel)
    return channel_matrices(model, channel)


def _trapezoidal(A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, period: float) -> Law:
    half = 0.5 * period * A
    unit = np.eye(A.shape[-1])
    inverse = np.linalg.inv(unit - half)
    read = C @ inverse
    return inverse @ (unit + half), period * inverse @ B, read, D + 0.5 * period * read @ B


def _held(A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, period: float) -> Law:
    return *zero_order_hold(A, B, period), C, D
