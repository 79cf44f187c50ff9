"""Does it fit together? Sums of forces against accelerations, fusion against corner observers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from estimators.faults import BoolArray
from estimators.interpolate import FloatArray
from estimators.pipeline.result import Check, Consistency
from estimators.signals.checks import batch, entries, mask, setting
from estimators.signals.memory import Memory
from estimators.vehicle import GRAVITY, VehicleParameters

BALANCE = 0.6
"""m/s^2 that sum of F/m and acceleration may stay apart: 0.15 of bias, 2 % of torque at 0.5 g, drag at 30 m/s (0.3)."""
LOAD = 0.05
"""Relative."""
VELOCITY = (0.5, 0.05)
"""m/s, and share of the speed."""


class CrossChecks(Memory):
    """Low-passed gaps between parts, and which of them are too large.

    Args:
        vehicle: mass.
        sample_time: s.
        batch_shape: () for one car.
        memory_time: s, of the low-pass: longer than a stroke of a brake controller.

    Raises:
        EstimatorError: a time that is not positive.
    """

    memory = ("gaps",)

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        memory_time: float = 0.5,
    ) -> None:
        self.vehicle, self.batch_shape = vehicle, batch(batch_shape)
        self._gain = 1.0 - math.exp(
            -setting(sample_time, "sample_time", "s") / setting(memory_time, "memory_time", "s")
        )
        self.gaps: FloatArray = np.zeros((*self.batch_shape, 3))

    def __call__(
        self,
        agreed: Any,
        lateral: Any,
        loads: Any,
        moved: Any,
        corners: Any,
        az: npt.ArrayLike | None,
        unknown: BoolArray,
        late: BoolArray | None,
    ) -> Consistency:
        """One sample of the parts' steps; a gap that nobody measured is held."""
        shape = self.batch_shape
        new = np.empty((*shape, 3))
        new[..., 0] = agreed.innovation / self.vehicle.mass
        new[..., 1] = lateral.innovation[..., 1]
        new[..., 2] = 0.0 if corners is None else moved.vx - corners.vx
        change = self._gain * (new - self.gaps)
        if not math.isfinite(float(change.sum())):
            change = np.where(np.isfinite(change), change, 0.0)
        self.gaps = self.gaps + change
        up = GRAVITY if az is None else entries(az, shape, "az")
        known = np.isfinite(up) & (np.absolute(up) > 0.1 * GRAVITY)
        weight = self.vehicle.mass * np.where(known, up, GRAVITY)
        load_gap = np.where(known, np.add.reduce(loads.load, -1) / weight - 1.0, 0.0)
        size = np.absolute(self.gaps)
        failed = np.zeros(shape, dtype=np.int32)
        limit = VELOCITY[0] + VELOCITY[1] * np.absolute(moved.vx)
        found = (
            (Check.FORCE_BALANCE, size[..., 0] > BALANCE),
            (Check.LATERAL_BALANCE, size[..., 1] > BALANCE),
            (Check.LOAD_SUM, np.absolute(load_gap) > LOAD),
            (Check.CORNERS_DISAGREE, size[..., 2] > limit),
            (Check.NO_WHEEL, ~(np.logical_or.reduce(moved.used, -1) | moved.standing)),
            (Check.UNKNOWN_FORCE, np.logical_or.reduce(unknown, -1)),
        )
        for check, bad in found:
            failed |= int(check) * np.asarray(bad).astype(np.int32)
        if late is not None:
            failed |= int(Check.LATE_SAMPLE) * late.astype(np.int32)
        gaps = self.gaps.copy()
        return Consistency(gaps[..., 0], gaps[..., 1], load_gap, gaps[..., 2], failed)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Forgets the gaps of the entries `where` (bool mask; None: all)."""
        chosen = mask(where, self.batch_shape, "where")
        self.gaps = np.where(chosen[..., None], 0.0, self.gaps)
