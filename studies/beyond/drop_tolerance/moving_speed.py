"""A wheel speed that moves: the certified drop probability, and the energy that proves it on a sweep of the runtime observer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import t as student

from analysis.drops.mean_square import MeanSquareSchedule, mean_square_schedule
from analysis.drops.modes import schedule_drop_modes
from analysis.drops.schedule import FrozenDropProbability, frozen_critical_probability
from estimators import GainSchedule
from estimators.arrays import BoolArray, FloatArray, IntArray
from studies.beyond.drop_tolerance.comparison import MISS
from studies.beyond.drop_tolerance.observers import NAMES, PACKAGE, QUICK, observer
from studies.beyond.drop_tolerance.population import START, evolve
from studies.papers.topic import Topic
from studies.plots import Axis, ErrorBars, Figure, Line, Mark, Panel
from studies.plots.colours import BLUE, GREY, RED
from studies.study import PartResult, Scope, Table
from synthesis.lmi.result import Verdict

TOPIC = Topic(PACKAGE)
SHARES = (0.95, 0.85, 0.7)  # of the smallest frozen value, tried in turn
CHECKS = 8  # samples at which the simulated energy is compared
RUNS, EVERY = 100, 2  # runs of a seed; samples between two resamplings


@dataclass(frozen=True)
class Sweep:
    """Wheel speed (k+1,) in rad/s through the range and back, exact energy (k+1,), and what was seen at the samples `at` (m,)."""

    speed: FloatArray
    exact: FloatArray
    at: IntArray
    seen: FloatArray
    half: FloatArray  # half width of the interval

    @property
    def holds(self) -> BoolArray:
        """Which intervals hold the exact energy, (m,)."""
        return np.asarray(np.abs(self.seen - self.exact[self.at]) <= self.half)


def moving(name: str, scope: Scope) -> PartResult:
    """The certificate of the observer `name`, and a sweep that follows it."""
    tested = observer(name)
    frozen = frozen_critical_probability(tested.schedule)
    proof = certificate(tested.schedule, frozen, SHARES[1:] if scope.quick else SHARES)
    measures = {"certified_drop_probability": 0.0, "frozen_drop_probability": frozen.smallest}
    if proof.verdict is not Verdict.CERTIFIED:
        note = f"{tested.title}: nothing is proved while the wheel speed moves; {proof.message}."
        return PartResult(notes=[note], measures=measures)
    sweep = run_sweep(tested.schedule, proof, scope, NAMES.index(name))
    hold, falls, at = sweep.holds, bool((np.diff(sweep.exact) < 0.0).all()), sweep.at
    columns = [at * tested.step, sweep.speed[at], sweep.exact[at], sweep.seen, sweep.half]
    table = Table(
        f"sweep-{name}",
        f"{tested.title}: energy of the certificate on a sweep of the wheel speed through the whole range and back at the "
        "fastest certified rates, in parts of its start.",
        ("time [ms]", "wheel speed [rad/s]", "predicted [1]", "simulated [1]", "half width of interval [1]"),
        np.stack(columns, axis=1).tolist(),
    )
    note = (
        f"{tested.title}: a drop probability of {proof.drop_probability:.3f} is {proof.verdict!s} for every motion of "
        f"the wheel speed within its rates (held at one speed: {frozen.smallest:.3f}). On the sweep the energy "
        f"{'falls at every sample' if falls else 'DOES NOT FALL at every sample'}, and {int(hold.sum())} of "
        f"{len(hold)} intervals of the runtime observer hold it ({1.0 - MISS:.1%} simultaneous confidence)."
    )
    measures |= {
        "certified_drop_probability": proof.drop_probability, "comparisons": float(len(hold) + 1),
        "agreeing": float(int(hold.sum()) + falls),
    }  # fmt: skip
    time = tested.step * np.arange(len(sweep.speed))
    lower = np.minimum(sweep.half, 0.99 * sweep.seen)  # a bar below zero has no place on a logarithmic axis
    energy: list[Mark] = [
        Line(time, sweep.exact, "predicted", BLUE, width=1.8),
        ErrorBars(time[at], sweep.seen, lower, sweep.half, "runtime observer", RED),
    ]
    y = Axis("mean energy over its start [1]", scale="log")
    figure = Figure(
        f"sweep-{name}",
        f"{tested.title}, wheel speed sweeping through its range and back at ±800 rad/s² while "
        f"{proof.drop_probability:.0%} of the force samples are lost: mean of the energy e'P(ω)e whose decrease at every sample "
        f"is {proof.verdict!s} for any such motion. Line: exact second moment; points: the runtime observer, {scope.seeds} "
        f"seeds, bars at {1.0 - MISS:.1%} simultaneous confidence. Below: the wheel speed.",
        "A falling line on a logarithmic scale with points on it, above a V-shaped course of the wheel speed.",
        [[Panel(energy, y=y, legend="upper right")],
         [Panel([Line(time, sweep.speed, color=GREY)], "time [ms]", "|ω| [rad/s]")]],
        (7.2, 4.4), share_x="all", heights=(3, 1),
    )  # fmt: skip
    return PartResult((), [table], [figure], [note], measures)


for each in NAMES:
    title, cost = f"Wheel speed in motion: {each.replace('-', ' ')}", 6.0 if each.endswith("lateral") else 1.0
    TOPIC.part(f"moving-{each}", title, cost, quick=each in QUICK)(partial(moving, each))


def certificate(schedule: GainSchedule, frozen: FrozenDropProbability, shares: tuple[float, ...]) -> MeanSquareSchedule:
    """The first share of the frozen value that is proved for a moving wheel speed; the last answer if none is."""
    for share in shares:
        found = mean_square_schedule(schedule, share * frozen.smallest, frozen)
        if found.verdict is Verdict.CERTIFIED:
            break
    return found


def run_sweep(schedule: GainSchedule, proof: MeanSquareSchedule, scope: Scope, seed: int) -> Sweep:
    """E e'P(w)e along the sweep: exact, and from populations of the runtime observer with intervals; 1 at the start.

    The wheel speed runs at the fastest certified rates; P of the certificate is linear between its nodes, (k+1, n, n).
    """
    q, p = schedule.parameter, proof.drop_probability
    down = np.arange(q.max, q.min, q.rate_min * schedule.sample_time)
    up = np.arange(q.min, q.max, q.rate_max * schedule.sample_time)
    speed = np.concatenate([down, up, [q.max]])
    flat = proof.lyapunov.reshape(len(proof.nodes), -1)
    P = np.stack([np.interp(speed, proof.nodes, column) for column in flat.T], -1).reshape(
        -1, *proof.lyapunov.shape[1:]
    )
    modes = schedule_drop_modes(schedule, speed)
    moment, exact = np.outer(START, START), [float(START @ P[0] @ START)]
    for k in range(len(speed) - 1):
        moment = sum(chance * A[k] @ moment @ A[k].T for chance, A in ((p, modes.dropped), (1.0 - p, modes.received)))
        exact.append(float(np.sum(P[k + 1] * moment)))
    generator, shape = np.random.default_rng(1000 + seed), (1, scope.seeds, RUNS)
    logs = evolve(
        schedule, generator.random(shape) < p, lambda k: np.full(shape, speed[k]), lambda _: generator.random(shape) < p,
        lambda k, error, _: np.einsum("csri,ij,csrj->csr", error, P[k], error), len(speed) - 1, EVERY, generator,
    )[:, 0]  # fmt: skip
    at = EVERY * np.unique(np.linspace(0, len(logs), CHECKS + 1).round().astype(int)[1:])
    seen = np.exp(logs[at // EVERY - 1] - np.log(exact[0]))
    factor = float(student.ppf(1.0 - 0.5 * MISS / len(at), scope.seeds - 1))
    half = factor * seen.std(axis=1, ddof=1) / np.sqrt(scope.seeds)
    return Sweep(speed, np.array(exact) / exact[0], at, seen.mean(axis=1), half)
