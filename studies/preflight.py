"""What can be refused before a design is begun: names, units, form of the file to be written, hidden modes, singular problems."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import sympy as sp

from analysis.observability.hidden_modes import undetectable_mode, unstabilisable_mode
from estimators.arrays import FloatArray
from estimators.schedule import check_content
from studies.law_spec import form_of
from studies.spec import ScheduleSpec
from synthesis.certificate.content import subject_of
from synthesis.design.deploy import Deployment
from synthesis.design.export import schedule_content
from synthesis.design.feedback_channel import FeedbackChannel, feedback_channel_matrices
from synthesis.design.generalised_plant import measured_rows
from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, channel_matrices
from synthesis.design.output_feedback import OutputFeedbackDesign
from synthesis.design.refusals import refuse_feedthrough, refuse_undetectable
from synthesis.design.state_feedback import StateFeedbackDesign, check_limits
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.design.weighted_state_feedback import check_weighted_states
from synthesis.errors import ProblemError
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.half_spaces import Faces

RANK = 1e-9  # of the largest singular value: less is no noise at all


def check_before_design(spec: ScheduleSpec, model: LpvModel) -> None:
    """Raise GainsmithError, one line, for what no solver can change."""
    if spec.law is not None:
        _check_feedback(spec, model)
    else:
        _check_observer(spec, model)
    check_file(spec, model)


def _check_observer(spec: ScheduleSpec, model: LpvModel) -> None:
    design = spec.observer_design()
    forces = [channel_matrices(model, channel)[0] for channel in design.channels]  # refuses names that are not known
    _check_channels(design)
    _check_effect(model, design.channels, forces)
    hidden = undetectable_mode(model)
    if hidden is not None:
        raise ProblemError(
            f"model '{model.name}' is not detectable: {hidden.words} does not decay and does not show in the output(s) "
            f"{', '.join(o.name for o in model.outputs)}; measure it, or shrink the range"
        )
    if design.fastest_pole is None and not design.regions.bounded and spec.deploy.update == "held":
        _check_noise(model, forces)


def _check_feedback(spec: ScheduleSpec, model: LpvModel) -> None:
    """Names, sizes and limits; a mode that no input moves; inputs that cost nothing, whose gains have no bound."""
    design = spec.feedback_design()
    pairs = [feedback_channel_matrices(model, channel) for channel in design.channels]
    limits = design.limits if isinstance(design, StateFeedbackDesign) else None
    check_limits(model, limits)
    for channel, (W, Z) in zip(design.channels, pairs, strict=True):
        if channel.norm != "H-infinity" and spec.law in ("state feedback", "output feedback"):
            refuse_feedthrough(model, channel, Z, W)
    if spec.weight_states and isinstance(design, StateFeedbackDesign):
        check_weighted_states(model, spec.weight_states)
    forces = [W for W, _ in pairs]
    _check_effect(model, design.channels, forces)
    if not model.inputs:
        raise ProblemError(f"model '{model.name}' has no input; a feedback law needs one")
    hidden = unstabilisable_mode(model)
    if hidden is not None:
        raise ProblemError(
            f"model '{model.name}' is not stabilisable: {hidden.words} does not decay and is moved by none of the input(s) "
            f"{', '.join(u.name for u in model.inputs)}; give it an input, or shrink the range"
        )
    if not isinstance(design, StateFeedbackDesign):
        refuse_undetectable(model, measured_rows(model, getattr(design, "measured", None)))
    if design.fastest_pole is not None or (not isinstance(design, StaticFeedbackDesign) and design.regions.bounded):
        return
    if isinstance(design, OutputFeedbackDesign):
        _check_noise(model, forces, measured_rows(model, design.measured))
    limited = () if limits is None else tuple(limits.inputs)
    bounds = "fastest_pole or input_limits" if isinstance(design, StateFeedbackDesign) else "fastest_pole"
    acting = sp.Matrix.vstack(model.D, sp.eye(len(model.inputs)))
    for i, signal in enumerate(model.inputs):
        rows = [len(model.states) + k for k, entry in enumerate(acting[:, i]) if entry != 0]
        if signal.name not in limited and not any(Z[:, rows].any() for _, Z in pairs):
            raise ProblemError(
                f"model '{model.name}': no channel sees the input {signal.name}, so its gains have no bound; put it into the "
                f"performance of a channel with a size, or give {bounds}"
            )


def check_file(spec: ScheduleSpec, model: LpvModel) -> None:
    """The file with a table of zeros in it, before hours are spent on the gains: form, limits, formulas, units."""
    lines = tuple(np.array([p.minimum, p.maximum]) for p in model.parameters)
    gains: Any
    if spec.law is not None:
        design = spec.feedback_design()
        measured, order = form_of(model, design, spec.weight_states)
        shape = order + len(model.inputs), order + len(model.states if measured == "states" else model.outputs)
        gains = SimpleNamespace(model=model, design=design, measured=measured, order=order)
    else:
        shape, empty = (len(model.states), len(model.outputs)), cast(Any, None)
        gains = ObserverGains(
            spec.observer_design(),
            model,
            None,
            0.0,
            empty,
            empty,
            np.ones(0),
            spec.deploy.update,
            spec.deploy.sample_time,
        )
    table = np.zeros((*map(len, lines), *shape))
    blank = Deployment(gains, spec.deploy_settings(), lines, table, (), 0.0)
    content = schedule_content(blank, spec.name, spec.description)
    where = f"model '{model.name}' cannot be exported"
    check_content(content, where)
    subject_of(content, where)


def _check_channels(design: ObserverDesign) -> None:
    for channel in design.channels:
        for what, names in (("disturbance", channel.disturbances), ("error", channel.errors)):
            twice = next((name for name in names if names.count(name) > 1), None)
            if twice is not None:
                raise ProblemError(f"channel '{channel.name}' has the {what} '{twice}' twice; remove one")


def _check_effect(model: LpvModel, channels: Sequence[Channel | FeedbackChannel], forces: list[FloatArray]) -> None:
    """A channel through which nothing comes has the gain zero, whatever the gains are."""
    effects = sp.Matrix.vstack(model.E, model.F)
    for channel, force in zip(channels, forces, strict=True):
        for name, column in zip(channel.disturbances, force.T, strict=True):
            place = int(np.argmax(column))
            if not any(effects[:, place]):
                raise ProblemError(
                    f"channel '{channel.name}': disturbance '{name}' acts on no state and no output of model '{model.name}'; "
                    "give it a column in E or F, or leave it out"
                )


def _check_noise(model: LpvModel, forces: list[FloatArray], rows: Sequence[int] | None = None) -> None:
    """Without noise on some combination of outputs, gains grow without bound while the level falls: a singular problem."""
    corners = np.stack(np.meshgrid(*[[p.minimum, p.middle, p.maximum] for p in model.parameters], indexing="ij"), -1)
    if model.half_spaces:
        corners = model.physical(
            Faces.of(model.half_spaces).on_lines([np.linspace(-1.0, 1.0, 3)] * len(model.parameters))
        )
    places = range(len(model.outputs)) if rows is None else rows
    F = model.on(corners.reshape(-1, len(model.parameters))).F[:, list(places)] @ np.hstack(forces)
    size = np.linalg.norm(F, axis=-1, keepdims=True)
    scaled = F / np.where(size > 0.0, size, 1.0)  # outputs in units of their noise
    values, names = np.linalg.svd(scaled, compute_uv=False), [model.outputs[i].name for i in places]
    rank = (values > RANK * np.maximum(values[:, :1], 1e-300)).sum(axis=-1).min() if F.shape[-1] else 0
    if rank < len(names):
        free = [name for name, row in zip(names, size[..., 0].T, strict=True) if not row.all()] or names
        raise ProblemError(
            f"model '{model.name}': no channel has noise on {', '.join(free)}, so the gains have no bound; put measurement "
            "noise into a channel, or give fastest_pole"
        )
