"""Reading columns of numbers from a CSV log, with the line of every complaint and the key that would mend it."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
import polars as pl

from estimators.arrays import FloatArray
from studies.drives.iso_time import iso_seconds, looks_iso
from studies.drives.quantities import short
from studies.drives.table import LogTable, no_column, table_of
from studies.errors import LogError

LONGEST_HEADER = 100_000  # characters
DELIMITERS = (",", ";", "\t", "|")
NUMBER = re.compile(r"[-+]?\d+([.,]\d*)?([eE][-+]?\d+)?|[-+]?[.,]\d+")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
_GROUPED = re.compile(
    r"[-+]?\d{1,3}(?:([ '\u00a0\u202f])\d{3}(?:\1\d{3})*|(,)\d{3}(?:,\d{3})*(?=\.|,)|(\.)\d{3}(?:\.\d{3})*(?=,|\.))(?:[.,]\d*)?"
)
_DATE = re.compile(r"\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}\D.*|.*\d:\d\d.*")
_MISSING = frozenset({
    "na", "n/a", "#n/a", "#na", "<na>", "#nv", "nan(ind)", "-nan(ind)", "1.#ind", "-1.#ind", "1.#qnan", "-1.#qnan",
    "null", "none", "nil", "missing", "-", "--",
})  # fmt: skip
"""What loggers, spreadsheets and languages write where nothing was measured, beside an empty cell, NaN and inf."""


@dataclass(frozen=True)
class CsvForm:
    """How the cells are written: keys of a log in the drive file. ``iso``: the column of time stamps in text, if any."""

    delimiter: str = ","
    decimal: str = "."
    encoding: str = "utf-8"
    units_row: bool = False
    iso: str | None = None
    thousands: str = ""
    header_line: int = 1

    @property
    def first_line(self) -> int:
        """The line of row 0, counted from 1: behind the header, and the line of units if there is one."""
        return self.header_line + (2 if self.units_row else 1)


@dataclass(frozen=True)
class _File:
    path: Path
    form: CsvForm

    @property
    def name(self) -> str:
        return self.path.name

    @contextmanager
    def text(self) -> Iterator[TextIO]:
        encoding = "utf-8-sig" if self.form.encoding.lower() in ("utf-8", "utf8") else self.form.encoding
        try:
            with self.path.open(encoding=encoding, errors="replace", newline="") as stream:
                for _ in range(self.form.header_line - 1):
                    stream.readline()
                yield stream
        except UnicodeError as error:
            raise self.undecodable(error) from error

    def undecodable(self, error: UnicodeError) -> LogError:
        why = error.reason if isinstance(error, UnicodeDecodeError) else str(error)
        words = f"is not in {self.form.encoding} ({why}); correct encoding for this log in the drive file"
        return LogError(f"{self.name}: {words}")

    def split(self, line: str, delimiter: str | None = None) -> list[str]:
        try:
            return next(csv.reader([line], delimiter=delimiter or self.form.delimiter), [])
        except csv.Error as error:
            raise LogError(f"{self.name}: is not a CSV file ({error}); export it again") from error


def read_columns(path: Path, wanted: Mapping[str, str], form: CsvForm | None = None) -> LogTable:
    """Read the ``wanted`` columns (name to what they are for) of a CSV file with one header line.

    Raises LogError naming file, line and remedy: no such file, empty, another encoding, delimiter or decimal sign, a row of
    units, unknown column, a row with too few or too many fields, text where a number belongs.
    """
    file = _File(path, form or CsvForm())
    if not path.is_file():
        raise LogError(f"{path.name}: cannot be read (no such file); check the path")
    _refuse_encoding(file)
    header = read_header(path, file.form)
    table = _read_text(file)
    if any("\n" in name for name in table.columns):
        raise LogError(f"{path.name}: line 1 opens a quote that it does not close; repair the header")
    for column, role in wanted.items():
        if column not in table.columns:
            raise no_column(path.name, role, column, table.columns)
        if header.count(column) > 1:
            raise LogError(f"{path.name}: {role}: column '{column}' appears {header.count(column)} times; rename one")
    if table.height == 0:
        raise LogError(f"{path.name}: has a header but no rows; record again or give another file")
    _refuse_units_row(file, table.select(list(wanted)))
    _refuse_short_rows(file, table)
    return table_of({column: _numbers(file, table[column]) for column in wanted}, file.form.first_line)


def read_header(path: Path, form: CsvForm) -> list[str]:
    """Names of the columns. Raises LogError for a header that is none, or that another delimiter splits."""
    file = _File(path, form)
    with file.text() as stream:
        line = stream.readline(LONGEST_HEADER + 1)
    if len(line) > LONGEST_HEADER:
        raise LogError(f"{path.name}: line 1 has more than {LONGEST_HEADER} characters; it must hold the column names")
    header = file.split(line)
    if len(header) == 1:
        for other in (*DELIMITERS, " "):
            if other != form.delimiter and len(file.split(line, other)) > 1:
                shown = other.replace("\t", "\\t")
                raise LogError(
                    f'{path.name}: the header has one column, and {len(file.split(line, other))} with "{shown}" between '
                    f'them; set delimiter = "{shown}" for this log in the drive file'
                )
    return header


def read_units(path: Path, form: CsvForm) -> list[str]:
    """The cells of the line behind the header."""
    file = _File(path, form)
    with file.text() as stream:
        stream.readline()
        return [cell.strip() for cell in file.split(stream.readline(LONGEST_HEADER))]


def _refuse_encoding(file: _File) -> None:
    with file.path.open("rb") as stream:
        start = stream.read(4096)
    wide = start[:2] in (b"\xff\xfe", b"\xfe\xff") or start.count(b"\0") > len(start) // 4
    if wide and not file.form.encoding.lower().startswith("utf-16"):
        raise LogError(f'{file.name}: is written in UTF-16; set encoding = "utf-16" for this log in the drive file')


def _read_text(file: _File) -> pl.DataFrame:
    form, source = file.form, file.path
    try:
        data: Path | bytes = source
        if form.encoding.lower() not in ("utf-8", "utf8"):
            data = source.read_bytes().decode(form.encoding).lstrip("\ufeff").encode()
        if _returns_only(file):
            data = (source.read_bytes() if isinstance(data, Path) else data).replace(b"\r", b"\n")
        table = pl.read_csv(
            data, separator=form.delimiter, infer_schema=False, skip_lines=form.header_line - 1,
            skip_rows_after_header=1 if form.units_row else 0,
        )  # fmt: skip
        while table.height and not any(table.row(-1)):  # empty lines at the end are no rows
            table = table.head(-1)
        return table
    except OSError as error:
        raise LogError(f"{file.name}: cannot be read ({error.strerror or error}); check the path") from error
    except UnicodeError as error:
        raise file.undecodable(error) from error
    except pl.exceptions.NoDataError as error:
        raise LogError(f"{file.name}: is empty; record again or give another file") from error
    except pl.exceptions.PolarsError as error:
        raise LogError(f"{file.name}: {_why_refused(file)}") from error


def _returns_only(file: _File) -> bool:
    """Whether lines end as they did on the first Macintosh, with a carriage return alone."""
    with file.text() as stream:
        line = stream.readline(LONGEST_HEADER)
    return line.endswith("\r")


def _why_refused(file: _File) -> str:
    """Why polars refuses a file: nearly always a row with more fields than the header, or another encoding."""
    with file.text() as stream:
        fields = len(file.split(stream.readline()))
        for number, line in enumerate(stream, start=file.form.header_line + 1):
            cells = file.split(line)
            found = len(cells)
            if found == fields + 1 and not cells[-1].strip():
                shown = file.form.delimiter.replace("\t", "\\t")
                header = f"line {file.form.header_line}"
                return (
                    f'line {number} ends with a "{shown}" that the header does not have; add one to the end of {header}'
                )
            if found > fields:
                comma = file.form.delimiter == "," and _decimal_commas(line)
                hint = "; commas seem to be decimal signs: export with another delimiter" if comma else ""
                return (
                    f"line {number} has {found} fields where the header has {fields}; repair or remove the line{hint}"
                )
            if "\ufffd" in line:
                return f'line {number} is not UTF-8; set encoding = "cp1252" (or what wrote it) for this log in the drive file'
    return "is not a CSV file in UTF-8 with one header line; export it again, or set encoding for it in the drive file"


def _decimal_commas(line: str) -> bool:
    cells = line.strip().split(",")
    return len(cells) % 2 == 0 and len(cells) > 2 and all(cell.strip("-+ ").isdigit() for cell in cells)


def _refuse_units_row(file: _File, table: pl.DataFrame) -> None:
    cells = [str(cell or "").strip() for cell in table.row(0)]
    words = [cell for cell in cells if cell]
    if file.form.units_row or len(words) < len(cells) // 2 or any(map(_is_value, words)):
        return
    if table.height > 1 and not _is_value(str(table.row(1)[0] or "")):
        return
    shown = short(", ".join(words), 40)
    raise LogError(
        f"{file.name}: line {file.form.first_line} is a row of units ({shown}), not of numbers; "
        "set units_row = true for this log in the drive file"
    )


def _is_value(cell: str) -> bool:
    """Whether a cell is a measurement, a missing one included, or a time stamp; not a name or a unit."""
    numeric = NUMBER.fullmatch(cell) or _GROUPED.fullmatch(cell) or _DATE.fullmatch(cell)
    return numeric is not None or cell.lower() in _MISSING | {"nan", "inf", "-inf"}


def _refuse_short_rows(file: _File, table: pl.DataFrame) -> None:
    """A row that ends early reads as empty cells: only the line itself tells it from a row whose last cell is empty."""
    suspects = table[table.columns[-1]].is_null().arg_true().to_list()
    if not suspects:
        return
    with file.text() as stream:
        lines = dict(zip(itertools.count(file.form.header_line), stream, strict=False))
    for row in suspects:
        number = row + file.form.first_line
        found = len(file.split(lines.get(number, "")))
        if found < table.width:
            raise LogError(
                f"{file.name}: line {number} has {found} fields where the header has {table.width}; "
                "the row is cut off: repair or remove the line"
            )


def _numbers(file: _File, text: pl.Series) -> FloatArray:
    stripped = text.str.strip_chars()
    if text.name == file.form.iso:
        seconds = iso_seconds(text)
        wrong = np.flatnonzero(np.isnan(seconds) & (stripped.fill_null("") != "").to_numpy())
        if wrong.size:
            place = f"{file.name}: line {int(wrong[0]) + file.form.first_line}: column '{text.name}'"
            cell = short(str(stripped[int(wrong[0])]), 30)
            raise LogError(f"{place} holds '{cell}', not a time such as 2024-05-01T12:00:00.005; correct time_format")
        return seconds
    decimal, grouped = file.form.decimal, file.form.thousands
    plain = (
        stripped.str.replace_all(f"[{grouped}\u00a0\u202f]" if grouped == " " else f"[{grouped}]", "")
        if grouped
        else stripped
    )
    plain = plain if decimal == "." else plain.str.replace(decimal, ".", literal=True)
    numbers = plain.cast(pl.Float64, strict=False)
    wrong_rows = (numbers.is_null() & stripped.is_not_null() & (stripped != "")).arg_true()
    if wrong_rows.len():
        wrong_rows = wrong_rows.filter(~stripped.gather(wrong_rows).str.to_lowercase().is_in(list(_MISSING)))
    if wrong_rows.len():
        row = int(wrong_rows[0])
        cell = str(stripped[row])
        raise LogError(
            f"{file.name}: line {row + file.form.first_line}: column '{text.name}' holds '{short(cell, 30)}', not a number; "
            f"{cell_remedy(cell, decimal)}"
        )
    return np.array(numbers.fill_null(np.nan).to_numpy(), dtype=np.float64)


def grouped_by(cell: str) -> str:
    """The sign between groups of three digits, empty where a cell has none for certain: 1,234 alone may be a decimal."""
    found = _GROUPED.fullmatch(cell)
    sign = "" if found is None else next(one for one in found.groups() if one)
    return " " if sign in "\u00a0\u202f" and sign else sign


def cell_remedy(cell: str, decimal: str) -> str:
    """What would make a number of a cell that is none."""
    in_file = "for this log in the drive file"
    if (sign := grouped_by(cell)) != "":
        comma = 'decimal = "," and ' if sign == decimal == "." else ""
        return f'set {comma}thousands = "{sign}" {in_file}'
    if decimal == "." and _DECIMAL_COMMA.fullmatch(cell):
        return f'set decimal = "," {in_file}'
    if looks_iso(cell):
        return f'if it is the time column, set time_format = "iso" {in_file}'
    if _DATE.fullmatch(cell):
        return "write time stamps as seconds, or as 2024-05-01T12:00:00.005"
    return "leave the cell empty where nothing was measured"
