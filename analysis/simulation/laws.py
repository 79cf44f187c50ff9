"""What runs beside the plant: the runtime of a schedule as it ships, observer or feedback law, one entry for every run."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from analysis.simulation.plants import SimulatedPlant
from analysis.simulation.signals import begun, places
from analysis.simulation.tape import Tape
from estimators.lpv.controller import LpvController
from estimators.lpv.observer import LpvObserver
from estimators.schedule import GainSchedule
from estimators.velocity.lpv import LpvVelocityObserver


class Beside(Protocol):
    """Acts on the tape before a sample (its inputs) and at the end of it (its estimates)."""

    def before(self, tape: Tape, k: int) -> None:
        """Inputs of sample k."""
        ...

    def after(self, tape: Tape, k: int) -> None:
        """What is known after the measurements of sample k."""
        ...


class NoLaw:
    """The plant alone."""

    def before(self, tape: Tape, k: int) -> None:
        """Nothing."""

    after = before


class ObserverBeside:
    """`LpvObserver`, or `LpvVelocityObserver` for two states, one input and one output."""

    def __init__(
        self, schedule: GainSchedule, body: SimulatedPlant, tape: Tape, estimate: npt.ArrayLike, velocity: bool
    ) -> None:
        runs, count = tape.x.shape[:2]
        self.into = places([s.name for s in schedule.inputs], body.inputs, "input", body.name)
        self.seen = places([s.name for s in schedule.outputs], body.outputs, "output", body.name)
        tape.estimate = np.empty((runs, count, len(schedule.states)))
        tape.estimate[:, 0] = begun(estimate, (runs, len(schedule.states)), "estimate")
        self.any_size = None if velocity else LpvObserver(schedule, (runs,))
        self.two_states = LpvVelocityObserver(schedule, (runs,)) if velocity else None
        for observer in (self.any_size, self.two_states):
            if observer is not None:
                observer.reset(state=tape.estimate[:, 0])

    def before(self, tape: Tape, k: int) -> None:
        """An observer acts on nothing."""

    def after(self, tape: Tape, k: int) -> None:
        """One step of the runtime."""
        u, y, p = tape.u[:, k, self.into], tape.arrived(tape.y[:, k, self.seen], k), tape.p[:, k]
        if self.two_states is not None:
            two = self.two_states.step(u[:, 0], y[:, 0], p[:, 0])
            found, flags = two.estimate, two.flags
        elif self.any_size is not None:
            step = self.any_size.step(u, y, p)
            found, flags = step.estimate, step.flags
        if tape.estimate is not None:
            tape.estimate[:, k + 1], tape.flags[:, k] = found, flags


class ControllerBeside:
    """`LpvController`: it measures while the command of the sample before is held, and then commands."""

    def __init__(self, schedule: GainSchedule, body: SimulatedPlant, tape: Tape) -> None:
        self.body, self.by_states = body, schedule.measured == "states"
        self.into = places([s.name for s in schedule.inputs], body.inputs, "input", body.name)
        signals, there = (schedule.states, body.states) if self.by_states else (schedule.outputs, body.outputs)
        self.seen = places([s.name for s in signals], there, "state" if self.by_states else "output", body.name)
        self.controller = LpvController(schedule, tape.x.shape[:1])
        self.command = np.tile(self.controller.law.rest, (tape.x.shape[0], 1))

    def before(self, tape: Tape, k: int) -> None:
        """One step of the runtime."""
        x, p = tape.x[:, k], tape.p[:, k]
        tape.u[:, k, self.into] = self.command
        measured = x if self.by_states else self.body.output(x, tape.u[:, k], tape.d[:, k], p)
        step = self.controller.step(tape.arrived(measured[:, self.seen], k), p)
        tape.u[:, k, self.into], tape.flags[:, k], self.command = step.command, step.flags, step.command

    def after(self, tape: Tape, k: int) -> None:
        """Nothing more."""


def beside(
    schedule: GainSchedule | None, body: SimulatedPlant, tape: Tape, estimate: npt.ArrayLike, velocity: bool
) -> Beside:
    """The runtime that a schedule asks for. Raises AnalysisError for signals that the plant does not have."""
    if schedule is None:
        return NoLaw()
    if schedule.update == "feedback":
        return ControllerBeside(schedule, body, tape)
    return ObserverBeside(schedule, body, tape, estimate, velocity)
