"""Figs. 1 to 3 on truth drives: rank of the gramian along wheel speeds, and both tests for an unknown start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimators.velocity.slip import LEAST_SPEED
from studies.papers.longitudinal_speed.figures_observability import gramian_rank
from studies.papers.longitudinal_speed.inputs import WheelRecord, printed_value, sample_time, speed_model
from studies.papers.longitudinal_speed.unknown_start import both_tests
from studies.plots.colours import CURVES
from studies.report.canvas import DASHES, canvas, label, legend
from studies.study import Cell, Drawing, PartResult, Scope, Table
from studies.trials.driven import LUGRE, driven
from studies.trials.motion import Moved
from studies.trials.play import run_of
from studies.truth import Truth

SECONDS = 6.0
STARTS = 40
"""Samples of Figs. 2 and 3: 0.2 s."""
TOLERANCES = (1e-9, 1e-2)
CHANGES = 1.0
"""rad/s^2, of the wheel's acceleration, from which on the drive has begun."""
GRAMIAN = (
    Moved("p2-double-lane-change-dry", "double lane change, dry"),
    Moved("p2-double-lane-change-snow", "double lane change, snow"),
    Moved("p2-acceleration-in-turn-dry", "acceleration in a turn, dry"),
    Moved("p2-brake-in-turn-snow", "braking in a turn, snow"),
    Moved("p2-launch-dry", "launch, dry"),
    Moved("p2-launch-ice", "launch, ice"),
)
"""Fig. 1."""
UNKNOWN = (
    Moved("p2-double-lane-change-dry", "double lane change, dry"),
    Moved("p2-brake-in-turn-snow", "braking in a turn, snow"),
    Moved("p2-sharp-turn", "sharp turn, dry and slippery"),
    Moved("p2-steer-wet-dry", "steering, wet and dry"),
)
"""Figs. 2 and 3."""


def wheel_record(truth: Truth, row: Moved, wheel: int = 0) -> WheelRecord:
    """Speed of one wheel (front left) as the truth has it, and its difference quotient, at the filter's sample time.

    It ends where the wheel leaves the range of the model: on ice it spins faster.
    """
    k, samples = run_of(truth, row.manoeuvre)
    speed = np.abs(truth["wheel_speed"][k, samples, wheel])
    values = speed, np.asarray(np.gradient(speed, sample_time()), dtype=np.float64)
    limits = zip(values, speed_model().parameters, strict=True)
    inside = np.all([(value >= p.minimum) & (value <= p.maximum) for value, p in limits], axis=0)
    end = inside.size if inside.all() else int(np.argmin(inside))
    return WheelRecord(row.title, truth.time[samples][:end], *(value[:end] for value in values))


def begun(record: WheelRecord) -> WheelRecord:
    """The record from the moment on at which the wheel first changes its speed; the whole one where it never does."""
    start = int(np.argmax(np.abs(record.acceleration) >= CHANGES))
    return WheelRecord(record.name, *(value[start:] for value in (record.time, record.speed, record.acceleration)))


def driven_tests_part(scope: Scope, tire: str = LUGRE) -> PartResult:
    """Both figures and their tables."""
    names = tuple(dict.fromkeys(row.manoeuvre for row in (*GRAMIAN, *UNKNOWN)))
    truth = driven(names, tire, scope, SECONDS).until(SECONDS)
    turning = [wheel_record(truth, row) for row in GRAMIAN]
    starting = [begun(wheel_record(truth, row)) for row in UNKNOWN]
    ranks = [gramian_rank(record) for record in turning]
    return PartResult(
        tables=[rank_table(turning, ranks), start_table(starting)],
        drawings=[_ranks(turning, ranks), _starts(starting)],
    )


def rank_table(records: Sequence[WheelRecord], ranks: Sequence[np.ndarray[tuple[int], np.dtype[np.int_]]]) -> Table:
    """When the gramian becomes regular, beside how long the wheel stands."""
    rows: list[list[Cell]] = []
    for record, rank in zip(records, ranks, strict=True):
        full = np.flatnonzero(rank == 3)
        turns = np.flatnonzero(np.abs(record.speed) * 0.33 >= LEAST_SPEED)
        rows.append(
            [
                record.name, round(float(record.time[turns[0]]), 3) if turns.size else None, int(rank[0]), int(rank[-1]),
                round(float(record.time[full[0]]), 3) if full.size else None,
            ]
        )  # fmt: skip
    return Table(
        "gramian-driven",
        f"Numerical rank of V(0, N) of P2 (A1) along the front left wheel of truth drives, first {SECONDS:g} s at 200 Hz. The "
        "paper finds 3 in all tests, except for launches while the wheel stands.",
        ("manoeuvre", f"faster than {LEAST_SPEED:g} m/s from [s]", "first rank", "last rank", "rank 3 from [s]"),
        rows,
    )


