"""The study of the fault matrix."""

from __future__ import annotations

import math

from estimators.velocity.isolability import SIGNALS as ISOLATED
from estimators.velocity.isolability import isolability
from studies.beyond.fault_matrix.drives import FAULT
from studies.beyond.fault_matrix.faults import RELATED, SEVERE, UNITS
from studies.beyond.fault_matrix.matrix import BOUND, FLAG_TIME, PATIENCE, RECOVERY, Cell, double_cases, matrix
from studies.papers.topic import Topic
from studies.study import Cell as Entry
from studies.study import PartResult, Scope, Study, Table

TOPIC = Topic("studies.beyond.fault_matrix")
QUICK_SEEDS, SEEDS = 1, 2  # each costs 355 cars
COLUMNS = (
    "signal",
    "fault",
    "drive",
    "V_x [m/s]",
    "V_y [m/s]",
    "V_x after [m/s]",
    "V_y after [m/s]",
    "beyond 3 sigma [s]",
)


@TOPIC.part("matrix", "Every signal at fault in every way on five drives", cost=60.0)
def fault_matrix(scope: Scope) -> PartResult:
    """A row for every signal and fault: the drives and what is missed there; and every cell that misses anything."""
    found = matrix(range(QUICK_SEEDS if scope.quick else SEEDS))
    drives, rows = _by_case(found)
    table: list[list[Entry]] = [[*key, *(_text(row[drive]) for drive in drives)] for key, row in rows.items()]
    far = ", ".join(f"{name} {size:g} {UNITS[name]}" for name, size in SEVERE.items())
    caption = (
        f"{_ERRORS} Letters: {_LETTERS} = where there is nothing to find: the reading is not far from the healthy one for "
        f"{FLAG_TIME:g} s ({far}). ~ where there is no flag, for no relation could show it."
    )
    tilt: list[list[Entry]] = [
        [*key, *(round(math.degrees(row[drive].pitch), 2) for drive in drives)] for key, row in rows.items()
    ]
    missed: list[list[Entry]] = [_row(cell) for cell in found if cell.missed()]
    hidden: list[list[Entry]] = [
        [cell.signal, cell.fault, cell.drive, round(cell.share, 2), round(cell.vx, 2), round(cell.vy, 2)]
        for cell in found
        if cell.hidden
    ]
    tables = [
        Table("fault-matrix", caption, ("signal", "fault", *drives), table),
        Table("fault-matrix-missed", "The cells that miss a bound.", (*COLUMNS, "misses"), missed),
        Table("fault-matrix-hidden", _HIDDEN, (*COLUMNS[:3], "share of the allowance", *COLUMNS[3:5]), hidden),
        Table("fault-matrix-pitch", _PITCH, ("signal", "fault", *drives), tilt),
    ]
    measures = {"cells with nothing to find": float(sum(_same(cell) for cell in found))}
    measures |= {"cells that no relation can show": float(len(hidden))} | _counts(found)
    measures["largest error of pitch without a fault [deg]"] = max(
        math.degrees(c.pitch) for c in found if c.signal == "none"
    )
    return PartResult(tables=tables, measures=measures)


@TOPIC.part("doubles", "Two signals at fault at once, on five drives", cost=120.0)
def double_faults(scope: Scope) -> PartResult:
    """A row for every two signals: what they look like, what is reported, and the worst of every drive."""
    found = matrix(range(QUICK_SEEDS if scope.quick else SEEDS), double_cases()[:: 5 if scope.quick else 1])
    apart = {faults.signals: faults for faults in isolability(3)}
    rows: dict[str, list[Cell]] = {}
    for cell in found:
        rows.setdefault(cell.signal, []).append(cell)
    drives, _ = _by_case(found)
    table: list[list[Entry]] = []
    for signal, cells in rows.items():
        faults = apart[tuple(sorted(_members(cells[0]), key=ISOLATED.index))]
        words = (
            ", ".join(" and ".join(group) for group in faults.alike),
            ", ".join(faults.live),
            ", ".join(faults.repeating),
        )
        worst = [[cell for cell in cells if cell.drive == drive] for drive in drives]
        table.append([signal, *(word or "-" for word in words), *(_worst(of) for of in worst)])
    broken: list[list[Entry]] = [_row(cell) for cell in found if set(cell.missed()) & set("sf")]
    wide: list[list[Entry]] = [_row(cell) for cell in found if set(cell.missed()) & set("xy")]
    tables = [
        Table("double-faults", f"{_ERRORS} {_DOUBLES} Letters: {_LETTERS}", (*_DOUBLE_COLUMNS, *drives), table),
        Table(
            "double-faults-missed",
            "Two faults that are not flagged, or beyond the stated deviation.",
            (*COLUMNS, "misses"),
            broken,
        ),
        Table("double-faults-wide", f"Two faults with an error above {BOUND:g} m/s.", (*COLUMNS, "misses"), wide),
    ]
    return PartResult(tables=tables, measures=_counts(found))


