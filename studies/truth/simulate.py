"""Drive a batch: every manoeuvre with its vehicle, all at once, at a fixed step."""

from __future__ import annotations

import multiprocessing
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import unknown
from studies.errors import SimulationError
from studies.truth.course import Course, Courses
from studies.truth.driver import Driver
from studies.truth.fleet import Fleet, tires_of
from studies.truth.layout import B, rolling
from studies.truth.plant import Plant, SteerAngles
from studies.truth.record import Truth
from studies.truth.signals import UNITS, WHEEL_UNITS, signals_of
from studies.truth.stepper import Step, advance
from studies.truth.vehicle import TruthVehicle
from synthesis.errors import SpecError

STEP = 0.001  # s, by the convergence study of the tests: velocities right to 1e-4 m/s, wheel speeds to 1e-2 rad/s
RECORD_TIME = 0.005  # s between samples, 200 Hz as in P1 to P3
EVERYTHING = tuple(UNITS)


def simulate(
    courses: Sequence[Course],
    vehicles: Sequence[TruthVehicle],
    *,
    step: float = STEP,
    record_time: float = RECORD_TIME,
    record: Sequence[str] = EVERYTHING,
    until: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Truth:
    """Integrate B runs, `courses[b]` driven with `vehicles[b]`; returns the signals named in ``record``.

    One course and vehicle for every run; equal courses cost once. ``step`` of the integration and ``record_time`` between
    recorded samples, a multiple of it, in s; ``record`` are names of `UNITS`; ``until`` in s, None: to the end of the longest
    course; ``progress`` is called with the fraction done.

    Raises SpecError for lists of different length, a step that does not divide the record time, an unknown signal, and
    SimulationError for a run that became infinite.
    """
    if len(courses) != len(vehicles) or not courses:
        raise SpecError(f"{len(courses)} courses and {len(vehicles)} vehicles: give one vehicle for each course")
    every = round(record_time / step) if step > 0 else 0
    if every < 1 or abs(every * step - record_time) > 1e-9:
        raise SpecError(f"record_time = {record_time:g} s is not a multiple of step = {step:g} s")
    for name in record:
        if name not in UNITS:
            raise SpecError(f"record: {unknown('signal', name, UNITS)}")
    kinds = list(dict.fromkeys(c.tire for c in courses))
    groups = [[k for k, c in enumerate(courses) if c.tire == kind] for kind in kinds]
    samples = int(np.ceil((until or max(c.duration for c in courses)) / record_time - 1e-9)) + 1
    signals = {n: np.empty((len(courses), samples, *_corner_axis(n))) for n in record}
    for rows in groups:
        part = _run([courses[k] for k in rows], [vehicles[k] for k in rows], samples, step, every, record, progress)
        for name, value in part.items():
            signals[name][rows] = value
    return _truth(np.asarray(record_time * np.arange(samples), dtype=np.float64), signals, courses, vehicles)


def _truth(
    time: FloatArray, signals: dict[str, FloatArray], courses: Sequence[Course], vehicles: Sequence[TruthVehicle]
) -> Truth:
    names, tires = tuple(c.name for c in courses), tuple(c.tire for c in courses)
    return Truth(time, signals, names, np.array([c.duration for c in courses]), tuple(vehicles), tires)


def _corner_axis(name: str) -> tuple[int, ...]:
    return (4,) if name in WHEEL_UNITS else ()


def _run(
    courses: Sequence[Course],
    vehicles: Sequence[TruthVehicle],
    samples: int,
    step: float,
    every: int,
    record: Sequence[str],
    progress: Callable[[float], None] | None,
) -> dict[str, FloatArray]:
    fleet = Fleet(vehicles)
    plant = Plant(fleet, tires_of(courses[0].tire, vehicles))
    driver = Driver(Courses(courses), fleet)
    state = rolling([c.initial_speed for c in courses], fleet.radius)
    out = {name: np.empty((fleet.size, samples, *_corner_axis(name))) for name in record}
    nothing = np.zeros((4, fleet.size))
    moving = plant.slide(state, SteerAngles(nothing, nothing + 1.0))
    for k in range(samples):
        if k == 0:  # the first sample shows what acts at the start
            controls = driver.act(state, moving, 0.0, 0.0)
            done = advance(plant, state, controls, 1e-9)
            done = Step(state, *done[1:])
        for n in range(every if k else 0):
            time = ((k - 1) * every + n) * step
            controls = driver.act(state, moving, time, step)
            done = advance(plant, state, controls, step)
            state, moving = done.state, done.slide
        if not np.isfinite(state[B["vx"]]).all():
            bad = int(np.flatnonzero(~np.isfinite(state[B["vx"]]))[0])
            raise SimulationError(
                f"'{courses[bad].name}' (run {bad}) became infinite before {k * every * step:g} s; "
                "use a smaller step or a vehicle that stays on its wheels"
            )
        found = signals_of(fleet, done, controls)
        for name in record:
            out[name][:, k] = found[name].T
        if progress is not None and k % 50 == 0:
            progress(k / samples)
    return out


def simulate_in_processes(
    courses: Sequence[Course], vehicles: Sequence[TruthVehicle], workers: int, **options: Any
) -> Truth:
    """`simulate` in ``workers`` processes, each with its share of the batch; the numbers are the same."""
    parts = min(workers, len(courses))
    if parts < 2:
        return simulate(courses, vehicles, **options)
    edges = [k * len(courses) // parts for k in range(parts + 1)]
    options["until"] = max(c.duration for c in courses)
    forks = sys.platform == "linux" and threading.active_count() == 1
    with ProcessPoolExecutor(parts, mp_context=multiprocessing.get_context("fork" if forks else "spawn")) as pool:
        running = [pool.submit(simulate, courses[a:b], vehicles[a:b], **options) for a, b in pairwise(edges)]
        done = [part.result() for part in running]
    signals = {name: np.concatenate([part.signals[name] for part in done]) for name in done[0].signals}
    return _truth(done[0].time, signals, courses, vehicles)
