"""What was read of a log, and what was wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from studies.drives.raised import Raised
from studies.sentence import shown
from studies.study import Table

Report = Mapping[str, Any]


def complaints(report: Report) -> list[str]:
    """One sentence for everything that had to be repaired or bridged, and for comparisons that do not agree."""
    found = []
    for log in report["logs"].values():
        place = log["file"]
        if log["duplicates"]:
            found.append(f"{place}: {_counted(log['duplicates'], 'duplicate time stamp')} merged.")
        if log["out_of_order"]:
            found.append(f"{place}: {_counted(log['out_of_order'], 'row')} out of order, sorted.")
        if log["gaps"]:
            longest, allowed = shown(1e3 * log["largest_gap_s"], 3), shown(1e3 * log["allowed_gap_s"], 3)
            found.append(f"{place}: {_counted(log['gaps'], 'gap')} longer than {allowed} ms, the longest {longest} ms.")
        found += [
            f"{place}: '{column}' has {_counted(n, 'cell')} without a number."
            for column, n in log["not_finite"].items()
        ]
    total = report["grid"]["samples"]
    for name, count in report["grid"]["missing_samples"].items():
        found.append(f"{name.replace('_', ' ')} is missing at {shown(100.0 * count / total, 2)} % of the samples.")
    for row in report.get("frames", ()):
        if row["verdict"].startswith(("off", "contradicts")):
            found.append(f"{row['comparison']} is {shown(row['slope'], 3)} and should be 1: {row['verdict']}.")
    if "frames" not in report:
        found.append("Signs, units and sides of the signals were not checked.")
    return found


def agreeing(report: Report) -> str:
    """How many comparisons of the signals with one another agree."""
    frames = report.get("frames", ())
    agreeing = [row for row in frames if row["verdict"] == "agrees"]
    if not agreeing:
        return ""
    agree = f"{len(agreeing)} of {len(frames)} comparisons of the signals with one another agree"
    return f"{agree}." if len(agreeing) == len(frames) else f"{agree}; the others are in the table of the log."


def log_tables(report: Report) -> list[Table]:
    """The files, and the comparisons."""
    rows = [
        (
            name, log["file"], log["rows"], shown(log["median_rate_hz"], 4), log["duplicates"], log["out_of_order"], log["gaps"],
            shown(1e3 * log["largest_gap_s"], 3), shown(1e3 * log["allowed_gap_s"], 3), shown(1e3 * log["clock_offset_s"], 3),
        )
        for name, log in report["logs"].items()
    ]  # fmt: skip
    columns = (
        "log", "file", "rows", "rate [Hz]", "duplicates", "out of order", "gaps", "largest step [ms]", "allowed [ms]",
        "clock offset [ms]",
    )  # fmt: skip
    grid = report["grid"]
    caption = (
        f"What was read. All signals are on one grid of {grid['samples']} samples every {shown(1e3 * grid['sample_time_s'])} ms, "
        f"from {shown(grid['start_s'], 4)} to {shown(grid['end_s'], 4)} s."
    )
    tables = [Table("files", caption, columns, rows)]
    if report.get("frames"):
        said = "Signals beside what the others say of them: a wrong sign, unit or side shows as a slope away from 1."
        lines = [(r["comparison"], _known(r["slope"]), _known(r["quality"]), r["verdict"]) for r in report["frames"]]
        tables.append(Table("comparisons", said, ("comparison", "slope [1]", "quality [1]", "verdict"), lines))
    return tables


def flag_table(rows: Sequence[Raised]) -> Table:
    """What rose, for how long, and what it means."""
    cells = [
        (row.owner, row.name, shown(row.share, 3), shown(row.first, 4), shown(row.longest, 3), row.meaning)
        for row in rows
    ]
    columns = ("of", "flag", "samples [%]", "first at [s]", "longest [s]", "what it means")
    return Table("flags", "Flags that rose at least once.", columns, cells)


def _known(value: float | None) -> str | None:
    return None if value is None else shown(value, 3)


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
