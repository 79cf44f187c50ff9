"""Reading columns of numbers from a CSV log, with the line of every complaint."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from estimators.arrays import FloatArray
from estimators.errors import unknown
from studies.errors import LogError


@dataclass(frozen=True)
class CsvColumns:
    """The wanted columns as numbers; an empty cell, NaN or infinity is NaN. Row k stands on line k + 2 of the file."""

    values: dict[str, FloatArray]
    rows: int
    not_finite: dict[str, int]


def line_of(row: int) -> int:
    """The line of the file that holds data row ``row``: one header line, lines counted from 1."""
    return row + 2


def read_columns(path: Path, wanted: Mapping[str, str], delimiter: str = ",") -> CsvColumns:
    """Read the ``wanted`` columns (name to what they are for) of a CSV file with one header line.

    Raises LogError naming file, line and remedy: no such file, empty, unknown column, a row with too few or too many
    fields, text where a number belongs.
    """
    table = _read_text(path, delimiter)
    header = _header(path, delimiter)
    if any("\n" in name for name in table.columns):
        raise LogError(f"{path.name}: line 1 opens a quote that it does not close; repair the header")
    for column, role in wanted.items():
        if column not in table.columns:
            raise LogError(f"{path.name}: {role}: {unknown('column', column, table.columns)}")
        if header.count(column) > 1:
            raise LogError(f"{path.name}: {role}: column '{column}' appears {header.count(column)} times; rename one")
    if table.height == 0:
        raise LogError(f"{path.name}: has a header but no rows; record again or give another file")
    _refuse_short_rows(path, table, delimiter)
    values = {column: _numbers(path, table[column]) for column in wanted}
    bad = {column: int(np.count_nonzero(~np.isfinite(v))) for column, v in values.items()}
    for value in values.values():
        value[~np.isfinite(value)] = np.nan
    return CsvColumns(values=values, rows=table.height, not_finite={c: n for c, n in bad.items() if n})


def _read_text(path: Path, delimiter: str) -> pl.DataFrame:
    if not path.is_file():
        raise LogError(f"{path.name}: cannot be read (no such file); check the path")
    try:
        return pl.read_csv(path, separator=delimiter, infer_schema=False)
    except OSError as error:
        raise LogError(f"{path.name}: cannot be read ({error.strerror or error}); check the path") from error
    except pl.exceptions.NoDataError as error:
        raise LogError(f"{path.name}: is empty; record again or give another file") from error
    except pl.exceptions.PolarsError as error:
        raise LogError(f"{path.name}: {_long_row(path, delimiter)}") from error


def _header(path: Path, delimiter: str) -> list[str]:
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
        return next(csv.reader([stream.readline()], delimiter=delimiter), [])


def _long_row(path: Path, delimiter: str) -> str:
    """Why polars refuses a file: nearly always a row with more fields than the header."""
    fields = len(_header(path, delimiter))
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
        for number, line in enumerate(stream, start=1):
            found = next(csv.reader([line], delimiter=delimiter), [])
            if len(found) > fields:
                return f"line {number} has {len(found)} fields where the header has {fields}; repair or remove the line"
    return "is not a CSV file in UTF-8 with one header line; export it again"


def _refuse_short_rows(path: Path, table: pl.DataFrame, delimiter: str) -> None:
    """A row that ends early reads as empty cells: only the line itself tells it from a row whose last cell is empty."""
    suspects = table[table.columns[-1]].is_null().arg_true().to_list()
    if not suspects:
        return
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
        lines = dict(zip(itertools.count(1), stream, strict=False))
    for row in suspects:
        line = lines.get(line_of(row), "")
        found = len(next(csv.reader([line], delimiter=delimiter), []))
        if found < table.width:
            raise LogError(
                f"{path.name}: line {line_of(row)} has {found} fields where the header has {table.width}; "
                "the row is cut off: repair or remove the line"
            )


def _numbers(path: Path, text: pl.Series) -> FloatArray:
    stripped = text.str.strip_chars()
    numbers = stripped.cast(pl.Float64, strict=False)
    wrong = (numbers.is_null() & stripped.is_not_null() & (stripped != "")).arg_true()
    if wrong.len():
        row = int(wrong[0])
        raise LogError(
            f"{path.name}: line {line_of(row)}: column '{text.name}' holds '{stripped[row]}', not a number; "
            "leave the cell empty where nothing was measured"
        )
    return np.array(numbers.fill_null(np.nan).to_numpy(), dtype=np.float64)
