"""What a manoeuvre asks of a car, as arrays: steering, torques, target speed, path and road of B runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from studies.truth.profile import GRID, PATH_GRID
from studies.truth.road import Roads, Zone


@dataclass(frozen=True)
class Course:
    """One compiled manoeuvre; tables over time are on the grid of `profile.GRID`, curvature on `PATH_GRID`.

    Without `speed` the torques are all there is; without `curvature` the steering table is. Both tables of a kind add up.
    """

    name: str
    duration: float  # s
    initial_speed: float  # m/s
    tire: str
    steer: FloatArray  # rad, front road wheels
    drive_torque: FloatArray  # N m, sum of the driven wheels
    drive_share: FloatArray  # of what the drivetrain can give, -1 to 1
    brake_torque: FloatArray  # N m, sum
    brake_share: FloatArray  # of the greatest brake torque, 0 to 1
    grade: FloatArray  # rad
    bank: FloatArray  # rad
    friction: float
    zones: tuple[Zone, ...] = ()
    speed: FloatArray | None = None  # m/s, target of the driver; NaN where it leaves the torques alone
    curvature: FloatArray | None = None  # 1/m over the way, of the path that the driver follows


class Courses:
    """The courses of B runs; equal courses are kept once, `which` (B,) tells who drives which."""

    def __init__(self, courses: Sequence[Course]) -> None:
        unique = list({id(c): c for c in courses}.values())
        place = {id(c): k for k, c in enumerate(unique)}
        self.which = np.array([place[id(c)] for c in courses])
        self.duration = max(c.duration for c in courses)
        self.steps = int(np.ceil(self.duration / GRID - 1e-9)) + 2

        def table(pick: Callable[[Course], FloatArray]) -> FloatArray:
            rows = [pick(c)[: self.steps] for c in unique]
            return np.stack([np.pad(r, (0, self.steps - r.size), mode="edge") for r in rows], axis=1)

        nothing = np.full(2, np.nan)
        names = ("steer", "drive_torque", "drive_share", "brake_torque", "brake_share", "grade", "bank")
        rows: list[Callable[[Course], FloatArray]] = [lambda c, n=name: getattr(c, n) for name in names]  # type: ignore[misc]
        rows.append(lambda c: nothing if c.speed is None else c.speed)
        self._table = np.stack([table(row) for row in rows])  # (8, steps, courses)
        self.roads = Roads([c.friction for c in courses], [c.zones for c in courses])
        self.controls_speed = bool(np.isfinite(self._table[7]).any())
        self.follows = np.array([c.curvature is not None for c in unique])[self.which]
        longest = max((c.curvature.size for c in unique if c.curvature is not None), default=2)
        bends = [np.zeros(2) if c.curvature is None else c.curvature for c in unique]
        self._bend = np.stack([np.pad(b, (0, longest - b.size)) for b in bends])

    def at(self, time: float) -> FloatArray:
        """(8, B): steer, drive torque, drive share, brake torque, brake share, grade, bank, target speed."""
        k = min(max(time / GRID, 0.0), self.steps - 1.001)
        low = int(k)
        w = k - low
        both = self._table[:, low : low + 2]
        row: FloatArray = both[:, 0] if w < 1e-9 else (1.0 - w) * both[:, 0] + w * both[:, 1]
        return np.asarray(row[:, self.which])

    def bend(self, way: FloatArray) -> FloatArray:
        """Curvature (B,), 1/m, of the paths at the ways (B,), m."""
        k = np.clip(way / PATH_GRID, 0.0, self._bend.shape[1] - 1.001)
        low = k.astype(np.int64)
        w = k - low
        return np.asarray((1.0 - w) * self._bend[self.which, low] + w * self._bend[self.which, low + 1])
