"""The study of consistency: normalised errors of the pipeline on every shipped manoeuvre, for both kinds of tires."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from estimators.filters import average_band
from studies.beyond.consistency.runs import Consistency, errors
from studies.plots import Axis, Figure, Mark, Panel, Shade, colours, dots
from studies.study import Cell, Part, PartResult, Scope, Study, Table
from studies.trials.histories import row_axis
from studies.trials.simulations import LUGRE, MAGIC_FORMULA, SIMULATIONS, simulated_truth
from studies.truth import shipped_manoeuvres

BAND = (0.25, 2.0)
"""NEES within which a deviation counts as true: up to twice too wide, and hardly too narrow, for that is worse.

The chi-square band of an ideal filter is in the table's caption; errors of tire models are the same for all seeds, so no
pipeline on a truth vehicle stays inside it."""
COLUMNS = (
    "manoeuvre", "NEES V_x", "NEES V_y", "NEES both", "V_x beyond 3 sigma [%]", "V_y beyond 3 sigma [%]", "V_x RMS [m/s]",
    "V_x sigma [m/s]", "V_y RMS [m/s]", "V_y sigma [m/s]", "NEES roll", "NEES pitch", "roll beyond 3 sigma [%]",
    "pitch beyond 3 sigma [%]", "roll RMS [deg]", "roll sigma [deg]", "pitch RMS [deg]", "pitch sigma [deg]", "verdict",
)  # fmt: skip
NAMES = ("V_x", "V_y", "both", "roll", "pitch")
"""As `Consistency.nees` has them."""
MARKS = (
    ("V_x", -0.24, colours.FUSION, "o"), ("V_y", -0.08, colours.OWN_OBSERVERS, "s"),
    ("roll", 0.08, colours.PIPELINE, "^"), ("pitch", 0.24, colours.SCHEDULE, "v"),
)  # fmt: skip
"""Of the picture: offset, colour and marker of each."""

GROUPS = {"p1": ("p1-",), "p2": ("p2-",), "others": ("p3-", "p4-", "p5-", "floor-")}
"""Manoeuvres by the start of their names: a part each, for workers to share and for a run that goes on to keep."""


def members(group: str) -> tuple[str, ...]:
    """The shipped manoeuvres of a group."""
    return tuple(name for name in sorted(shipped_manoeuvres()) if name.startswith(GROUPS[group]))


def consistency_part(scope: Scope, tire: str, group: str) -> PartResult:
    """A row for every manoeuvre, a picture of their NEES, and how many are inside the band."""
    truth = simulated_truth(members(group), tire, scope)
    found = sorted((one.tested() for one in errors(truth, range(scope.seeds))), key=lambda one: one.manoeuvre)
    low, high = average_band(scope.seeds, 1)
    caption = (
        f"Average NEES over {scope.seeds} seeds and time on {tire} tires; 1 where the stated deviation is true. An ideal "
        f"filter's average over the seeds lies within {low:.2f} and {high:.2f} with 95 %. From {BAND[0]:g} to {BAND[1]:g} it is "
        "at most twice too wide or by 1.4 too narrow. Radii differ from those assumed by 1.5 % (all wheels) and 0.5 % (each), "
        "the thrust angle of the rear axle and the angle of the front wheels by 0.1 degrees."
    )
    counts = {
        f"{tire}, {group}: manoeuvres with {name} {word}": float(sum(_side(one.nees[k]) == side for one in found))
        for k, name in enumerate(NAMES)
        for side, word in ((1, "overconfident"), (0, "true"), (-1, "too wide"))
    }
    return PartResult(
        tables=[Table(f"consistency-{tire}-{group}", caption, COLUMNS, [_row(one) for one in found])],
        figures=[picture(f"consistency-{tire}-{group}", caption, found)],
        measures=counts,
    )


def picture(name: str, caption: str, found: Sequence[Consistency]) -> Figure:
    """NEES of speeds and tilt, manoeuvre below manoeuvre, and the band."""
    rows = np.arange(len(found))
    marks: list[Mark] = [
        *(
            dots([one.nees[NAMES.index(name)] for one in found], rows + shift, name, colour, marker)
            for name, shift, colour, marker in MARKS
        ),
        Shade(*BAND, "x", "at most twice too wide, or by 1.4 too narrow"),
    ]
    panel = Panel(
        marks, Axis("NEES, average over seeds and time", scale="log"), row_axis([one.manoeuvre for one in found])
    )
    words = f"Dots of the NEES of speeds, roll and pitch for {len(found)} manoeuvres, between 0.01 and 100, with the band {BAND}."
    return Figure(name, caption, words, panel, (7.2, 0.8 + 0.22 * len(found)), "below")


def _side(value: float) -> int:
    """1 overconfident, -1 too wide."""
    return int(value > BAND[1]) - int(value < BAND[0])


def _row(one: Consistency) -> list[Cell]:
    words = {1: "overconfident", -1: "too wide"}
    said = [
        f"{name} {words[side]}"
        for name, value in zip(NAMES, one.nees, strict=True)
        if name != "both" and (side := _side(value))
    ]
    shares = [100.0 * share for share in one.beyond]
    sizes = [value for pair in zip(one.rms, one.sigma, strict=True) for value in pair]
    tilt = (*one.nees[3:], *shares[2:], *np.degrees(sizes[4:]).tolist())
    return [
        one.manoeuvre, *(round(value, 3) for value in (*one.nees[:3], *shares[:2])), *(round(value, 4) for value in sizes[:4]),
        *(round(value, 3) for value in tilt), ", ".join(said) or "true",
    ]  # fmt: skip


STUDY = Study(
    "consistency",
    "Whether the stated deviations are true: NEES of the whole pipeline",
    "",
    "V_x, V_y, roll and pitch of the default pipeline with an attitude part on every shipped manoeuvre, over seeds of sensor "
    "errors, of tire radii and of the alignment of axles: normalised "
    "errors, where the pipeline is overconfident and where its deviations are far too wide.",
    tuple(
        Part(
            f"{tire}-{group}",
            f"NEES on {tire} tires, manoeuvres of group {group}",
            partial(consistency_part, tire=tire, group=group),
            140.0,
            (SIMULATIONS[tire],),
            tire == LUGRE,
        )
        for tire in (LUGRE, MAGIC_FORMULA)
        for group in GROUPS
    ),
)
