"""From the log files of a drive to signals in SI on one clock and one grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.align import find_offset
from studies.drives.columns import Column, LogFile
from studies.drives.direction import signed_wheels
from studies.drives.drive_file import DriveFile
from studies.drives.formats import is_bag_folder, read_table
from studies.drives.mounted import PULLS, RATES, centred_reference, centred_signals
from studies.drives.plausible import check_plausible
from studies.drives.quantities import REFERENCES, SIGNALS, factor_to
from studies.drives.stamps import Stamped, clean_stamps, resample
from studies.drives.table import LogTable
from studies.errors import LogError

LONGEST_GAP = 10.0  # s without a row: beyond it the clock has jumped, or it is another drive
ABSURD = 1e9  # in SI: a cell of 1e308 is no measurement, and overflows in the first square
TIME_UNITS = ("s", "ms", "us", "ns")
EPOCH = 1e7  # s beyond which a clock counts from long ago, and its origin is moved to the first stamp: digits for the samples
MOST_SAMPLES = 5_000_000  # of the common grid, seven hours at 5 ms: all signals are held in memory


@dataclass(frozen=True)
class DriveLog:
    """Signals and references in SI over ``time``, s, n samples; NaN where nothing was measured.

    Both are of the centre of gravity, along the axes of the car, if the drive file's ``mounting`` is right; ``unit`` holds the
    accelerations and rates as the inertial unit reads them. ``report`` says for every log what was read, repaired, bridged
    and found.
    """

    time: FloatArray
    signals: dict[str, FloatArray]
    reference: dict[str, FloatArray]
    report: dict[str, Any]
    unit: dict[str, FloatArray] = field(default_factory=dict)

    @property
    def files(self) -> dict[str, str]:
        """Name of the file of each log."""
        return {name: str(entry["file"]) for name, entry in self.report["logs"].items()}


@dataclass(frozen=True)
class _Track:
    stamped: Stamped
    signals: dict[str, FloatArray]
    reference: dict[str, FloatArray]


def read_log(paths: Sequence[Path], drive: DriveFile) -> DriveLog:
    """Read every log of the drive, put it on one clock, and resample it to ``drive.sample_time``.

    Raises LogError: a file that belongs to no log, a log without a file, logs that do not overlap, and whatever
    :mod:`studies.drives.csv_log`, :mod:`.resample`, :mod:`.align` and :mod:`.plausible` refuse.
    """
    files = assign_files(paths, drive.log)
    report: dict[str, Any] = {"logs": {}}
    tracks: dict[str, _Track] = {}
    for entry in drive.log:
        tracks[entry.name], report["logs"][entry.name] = _read_track(files[entry.name], entry, drive)
    tracks = _from_origin(tracks, report)
    offsets = _clock_offsets(drive, tracks, report)
    grid = _common_grid(drive, tracks, offsets)
    gaps = {entry.name: entry.allowed_gap for entry in drive.log}

    def on_grid(columns: dict[str, Column], table: str) -> dict[str, FloatArray]:
        out = {}
        for name, column in columns.items():
            log = drive.log_of(column)
            values: dict[str, FloatArray] = getattr(tracks[log], table)
            when = tracks[log].stamped.time + offsets[log]
            _check_bridged(
                f"{files[log].name}: {table}.{name}: column '{column.column}'", when, values[name], gaps[log], log
            )
            out[name] = resample(when, values[name], grid, gaps[log])
        return out

    signals, reference = on_grid(drive.signals, "signals"), on_grid(drive.reference, "reference")
    if (gear := drive.direction) is not None:
        log = drive.log_of(gear)
        way = resample(tracks[log].stamped.time + offsets[log], tracks[log].signals["direction"], grid, gaps[log])
        signals["direction"] = np.where(np.abs(way) == 1.0, way, 0.0)  # between two gears it says nothing
    if drive.unsigned_wheels:
        signals |= signed_wheels(signals)
    unit, read = {name: signals[name] for name in (*PULLS, *RATES) if name in signals}, signals
    signals = centred_signals(signals, drive.mounting.inertial, drive.sample_time)
    reference = centred_reference(reference, signals, drive.mounting.reference)
    check_plausible(drive, read, reference, {name: path.name for name, path in files.items()})
    missing = {name: int(np.count_nonzero(np.isnan(value))) for name, value in {**reference, **signals}.items()}
    report["grid"] = {
        "samples": int(grid.size), "sample_time_s": drive.sample_time, "start_s": float(grid[0]),
        "end_s": float(grid[-1]), "missing_samples": {name: count for name, count in missing.items() if count},
    }  # fmt: skip
    return DriveLog(time=grid, signals=signals, reference=reference, report=report, unit=unit)


def assign_files(paths: Sequence[Path], entries: Sequence[LogFile]) -> dict[str, Path]:
    """Which file is which log: by the ``file`` pattern of the log, in order where no log has one.

    A directory stands for the files in it that some log asks for by pattern. Raises LogError naming what is left over.
    """
    patterns = [entry.file for entry in entries if entry.file is not None]
    found: list[Path] = []
    for path in paths:
        if path.is_dir() and not is_bag_folder(path):
            found += sorted(p for p in path.iterdir() if any(fnmatch(p.name, pattern) for pattern in patterns))
        elif path.exists():
            found.append(path)
        else:
            raise LogError(f"{path.name}: cannot be read (no such file); check the path")
    if not patterns and len(found) == len(entries):
        return {entry.name: path for entry, path in zip(entries, found, strict=True)}
    files: dict[str, Path] = {}
    for entry in entries:
        matching = [path for path in found if entry.file is None or fnmatch(path.name, entry.file)]
        if len(matching) != 1:
            wanted = f"one file like '{entry.file}'" if entry.file else "one file"
            got = ", ".join(path.name for path in matching or paths) or "none"
            empty = ", which is none" if all(path.is_file() for path in paths) else ", with none in it"
            fits = "" if matching else empty
            raise LogError(
                f"log '{entry.name}' needs {wanted}, given: {got}{fits}; "
                f"name one file for each log, or correct file of log '{entry.name}' in the drive file"
            )
        files[entry.name] = matching[0]
    spare = [path.name for path in found if path not in files.values()]
    if spare:
        raise LogError(f"{spare[0]}: belongs to no log of the drive file; leave it out, or add a [[log]] for it")
    return files


def _read_track(path: Path, entry: LogFile, drive: DriveFile) -> tuple[_Track, dict[str, Any]]:
    signals = {name: c for name, c in drive.signals.items() if drive.log_of(c) == entry.name}
    reference = {name: c for name, c in drive.reference.items() if drive.log_of(c) == entry.name}
    wanted = {entry.time: f"time of log '{entry.name}'"}
    wanted |= {c.column: f"reference.{name}" for name, c in reference.items()}
    wanted |= {c.column: f"signals.{name}" for name, c in signals.items()}
    gear = drive.direction if drive.direction and drive.log_of(drive.direction) == entry.name else None
    if gear is not None:
        wanted.setdefault(gear.column, "direction")
    table = read_table(path, wanted, entry)
    values = {column: table.values[column] for column in wanted if column != entry.time}
    unit = "s" if entry.time_format == "iso" or table.merged else entry.time_unit
    seconds = table.values[entry.time] * factor_to(unit, "s")
    stamped = clean_stamps(path.name, table, seconds, values, sort=entry.sort, duplicates=entry.duplicates)
    if stamped.time.size < 2:
        raise LogError(f"{path.name}: holds a single time stamp; a drive needs at least two")
    spacing = np.diff(stamped.time)
    if not table.merged:
        _check_rate(path, entry, float(np.median(spacing)))
    _check_gap(path, entry, table, seconds, stamped.time)
    report: dict[str, Any] = {
        "file": path.name, "rows": table.rows, "duplicates": stamped.duplicates, "out_of_order": stamped.out_of_order,
        "gaps": int(np.count_nonzero(spacing > entry.allowed_gap * (1 + 1e-9))), "largest_gap_s": float(spacing.max()),
        "allowed_gap_s": entry.allowed_gap, "median_rate_hz": float(1.0 / np.median(spacing)),
        "clock_offset_s": entry.clock_offset, "not_finite": table.not_finite,
    }  # fmt: skip
    measured = {
        n: _sane(stamped.values[c.column], c.scale(SIGNALS[n], drive.vehicle.radius_for(n))) for n, c in signals.items()
    }
    if gear is not None:
        measured["direction"] = gear.ways(stamped.values[gear.column])
    track = _Track(
        stamped=stamped,
        signals=measured,
        reference={n: _sane(stamped.values[c.column], c.scale(REFERENCES[n])) for n, c in reference.items()},
    )
    return track, report


def _check_rate(path: Path, entry: LogFile, spacing: float) -> None:
    """A clock in the wrong unit shows as a rate that is off by a power of ten."""
    if not 1 / 3 < spacing * entry.rate < 3:
        given = factor_to(entry.time_unit, "s")
        fitting = [u for u in TIME_UNITS if 1 / 2 < spacing * entry.rate * factor_to(u, "s") / given < 2]
        likely = f', likely time_unit = "{fitting[0]}"' if fitting else ""
        raise LogError(
            f"{path.name}: rows are {spacing:g} s apart where log '{entry.name}' says {entry.rate:g} Hz; "
            f"correct its rate or its time_unit (now '{entry.time_unit}'{likely})"
        )


def _sane(value: FloatArray, scale: float) -> FloatArray:
    """``value`` in SI; what no sensor on a car means is missing."""
    with np.errstate(over="ignore"):
        si = value * scale
    return np.where(np.abs(si) < ABSURD, si, np.nan)


def _check_gap(path: Path, entry: LogFile, table: LogTable, raw: FloatArray, time: FloatArray) -> None:
    """``raw``: stamps as they stand in the file, ``time``: those of the track, both in s."""
    k = int(np.argmax(np.diff(time)))
    gap = float(time[k + 1] - time[k])
    longest = max(LONGEST_GAP, entry.allowed_gap)
    if gap > longest:
        place = table.place(int(np.flatnonzero(raw == time[k + 1])[0]))
        raise LogError(
            f"{path.name}: time column '{entry.time}' jumps by {gap:g} s on {place} (from {time[k]:.10g} s to "
            f"{time[k + 1]:.10g} s), at most {longest:g} s may be missing; correct the clock from there on, or cut "
            "the log in two"
        )


def _check_bridged(place: str, time: FloatArray, value: FloatArray, gap: float, log: str) -> None:
    """A column slower than its log would vanish between its own samples."""
    spacing = np.diff(time[np.isfinite(value)])
    usual = float(np.median(spacing)) if spacing.size else 0.0
    if usual > gap * (1 + 1e-6) + 1e-6:
        raise LogError(
            f"{place} has a sample every {usual:.3g} s, and gaps above {gap:.3g} s are not bridged: nothing is left of it; "
            f"set max_gap = \"{5e3 * usual:.3g} ms\" for log '{log}'"
        )


def _from_origin(tracks: dict[str, _Track], report: dict[str, Any]) -> dict[str, _Track]:
    """Clocks that count from long ago, as an epoch does, count from the whole second where the first of them starts."""
    starts = [float(track.stamped.time[0]) for track in tracks.values()]
    late = [start for start in starts if start > EPOCH]
    if not late:
        return tracks
    origin = float(np.floor(late[0]))
    report["time_origin_s"] = origin
    return {
        name: replace(track, stamped=replace(track.stamped, time=track.stamped.time - origin))
        if track.stamped.time[0] > EPOCH
        else track
        for name, track in tracks.items()
    }


def _clock_offsets(drive: DriveFile, tracks: dict[str, _Track], report: dict[str, Any]) -> dict[str, float]:
    """Seconds added to the stamps of each log; logs with ``align`` have theirs estimated and reported."""
    offsets = {entry.name: entry.clock_offset for entry in drive.log}
    for entry in drive.log:
        if entry.align is None:
            continue
        velocity_log, velocity = _find(drive, tracks, entry.align.velocity)
        acceleration_log, acceleration = _find(drive, tracks, entry.align.acceleration)
        times = [tracks[log].stamped.time for log in (velocity_log, acceleration_log)]
        found = find_offset(times[0], velocity, times[1], acceleration, entry.align.search)
        sign = 1.0 if velocity_log == entry.name else -1.0
        offsets[entry.name] = offsets[entry.align.to] + sign * found.seconds
        report["logs"][entry.name]["clock_offset_s"] = offsets[entry.name]
        report["logs"][entry.name]["alignment"] = {
            "to": entry.align.to, "correlation": found.correlation, "slope": found.slope,
        }  # fmt: skip
    return offsets


def _find(drive: DriveFile, tracks: dict[str, _Track], name: str) -> tuple[str, FloatArray]:
    column = drive.signals.get(name) or drive.reference[name]
    log = drive.log_of(column)
    return log, (tracks[log].signals if name in drive.signals else tracks[log].reference)[name]


def _common_grid(drive: DriveFile, tracks: dict[str, _Track], offsets: dict[str, float]) -> FloatArray:
    """The grid t0 + k*Ts over the time that all logs cover."""
    start = max(float(track.stamped.time[0]) + offsets[name] for name, track in tracks.items())
    end = min(float(track.stamped.time[-1]) + offsets[name] for name, track in tracks.items())
    samples = int(np.floor((end - start) / drive.sample_time + 1e-6)) + 1
    if samples < 2:
        raise LogError(
            f"the logs {', '.join(tracks)} do not overlap on one clock (from {start:g} s to {end:g} s); "
            "check clock_offset, or let align estimate it"
        )
    if samples > MOST_SAMPLES:
        raise LogError(
            f"the logs {', '.join(tracks)} span {end - start:g} s, {samples} samples at sample_time = "
            f"{drive.sample_time:g} s, and at most {MOST_SAMPLES} are replayed at once; cut them into shorter drives"
        )
    return np.asarray(start + drive.sample_time * np.arange(samples), dtype=np.float64)
