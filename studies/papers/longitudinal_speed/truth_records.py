"""Figs. 1 to 3 along wheel speeds of the truth vehicle: rank of the gramian, and both tests for an unknown start."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from estimators.velocity.slip import LEAST_SPEED
from studies.papers.longitudinal_speed.inputs import SAMPLE_TIME, WheelRecord, speed_model
from studies.papers.longitudinal_speed.model import Ranks, gramian_rank, rank_panels
from studies.papers.longitudinal_speed.stochastic_observability import TOPIC, both_tests, covariance_panels
from studies.plots import DASHES, Axis, Figure, colours
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.estimation import run_of
from studies.trials.motion import MotionTest
from studies.trials.simulations import LUGRE, simulated_truth
from studies.truth import Truth

SECONDS = 6.0
STARTS, TOLERANCES = 40, (1e-9, 1e-2)  # samples of Figs. 2 and 3 (0.2 s), and rank tolerances
CHANGES = 1.0  # rad/s^2, of the wheel's acceleration, from which on the manoeuvre has begun
FIG_1 = (
    MotionTest("p2-double-lane-change-dry", "double lane change, dry"),
    MotionTest("p2-double-lane-change-snow", "double lane change, snow"),
    MotionTest("p2-acceleration-in-turn-dry", "acceleration in a turn, dry"),
    MotionTest("p2-brake-in-turn-snow", "braking in a turn, snow"),
    MotionTest("p2-launch-dry", "launch, dry"),
    MotionTest("p2-launch-ice", "launch, ice"),
)
FIGS_2_3 = (
    FIG_1[0], FIG_1[3],
    MotionTest("p2-sharp-turn", "sharp turn, dry and slippery"),
    MotionTest("p2-steer-wet-dry", "steering, wet and dry"),
)  # fmt: skip


def wheel_record(truth: Truth, row: MotionTest) -> WheelRecord:
    """Speed of the front left wheel as the truth has it, and its difference quotient, at the filter's sample time.

    It ends where the wheel leaves the range of the model: on ice it spins faster.
    """
    k, samples = run_of(truth, row.manoeuvre)
    speed = np.abs(truth["wheel_speed"][k, samples, 0])
    values = speed, np.asarray(np.gradient(speed, SAMPLE_TIME), dtype=np.float64)
    limits = zip(values, speed_model().parameters, strict=True)
    inside = np.all([(value >= p.minimum) & (value <= p.maximum) for value, p in limits], axis=0)
    return WheelRecord(row.title, truth.time[samples], *values).cut(0, None if inside.all() else int(np.argmin(inside)))


def begun(record: WheelRecord) -> WheelRecord:
    """The record from the moment on at which the wheel first changes its speed; the whole one where it never does."""
    return record.cut(int(np.argmax(np.abs(record.acceleration) >= CHANGES)))


def truth_part(scope: Scope, tire: str = LUGRE) -> PartResult:
    """Both figures and their tables."""
    names = tuple(dict.fromkeys(row.manoeuvre for row in (*FIG_1, *FIGS_2_3)))
    truth = simulated_truth(names, tire, scope, SECONDS).until(SECONDS)
    turning = [wheel_record(truth, row) for row in FIG_1]
    starting = [begun(wheel_record(truth, row)) for row in FIGS_2_3]
    ranks = [gramian_rank(record) for record in turning]
    fig_1 = Figure(
        "gramian-driven",
        "Fig. 1 of P2 on truth drives: speed of the front left wheel (above, logarithmic beyond 20 rad/s), and numerical "
        "rank of the observability gramian over all samples so far (below, lines a little apart).",
        "Above: six wheel speeds over time. Below: their ranks; those of the launches stay low until the wheel turns.",
        rank_panels(turning, ranks, Axis("wheel speed [rad/s]", scale="symlog", linear=20.0)),
        (7.2, 4.6), legend="below", columns=3, share_x="col",
    )  # fmt: skip
    curves = [
        (f"{record.name}, {tolerance:g}", both_tests(record.cut(0, STARTS), tolerance=tolerance), color, dash)
        for record, color in zip(starting, colours.CURVES, strict=False)
        for tolerance, dash in zip(TOLERANCES, DASHES, strict=False)
    ]
    figs_2_3 = Figure(
        "unknown-start-driven",
        "Figs. 2 and 3 of P2 on truth drives, from the moment on at which the front left wheel changes its speed: what is "
        "unknown of the initial state (a line ends where it is exactly zero) and the covariance of what is known, for two "
        "rank tolerances.",
        "Left: lines that fall and end within some samples. Right: peaks that fall off and settle.",
        covariance_panels(curves, Axis("time [s]")), (7.2, 3.8), legend="below", columns=2,
    )  # fmt: skip
    return PartResult(tables=[rank_table(turning, ranks), start_table(starting)], figures=[fig_1, figs_2_3])


def rank_table(records: Sequence[WheelRecord], ranks: Sequence[Ranks]) -> Table:
    """When the gramian becomes regular, beside how long the wheel stands."""
    rows: list[list[Cell]] = []
    for record, rank in zip(records, ranks, strict=True):
        turns, full = np.abs(record.speed) * 0.33 >= LEAST_SPEED, rank == 3
        first = [round(float(record.time[np.argmax(when)]), 3) if when.any() else None for when in (turns, full)]
        rows.append([record.name, first[0], int(rank[0]), int(rank[-1]), first[1]])
    return Table(
        "gramian-driven",
        f"Numerical rank of V(0, N) of P2 (A1) along the front left wheel of truth drives, first {SECONDS:g} s at 200 Hz. The "
        "paper finds 3 in all tests, except for launches while the wheel stands.",
        ("manoeuvre", f"faster than {LEAST_SPEED:g} m/s from [s]", "first rank", "last rank", "rank 3 from [s]"), rows,
    )  # fmt: skip


def start_table(records: Sequence[WheelRecord]) -> Table:
    """When M is exactly zero, and how large N becomes, by rank tolerance."""
    rows: list[list[Cell]] = []
    for record, tolerance in product(records, TOLERANCES):
        found = both_tests(record.cut(0, STARTS), tolerance=tolerance)
        known, peak = found.largest_known, int(np.nanargmax(found.largest_known))
        zero = None if found.samples_needed is None else round(found.samples_needed * SAMPLE_TIME, 3)
        at = round(peak * SAMPLE_TIME, 3)
        rows.append([record.name, f"{tolerance:g}", zero, float(known[peak]), at, float(known[-1])])
    return Table(
        "unknown-start-driven",
        "Both tests of Lemma 1 of P2 along the front left wheel of truth drives, from the moment on at which the wheel "
        f"changes its speed by {CHANGES:g} rad/s^2: time until M is exactly zero (Fig. 2 of the paper: "
        f"{TOPIC.printed('P2-test1')} s), greatest eigenvalue of N and when, and at the end of {STARTS * SAMPLE_TIME:g} s, by "
        "rank tolerance (Q = 2.5e-3 I, R = 1e-3).",
        ["manoeuvre", "rank tolerance", "M = 0 after [s]", "peak of lambda_max(N)", "at [s]", "lambda_max(N) at the end"], rows,
    )  # fmt: skip
