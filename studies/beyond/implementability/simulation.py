"""Observers run sample by sample, each in the form in which people write it down; the exact update is the runtime's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from estimators.phi import phi_of
from estimators.velocity import LpvVelocityObserver
from studies.beyond.implementability.break_rates import break_curves
from studies.beyond.implementability.designs import PAPER_RATE, WHEEL_SPEED, Design, printed_designs, shipped_designs
from studies.beyond.implementability.updates import BREAKABLE
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Level, Line, Mark, Panel
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE, RED
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic("studies.beyond.implementability")
STEP_AWAY = 0.03  # of the break rate, to either side
LARGEST = 1e12  # a diverging estimate is followed up to here
SUBSTEPS = 20  # of the true motion in one sample
START = np.array([0.0, 0.5])  # m, m/s: of the estimate
Step = Callable[[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, float, float], ArrayLike]
STEPS: dict[str, Step] = {
    "forward Euler": lambda x, A, L, C, u, y, T: x + T * (A @ x + u + L * (y - C @ x)),
    "sampled innovation": lambda x, A, L, C, u, y, T: x + T * phi_of(T * A) @ (A @ x + u + L * (y - C @ x)),
    "predict, then T·L": lambda x, A, L, C, u, y, T: x + T * phi_of(T * A) @ (A @ x + u) + T * L * (y - C @ x),
    "Tustin": lambda x, A, L, C, u, y, T: np.linalg.solve(
        np.eye(2) - 0.5 * T * (A - np.outer(L, C)), x + 0.5 * T * (A - np.outer(L, C)) @ x + T * (u + L * y)
    ),
    "backward Euler": lambda x, A, L, C, u, y, T: np.linalg.solve(
        np.eye(2) - T * (A - np.outer(L, C)), x + T * (u + L * y)
    ),
}
"""The next estimate from x, A, L, C, the input B u, the measurement y and the sample time T; u and y are held over it."""
RUNTIME = "exact closed loop"


@dataclass(frozen=True)
class Motion:
    """Samples (n,): wheel speed rad/s, relative acceleration m/s^2, normalised force; states (n, 2) m and m/s."""

    sample_time: float
    wheel_speed: FloatArray
    acceleration: FloatArray
    force: FloatArray
    states: FloatArray


def rolling(sample_time: float, samples: int, wheel_speed: float) -> Motion:
    """A wheel that rolls freely at constant speed: no slip, no force. Whatever the estimate does, it does by itself."""
    zero = np.zeros(samples)
    return Motion(sample_time, np.full(samples, wheel_speed), zero, zero, np.zeros((samples, 2)))


def launch(design: Design, sample_time: float = 0.005, seconds: float = 8.0, slip: float = 0.3) -> Motion:
    """The wheel speeds up evenly through the whole range while its relative velocity oscillates with 0.5 Hz.

    The true states follow the design model without friction term, in 20 exact substeps of each sample.
    """
    samples, fine = round(seconds / sample_time), sample_time / SUBSTEPS
    time = fine * np.arange(samples * SUBSTEPS)
    speed = np.interp(time, [0.0, seconds], WHEEL_SPEED)
    velocity = slip * np.sin(np.pi * time)
    decay = -design.model.on(np.array([1.0])).A[0, 0, 0] * speed  # kappa R_e omega, 1/s
    deflection = np.zeros(len(time))
    for k in range(len(time) - 1):  # z' = -a z + v, v linear over the substep
        fade = np.exp(-decay[k] * fine)
        deflection[k + 1] = fade * deflection[k] + 0.5 * fine * (velocity[k] * fade + velocity[k + 1])
    states = np.stack([deflection, velocity], axis=1)[::SUBSTEPS]
    wheel_speed = speed[::SUBSTEPS]
    acceleration = np.append(np.diff(states[:, 1]) / sample_time, 0.0)  # mean over the sample: no error from holding it
    C = design.model.on(wheel_speed).C[:, 0]
    return Motion(sample_time, wheel_speed, acceleration, np.einsum("gi,gi->g", C, states), states)


def run(design: Design, scheme: str, motion: Motion, start: FloatArray) -> FloatArray:
    """Estimates (n, 2) at the sample times from the initial estimate `start`; frozen once beyond 1e12."""
    if scheme == RUNTIME:  # gains and plant are as they were; nothing is proved for another sample time
        observer = LpvVelocityObserver(replace(design.schedule, sample_time=motion.sample_time), batch_shape=())
        observer.reset(state=start)
        steps = zip(motion.acceleration, motion.force, motion.wheel_speed, strict=True)
        return np.array([start, *(observer.step(u, y, p).estimate for u, y, p in steps)])[:-1]
    A, L, C = design.matrices(motion.wheel_speed)
    step, x, path = STEPS[scheme], np.array(start, float), []
    for k, (u, y) in enumerate(zip(motion.acceleration, motion.force, strict=True)):
        path.append(x)
        if np.abs(x).max() < LARGEST:
            x = np.asarray(step(x, A[k], L[k, :, 0], C[k, 0], np.array([0.0, u]), y, motion.sample_time))
    return np.array(path)


def growth(design: Design, scheme: str, rate: float, wheel_speed: float, samples: int) -> float:
    """Factor per sample by which the size of the error changes in the end, from a run of `samples` at `rate` [Hz].

    Sizes are taken over the last quarter, in states scaled so that both count; complex poles are averaged out.
    """
    path = run(design, scheme, rolling(1.0 / rate, samples, wheel_speed), START)
    size = np.linalg.norm(path * [design.model.on(np.array([0.0])).C[0, 0, 0], 1.0], axis=1)
    size = size[(size > 1e-250) & (size < 0.1 * LARGEST)]
    last = size[-3 * (len(size) // 4) :]
    return float(np.exp(np.polyfit(np.arange(len(last)), np.log(last), 1)[0]))


@TOPIC.part("confirmation", "Observers run on both sides of every break", 9.0, quick=False)
def confirmation(scope: Scope) -> PartResult:
    """Simulated growth on both sides of every break, and of the runtime at the lower rate."""
    designs = printed_designs() if scope.quick else (*printed_designs(), *shipped_designs())
    curves, samples = break_curves(designs, 36 if scope.quick else 71), 200 if scope.quick else 400
    rows: list[list[Cell]] = []
    for design, scheme in product(designs, BREAKABLE):
        curve = curves[design.name, scheme]
        low, high = curve.worst_rate * (1.0 - STEP_AWAY), curve.worst_rate * (1.0 + STEP_AWAY)
        below, above = (growth(design, scheme, rate, curve.worst_wheel_speed, samples) for rate in (low, high))
        exact = growth(design, RUNTIME, low, curve.worst_wheel_speed, 60)
        factors = (round(value, 4) for value in (below, above, exact))
        confirmed = below > 1.0 > above and exact < 1.0
        rows.append([design.name, scheme, round(curve.worst_rate, 2), *factors, confirmed])
    table = Table(
        "confirmation",
        f"Observers run sample by sample at the worst wheel speed, {100 * STEP_AWAY:g} % below and above the "
        "computed break rate: factor by which the error changes in every sample. The last factor is that of the "
        "runtime's exact update at the lower rate.",
        ("design", "discretisation", "break rate [Hz]", "growth below [1]", "growth above [1]", "runtime below [1]",
         "confirmed"), rows,
    )  # fmt: skip
    return PartResult((), [table], measures={"breaks confirmed": float(sum(bool(row[-1]) for row in rows))})


@TOPIC.part("launch", "Accelerating through the whole range at 200 Hz", 1.5, quick=False)
def acceleration(scope: Scope) -> PartResult:
    """Errors of the estimated relative velocity while the wheel speeds up through the whole range, 200 Hz."""
    panels, seconds = [], 3.0 if scope.quick else 8.0
    for k, design in enumerate((printed_designs()[0], printed_designs()[2], shipped_designs()[0])):
        motion = launch(design, 1.0 / PAPER_RATE, seconds)
        marks: list[Mark] = [Level(0.3, color="0.5", dash="dotted", width=0.9)]
        for scheme, colour in zip((*STEPS, RUNTIME), (BLUE, RED, ORANGE, GREEN, PURPLE, "black"), strict=True):
            error = np.abs(run(design, scheme, motion, START)[:, 1] - motion.states[:, 1])
            label, width = (f"{scheme} (runtime)", 1.8) if scheme == RUNTIME else (scheme, 1.1)
            marks.append(Line(motion.wheel_speed, np.clip(error, 1e-7, 1e9), label, colour, width=width))
        x = Axis("wheel speed, rising with time [rad/s]", *WHEEL_SPEED)
        y = Axis("" if k else "error of the relative velocity [m/s]", 1e-7, 1e9, "log")
        panels.append(Panel(marks, x, y, design.name.removeprefix("schedule ")))
    figure = Figure(
        "launch",
        f"The observers at 200 Hz while the wheel speeds up through the whole range in {seconds:g} s and its "
        "relative velocity swings by 0.3 m/s (dotted); the estimate starts 0.5 m/s off, measurements are exact. "
        "Schemes that are unstable at a wheel speed diverge there and recover only if they become stable early "
        "enough; the runtime's exact update converges at once. Its remaining error of a few mm/s is half a sample "
        "of delay: the measurement of the beginning is held over the sample.",
        "Panels of the estimation error on a logarithmic scale over the rising wheel speed; several curves shoot "
        "up by many decades, the black runtime curve stays low.",
        panels, (9.8, 4.2), "below", 6, share_y="all",
    )  # fmt: skip
    return PartResult(figures=[figure])
