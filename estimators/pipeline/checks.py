"""Does it fit together? Sums of forces against accelerations, fusion against corner observers."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, entries, mask, setting
from estimators.arithmetic import Number, arithmetic
from estimators.memory import Memory
from estimators.pipeline.result import Check, Consistency
from estimators.vehicle import GRAVITY, VehicleParameters

BALANCE = 0.6
"""m/s^2 that sum of F/m and acceleration may stay apart: 0.15 of bias, 2 % of torque at 0.5 g, drag at 30 m/s (0.3)."""
LEAP = (0.3, 0.15)
"""m/s^2, and share of what a_x changes: by how much the first of these gaps may change within `LEAP_TIME`.

Drag, grade, bias and mass stay the same for so long; pads and motors are as wrong as their force is."""
LEAP_TIME, LEAP_LAG = 0.2, 0.1
"""s; two such times at most, and of the low-pass before: above the lag of a force observer."""
LOAD = 0.05
"""Relative."""
HEAVE = (0.25, 0.2)
"""Share of g that a_z may be off, low-passed over so many seconds: crests and dips are shorter or weaker, a fault is not."""
VELOCITY = (0.5, 0.05)
"""m/s, and share of the speed."""
_BITS = [int(check) for check in (Check.FORCE_BALANCE, Check.LATERAL_BALANCE, Check.LOAD_SUM, Check.CORNERS_DISAGREE)]
_BITS += [int(check) for check in (Check.NO_WHEEL, Check.UNKNOWN_FORCE, Check.LATE_SAMPLE)]


class Forces(NamedTuple):
    """What has been found of forces since; numbers of a kit."""

    gap: Number  # N, innovation of `reconcile`
    side_gap: Number  # m/s^2, innovation of a_y
    front: Number  # N, F_yf
    push: Number  # N, sum of the wheels' F_x as their equations say
    unknown: Number  # F_x of some wheel is
    late: Number  # the sample


class CrossChecks(Memory):
    """Low-passed gaps between parts, and which of them are too large.

    Args:
        vehicle: mass.
        sample_time: s.
        batch_shape: () for one car.
        memory_time: s, of the low-pass: longer than a stroke of a brake controller.
        repeat_time: s, the longest interval of the wheel speed sensors: between their samples no wheel says anything new.

    Raises:
        EstimatorError: a time that is not positive.
    """

    memory = ("gaps", "alone", "heave", "quick", "recent", "older", "phase")
    unknowns = ("quick", "recent", "older")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        memory_time: float = 0.5,
        repeat_time: float = 0.025,
    ) -> None:
        self.vehicle, self.batch_shape = vehicle, batch(batch_shape)
        self._patience = setting(repeat_time, "repeat_time", "s") / setting(sample_time, "sample_time", "s")
        self._gain = 1.0 - math.exp(
            -setting(sample_time, "sample_time", "s") / setting(memory_time, "memory_time", "s")
        )
        self._kit = arithmetic(self.batch_shape)
        self.gaps: list[Number] = [self._kit.full(0.0)] * 3
        self._heave = 1.0 - math.exp(-sample_time / HEAVE[1])
        self._leap, self._turn = 1.0 - math.exp(-sample_time / LEAP_LAG), LEAP_TIME / sample_time
        self.heave: Number = self._kit.full(0.0)  # a_z/g - 1, low-passed
        unknown = [self._kit.full(math.nan)] * 2
        self.quick: list[Number] = unknown[:]  # m/s^2, force gap and a_x, low-passed
        self.recent: list[Number] = unknown[:]  # the same at the last turn of `LEAP_TIME`
        self.older: list[Number] = unknown[:]  # and at the one before
        self.phase: Number = self._kit.full(0.0)  # samples since
        self._never = self._kit.full(False)
        self.alone: Number = self._kit.full(0.0)  # samples since a wheel last supported V_x

    def __call__(
        self,
        forces: Forces,
        loads: Any,
        moved: Any,
        corner_speed: Number | None,
        az: npt.ArrayLike | None,
    ) -> Consistency:
        """One sample; a gap that nobody measured is held. `corner_speed`: V_x of the corner observers, m/s."""
        kit, shape, choose, mass = self._kit, self.batch_shape, self._kit.where, self.vehicle.mass
        own, speed = kit.own, kit.own(moved.vx)
        apart = 0.0 if corner_speed is None else speed - corner_speed
        new = (forces.gap / mass, forces.side_gap, apart)
        gaps = []
        for value, gap in zip(new, self.gaps, strict=True):
            change = self._gain * (value - gap)
            gaps.append(gap + choose(abs(change) < math.inf, change, 0.0))
        self.gaps = gaps
        up = GRAVITY if az is None else own(entries(az, shape, "az"))
        there = abs(up) < 1e6  # False for NaN
        self.heave = self.heave + choose(
            there, self._heave * (choose(there, up, 0.0) / GRAVITY - 1.0 - self.heave), 0.0
        )
        known = (abs(up) > 0.1 * GRAVITY) & (abs(up) < math.inf)
        load = kit.rows(loads.load, 4)
        weight = mass * choose(known, up, GRAVITY)
        load_gap = choose(known, (load[0] + load[1] + load[2] + load[3]) / weight - 1.0, 0.0)
        wheels = kit.rows(moved.used, 4)
        supported = wheels[0] | wheels[1] | wheels[2] | wheels[3] | own(moved.standing)
        self.alone = choose(supported, 0.0, kit.minimum(self.alone + 1.0, self._patience + 1.0))
        contested = getattr(moved, "force_contested", None)  # sooner, where the velocity part watches it
        found = (
            (abs(gaps[0]) > BALANCE) | self._leaps(forces) | (self._never if contested is None else own(contested)),
            abs(gaps[1]) > BALANCE,
            (abs(load_gap) > LOAD) | (abs(self.heave) > HEAVE[0]),
            abs(gaps[2]) > VELOCITY[0] + VELOCITY[1] * abs(speed),
            self.alone > self._patience,
            forces.unknown,
            forces.late,
        )
        failed = 0
        for bit, bad in zip(_BITS, found, strict=True):
            failed = failed | choose(bad, bit, 0)
        outputs = kit.table(((gaps[0], gaps[1], load_gap, gaps[2]),), shape)
        sums = np.asarray(failed, dtype=np.int32).reshape(shape)
        return Consistency(outputs[..., 0], outputs[..., 1], outputs[..., 2], outputs[..., 3], sums)

    def _leaps(self, forces: Forces) -> Number:
        """Whether the force gap changes as no drag, grade, bias or scale does; begins anew where a force is unknown."""
        kit, choose, mass = self._kit, self._kit.where, self.vehicle.mass
        gap = choose(forces.unknown, math.nan, forces.gap / mass)
        total, gain = gap + forces.push / mass, self._leap
        self.quick = [
            choose(abs(before) < math.inf, before + gain * (value - before), value)
            for before, value in zip(self.quick, (gap, total), strict=True)
        ]
        self.phase = self.phase + 1.0
        turns, lost = self.phase >= self._turn, kit.no(abs(gap) < math.inf)
        if kit.some(turns | lost):
            self.phase = choose(turns | lost, 0.0, self.phase)
            for k, quick in enumerate(self.quick):
                recent = choose(lost, math.nan, self.recent[k])
                self.older[k] = choose(turns, recent, choose(lost, math.nan, self.older[k]))
                self.recent[k] = choose(turns, quick, recent)
        floor, share = LEAP
        return abs(self.quick[0] - self.older[0]) > floor + share * abs(self.quick[1] - self.older[1])

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Forgets the gaps of the entries `where` (bool mask; None: all)."""
        chosen = self._kit.own(mask(where, self.batch_shape, "where"))
        self.gaps = [self._kit.where(chosen, 0.0, gap) for gap in self.gaps]
        for old in (self.quick, self.recent, self.older):
            old[:] = [self._kit.where(chosen, math.nan, value) for value in old]
        self.alone, self.phase = (self._kit.where(chosen, 0.0, value) for value in (self.alone, self.phase))
        self.heave = self._kit.where(chosen, 0.0, self.heave)
