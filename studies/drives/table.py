"""Columns of numbers as a log file holds them, whatever its format."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import unknown
from studies.drives.quantities import short
from studies.errors import LogError

LONGEST_LIST = 180  # characters of the names of columns in one message


@dataclass(frozen=True)
class LogTable:
    """The wanted columns as numbers; what is empty, NaN or infinite is NaN, and counted in ``not_finite``.

    ``first_line``: of the file that holds row 0, None where a file has no lines. ``merged``: the columns have stamps of their
    own, which were put into one column, so that rows come in any spacing.
    """

    values: dict[str, FloatArray]
    rows: int
    not_finite: dict[str, int]
    first_line: int | None = 2
    merged: bool = False

    def place(self, row: int) -> str:
        """Where a row stands, for messages."""
        return f"sample {row}" if self.first_line is None else f"line {row + self.first_line}"


def table_of(values: Mapping[str, FloatArray], first_line: int | None, merged: bool = False) -> LogTable:
    """A table of equally long columns, infinities made NaN."""
    clean = {name: np.where(np.isfinite(value), value, np.nan) for name, value in values.items()}
    bad = {name: int(np.count_nonzero(np.isnan(value))) for name, value in clean.items()}
    rows = max((value.size for value in clean.values()), default=0)
    return LogTable(clean, rows, {name: n for name, n in bad.items() if n and not merged}, first_line, merged)


def merge(series: Mapping[str, tuple[FloatArray, FloatArray]], time: str) -> LogTable:
    """One table of columns (stamps, values) that have clocks of their own: every stamp once, NaN where a column has none."""
    stamps = np.unique(np.concatenate([when for when, _ in series.values()]))
    values = {time: stamps}
    for name, (when, value) in series.items():
        column = np.full(stamps.size, np.nan)
        column[np.searchsorted(stamps, when)] = value
        values[name] = column
    return table_of(values, None, merged=True)


def no_column(file: str, role: str, name: str, known: Iterable[str]) -> LogError:
    """The refusal of a column that a file does not have, with the nearest of those it has."""
    names = [short(one, 40) for one in list(known)[:2000]]
    said = unknown("column", short(name, 40), names)
    return LogError(f"{file}: {short(role, 60)}: {short(said, LONGEST_LIST)}")
