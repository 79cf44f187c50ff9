"""What a pipeline works out of one sample on plain numbers: accelerations in the plane of the road, loads, velocity, checks."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arithmetic import Number, arithmetic
from estimators.arrays import BoolArray, FloatArray
from estimators.forces import AttitudeStep, LoadStep
from estimators.memory import Memory
from estimators.pipeline.checks import CrossChecks, Forces
from estimators.pipeline.direction import DirectionOfTravel, SignedWheels
from estimators.pipeline.last_sample import LastSample, Tilt, possible
from estimators.pipeline.parts import AttitudePart, LoadPart, VelocityPart, VelocityResult
from estimators.pipeline.result import Consistency
from estimators.pipeline.signals import VehicleSignals
from estimators.signals import limits
from estimators.vehicle import VehicleParameters
from estimators.velocity.slip import LEAST_SPEED


class BeforeForces(NamedTuple):
    """What the inertial unit says of a sample, before the force of any wheel is known; numbers of a kit."""

    loads: LoadStep
    ax: Number  # m/s^2 in the plane of the road, without biases
    ay: Number
    yaw_rate: Number  # rad/s, as believed
    steer: Number  # rad, of the front wheels; NaN where missing
    total: Number  # N, what the forces in the wheel planes add up to
    attitude: AttitudeStep | None = None


class CarMotion(Memory):
    """The parts that run on plain numbers of one car, or on arrays of many: arguments as `EstimationPipeline`.

    A sample goes through `signed`, `before_forces`, `after_forces` and `checked`, and leaves what the next of them needs. Without
    a velocity part of its own, `felt` and `take` are the two halves of `after_forces`.
    """

    memory = ("front", "angle")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...],
        loads: LoadPart,
        velocity: VelocityPart | None,
        attitude: AttitudePart | None = None,
        repeat_time: float = 0.025,
        unsigned_wheels: bool = False,
    ) -> None:
        self.vehicle, self.batch_shape = vehicle, batch_shape
        self.loads, self.velocity, self.attitude = loads, velocity, attitude
        self.checks = CrossChecks(vehicle, sample_time, batch_shape, repeat_time=repeat_time)
        self.direction = DirectionOfTravel(vehicle, sample_time, batch_shape) if unsigned_wheels else None
        self.last = LastSample(vehicle, sample_time, batch_shape)
        named = ("loads", "velocity", "attitude", "checks", "last", "direction")
        self.parts = tuple(name for name in named if hasattr(getattr(self, name), "save"))
        self._takes_gravity = bool(getattr(velocity, "uses_gravity", False))
        self._kit = kit = arithmetic(batch_shape)
        self.front: Number = kit.full(0.0)  # F_yf of the last sample, N
        self.angle: Number = kit.full(0.0)  # the last known steering of the front wheels, rad
        self._given: tuple[Number, Number, Number, FloatArray, VehicleSignals]  # of this sample
        self._before: BeforeForces
        self._tilt: Tilt | None
        self._forces: Forces
        self._moved: VelocityResult

    def signed(self, w: FloatArray, ax: Number, gear: npt.ArrayLike | None) -> SignedWheels | None:
        """Wheel speeds with a sign; None, if they have one."""
        if self.direction is None:
            return None
        pull = self.last.pull(possible(self._kit, ax, limits.ACCELERATION))
        signed = self.direction.step(w, np.asarray(pull), gear)
        if np.count_nonzero(signed.turned) and (reset := getattr(self.velocity, "reset", None)) is not None:
            reset(signed.turned, signed.speed)
        return signed

    def before_forces(
        self, ax: Number, ay: Number, turn: Number, steer: FloatArray, signals: VehicleSignals
    ) -> BeforeForces:
        """Takes the readings of the unit, m/s^2 and rad/s, and the steering (..., 4), rad."""
        kit, last, choose = self._kit, self.last, self._kit.where
        read_x, read_y = (possible(kit, value, limits.ACCELERATION) for value in (ax, ay))
        turned = possible(kit, turn, limits.YAW_RATE)
        tilt = self._tilt = last.tilted(self.attitude, signals, read_x, read_y, turned)
        read_x, read_y, turned = last.believed(read_x, read_y, turned)
        own_x, own_y = (read_x, read_y) if tilt is None else tilt.level(read_x, read_y)
        bias_x, bias_y = last.bias
        own_x, own_y = own_x - bias_x, own_y - bias_y
        lean, rise = (None, None) if tilt is None else (tilt.roll, tilt.pitch)
        loads = self.loads.step(read_x - bias_x, read_y - bias_y, signals.az, rise, lean)
        front = kit.rows(steer, 4)
        angle = possible(kit, 0.5 * (front[0] + front[1]), limits.ANGLE)
        self.angle = choose(abs(angle) < math.inf, angle, self.angle)
        total = self.vehicle.mass * own_x + self.front * kit.sin(self.angle)
        self._given = ax, ay, turn, steer, signals
        self._before = BeforeForces(loads, own_x, own_y, turned, angle, total, None if tilt is None else tilt.step)
        return self._before

    def after_forces(self, w: FloatArray, use: FloatArray, forces: Forces, more: dict[str, Any]) -> VelocityResult:
        """Steps the velocity part: wheel speeds, F_x/F_z (..., 4), and `more` where it asks for it."""
        assert self.velocity is not None
        _, _, turn, steer, signals = self._given
        ax, ay, gravity = self.felt(self._takes_gravity)
        if gravity is not None:
            more = {**more, "gravity": gravity}
        moved = self.velocity.step(w, steer, ax, ay, turn, use, signals.elapsed, **more)
        self.take(forces, moved)
        return moved

    def felt(self, with_gravity: bool) -> tuple[Number, Number, FloatArray | None]:
        """a_x, a_y for a velocity part, m/s^2, and the gravity in them (..., 4), unless it has to be taken off before."""
        ax, ay, tilt = *self._given[:2], self._tilt
        if tilt is None or with_gravity:
            return ax, ay, None if tilt is None else tilt.gravity
        along, across = (self._kit.own(tilt.gravity[..., k]) for k in (0, 1))
        return ax - along, ay - across, None

    def take(self, forces: Forces, moved: VelocityResult) -> None:
        """What has been found of the sample, for `checked`."""
        self._forces, self._moved = forces, moved

    def checked(self, corner_speed: Number | None = None) -> tuple[Consistency, Number]:
        """Cross-checks, and the sideslip, rad; learns for the next sample. `corner_speed`: V_x of corner observers, m/s."""
        kit, last, forces, moved = self._kit, self.last, self._forces, self._moved
        consistency = self.checks(forces, self._before.loads, moved, corner_speed, self._given[-1].az)
        self.front = forces.front
        last.learn(moved, forces.push - forces.front * kit.sin(self.angle), forces.unknown)
        vx, vy, _ = last.speed
        return consistency, kit.atan(vy / kit.maximum(abs(vx), LEAST_SPEED))

    def reset(self, chosen: BoolArray, vx: npt.ArrayLike, vy: npt.ArrayLike) -> None:
        """Forgets the entries `chosen`, as `EstimationPipeline.reset`."""
        start = chosen, vx, vy
        for part, given in ((self.loads, start[:1]), (self.attitude, start[:1]), (self.velocity, start)):
            if (reset := getattr(part, "reset", None)) is not None:
                reset(*given)
        self.checks.reset(chosen)
        here, choose = self._kit.own(chosen), self._kit.where
        self.front, self.angle = choose(here, 0.0, self.front), choose(here, 0.0, self.angle)
        self.last.forget(here)
        if self.direction is not None:
            self.direction.forget(here if math.prod(self.batch_shape) == 1 else np.ravel(here))
