"""Stretches driven backward that read as forward: wheel speeds have no sign in most cars, and a drive file may not say so.

Between two stops a car goes one way. There the slope of the wheel speed is a_x, or -a_x where backward reads as forward: over a
whole drive the few metres backward are lost among the rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.agreement import Comparison, compare, surface_speeds
from studies.drives.drive_file import DriveFile

STOPPED = 0.3  # m/s below which a wheel sensor gives no pulses


def read_as_forward(signals: Mapping[str, FloatArray], drive: DriveFile) -> Comparison | None:
    """The clearest stretch that contradicts a_x by its sign alone; None without one."""
    speed = surface_speeds(signals, drive.vehicle)
    known = np.isfinite(speed)
    mean = np.where(known, speed, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    found = []
    for run in _between_stops(mean):
        along = compare({name: value[run] for name, value in signals.items()}, drive)[0]
        if along.contradicts and along.explained({"wheels": -1.0}):
            begin, end = (k * drive.sample_time for k in (run.start, run.stop))
            found.append(replace(along, title=f"from {begin:.1f} to {end:.1f} s, {along.title}"))
    return max(found, key=lambda one: one.line.quality if one.line else 0.0, default=None)


def _between_stops(speed: FloatArray) -> Iterator[slice]:
    moves = np.concatenate([[False], speed > STOPPED, [False]])
    edges = np.flatnonzero(moves[1:] != moves[:-1])
    return (slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True))
