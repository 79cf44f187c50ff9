"""What limits the tolerance: not the plant; and what a mean square that grows looks like from inside one car."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.linalg import expm

from analysis.drops.intermittent import certify_static_gain, kalman_critical_arrival
from estimators import GainSchedule, LpvVelocityObserver
from estimators.arrays import FloatArray
from studies.beyond.drop_tolerance.observers import PACKAGE, observer
from studies.beyond.drop_tolerance.population import START
from studies.beyond.drop_tolerance.prediction import critical, independent_drops, radius, system
from studies.beyond.observers import SHIPPED
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Line, Panel
from studies.plots.colours import BLUE, GREEN, GREY, ORANGE, RED
from studies.study import Cell, PartResult, Scope, Table
from synthesis.lmi.result import Verdict

TOPIC = Topic(PACKAGE)
SPEEDS = (0.0, 1.0, 20.0, 140.0)  # rad/s
RARE = 0.05  # arrival rate at which a gain is looked for
SAMPLES = 200
ABOVE = 0.3  # of the way from the critical probability to 1
QUANTILES = (0.5, 0.9, 0.99, 0.999)


@TOPIC.part("any-gain", "The plant sets no limit", 0.2)
def any_gain(_: Scope) -> PartResult:
    """Whether some constant gain survives 95 % drops, by plant and wheel speed."""
    rows, proved = list[list[Cell]](), 0
    for tested, speed in product([observer(name) for name in SHIPPED], SPEEDS):
        plant = tested.schedule.plant_at(np.array(speed))
        A = expm(tested.schedule.sample_time * plant.A)
        found, kalman = certify_static_gain(A, plant.C, RARE), kalman_critical_arrival(A, plant.C, tolerance=1e-2)
        proved += found.verdict is Verdict.CERTIFIED
        limits = kalman.upper, float(critical(tested.schedule, speed))
        rows.append([tested.plant, speed, str(found.verdict), found.radius, *limits])
    table = Table(
        "any-gain",
        f"Whether some constant gain keeps the mean square of the error falling although only {RARE:.0%} of the "
        "force samples arrive (wheel speed held), its second-moment radius, the arrival rate that suffices for a "
        "Kalman filter (upper bound), and for comparison the critical drop probability of the shipped schedule.",
        ("plant", "wheel speed [rad/s]", "some gain at 5 % arrivals", "its radius [1]", "Kalman filter suffices from [1]",
         "shipped schedule [1]"), rows,
    )  # fmt: skip
    note = (
        f"{'Every' if proved == len(rows) else f'{proved} of {len(rows)}'} plant and wheel speed has a constant gain "
        f"that survives the loss of {1.0 - RARE:.0%} of the samples, as the open loop is an integrator and does not "
        "diverge. Drop tolerance is bought with slow gains: it is a property of the design, not of the car."
    )
    return PartResult((), [table], (), [note], {"comparisons": float(len(rows)), "agreeing": float(proved)})


def runs_above(schedule: GainSchedule, p: float, runs: int, seed: int) -> FloatArray:
    """|velocity error| (samples + 1, runs) in m/s of the runtime observer at standstill with independent drops."""
    runtime = LpvVelocityObserver(schedule, (runs,))
    runtime.reset(state=START)
    generator, zero, speed = np.random.default_rng(seed), np.zeros(runs), np.full(runs, schedule.parameter.min)
    out = np.full((SAMPLES + 1, runs), abs(START[1]))
    for k in range(SAMPLES):
        force = np.where(generator.random(runs) < p, np.nan, 0.0)
        out[k + 1] = np.abs(runtime.step(zero, force, speed).estimate[:, 1])
    return out


@TOPIC.part("mean-and-typical", "What a growing mean square looks like", 1.2)
def typical(scope: Scope) -> PartResult:
    """Quantiles of the error beyond the critical probability, beside its exact root mean square."""
    tested, schedule = observer("printed-longitudinal"), observer("printed-longitudinal").schedule
    p_cr = float(critical(schedule, schedule.parameter.min))
    p = p_cr + ABOVE * (1.0 - p_cr)
    runs = runs_above(schedule, p, 2_000 if scope.quick else 50 * scope.seeds, 7)
    channel = independent_drops(schedule.parameter.min, p)
    moment = system(schedule, channel).propagate_second_moment(np.outer(START, START), [1.0 - p, p], SAMPLES)
    exact = np.sqrt(moment[:, 0, :, 1, 1].sum(axis=-1))
    time = tested.step * np.arange(SAMPLES + 1)
    marks = [
        Line(time, exact, "root mean square, exact", "0.1", width=1.8),
        Line(time, np.sqrt((runs**2).mean(axis=1)), f"of {runs.shape[1]} runs", GREY, "dotted", 1.2),
    ]
    for q, colour in zip(QUANTILES, (BLUE, GREEN, ORANGE, RED), strict=True):
        marks.append(Line(time, np.quantile(runs, q, axis=1), f"{q:.1%} of the runs below", colour, width=1.4))
    y = Axis("velocity error over its start [1]", 1e-6, max(10.0 * float(exact[-1]), 1e3), "log")
    share, last = float((runs.max(axis=0) > 10.0).mean()), float(np.median(runs[-1]))
    figure = Figure(
        "mean-square-and-typical",
        f"{tested.title}, at standstill with {p:.0%} of the force samples lost, above the critical {p_cr:.0%}: size "
        "of the velocity error of the runtime observer after an error of 1 m/s. The root mean square grows (radius "
        f"{float(radius(schedule, channel)[0]):.3f} a sample for its square), although the middle run dies out: it "
        "is carried by ever rarer and larger bursts, so that an average over any number of runs (dotted) falls "
        "below it in the end.",
        "Quantile lines falling one after the other on a logarithmic scale, while the exact root mean square rises.",
        Panel(marks, Axis("time [ms]", 0.0, time[-1]), y), (7.2, 4.2), "below", 3,
    )  # fmt: skip
    note = (
        f"Beyond the critical probability the mean square grows but a typical run does not: with {p:.0%} lost the "
        f"median error has fallen to {last:.1e} of its start after {time[-1] / 1e3:g} s, while {share:.1%} of the "
        "runs exceeded ten times the start on the way. The mean-square criterion is the careful one."
    )
    return PartResult((), (), [figure], [note], {"share_of_runs_above_ten_times": share, "median_after_1_s": last})
