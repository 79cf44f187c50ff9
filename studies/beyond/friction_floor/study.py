"""The friction floor: theory against the runtime observers and against the truth vehicle."""

from __future__ import annotations

import numpy as np

from analysis.dc_floor import static_gain
from studies.beyond.friction_floor import figures
from studies.beyond.friction_floor.launches import FRICTIONS, launches
from studies.beyond.friction_floor.runtime import SCHEDULES, WHEEL_SPEEDS, missed_by
from studies.study import Cell, Drawing, Part, PartResult, Scope, Study, Table
from synthesis.models.catalogue import corner_velocity_model
from synthesis.models.parameter_set import load_parameter_set

SLIPS = (0.003, 0.01, 0.02, 0.05, 0.1, 0.3, 1.0)


def theory(_: Scope) -> PartResult:
    """Closed form against the runtime observer of every shipped schedule."""
    rows: list[list[Cell]] = []
    gap = 0.0
    drawings: list[Drawing] = []
    for schedule, (values, direction) in SCHEDULES.items():
        missed = missed_by(schedule, np.array(FRICTIONS), np.array(SLIPS))
        model = corner_velocity_model(load_parameter_set(values), direction, wheel_speed_maximum=140.0)
        floor = static_gain(model, "friction", "relative_velocity")
        gap = max(gap, missed.largest_gap)
        middle = missed.simulated[1]
        rows.append(
            [
                schedule,
                str(floor.free_of_gain),
                *(round(100 * float(middle[1, k]), 1) for k in (1, 3, 5)),
                missed.largest_gap,
            ]
        )
        if not drawings:
            drawings.append(figures.shares(missed, FRICTIONS, SLIPS))
    table = Table(
        "shares",
        f"Share of the slip velocity missed at rest, at {WHEEL_SPEEDS[1]:g} rad/s and friction "
        f"{FRICTIONS[1]:g}; the last column is "
        "the largest difference between closed form and runtime observer over all wheel speeds, frictions and slips.",
        [
            "schedule",
            "static gain free of L",
            "at slip 0.01 [%]",
            "at slip 0.05 [%]",
            "at slip 0.3 [%]",
            "largest difference [1]",
        ],
        rows,
    )
    note = (
        "The static gain from the friction term to the velocity error is the same for every observer gain. "
        "What a corner observer of "
        "this structure misses of the slip velocity is therefore s/(1 + s) with s = (sigma0/kappa) |slip|/friction, whatever its "
        "schedule: half of it already where the slip is friction over slip stiffness."
    )
    return PartResult((), [table], drawings, [note], {"largest difference": gap})


def simulation(scope: Scope) -> PartResult:
    """The truth vehicle on five roads."""
    found = launches(scope)
    rows: list[list[Cell]] = []
    for launch in found:
        known = np.isfinite(launch.predicted) & np.isfinite(launch.missed)
        own, fused = launch.errors["corner observers"], launch.errors["fusion"]
        rows.append(
            [
                launch.friction, round(100 * float(np.max(launch.slip)), 1),
                round(100 * float(np.median(launch.predicted[known])), 1), round(100 * float(np.median(launch.missed[known])), 1),
                *(launch.errors[name].text() for name in figures.NAMES), round(100 * (1 - fused.mean / own.mean), 1),
            ]
        )  # fmt: skip
    columns = [
        "friction [1]", "largest mean slip [%]", "missed, closed form [%]", "missed, simulated [%]",
        *(f"{name} NRMS [%]" for name in figures.NAMES), "recovered by the fusion [%]",
    ]  # fmt: skip
    caption = (
        f"Launches of the truth vehicle on LuGre tires, {scope.seeds} sensor draws: median share of the slip "
        "velocity missed where slip "
        "exceeds 1 %, and velocity errors with 95 % interval. The last column is the error of the corner "
        "observers that the fusion removes."
    )
    measures = {f"recovered at friction {row[0]}": float(row[-1] or 0.0) for row in rows}
    table = Table("launches", caption, columns, rows)
    return PartResult((), [table], [figures.over_time(found), figures.recovered(found)], (), measures)


STUDY = Study(
    id="friction-floor",
    title="The friction floor: slip velocity that force cannot tell",
    paper="",
    summary=(
        "When friction saturates, force does not tell the slip velocity any more. How much any observer of the papers' structure "
        "must then miss follows in closed form, independent of its gains; the runtime observers and a truth "
        "vehicle confirm it, and "
        "the vehicle-level fusion recovers most of it from acceleration and from the wheels that still roll."
    ),
    parts=(
        Part("theory", "The floor in closed form, and the runtime observers at rest", theory, cost=15.0),
        Part("launches", "Launches on five roads", simulation, cost=41.0),
    ),
)
