"""Simulate a plant with the runtime of a schedule along parameter trajectories, many runs at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import numpy.typing as npt

from analysis.errors import AnalysisError
from analysis.simulation.continuous_loop import ContinuousLoop
from analysis.simulation.laws import Beside, beside
from analysis.simulation.nonlinear import NonlinearPlant
from analysis.simulation.plants import LinearPlant, SimulatedPlant
from analysis.simulation.signals import Signals, begun, followed, laid, white_or_given
from analysis.simulation.simulation import Simulation
from analysis.simulation.tape import Tape
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from synthesis.models.lpv import LpvModel

PARTS = 2  # of a sample while parameters move through it
Feedback = Callable[[int, FloatArray, FloatArray, FloatArray], npt.ArrayLike]


def simulate(
    plant: GainSchedule | LpvModel | NonlinearPlant | ContinuousLoop,
    schedule: GainSchedule | None = None,
    parameters: npt.ArrayLike | None = None,
    *,
    disturbances: Signals | None = None,
    inputs: Signals | Feedback | None = None,
    start: npt.ArrayLike = 0.0,
    estimate: npt.ArrayLike = 0.0,
    drops: float = 0.0,
    runs: int = 0,
    samples: int = 0,
    sample_time: float | None = None,
    between: Literal["held", "moving"] = "held",
    observer: Literal["any size", "velocity"] = "any size",
    seed: int = 0,
) -> Simulation:
    """x' = A x + B u + E d, y = C x + D u + F d (or the nonlinear truth) beside the runtime of `schedule`, u and d held.

    Args:
        plant: a schedule (its own plant, in the numbers of the runtime), a model, a `NonlinearPlant`, which schedules itself, or
            a `ContinuousLoop`, which has its law inside.
        schedule: its runtime estimates, or commands the plant's inputs; signals are found by name. None: the plant alone.
        parameters: (runs, samples + 1, p) at the sample instants, as `random_trajectories` makes them; for a nonlinear plant
            give `runs` and `samples` instead.
        disturbances: by name a size (standard deviation of a white sequence, one value a sample) or the values themselves,
            (samples,) or (runs, samples). Those that are not named are zero.
        inputs: likewise, by name; a number is a constant. Or a law u(k, x, estimate, p) of arrays (runs, ..), called once a
            sample, which returns (runs, nu); without a schedule its estimate is x.
        start, estimate: state and estimate at the beginning, broadcast to (runs, nx).
        drops: probability that all measurements of a sample are lost, each sample for itself.
        sample_time: s; None: that of the schedule.
        between: parameters stand still over a sample ("held", what the claims about an update say), or move linearly.
        observer: the runtime: `LpvObserver`, or `LpvVelocityObserver` for two states, one input and one output.

    Raises AnalysisError for names, shapes and counts that do not fit.

    >>> from analysis import random_trajectories
    >>> schedule = GainSchedule.shipped("corner-estimation-longitudinal")
    >>> paths = random_trajectories(schedule, samples=100, runs=4)
    >>> simulate(schedule, schedule, paths, disturbances={"force_noise": 0.01}).error.shape
    (4, 101, 2)
    """
    if isinstance(plant, NonlinearPlant):
        body: SimulatedPlant = plant
        path = np.zeros((runs, samples + 1, len(plant.parameters)))
    else:
        system = plant.schedule if isinstance(plant, ContinuousLoop) else plant
        body = plant if isinstance(plant, ContinuousLoop) else LinearPlant(plant, PARTS if between == "moving" else 0)
        if parameters is None:
            raise AnalysisError(
                f"'{plant.name}' needs parameters (runs, samples + 1, p); random_trajectories() makes some"
            )
        path = followed(system, parameters)
    count, length = path.shape[0], path.shape[1] - 1
    if not (count >= 1 and length >= 1):
        raise AnalysisError(f"runs = {count}, samples = {length}; give 1 of each at least")
    period, rng, size = _period(plant, schedule, sample_time), np.random.default_rng(seed), len(body.states)
    d = white_or_given(disturbances or {}, body.disturbances, (count, length), rng)
    u = laid({} if callable(inputs) else inputs or {}, body.inputs, (count, length), "input")
    lost = rng.uniform(size=(count, length)) < drops
    x = np.empty((count, length + 1, size))
    x[:, 0] = begun(start, (count, size), "start")
    y = np.empty((count, length, len(body.outputs)))
    tape = Tape(x, path, u, d, y, np.zeros((count, length), np.int32), lost)
    law = beside(schedule, body, tape, estimate, observer == "velocity")
    _run(body, law, inputs if callable(inputs) else None, tape, period)
    time: FloatArray = np.asarray(period * np.arange(length + 1), float)
    return Simulation(
        time, tape.x, tape.estimate, tape.p, tape.u, tape.d, tape.y, tape.flags,
        body.states, body.parameters, body.inputs, body.disturbances, body.outputs,
    )  # fmt: skip


def _run(body: SimulatedPlant, law: Beside, feedback: Feedback | None, tape: Tape, period: float) -> None:
    """All samples, one after the other; every operation is on all runs."""
    for k in range(tape.u.shape[1]):
        x, d, p = tape.x[:, k], tape.d[:, k], tape.p[:, k]
        if isinstance(body, NonlinearPlant):
            p[:] = body.scheduled(x, tape.u[:, k], d)
        if feedback is not None:
            known = x if tape.estimate is None else tape.estimate[:, k]
            tape.u[:, k] = np.asarray(feedback(k, x, known, p), float)
        law.before(tape, k)
        u = tape.u[:, k]
        tape.y[:, k] = body.output(x, u, d, p)
        law.after(tape, k)
        tape.x[:, k + 1] = body.advance(x, u, d, p, tape.p[:, k + 1], period)
    if isinstance(body, NonlinearPlant):
        tape.p[:, -1] = body.scheduled(tape.x[:, -1], tape.u[:, -1], tape.d[:, -1])


def _period(plant: object, schedule: GainSchedule | None, given: float | None) -> float:
    """Raises AnalysisError for a sample time that is missing or not the schedule's."""
    own = schedule or (plant.schedule if isinstance(plant, ContinuousLoop) else plant)
    if given is None and isinstance(own, GainSchedule):
        return own.sample_time
    if given is None or not 0.0 < given < np.inf:
        raise AnalysisError(f"sample_time = {given} s; without a schedule give a positive one")
    if schedule is not None and given != schedule.sample_time:
        raise AnalysisError(
            f"sample_time = {given:g} s, but '{schedule.name}' is proved for {schedule.sample_time:g} s; leave it out"
        )
    return float(given)
