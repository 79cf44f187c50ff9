"""Numbers behind the figures, and the printed gains beside the designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimators.schedule import GainSchedule
from studies.beyond.well_posed_design.achieved import Achieved, achieved, printed_achieved
from studies.beyond.well_posed_design.cases import Case
from studies.beyond.well_posed_design.literal import Approach, floor
from studies.beyond.well_posed_design.sweeps import Sweep
from studies.study import Cell, Table

ACHIEVED = ("friction gain [1]", "force noise gain [m/s]", "H2 gain, white force noise [m/s sqrt(Hz)]", "acceleration gain [s]",
            "slowest pole [1/s]", "fastest pole [1/s]")  # fmt: skip


def literal_table(
    cases: Sequence[Case], literal: Mapping[tuple[str, int], Approach], posed: Mapping[str, Approach]
) -> Table:
    """Infimum, floor and growth of the gains."""
    rows: list[list[Cell]] = []
    for case in cases:
        exact, free = floor(case)
        found = [(f"literal, degree {degree}", value) for (name, degree), value in literal.items() if name == case.name]
        for problem, approach in [*found, ("well-posed, degree 1", posed[case.name])]:
            least: list[Cell] = [float(exact), free] if problem.startswith("literal") else [None, None]
            ends: list[Cell] = [round(float(value), 3) for value in approach.gains[[0, -1], 1]]
            growth = round(approach.growth_per_decade, 2)
            rows.append([case.title, problem, *least, approach.gamma, *ends, growth, approach.unbounded])
    return Table(
        "ill-posed",
        "The literal problem (minimise the gain from friction and acceleration error to both errors) beside the "
        "well-posed one. The exact floor follows from static gains that no L changes; gamma is what the solver "
        "finds; then the largest |L2| needed at a back-off of 10 % and of 0.1 %, and its growth for each decade of "
        "back-off. More than 2 counts as unbounded.",
        ("case", "problem", "exact floor of gamma [1]", "floor free of L", "gamma found [1 or m/s]", "|L2| at 10 % [m/s^2]",
         "|L2| at 0.1 % [m/s^2]", "growth per decade [1]", "unbounded"),
        rows,
    )  # fmt: skip


def sweep_table(name: str, demand: str, sweeps: Sequence[Sweep]) -> Table:
    """Every design of a sweep."""
    rows: list[list[Cell]] = []
    for sweep in sweeps:
        for k, value in enumerate(sweep.demand):
            if not sweep.feasible[k]:
                rows.append([sweep.case.title, float(value), False, *[None] * 12])
                continue
            low, high = sweep.gains[k].min(axis=0), sweep.gains[k].max(axis=0)
            gains = (low[0], high[0], low[1], high[1], sweep.gamma_lower[k], sweep.gamma[k])
            real = [field[k] for field in vars(sweep.achieved).values()]
            rows.append([sweep.case.title, float(value), True, *_short(gains), *_short(real)])
    return Table(
        name,
        f"Designs of degree 1 for several values of one demand ({demand}), everything else as shipped: ranges of "
        "the gains over the wheel speeds, the proved bound of the minimised channel with its lower bound, and what "
        "the gains do at the worst constant wheel speed.",
        (
            "case",
            demand,
            "feasible",
            "L1 from [m/s]",
            "L1 to [m/s]",
            "L2 from [m/s^2]",
            "L2 to [m/s^2]",
            "lower bound",
            "proved bound",
            *ACHIEVED,
        ),
        rows,
    )


def comparison_table(cases: Sequence[Case], points: int = 57) -> Table:
    """Printed gains and shipped schedules by the same measures."""
    rows: list[list[Cell]] = []
    for case in cases:
        grid = case.grid(points)
        shipped = achieved(case, GainSchedule.shipped(case.name).gain(grid)[..., 0], grid)
        for what, found in (("printed gains", printed_achieved(case, points)), ("shipped schedule", shipped)):
            rows.append([case.title, what, *_short(_numbers(found))])
    return Table(
        "comparison",
        "Printed gains and shipped schedules by the same measures, at the worst constant wheel speed from 0 to 140 "
        "rad/s. Friction and force noise are at their static floors in nearly all rows; decay, fastest pole and "
        "broadband noise tell the gains apart.",
        ("case", "gains", *ACHIEVED),
        rows,
    )


def _numbers(found: Achieved) -> list[float]:
    return [float(np.asarray(value)) for value in vars(found).values()]


def _short(values: Sequence[float]) -> list[Cell]:
    return [None if np.isnan(value) else float(f"{value:.6g}") for value in values]
