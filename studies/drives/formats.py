"""A log file of any format as a table of columns: the ending of its name says which reader it needs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from studies.drives.columns import LogFile
from studies.drives.csv_log import CsvForm, read_columns, read_header, read_units
from studies.drives.table import LogTable


def is_text(path: Path) -> bool:
    """Whether a file is read as CSV: whatever has no ending of another format."""
    return True


def read_table(path: Path, wanted: Mapping[str, str], entry: LogFile) -> LogTable:
    """The ``wanted`` columns (name to what they are for), among them the time of the log ``entry``.

    Raises LogError naming file, place and remedy.
    """
    return read_columns(path, wanted, form_of(entry))


def name_columns(path: Path, entry: LogFile) -> dict[str, str]:
    """Names of all columns with their units, empty where the file has none."""
    form = form_of(entry)
    names = read_header(path, form)
    units = read_units(path, form) if form.units_row else []
    return {name: units[k] if k < len(units) else "" for k, name in enumerate(names)}


def form_of(entry: LogFile) -> CsvForm:
    """How the cells of a text file are written."""
    iso = entry.time if entry.time_format == "iso" else None
    return CsvForm(entry.delimiter, entry.decimal, entry.encoding, entry.units_row, iso)
