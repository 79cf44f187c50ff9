"""Plant and runtime side by side: the plant integrated by scipy with everything held over a sample, the runtime as it ships.

A run is arrays over samples and entries of a batch. What claims say about it is judged in `tests.support.update_judge`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from estimators import GainSchedule, LpvVelocityObserver
from estimators.faults import Flag
from tests.support.random_plant import RandomPlant, interpolated

LARGEST = 1e50  # of a state: the runtime starts afresh from 1e100 on


@dataclass(frozen=True)
class Paths:
    """What drives a run: parameters (k+1, n), inputs (k, n), disturbances (k, n, 2), lost measurements (k, n), starts (n, 2)."""

    p: np.ndarray
    u: np.ndarray
    d: np.ndarray
    lost: np.ndarray
    x: np.ndarray
    estimate: np.ndarray


@dataclass(frozen=True)
class Run:
    """States x, estimates, and what the formulas of the error need; the last index of x and e is one behind the inputs."""

    paths: Paths
    x: np.ndarray  # (k+1, n, 2)
    estimate: np.ndarray  # (k+1, n, 2)
    motion: np.ndarray  # (k, n, 2) x' at the start of each sample
    coasted: np.ndarray  # (k, n, 2) the estimate after each sample if no measurement corrects it
    size: np.ndarray  # (k, n, 2) of the numbers that were added up for the next state: what rounding is relative to

    @property
    def e(self) -> np.ndarray:
        """x - estimate."""
        return self.x - self.estimate


def simulate(plant: RandomPlant, schedule: GainSchedule, paths: Paths, feedback: np.ndarray) -> Run:
    """Every entry of the batch is its own plant with its own observer; nothing but lost measurements may be flagged.

    The input is that of the paths less `feedback` x, which keeps an unstable plant in bounds.
    """
    steps, count = paths.u.shape
    paths = replace(paths, u=paths.u.copy())
    # A handful of entries runs in plain numbers, more in arrays: every other plant is cut in handfuls.
    parts = np.array_split(np.arange(count), 1 if plant.seed % 4 < 2 or count > 30 else max(1, count // 10))
    observers = [LpvVelocityObserver(schedule, (len(part),), outside="refuse") for part in parts]
    for observer, part in zip(observers, parts, strict=True):
        observer.reset(state=paths.estimate[part])
    flat = paths.p[:-1].reshape(-1)
    matrices = {key: m.reshape(steps, count, *m.shape[1:]) for key, m in plant.at(flat).items()}
    coast, drive = (m.reshape(steps, count, 2, 2) for m in plant.held_over_a_sample(flat))
    gain = interpolated(schedule.breakpoints, schedule.table, flat).reshape(steps, count, 2, 1)
    weight = gain * (1.0 if schedule.update == "sampled" else schedule.sample_time)
    x, estimate = np.empty((steps + 1, count, 2)), np.empty((steps + 1, count, 2))
    motion, coasted, size = np.empty((3, steps, count, 2))
    x[0], estimate[0] = paths.x, paths.estimate
    for k in range(steps):
        M = {key: value[k] for key, value in matrices.items()}
        paths.u[k] -= x[k] @ feedback
        forced = _times(M["B"], paths.u[k][:, None]) + _times(M["E"], paths.d[k])
        y = (_times(M["C"], x[k]) + _times(M["D"], paths.u[k][:, None]) + _times(M["F"], paths.d[k]))[:, 0]
        allowed = np.where(paths.lost[k], int(Flag.MISSING_MEASUREMENT), 0) | int(Flag.RESET) * (k == 0)
        for observer, part in zip(observers, parts, strict=True):
            y_part = np.where(paths.lost[k], np.nan, y)[part]
            step = observer.step(paths.u[k, part], y_part, paths.p[k, part])
            estimate[k + 1, part] = step.estimate
            assert (step.flags == allowed[part]).all(), f"seed {plant.seed}, sample {k}: flags {step.flags}"
        motion[k] = _times(M["A"], x[k]) + forced
        x[k + 1] = _times(coast[k], x[k]) + _times(drive[k], forced)
        coasted[k] = _times(coast[k], estimate[k]) + _times(drive[k], _times(M["B"], paths.u[k][:, None]))
        known = np.abs(x[k]) + np.abs(estimate[k])
        shown = _times(np.abs(M["C"]), known) + np.abs(y)[:, None] + np.abs(_times(M["D"], paths.u[k][:, None]))
        size[k] = _times(np.abs(coast[k]) + np.eye(2), known) + _times(np.abs(weight[k]), shown)
        size[k] += _times(np.abs(drive[k]), _times(np.abs(M["B"]), np.abs(paths.u[k])[:, None]) + np.abs(forced))
        if not np.abs(x[k + 1]).max() < LARGEST:  # it runs away in spite of all: what was seen so far is enough
            steps = k + 1
            break
    cut = Paths(paths.p[: steps + 1], paths.u[:steps], paths.d[:steps], paths.lost[:steps], paths.x, paths.estimate)
    return Run(cut, x[: steps + 1], estimate[: steps + 1], motion[:steps], coasted[:steps], size[:steps])


def probed(schedule: GainSchedule, parameters: np.ndarray, lost: bool = False) -> np.ndarray:
    """The matrix of the runtime's own update at rest, from unit estimates with u = y = 0: (g, 2, 2)."""
    count = len(parameters)
    observer = LpvVelocityObserver(schedule, (2, count))
    observer.reset(state=np.broadcast_to(np.eye(2)[:, None, :], (2, count, 2)))
    p = np.broadcast_to(parameters, (2, count))
    step = observer.step(np.zeros((2, count)), np.full((2, count), np.nan if lost else 0.0), p)
    return np.moveaxis(step.estimate, 0, -1)


def walks(plant: RandomPlant, steps: int, count: int, draw: np.random.Generator) -> np.ndarray:
    """Parameters (steps + 1, count) inside range and rates: at rest, to and fro at the largest rates, at random."""
    low, high = float(plant.low), float(plant.high)
    fall, rise = (rate * plant.sample_time * (1.0 - 1e-6) for rate in plant.rates)
    p = np.empty((steps + 1, count))
    p[0] = np.where(draw.random(count) < 0.3, draw.choice([low, high], count), draw.uniform(low, high, count))
    style = np.arange(count) % 4
    direction = draw.choice([-1.0, 1.0], count)
    for k in range(steps):
        bounced = np.where(p[k] >= high, -1.0, np.where(p[k] <= low, 1.0, direction))
        direction = np.where(style == 1, bounced, np.where(draw.random(count) < 0.2, -direction, direction))
        fraction = np.where(style == 3, draw.random(count), 1.0)
        move = np.where(direction > 0.0, rise, fall) * fraction
        p[k + 1] = np.clip(np.where(style == 0, p[k], p[k] + move), low, high)
    return p


def _times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", matrix, vector)
