"""What the velocity part said of the last sample, and what follows from it for the next: levels, gravity, believed readings."""

from __future__ import annotations

import math
from typing import Any

import numpy.typing as npt

from estimators.arguments import entries
from estimators.arithmetic import Arithmetic, Number, arithmetic
from estimators.faults import Flag
from estimators.forces import AttitudeStep, levelled, without_gravity
from estimators.memory import Memory
from estimators.pipeline.parts import AttitudePart
from estimators.pipeline.signals import VehicleSignals
from estimators.signals import limits
from estimators.vehicle import GRAVITY


class LastSample(Memory):
    """Biases, speeds, and readings that were not believed, of one car or a batch.

    A reading that the velocity part replaced is replaced everywhere: loads, forces and attitude take its word.
    """

    memory = ("bias", "speed", "used", "inertial", "gravity", "drive", "read", "free")
    unknowns = ("drive", "read", "free")

    def __init__(self, sample_time: float, batch_shape: tuple[int, ...]) -> None:
        self.sample_time, self.batch_shape = sample_time, batch_shape
        self._kit = kit = arithmetic(batch_shape)
        self.bias: list[Number] = [kit.full(0.0)] * 2  # of a_x, a_y, m/s^2
        self.speed: list[Number] = [kit.full(0.0)] * 3  # V_x, V_y, r
        self.used: list[Number] = [kit.full(True)] * 3  # whether a_x, a_y, r were believed
        self.inertial: list[Number] = [kit.full(0.0)] * 3  # and what they were taken for
        self.gravity: Number = kit.full(0.0)  # in a_x, m/s^2
        self.drive: Number = kit.full(math.nan)  # V_x' - r V_y without gravity, m/s^2, where anything tells
        self.read: list[Number] = [kit.full(math.nan)] * 2  # a_x, a_y as they came
        self.free: list[Number] = [kit.full(math.nan)] * 2  # and without gravity

    def believed(self, *readings: Number) -> list[Number]:
        """Of a_x, a_y and r, as many as are given: what was not believed, replaced; what is missing stays so."""
        kit = self._kit
        return [
            kit.where(used | kit.no(abs(value) < math.inf), value, instead)
            for used, value, instead in zip(self.used, readings, self.inertial, strict=False)
        ]

    def learn(self, moved: Any, force: Number, lost: Number) -> None:
        """From the step of the velocity part; `force` m/s^2, the wheels' F_x over m, `lost` where one of them is not known."""
        kit = self._kit
        before, turn = self.speed[0], kit.own(moved.yaw_rate)
        vx, vy = kit.own(moved.vx), kit.own(moved.vy)
        self.bias, self.speed = kit.rows(moved.sensor_bias, 3)[:2], [vx, vy, turn]
        if (used := getattr(moved, "inertial_used", None)) is not None:
            self.used, self.inertial = kit.rows(used, 3), kit.rows(moved.inertial, 3)
            self.gravity = kit.own(moved.gravity[..., 0])
        # without torques what the wheels hold V_x to: slower, but no more in a loop with gravity than they are
        started = ((kit.own(moved.flags) & int(Flag.RESET)) != 0) | kit.own(moved.standing)
        gained = kit.where(started, math.nan, (vx - before) / self.sample_time - turn * vy)
        self.drive = kit.where(lost, gained, force)

    def forget(self, here: Number) -> None:
        """Starts the cars `here` afresh."""
        choose = self._kit.where
        for name, start in (("bias", 0.0), ("speed", 0.0), ("used", True), ("read", math.nan), ("free", math.nan)):
            setattr(self, name, [choose(here, start, value) for value in getattr(self, name)])
        self.gravity, self.drive = choose(here, 0.0, self.gravity), choose(here, math.nan, self.drive)

    def pull(self, ax: Number) -> Number:
        """What a_x said last that V_x gains, m/s^2; `ax` the present reading, where nothing was levelled."""
        return self._kit.where(abs(self.free[0]) < math.inf, self.free[0], ax) - self.bias[0] - self.gravity

    def tilted(
        self, attitude: AttitudePart | None, signals: VehicleSignals, ax: Number, ay: Number, turn: Number
    ) -> tuple[AttitudeStep | None, Number, Number, Number, Number]:
        """The attitude step, a_x and a_y level with the road (forces), and without gravity (velocities), m/s^2."""
        if attitude is None:
            return None, ax, ay, ax, ay
        shape, kit = self.batch_shape, self._kit

        def read(given: npt.ArrayLike | None, name: str, limit: float) -> Number:
            """NaN for what is absent, and for what no sensor reads."""
            return math.nan if given is None else possible(kit, kit.own(entries(given, shape, name)), limit)

        tilt = attitude.step(
            read(signals.roll_rate, "roll_rate", limits.YAW_RATE),
            read(signals.pitch_rate, "pitch_rate", limits.YAW_RATE),
            kit.where(self.used[0], ax - self.bias[0], math.nan),
            kit.where(self.used[1], ay - self.bias[1], math.nan),
            motion_x=self.drive,
            motion_y=self.speed[2] * self.speed[0],
            yaw_rate=kit.where(self.used[2], turn, self.inertial[2]),
            grade=read(signals.grade, "grade", limits.ANGLE),
            bank=read(signals.bank, "bank", limits.ANGLE),
        )
        up = read(signals.az, "az", limits.ACCELERATION)
        up = kit.where(abs(up) < math.inf, up, GRAVITY)
        own_x, own_y, _ = levelled(ax, ay, up, tilt.pitch, tilt.roll)
        moved = (kit.own(value) for value in without_gravity(ax, ay, tilt.total_roll, tilt.total_pitch))
        # a reading that repeats itself is the old one, and so is what is left of it: else a frozen sensor would seem alive
        pairs = zip((ax, ay), self.read, moved, self.free, strict=True)
        self.free = [kit.where(new == old, last, value) for new, old, value, last in pairs]
        self.read = [ax, ay]
        return tilt, kit.own(own_x), kit.own(own_y), *self.free


def possible(kit: Arithmetic, value: Number, limit: float) -> Number:
    """NaN for what no sensor of a car reads."""
    return kit.where(abs(value) <= limit, value, math.nan)
