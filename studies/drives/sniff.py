"""How a text log is written, from its first lines: encoding, separator, decimal sign, row of units, time stamps."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

from studies.drives.columns import LogFile
from studies.drives.csv_log import DELIMITERS, NUMBER, grouped_by
from studies.drives.formats import is_text
from studies.drives.guess_names import guess_column
from studies.drives.iso_time import looks_iso
from studies.errors import LogError

LINES = 60


def sniff(path: Path) -> LogFile:
    """The keys of a log in a drive file, its rate and time column still to be found. Raises LogError: not readable, no text."""
    if not is_text(path):
        return _log({"name": path.stem})
    encoding = _encoding(path)
    try:
        with path.open(encoding="utf-8-sig" if encoding == "utf-8" else encoding, newline="") as stream:
            lines = [line.rstrip("\r\n") for _, line in zip(range(LINES), stream, strict=False)]
    except (OSError, UnicodeError) as error:
        raise LogError(
            f"{path.name}: cannot be read as text ({error}); give a CSV log, or write the drive file by hand"
        ) from error
    start = _header(lines)
    if start is None:
        raise LogError(f"{path.name}: line 1 is empty; it must hold the column names")
    delimiter = _delimiter(lines[start])
    header, rows = _split(lines[start], delimiter), [_split(line, delimiter) for line in lines[start + 1 :] if line]
    units_row = bool(rows) and not any(NUMBER.fullmatch(cell) or looks_iso(cell) for cell in rows[0] if cell)
    body = rows[1:] if units_row else rows
    cells = [cell for row in body for cell in row]
    commas = sum(bool(re.fullmatch(r"[-+]?[\d.' ]+,\d+([eE][-+]?\d+)?", cell)) for cell in cells)
    points = sum(bool(re.fullmatch(r"[-+]?[\d,' ]+\.\d+([eE][-+]?\d+)?", cell)) for cell in cells)
    decimal = "," if delimiter != "," and commas > points else "."
    grouped = {sign for cell in cells if (sign := grouped_by(cell))} - {decimal}
    clock = next(
        (k for k, name in enumerate(header) if (g := guess_column(name)) is not None and g.table == "time"), None
    )
    iso = clock is not None and any(looks_iso(row[clock]) for row in body if len(row) > clock)
    return _log({
        "name": path.stem, "time": header[clock] if clock is not None else "time", "delimiter": delimiter,
        "decimal": decimal, "thousands": min(grouped, default=""), "encoding": encoding, "header_line": start + 1,
        "units_row": units_row, "time_format": "iso" if iso else "number",
    })  # fmt: skip


def _header(lines: list[str]) -> int | None:
    """The first line that has as many fields as the last one, several: what a logger says of itself may stand before it."""
    for k, line in enumerate(lines):
        cells = _split(line, _delimiter(line))
        if 2 * sum(NUMBER.fullmatch(cell) is not None for cell in cells) > len(cells):
            break  # measured rows have begun; a title may hold a number, too
        if len(cells) > 1 and len(cells) == len(_split(lines[-1], _delimiter(line))):
            return k
    return 0 if lines and lines[0].strip() else None


def _delimiter(header: str) -> str:
    """What splits a header into the most fields; a space only where nothing else does."""
    best = max(DELIMITERS, key=lambda one: len(_split(header, one)))
    return best if len(_split(header, best)) > 1 else " " if " " in header.strip() else best


def _log(keys: dict[str, Any]) -> LogFile:
    return LogFile.model_validate({**keys, "rate": "1 Hz"})


def _split(line: str, delimiter: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return [line]


def _encoding(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            start = stream.read(65536)
    except OSError as error:
        raise LogError(f"{path.name}: cannot be read ({error.strerror}); check the path") from error
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    if start.count(b"\0") > len(start) // 4:
        return "utf-16-le" if start[1:2] == b"\0" else "utf-16-be"
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"
