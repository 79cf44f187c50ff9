"""Time stamps as text: dates of ISO 8601, or a time of day, as seconds."""

from __future__ import annotations

import re

import numpy as np
import polars as pl

from estimators.arrays import FloatArray

_DAY, _CLOCK, _ZONE = (
    r"(?:(\d{4}-\d{2}-\d{2})[T ])?",
    r"(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d{1,9}))?",
    r"(Z|[+-]\d{2}:?\d{2})?",
)
PATTERN = f"^{_DAY}{_CLOCK}{_ZONE}$"
_LOOKS = re.compile(PATTERN)


def looks_iso(text: str) -> bool:
    """Whether a cell is a time stamp in text, such as 2024-05-01T12:00:00.005Z or 12:00:00,005."""
    return _LOOKS.fullmatch(text.strip()) is not None


def iso_seconds(text: pl.Series) -> FloatArray:
    """Seconds since 1970, or since midnight where there is no date (n,); NaN where a cell is no time stamp.

    Seconds and their fraction are read apart: no digit of a microsecond is lost to a binary number of nanoseconds.
    """
    cells = text.str.strip_chars()

    def part(group: int) -> pl.Series:
        return cells.str.extract(PATTERN, group)

    def number(group: int) -> FloatArray:
        return np.asarray(part(group).cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy(), dtype=np.float64)

    days = part(1).str.to_date("%Y-%m-%d", strict=False).cast(pl.Int32).cast(pl.Float64).fill_null(0.0).to_numpy()
    fraction = part(5).str.pad_end(9, "0").cast(pl.Float64, strict=False).fill_null(0.0).to_numpy() * 1e-9
    zone = part(6).fill_null("Z").str.replace(":", "")
    hours = zone.str.slice(1, 2).cast(pl.Float64, strict=False).fill_null(0.0).to_numpy()
    minutes = zone.str.slice(3, 2).cast(pl.Float64, strict=False).fill_null(0.0).to_numpy()
    east = np.where(zone.str.starts_with("-").to_numpy(), -60.0, 60.0) * (60.0 * hours + minutes)
    whole = 86400.0 * days + 3600.0 * number(2) + 60.0 * number(3) + number(4)
    return np.asarray(whole - east + fraction, dtype=np.float64)