_ERRORS = (
    f"Largest errors of V_x / V_y during a fault of {FAULT[1] - FAULT[0]:g} s, m/s, through the default pipeline with an "
    "attitude part."
)
_LETTERS = (
    f"x, y an error above {BOUND:g} m/s; r not back within {RECOVERY:g} s; s beyond three deviations for more than "
    f"{PATIENCE:g} s; f no flag within {FLAG_TIME:g} s though a reading is far off."
)
_DOUBLES = (
    "The worst of all ways in which the two fail: missing, frozen, zero, negated. What they look like and what is reported "
    "follows from the relations; an error above the bound is open where it is flagged and within the stated deviation."
)
_DOUBLE_COLUMNS = ("signals", "looks like", "reported, live", "reported, repeating")
_HIDDEN = (
    "Faults that no relation can show: the largest residual of a relation that the fault moves, as a share of what that "
    "relation allows, from the healthy car and the size of the fault alone."
)


def _by_case(found: list[Cell]) -> tuple[list[str], dict[tuple[str, str], dict[str, Cell]]]:
    """Drives, and the cells by signal and fault, and drive."""
    rows: dict[tuple[str, str], dict[str, Cell]] = {}
    for cell in found:
        rows.setdefault((cell.signal, cell.fault), {})[cell.drive] = cell
    return list(dict.fromkeys(cell.drive for cell in found)), rows


def _counts(found: list[Cell]) -> dict[str, float]:
    count = {f"cells missing {name}": sum(letter in cell.missed() for cell in found) for letter, name in _NAMES.items()}
    count |= {"cells": len(found), "cells missing anything": sum(bool(cell.missed()) for cell in found)}
    return {name: float(value) for name, value in count.items()}


def _members(cell: Cell) -> list[str]:
    """Its signals by the names of the relations."""
    return [name for signal, _ in cell.case for name in RELATED.get(signal, (signal,))]


def _worst(cells: list[Cell]) -> str:
    letters = sorted({letter for cell in cells for letter in cell.missed()}, key="xyrsf".index)
    return f"{max(c.vx for c in cells):.2f} / {max(c.vy for c in cells):.2f} {''.join(letters)}".rstrip()


_NAMES = {"x": "V_x", "y": "V_y", "r": "recovery", "s": "deviation", "f": "flag"}


_PITCH = "Largest error of the body's pitch during the fault, degrees, by the attitude part."


def _same(cell: Cell) -> bool:
    return cell.signal != "none" and cell.flagged is None


def _text(cell: Cell) -> str:
    mark = "=" if _same(cell) else "~" if cell.hidden else ""
    return f"{cell.vx:.2f} / {cell.vy:.2f} {mark}{cell.missed()}".rstrip()


def _row(cell: Cell) -> list[Entry]:
    values = (cell.vx, cell.vy, cell.vx_after, cell.vy_after, cell.beyond)
    return [cell.signal, cell.fault, cell.drive, *(round(value, 2) for value in values), cell.missed()]


STUDY = Study(
    "fault-matrix",
    "Every signal at fault: what the pipeline finds, keeps and gives back",
    "",
    "Ten signals that are missing, frozen, zero, clipped, negated, doubled or late, on a car that goes straight, turns, pulls "
    "away, brakes or stands: errors of V_x and V_y during the fault and after it, stated deviations, and whether it is flagged.",
    tuple(TOPIC.parts),
)
