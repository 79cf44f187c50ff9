"""The channel of a claim along parameter trajectories, for observers and feedback laws."""

from __future__ import annotations

import numpy as np

from analysis.simulation.closed_loop import closed_loop
from analysis.simulation.error_update import error_update
from analysis.simulation.linear import Linear
from analysis.simulation.plants import matrices_of
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from synthesis.certificate.claims import ERROR_EQUATION, WITH_CHANNEL, ClaimChannel, rows_of


def channel_of(schedule: GainSchedule, kind: str, channel: ClaimChannel, p: FloatArray) -> Linear:
    """At parameters (..., p): inputs and outputs of the channel, as numbers of their sizes.

    Of the update over a sample, or for a claim about the error equation of x' = A x + B w.
    """
    lead, flat = p.shape[:-1], p.reshape(-1, p.shape[-1])
    group = WITH_CHANNEL[kind]
    signals = schedule.disturbances if group == "disturbances" else schedule.states
    places, sizes = rows_of([s.name for s in signals], channel)
    A, B, C, D = _error_equation(schedule, flat) if kind in ERROR_EQUATION else _loop(schedule, group, flat)
    shown = [s.name for s in schedule.states]
    if schedule.update == "feedback":
        shown += [s.name for s in (*schedule.outputs, *schedule.inputs)]
    rows = [shown.index(name) for name in channel.errors]
    scale = 1.0 / np.array(channel.error_sizes)[:, None]
    found = A, B[..., places] * sizes, C[:, rows] * scale, D[:, rows][..., places] * scale * sizes
    return Linear(*(part.reshape(*lead, *part.shape[1:]) for part in found))


def _loop(schedule: GainSchedule, group: str, p: FloatArray) -> Linear:
    """The whole loop; the outputs of an observer's are its estimation errors."""
    if schedule.update == "feedback":
        gain = schedule.gain(p[:, 0] if len(schedule.parameters) == 1 else p)
        by_states = schedule.measured == "states"
        return closed_loop(matrices_of(schedule, p), gain, by_states, schedule.order, schedule.sample_time)
    A, B = error_update(schedule, p)
    eye = np.broadcast_to(np.eye(len(schedule.states)), A.shape)
    return Linear(A, B[group], eye, np.zeros_like(B[group]))


def _error_equation(schedule: GainSchedule, p: FloatArray) -> Linear:
    """e' = (A - L C) e + (E - L F) d."""
    A, _, C, _, E, F = matrices_of(schedule, p)
    gain = schedule.gain(p[:, 0] if len(schedule.parameters) == 1 else p)
    eye = np.broadcast_to(np.eye(len(schedule.states)), A.shape)
    return Linear(A - gain @ C, E - gain @ F, eye, np.zeros_like(E))
