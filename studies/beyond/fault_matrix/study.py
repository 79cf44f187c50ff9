"""The study of the fault matrix."""

from __future__ import annotations

import math

from studies.beyond.fault_matrix.drives import FAULT
from studies.beyond.fault_matrix.faults import SEVERE, UNITS
from studies.beyond.fault_matrix.matrix import BOUND, FLAG_TIME, PATIENCE, RECOVERY, Cell, matrix
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
    drives = list(dict.fromkeys(cell.drive for cell in found))
    rows: dict[tuple[str, str], dict[str, Cell]] = {}
    for cell in found:
        rows.setdefault((cell.signal, cell.fault), {})[cell.drive] = cell
    table: list[list[Entry]] = [[*key, *(_text(row[drive]) for drive in drives)] for key, row in rows.items()]
    far = ", ".join(f"{name} {size:g} {UNITS[name]}" for name, size in SEVERE.items())
    caption = (
        f"Largest errors of V_x / V_y during a fault of {FAULT[1] - FAULT[0]:g} s, m/s, through the default pipeline with an "
        f"attitude part. Letters: x, y an error above {BOUND:g} m/s; r not back within {RECOVERY:g} s; s beyond three "
        f"deviations for more than {PATIENCE:g} s; f no flag within {FLAG_TIME:g} s though the reading is far off. "
        f"= where there is nothing to find: the reading is not far from the healthy one for {FLAG_TIME:g} s ({far})."
    )
    tilt: list[list[Entry]] = [
        [*key, *(round(math.degrees(row[drive].pitch), 2) for drive in drives)] for key, row in rows.items()
    ]
    missed: list[list[Entry]] = [_row(cell) for cell in found if cell.missed()]
    tables = [
        Table("fault-matrix", caption, ("signal", "fault", *drives), table),
        Table("fault-matrix-missed", "The cells that miss a bound.", (*COLUMNS, "misses"), missed),
        Table("fault-matrix-pitch", _PITCH, ("signal", "fault", *drives), tilt),
    ]
    count = {"cells with nothing to find": sum(_same(cell) for cell in found)}
    count |= {
        f"cells missing {name}": sum(letter in cell.missed() for cell in found) for letter, name in _NAMES.items()
    }
    measures = {name: float(value) for name, value in count.items()}
    measures |= {
        "cells": len(found),
        "cells missing anything": len(missed),
        "largest error of pitch without a fault [deg]": max(math.degrees(c.pitch) for c in found if c.signal == "none"),
    }
    return PartResult(tables=tables, measures=measures)


_NAMES = {"x": "V_x", "y": "V_y", "r": "recovery", "s": "deviation", "f": "flag"}


_PITCH = "Largest error of the body's pitch during the fault, degrees, by the attitude part."


def _same(cell: Cell) -> bool:
    return cell.signal != "none" and cell.flagged is None


def _text(cell: Cell) -> str:
    return f"{cell.vx:.2f} / {cell.vy:.2f} {'=' if _same(cell) else ''}{cell.missed()}".rstrip()


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