def start_table(records: Sequence[WheelRecord]) -> Table:
    """When M is exactly zero, and how large N becomes, by rank tolerance."""
    rows: list[list[Cell]] = []
    for record in records:
        for tolerance in TOLERANCES:
            found = both_tests(_first(record), tolerance=tolerance)
            needed, known = found.samples_needed, found.largest_known
            peak = int(np.nanargmax(known))
            rows.append(
                [
                    record.name, f"{tolerance:g}", None if needed is None else round(needed * sample_time(), 3),
                    float(known[peak]), round(peak * sample_time(), 3), float(known[-1]),
                ]
            )  # fmt: skip
    return Table(
        "unknown-start-driven",
        "Both tests of Lemma 1 of P2 along the front left wheel of truth drives, from the moment on at which the wheel changes "
        f"its speed by {CHANGES:g} rad/s^2: time until M is exactly zero (Fig. 2 of the paper: {printed_value('P2-test1')} s), "
        f"greatest eigenvalue of N and when, and at the end of {STARTS * sample_time():g} s, by rank tolerance (Q = 2.5e-3 I, "
        "R = 1e-3).",
        (
            "manoeuvre",
            "rank tolerance",
            "M = 0 after [s]",
            "peak of lambda_max(N)",
            "at [s]",
            "lambda_max(N) at the end",
        ),
        rows,
    )


def _first(record: WheelRecord) -> WheelRecord:
    return WheelRecord(record.name, *(value[:STARTS] for value in (record.time, record.speed, record.acceleration)))


def _ranks(records: Sequence[WheelRecord], ranks: Sequence[np.ndarray[tuple[int], np.dtype[np.int_]]]) -> Drawing:
    figure, axes = canvas(7.2, 4.6, 2, 1, sharex=True)
    top, bottom = axes[:, 0]
    for k, (record, rank) in enumerate(zip(records, ranks, strict=True)):
        style = {"color": CURVES[k], "linestyle": DASHES[k % len(DASHES)], "label": record.name}
        top.plot(record.time, record.speed, **style)
        bottom.step(record.time, rank + 0.05 * (k - 2.5), where="post", **style)
    label(top, "", "wheel speed [rad/s]")
    label(bottom, "time [s]", "rank of V(0, N) [1]")
    bottom.set_yticks([1, 2, 3])
    top.set_yscale("symlog", linthresh=20.0)
    legend(figure, ncols=3)
    return Drawing(
        "gramian-driven",
        "Fig. 1 of P2 on truth drives: speed of the front left wheel (above, logarithmic beyond 20 rad/s), and numerical rank of "
        "the observability gramian over all samples so far (below, lines a little apart).",
        "Above: six wheel speeds over time. Below: their ranks; those of the launches stay low until the wheel turns.",
        figure,
    )


def _starts(records: Sequence[WheelRecord]) -> Drawing:
    figure, axes = canvas(7.2, 3.8, 1, 2, sharex=True)
    left, right = axes[0]
    for record, colour in zip(records, CURVES, strict=False):
        for tolerance, dash in zip(TOLERANCES, DASHES, strict=False):
            found = both_tests(_first(record), tolerance=tolerance)
            time = sample_time() * np.arange(len(found.M))
            style = {"color": colour, "linestyle": dash, "marker": ".", "markersize": 3.5}
            unknown = np.where(found.largest_unknown > 0.0, found.largest_unknown, np.nan)
            left.semilogy(time, unknown, **style, label=f"{record.name}, {tolerance:g}")
            right.semilogy(time[1:], found.largest_known[1:], **style)
    printed = float(printed_value("P2-test1"))
    left.axvline(printed, color="0.1", linewidth=0.9, label=f"{printed:g} s, Fig. 2")
    label(left, "time [s]", "λmax(M), 1 at the start [1]", "test 1: what is still unknown")
    label(right, "time [s]", "λmax(N) [1, states in m and m/s]", "test 2: covariance of what is known")
    legend(figure, ncols=2)
    return Drawing(
        "unknown-start-driven",
        "Figs. 2 and 3 of P2 on truth drives, from the moment on at which the front left wheel changes its speed: what is "
        "unknown of the initial state (a line ends where it is exactly zero) and the covariance of what is known, for two rank "
        "tolerances.",
        "Left: lines that fall and end within some samples. Right: peaks that fall off and settle.",
        figure,
    )
