"""Time stamps as text: dates of ISO 8601 and their usual spellings, or a time of day, as seconds."""

from __future__ import annotations

import re

import numpy as np
import polars as pl

from estimators.arrays import FloatArray

_DAY, _CLOCK, _ZONE = (
    r"(?:(\d{4}-\d{1,2}-\d{1,2})[T ]\s*)?",
    r"(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d{1,9}))?",
    r"\s?(Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)?",
)
PATTERN = f"^{_DAY}{_CLOCK}{_ZONE}$"
_SPELLINGS = (
    (r"^(\d{4})/(\d{1,2})/(\d{1,2})", "${1}-${2}-${3}"),
    (r"^(\d{1,2})\.(\d{1,2})\.(\d{4})", "${3}-${2}-${1}"),
    (r"^(\d{4})(\d{2})(\d{2})T(\d{2})(\d{2})(\d{2})", "${1}-${2}-${3}T${4}:${5}:${6}"),
)
"""2024/05/01, 01.05.2024 and 20240501T120000. Not 05/01/2024: nobody can tell the day from the month."""
_LOOKS = re.compile(r"\d.*:\d\d.*|\d{8}T\d{6}.*")
_NOON = 43200.0  # s; a time of day that falls by more has passed midnight


def looks_iso(text: str) -> bool:
    """Whether a cell is a time stamp in text, such as 2024-05-01T12:00:00.005Z or 12:00:00,005."""
    cell = text.strip()
    return _LOOKS.fullmatch(cell) is not None and not np.isnan(iso_seconds(pl.Series([cell]))[0])


def iso_seconds(text: pl.Series) -> FloatArray:
    """Seconds since 1970, or since the first midnight where there is no date (n,); NaN where a cell is no time stamp.

    Seconds and their fraction are read apart: no digit of a microsecond is lost to a binary number of nanoseconds.
    """
    cells = text.str.strip_chars()
    for spelling, usual in _SPELLINGS:
        cells = cells.str.replace(spelling, usual)

    def part(group: int) -> pl.Series:
        return cells.str.extract(PATTERN, group)

    def number(group: int) -> FloatArray:
        return np.asarray(part(group).cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy(), dtype=np.float64)

    date = part(1)
    days = date.str.to_date("%Y-%m-%d", strict=False).cast(pl.Int32).cast(pl.Float64).to_numpy()
    fraction = part(5).str.pad_end(9, "0").cast(pl.Float64, strict=False).fill_null(0.0).to_numpy() * 1e-9
    zone = part(6).fill_null("Z").str.replace(":", "")
    hours = zone.str.slice(1, 2).cast(pl.Float64, strict=False).fill_null(0.0).to_numpy()
    minutes = zone.str.slice(3, 2).cast(pl.Float64, strict=False).fill_null(0.0).to_numpy()
    east = np.where(zone.str.starts_with("-").to_numpy(), -60.0, 60.0) * (60.0 * hours + minutes)
    clock = 3600.0 * number(2) + 60.0 * number(3) + number(4) - east + fraction
    undated = np.flatnonzero(date.is_null().to_numpy() & ~np.isnan(clock))
    midnights = np.zeros(clock.shape)
    midnights[undated] = np.concatenate([[0.0], np.cumsum(np.diff(clock[undated]) < -_NOON)])[: undated.size]
    return np.asarray(86400.0 * np.where(date.is_null().to_numpy(), midnights, days) + clock, dtype=np.float64)
