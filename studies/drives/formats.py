"""A log file of any format as a table of columns: the ending of its name says which reader it needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from studies.drives.bag_log import name_fields, read_fields
from studies.drives.columns import LogFile
from studies.drives.csv_log import CsvForm, read_columns, read_header, read_units
from studies.drives.mat_log import name_variables, read_variables
from studies.drives.mdf_log import name_channels, read_channels
from studies.drives.table import LogTable
from studies.errors import LogError

Read = Callable[[Path, Mapping[str, str], str], LogTable]
Name = Callable[[Path], dict[str, str]]
_MDF, _BAG = (read_channels, name_channels), (read_fields, name_fields)
READERS: dict[str, tuple[Read, Name]] = {
    ".mf4": _MDF, ".mdf": _MDF, ".mcap": _BAG, ".bag": _BAG, ".db3": _BAG, ".mat": (read_variables, name_variables),
}  # fmt: skip
"""By ending: what reads columns, and what names them. Every other file is text."""
BAG_FOLDER = "metadata.yaml"  # what makes a folder a ROS 2 bag


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a log itself, and not a place of logs."""
    return path.is_dir() and (path / BAG_FOLDER).is_file()


def is_text(path: Path) -> bool:
    """Whether a file is read as CSV: whatever has no ending of another format."""
    return _reader(path) is None


def read_table(path: Path, wanted: Mapping[str, str], entry: LogFile) -> LogTable:
    """The ``wanted`` columns (name to what they are for), among them the time of the log ``entry``.

    Raises LogError naming file, place and remedy.
    """
    reader = _reader(path)
    return read_columns(path, wanted, form_of(entry)) if reader is None else reader[0](path, wanted, entry.time)


def name_columns(path: Path, entry: LogFile) -> dict[str, str]:
    """Names of all columns with their units, empty where the file has none."""
    reader = _reader(path)
    if reader is not None:
        if not path.exists():
            raise LogError(f"{path.name}: cannot be read (no such file); check the path")
        return reader[1](path)
    form = form_of(entry)
    names = read_header(path, form)
    units = read_units(path, form) if form.units_row else []
    return {name: units[k] if k < len(units) else "" for k, name in enumerate(names)}


def _reader(path: Path) -> tuple[Read, Name] | None:
    return _BAG if is_bag_folder(path) else READERS.get(path.suffix.lower())


def form_of(entry: LogFile) -> CsvForm:
    """How the cells of a text file are written."""
    iso = entry.time if entry.time_format == "iso" else None
    return CsvForm(
        entry.delimiter, entry.decimal, entry.encoding, entry.units_row, iso, entry.thousands, entry.header_line
    )
