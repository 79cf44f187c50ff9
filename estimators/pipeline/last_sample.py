"""What the velocity part said of the last sample, and what follows from it for the next: levels, gravity, believed readings."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy.typing as npt

from estimators.arithmetic import Arithmetic, Number, arithmetic
from estimators.arrays import FloatArray
from estimators.faults import Flag
from estimators.forces import AttitudeStep, levelled
from estimators.memory import Memory
from estimators.pipeline.parts import AttitudePart
from estimators.pipeline.signals import VehicleSignals
from estimators.signals import limits
from estimators.vehicle import GRAVITY, VehicleParameters

SOFTEST = (0.07, 0.12)
"""rad per g: how far the softest body pitches and rolls, 4 and 7 degrees."""
_LOADED = 0.02  # rad: passengers and load on one side
_SLIDE = 0.4  # m/s^2 of V_y': more than a bias of a_y, 0.15, and errors of V_y make over `_LASTS`
_LASTS = 1.0  # s
_LED = 10.0  # s after which gyros alone say less of gravity than an accelerometer that is not believed
_LIVE = 0.1  # s within which a reading changes
_ROLLING = 0.01 * GRAVITY  # m/s^2, of tires on asphalt: c_rr is 0.008 to 0.013
_DRAG = 0.5 * 1.2 * 0.7  # kg/m, of air by a passenger car: c_d A is 0.6 to 0.9 m^2
_ROLLS = 1.0  # m/s, from which on a car rolls in one direction, whatever V_x is off by


class LastSample(Memory):
    """Biases, speeds, and readings that were not believed, of one car or a batch.

    A reading that the velocity part replaced is replaced everywhere: loads, forces and attitude take its word.
    """

    memory = (
        "bias", "speed", "used", "inertial", "gravity", "drive", "side", "gliding", "heavy", "road", "doubted", "same", "read",
    )  # fmt: skip
    unknowns = ("drive", "read")

    def __init__(self, vehicle: VehicleParameters, sample_time: float, batch_shape: tuple[int, ...]) -> None:
        self.sample_time, self.batch_shape, self.mass = sample_time, batch_shape, vehicle.mass
        # what F_x of wheels has too much that know of no rolling resistance
        self._rolling = 0.0 if vehicle.rolling_resistance > 0.0 else _ROLLING
        self._kit = kit = arithmetic(batch_shape)
        self.bias: list[Number] = [kit.full(0.0)] * 2  # of a_x, a_y, m/s^2
        self.speed: list[Number] = [kit.full(0.0)] * 3  # V_x, V_y, r
        self.used: list[Number] = [kit.full(True)] * 3  # whether a_x, a_y, r were believed
        self.inertial: list[Number] = [kit.full(0.0)] * 3  # and what they were taken for
        self.gravity: Number = kit.full(0.0)  # in a_x, m/s^2, of what grade the attitude leaves
        self.heavy: Number = kit.full(0.0)  # in a_x, m/s^2, as the attitude says
        self.road: Number = kit.full(0.0)  # of this, what grade makes
        self.drive: Number = kit.full(math.nan)  # V_x' - r V_y without gravity, m/s^2, where anything tells
        self.side: Number = kit.full(0.0)  # r V_x, and V_y' of a slide, m/s^2
        self.gliding: Number = kit.full(0.0)  # V_y', low-passed over `_LASTS`
        self._keep = math.exp(-sample_time / _LASTS)
        self.doubted: list[Number] = [kit.full(0.0)] * 2  # s for which a_x, a_y were not believed
        self.same: list[Number] = [kit.full(0.0)] * 2  # s for which they have been the same
        self.read: list[Number] = [kit.full(math.nan)] * 2  # and what they were

    def believed(self, *readings: Number) -> list[Number]:
        """Of a_x, a_y and r, as many as are given: what was not believed, replaced; what is missing stays so."""
        kit = self._kit
        return [
            kit.where(used | kit.no(abs(value) < math.inf), value, instead)
            for used, value, instead in zip(self.used, readings, self.inertial, strict=False)
        ]

    def learn(self, moved: Any, force: Number, lost: Number) -> None:
        """From the step of the velocity part; `force` N, what the wheels pull along, `lost` where F_x of one is not known."""
        kit = self._kit
        (ahead, left, _), turn = self.speed, kit.own(moved.yaw_rate)
        vx, vy = kit.own(moved.vx), kit.own(moved.vy)
        self.bias, self.speed = kit.rows(moved.sensor_bias, 3)[:2], [vx, vy, turn]
        if (used := getattr(moved, "inertial_used", None)) is not None:
            self.used, self.inertial = kit.rows(used, 3), kit.rows(moved.inertial, 3)
            self.gravity = kit.own(moved.gravity[..., 0])
            self.doubted = [
                kit.where(good, 0.0, time + self.sample_time)
                for good, time in zip(self.used[:2], self.doubted, strict=True)
            ]
        # Without torques, or on a slope, which the forces carry, what the wheels hold V_x to: slower, but no more in a loop with
        # gravity than they are.
        started = ((kit.own(moved.flags) & int(Flag.RESET)) != 0) | kit.own(moved.standing)
        gained = kit.where(started, math.nan, (vx - ahead) / self.sample_time - turn * vy)
        rolling = kit.maximum(kit.minimum(vx / _ROLLS, 1.0), -1.0) * self._rolling
        pulled = (force - _DRAG * vx * abs(vx)) / self.mass - rolling
        self.drive = kit.where(lost | (abs(self.road) > GRAVITY * _LOADED), gained, pulled)
        # A slide must not count as roll, and errors of V_y must, or nothing would lead roll and V_y back: V_y' belongs to
        # the motion the more, the larger it is.
        moved_left = kit.where(started, 0.0, (vy - left) / self.sample_time)
        self.gliding = self._keep * self.gliding + (1.0 - self._keep) * moved_left
        far = (self.gliding / _SLIDE) ** 4
        self.side = turn * vx + moved_left * far / (1.0 + far)

    def forget(self, here: Number) -> None:
        """Starts the cars `here` afresh."""
        choose = self._kit.where
        for name, start in (("bias", 0.0), ("speed", 0.0), ("used", True), ("doubted", 0.0), ("same", 0.0)):
            setattr(self, name, [choose(here, start, value) for value in getattr(self, name)])
        self.gravity, self.heavy, self.road = (choose(here, 0.0, v) for v in (self.gravity, self.heavy, self.road))
        self.drive, self.side = choose(here, math.nan, self.drive), choose(here, 0.0, self.side)
        self.gliding = choose(here, 0.0, self.gliding)

    def pull(self, ax: Number) -> Number:
        """What `ax` says that V_x gains, m/s^2."""
        return ax - self.heavy - self.bias[0] - self.gravity

    def _led(self, *readings: Number) -> list[Number]:
        """a_x and a_y as the attitude part is to have them.

        A reading that is not believed says nothing of gravity: it would be taken for tilt, and agree. But a tilt that gyros alone
        carry for long is off itself, contradicts every reading, and would keep it out for ever: then a live one leads again.
        """
        kit = self._kit
        self.same = [
            kit.where(new == old, time + self.sample_time, 0.0)
            for new, old, time in zip(readings, self.read, self.same, strict=True)
        ]
        self.read = list(readings)
        return [
            kit.where(used | ((doubted > _LED) & (same < _LIVE)), value - bias, math.nan)
            for used, doubted, same, value, bias in zip(
                self.used[:2], self.doubted, self.same, readings, self.bias, strict=True
            )
        ]

    def tilted(
        self, attitude: AttitudePart | None, signals: VehicleSignals, ax: Number, ay: Number, turn: Number
    ) -> Tilt | None:
        """What the attitude part says, if there is one."""
        if attitude is None:
            return None
        shape, kit = self.batch_shape, self._kit

        def read(given: npt.ArrayLike | None, name: str, limit: float) -> Number:
            """NaN for what is absent, and for what no sensor reads."""
            return math.nan if given is None else possible(kit, kit.car(given, shape, name), limit)

        lead_x, lead_y = self._led(ax, ay)
        tilt = attitude.step(
            read(signals.roll_rate, "roll_rate", limits.YAW_RATE),
            read(signals.pitch_rate, "pitch_rate", limits.YAW_RATE),
            lead_x,
            lead_y,
            motion_x=self.drive,
            motion_y=self.side,
            yaw_rate=kit.where(self.used[2], turn, self.inertial[2]),
            grade=read(signals.grade, "grade", limits.ANGLE),
            bank=read(signals.bank, "bank", limits.ANGLE),
        )
        up = read(signals.az, "az", limits.ACCELERATION)
        up = kit.where(abs(up) < math.inf, up, GRAVITY)
        heavy: list[Number] = []
        road: list[Number] = []
        body: list[Number] = []
        angles = (tilt.pitch, tilt.total_pitch, ax, SOFTEST[0]), (tilt.roll, tilt.total_roll, ay, SOFTEST[1])
        for angle, total, felt, softest in angles:
            body.append(own_tilt(kit, kit.own(angle), kit.where(abs(felt) < math.inf, felt, 0.0), softest))
            heavy.append(GRAVITY * kit.sin(kit.own(total)))
            road.append(heavy[-1] - GRAVITY * kit.sin(body[-1]))
        self.heavy, self.road = heavy[0], road[0]
        return Tilt(tilt, body[0], body[1], up, kit.table(((*heavy, *road),), shape))


class Tilt(NamedTuple):
    """What an attitude part says."""

    step: AttitudeStep
    pitch: Number  # rad, of the body against the road
    roll: Number
    up: Number  # m/s^2, a_z
    gravity: FloatArray  # (..., 4) m/s^2, as `VelocityFusion.step` takes it

    def level(self, ax: Number, ay: Number) -> tuple[Number, Number]:
        """a_x and a_y in the plane of the road, m/s^2: what the tires carry."""
        along, across, _ = levelled(ax, ay, self.up, self.pitch, self.roll)
        return along, across


def own_tilt(kit: Arithmetic, angle: Number, felt: Number, softest: float) -> Number:
    """What of a tilt, rad, is the body on its springs and not the road, by the acceleration `felt`, m/s^2.

    A body tilts by 0 to `softest` rad per g, +-`_LOADED`. A tilt that is within is its own; the further it is out, the more of it
    is road, and the less it says of the body.
    """
    middle = 0.5 * softest * felt / GRAVITY
    band = abs(middle) + _LOADED
    off = (angle - middle) / band
    return middle + band * off / kit.maximum(1.0, off * off)


def possible(kit: Arithmetic, value: Number, limit: float) -> Number:
    """NaN for what no sensor of a car reads."""
    return kit.where(abs(value) <= limit, value, math.nan)
