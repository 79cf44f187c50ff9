"""Strictly increasing time stamps from those of a log, and signals from them on an even grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.table import LogTable
from studies.errors import LogError

MOST_LATE = 10  # rows that a logger with buffers may write behind later ones


@dataclass(frozen=True)
class Stamped:
    """Columns over strictly increasing time, s, and what had to be done to get there."""

    time: FloatArray
    values: dict[str, FloatArray]
    duplicates: int
    out_of_order: int


def clean_stamps(
    file: str,
    table: LogTable,
    time: FloatArray,
    values: dict[str, FloatArray],
    *,
    sort: bool = False,
    duplicates: Literal["mean", "last", "refuse"] = "mean",
) -> Stamped:
    """Strictly increasing stamps: sorted if ``sort``, equal stamps averaged or reduced to the last one.

    ``time``, s, and ``values`` (n,) are those of ``table``, which knows where rows stand.

    Raises LogError with the line of the first stamp that is missing, runs backwards or (``refuse``) repeats.
    """
    missing = np.flatnonzero(~np.isfinite(time))
    if missing.size:
        raise LogError(f"{file}: {table.place(int(missing[0]))} has no time stamp; remove the line")
    backwards = np.flatnonzero(np.diff(time) < 0)
    if backwards.size:
        k = int(backwards[0])
        where = f"time runs backwards on {table.place(k + 1)} ({time[k + 1]:.10g} s after {time[k]:.10g} s)"
        if _overlap(time, values, k):
            raise LogError(
                f"{file}: {where} and goes on from there; correct the clock from there on, or cut the log in two"
            )
        if not sort:
            raise LogError(f"{file}: {where}; repair the log, or set sort = true for it in the drive file")
    order = np.argsort(time, kind="stable")
    time = time[order]
    values = {name: value[order] for name, value in values.items()}
    repeats = np.flatnonzero(np.diff(time) == 0)
    if repeats.size and duplicates == "refuse":
        k = int(repeats[0]) + 1
        raise LogError(
            f"{file}: time {time[k]:g} s appears twice, again on {table.place(int(order[k]))}; "
            'set duplicates = "mean" or "last" for this log'
        )
    if repeats.size:
        values = {name: _merge(time, value, duplicates == "mean") for name, value in values.items()}
        time = np.unique(time)
    return Stamped(time=time, values=values, duplicates=int(repeats.size), out_of_order=int(backwards.size))


def _overlap(time: FloatArray, values: Mapping[str, FloatArray], k: int) -> bool:
    """Whether a column comes a second time from row k + 1 on, as after a clock that was set back: rows late in a file fill gaps.

    Sorted, such rows would be two drives mixed. They stand where the rows up to k have no gap.
    """
    for value in values.values():
        there = np.isfinite(value)
        first, again = np.sort(time[: k + 1][there[: k + 1]]), time[k + 1 :][there[k + 1 :]]
        if first.size > MOST_LATE:
            gaps = np.diff(first)
            at = np.searchsorted(first, again[(again >= first[0]) & (again < first[-1])], side="right")
            if np.count_nonzero(gaps[at - 1] < 1.5 * np.median(gaps)) > MOST_LATE:
                return True
    return False


def _merge(time: FloatArray, value: FloatArray, mean: bool) -> FloatArray:
    """One value per distinct stamp: the mean, or the last, of the finite ones (NaN if there is none)."""
    finite = np.isfinite(value)
    unique, group = np.unique(time, return_inverse=True)
    merged = np.full(unique.size, np.nan)
    if not mean:
        merged[group[finite]] = value[finite]  # numpy assigns in order: the last one stays
        return merged
    count = np.bincount(group[finite], minlength=unique.size)
    total = np.bincount(group[finite], weights=value[finite], minlength=unique.size)
    np.divide(total, count, out=merged, where=count > 0)
    return merged


def resample(time: FloatArray, value: FloatArray, grid: FloatArray, max_gap: float) -> FloatArray:
    """Linear interpolation of the finite samples on ``grid``; NaN outside the record and inside gaps.

    A gap is a spacing of finite samples above ``max_gap``, s; its two ends are measured and stay. Error of the
    interpolation between samples at distance h: at most h^2/8 times the largest second derivative.
    """
    finite = np.isfinite(value)
    time, value = time[finite], value[finite]
    if time.size < 2:
        return np.full(grid.shape, np.nan)
    tolerance = max(
        1e-9 * abs(float(time[-1])), 1e-6
    )  # rounding of the stamps (0.24 us of an epoch), not a physical time
    out = np.interp(grid, time, value)
    out[(grid < time[0] - tolerance) | (grid > time[-1] + tolerance)] = np.nan
    left = np.clip(np.searchsorted(time, grid + tolerance, side="right") - 1, 0, time.size - 2)
    gap = np.diff(time)[left] > max_gap + tolerance
    out[gap & (grid > time[left] + tolerance) & (grid < time[left + 1] - tolerance)] = np.nan
    return out
