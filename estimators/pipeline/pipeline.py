"""The whole chain on one car, or on a batch of them: raw signals in, forces, slips, velocities and sideslip out."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from estimators.errors import EstimatorError
from estimators.faults import BoolArray, Flag, FlagArray
from estimators.forces import (
    LateralForceEstimator,
    UnknownInputForceObserver,
    VerticalLoads,
    levelled,
    reconcile,
    without_gravity,
)
from estimators.interpolate import FloatArray
from estimators.pipeline.checks import CrossChecks
from estimators.pipeline.result import PipelineStep
from estimators.pipeline.signals import VehicleSignals
from estimators.signals import FilteredDerivative
from estimators.signals.checks import any_missing, batch, entries, mask, quiet, setting
from estimators.signals.held import Held
from estimators.signals.memory import Memory
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity import VelocityFusion

REAL_SENSORS = (0.3, 0.1, 0.3)
"""m/s^2, m/s^2, rad/s^2: deviations of a_x, a_y, dr/dt for the lateral forces, sensors and model together."""
_LIFTED = 0.05  # share of its static load below which a wheel's F/F_z means nothing
_LEAST_SPEED = 0.5  # m/s by which V_y is divided at least
_LATE = 0.5  # relative error of the sample time beyond which a difference quotient of wheel speeds is no acceleration
_FASTEST_BODY = 100.0  # m/s^2: an accelerometer of a car reads no more


class EstimationPipeline(Memory):
    """Loads, longitudinal forces, velocities and lateral forces of the four corners, sample by sample.

    1. attitude (optional): roll and pitch, and the accelerations without their share of gravity;
    2. loads F_z from the accelerations, less the accelerometer bias that the velocity part found up to the last sample;
    3. F_x of each wheel from torque and wheel speed, made to agree with m a_x = sum F_x - F_yf sin(delta) (`reconcile`):
       what a stopped wheel or a lost torque leaves open is its share of m a_x by load;
    4. V_x, V_y, slips and slip angles, with F_x/F_z as what says how much a wheel may slip;
    5. F_y of both axles from planar dynamics; front split from the model, rear split by load;
    6. corner observers and a sideslip part (optional), beside the chain: for comparison and cross-check.

    Each part is replaced by any object with the same `step`; one with `reset`, `save` and `restore` takes part in these of
    the pipeline, one without counts as stateless. Their signatures: `longitudinal_force.step(wheel_speed, torque,
    vertical_load, fresh=)` as `UnknownInputForceObserver`, `WheelForceFilter` and `DifferentiatedPid`, of shape (..., 4);
    `loads.step(ax, ay, az, pitch, roll)` as `VerticalLoads`; `attitude.step(...)` as `AttitudeObserver`;
    `lateral_force.step(ax, ay, yaw_acceleration, steer, force_x, force_z)` as `LateralForceEstimator`; `velocity.step(
    wheel_speed, steer, ax, ay, yaw_rate, normalised_force, elapsed)` as `VelocityFusion`; `corner_observers.step(...)` as
    `CornerObservers`; `sideslip.step(...)` as in `sideslip_parts`.

    Estimates are finite whatever comes in; what was wrong is in the flags, and what does not fit together in
    `consistency`. A wheel speed that repeats bit for bit is the old one read again, for up to `repeat_time`.

    Args:
        vehicle: masses, lengths, radii.
        sample_time: s.
        batch_shape: leading axes of every signal; () for one car.
        longitudinal_force, loads, lateral_force, velocity: parts; None: the default one.
        attitude, corner_observers, sideslip: parts; None: without. The car is then level, and tilt counts as bias.
        acceleration_deviation: m/s^2, how wrong a_x may be where it corrects the sum of the wheels' forces.
        repeat_time: s, the longest interval of the wheel speed sensors.

    Raises:
        EstimatorError: a setting that is not positive, a part for another batch or sample time.
    """

    memory = ("bias", "front", "speed", "last", "age", "drive")
    unknowns = ("last", "drive")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        longitudinal_force: Any = None,
        loads: Any = None,
        attitude: Any = None,
        lateral_force: Any = None,
        velocity: Any = None,
        corner_observers: Any = None,
        sideslip: Any = None,
        acceleration_deviation: float = 0.15,
        repeat_time: float = 0.025,
    ) -> None:
        self.vehicle, self.batch_shape = vehicle, batch(batch_shape)
        shape = self.batch_shape
        time = self.sample_time = setting(sample_time, "sample_time", "s")
        four = (*shape, 4)
        self.longitudinal_force = longitudinal_force or UnknownInputForceObserver(vehicle, time, four)
        self.loads = loads or VerticalLoads(vehicle, time, shape)
        self.lateral_force = lateral_force or LateralForceEstimator(
            vehicle, time, shape, "linear", measurement_deviation=REAL_SENSORS
        )
        self.velocity = velocity or VelocityFusion(vehicle, time, shape)
        self.attitude, self.corner_observers, self.sideslip = attitude, corner_observers, sideslip
        self.yaw_slope = FilteredDerivative(time, 0.02, shape)
        self.checks = CrossChecks(vehicle, time, shape)
        self.angle = Held(shape, "steer")
        self._four = ("longitudinal_force",)  # parts whose batch has the corners on a last axis
        names = ("longitudinal_force", "loads", "attitude", "lateral_force", "velocity", "corner_observers", "sideslip")
        self._named = (*(name for name in names if getattr(self, name) is not None), "yaw_slope", "checks", "angle")
        self._check_parts()
        self.parts = tuple(name for name in self._named if hasattr(getattr(self, name), "save"))
        self._total_deviation = vehicle.mass * setting(acceleration_deviation, "acceleration_deviation", "m/s^2")
        self._hold = max(1, round(setting(repeat_time, "repeat_time", "s") / time))
        self._least_load = _LIFTED * vehicle.static_loads
        self._level = np.zeros(shape)
        self.bias: FloatArray = np.zeros((*shape, 2))  # of a_x, a_y, m/s^2, up to the last sample
        self.front: FloatArray = np.zeros(shape)  # F_yf of the last sample, N
        self.speed: FloatArray = np.zeros((*shape, 3))  # V_x, V_y, r of the last sample
        self.last: FloatArray = np.full(four, np.nan)  # wheel speeds of the last sample, as read
        self.age: npt.NDArray[np.int64] = np.zeros(four, dtype=np.int64)
        self.drive: FloatArray = np.full(shape, np.nan)  # sum of the wheels' own F_x over m, m/s^2, where all are known

    def step(self, signals: VehicleSignals) -> PipelineStep:
        """One sample on.

        Raises:
            EstimatorError: a signal of another shape, or not numbers.
        """
        shape, car = self.batch_shape, self.vehicle
        w, steer, torque, ax, ay, turn = signals.arrays(shape)
        read_x, read_y = _possible(ax), _possible(ay)
        late = self._late(signals.elapsed)
        fresh = self._fresh(w)
        tilt, own_x, own_y, free_x, free_y = self._tilted(signals, read_x, read_y, turn)
        own_x, own_y = own_x - self.bias[..., 0], own_y - self.bias[..., 1]
        loads = self.loads.step(
            read_x - self.bias[..., 0],
            read_y - self.bias[..., 1],
            signals.az,
            None if tilt is None else tilt.pitch,
            None if tilt is None else tilt.roll,
        )
        wheels = self.longitudinal_force.step(w, torque, loads.load, fresh=fresh)
        unknown = wheels.unknown if late is None else wheels.unknown | late[..., None]
        angle = self._front_angle(steer)
        total = car.mass * own_x + self.front * np.sin(self.angle(angle)[0])
        agreed = reconcile(wheels.force, wheels.deviation, total, self._total_deviation, loads.load, unknown)
        use = self._normalised(agreed.force, loads.load, unknown)
        if tilt is None:  # untouched: the velocity part tells the impossible from the missing
            free_x, free_y = ax, ay
        moved = self.velocity.step(w, steer, free_x, free_y, turn, use, signals.elapsed)
        swing = self.yaw_slope.step(turn if late is None else np.where(late, np.nan, turn)).derivative
        swing = swing if quiet(turn) else np.where(np.isfinite(turn), swing, np.nan)
        lateral = self.lateral_force.step(own_x, own_y, swing, angle, agreed.force, loads.load)
        corners = None
        if self.corner_observers is not None:
            across = self._normalised(lateral.corner_force, loads.load, None)
            corners = self.corner_observers.step(w, steer, own_x, own_y, turn, use, across, moved.vy)
        beside = None
        if self.sideslip is not None:
            beside = self.sideslip.step(
                angle, turn, moved.vx, own_x, own_y, agreed.force, loads.load, lateral.axle_force
            )
        consistency = self.checks(agreed, lateral, loads, moved, corners, signals.az, unknown, late)
        self.bias = np.array(moved.sensor_bias[..., :2])
        self.front = lateral.axle_force[..., 0].copy()
        self.speed = np.stack([moved.vx, moved.vy, moved.yaw_rate], axis=-1)
        if tilt is not None:
            self.drive = np.where(unknown.any(axis=-1), np.nan, wheels.force.sum(axis=-1) / car.mass)
        flags: FlagArray = moved.flags | loads.flags | lateral.flags
        if tilt is not None:
            flags = flags | tilt.flags
        if late is not None:
            flags = flags | np.where(late, np.int32(Flag.STALE_MEASUREMENT), np.int32(0))
        return PipelineStep(
            vx=moved.vx,
            vy=moved.vy,
            vx_deviation=moved.vx_deviation,
            vy_deviation=moved.vy_deviation,
            sideslip=np.arctan(moved.vy / np.maximum(np.absolute(moved.vx), _LEAST_SPEED)),
            yaw_rate=moved.yaw_rate,
            force_x=agreed.force,
            force_x_deviation=agreed.deviation,
            force_y=lateral.corner_force,
            axle_force_y=lateral.axle_force,
            force_z=loads.load,
            slip=moved.slip,
            slip_angle=moved.slip_angle,
            roll=self._level if tilt is None else tilt.roll,
            pitch=self._level if tilt is None else tilt.pitch,
            consistency=consistency,
            flags=flags,
            wheel_flags=moved.wheel_flags | wheels.flags,
            wheels=wheels,
            reconciled=agreed,
            loads=loads,
            lateral=lateral,
            velocity=moved,
            attitude=tilt,
            corners=corners,
            sideslip_step=beside,
        )

    def reset(self, where: npt.ArrayLike | None = None, vx: npt.ArrayLike = np.nan, vy: npt.ArrayLike = 0.0) -> None:
        """Forgets the entries `where` (bool mask of the batch shape; None: all) and starts them at `vx`, `vy`, m/s.

        NaN for `vx`: from the wheel speeds of the next step, which carries the flag RESET.

        Raises:
            EstimatorError: a mask or speeds of another shape.
        """
        chosen = mask(where, self.batch_shape, "where")
        corners = np.repeat(chosen[..., None], 4, axis=-1)
        for name in self._named:
            part = getattr(self, name)
            if isinstance(part, Held):
                part.forget(chosen)
            if not hasattr(part, "reset"):
                continue
            if name == "velocity":
                part.reset(chosen, vx, vy)
            else:
                part.reset(corners if name in self._four else chosen)
        self.bias = np.where(chosen[..., None], 0.0, self.bias)
        self.front = np.where(chosen, 0.0, self.front)
        self.speed = np.where(chosen[..., None], 0.0, self.speed)
        self.last, self.age = np.where(corners, np.nan, self.last), np.where(corners, 0, self.age)
        self.drive = np.where(chosen, np.nan, self.drive)

    def _check_parts(self) -> None:
        for name in self._named:
            part, shape = getattr(self, name), self.batch_shape
            own = getattr(part, "batch_shape", None)
            wanted = (*shape, 4) if name in self._four else shape
            if own is not None and tuple(own) != wanted:
                raise EstimatorError(f"{name} has batch_shape {tuple(own)}, expected {wanted}; build it for that batch")
            time = getattr(part, "sample_time", None)
            if time is not None and abs(time - self.sample_time) > 1e-9 * self.sample_time:
                raise EstimatorError(
                    f"{name} is for sample_time = {time:g} s, the pipeline runs at {self.sample_time:g} s; build both for one"
                )

    def _late(self, elapsed: npt.ArrayLike | None) -> BoolArray | None:
        """Where the sample came so early or late that a difference quotient over it is no derivative; None: nowhere."""
        if elapsed is None:
            return None
        given = entries(elapsed, self.batch_shape, "elapsed")
        with np.errstate(invalid="ignore"):
            odd: BoolArray = ~(np.absolute(given / self.sample_time - 1.0) <= _LATE)
        return odd if odd.any() else None

    def _fresh(self, wheel_speed: FloatArray) -> BoolArray | None:
        """Which wheel speeds are new; None: all of them."""
        same: BoolArray = wheel_speed == self.last
        self.last = wheel_speed.copy()
        if self._hold == 1 or not np.count_nonzero(same):
            if self.age.any():
                self.age = np.zeros_like(self.age)
            return None
        age = np.where(same, self.age + 1, 0)
        fresh = ~same | (age >= self._hold)
        self.age = np.where(fresh, 0, age)
        return fresh

    def _front_angle(self, steer: FloatArray) -> FloatArray:
        """(...) rad, mean of both front wheels; NaN where one is missing."""
        angle: FloatArray = 0.5 * (steer[..., 0] + steer[..., 1])
        return angle

    def _normalised(self, force: FloatArray, load: FloatArray, unknown: BoolArray | None) -> FloatArray:
        """F/F_z (..., 4); NaN where a wheel is off the ground, or its force is a mere share of the total."""
        lifted: BoolArray = load < self._least_load
        if unknown is not None:
            lifted = lifted | unknown
        if not lifted.any():
            ratio: FloatArray = force / load
            return ratio
        return np.where(lifted, np.nan, force / np.where(lifted, 1.0, load))

    def _tilted(
        self, signals: VehicleSignals, ax: FloatArray, ay: FloatArray, turn: FloatArray
    ) -> tuple[Any, FloatArray, FloatArray, FloatArray, FloatArray]:
        """The attitude step, a_x and a_y level with the road (forces), and without gravity (velocities), m/s^2."""
        if self.attitude is None:
            return None, ax, ay, ax, ay
        spin = self.speed[..., 2]
        nothing = np.nan
        tilt = self.attitude.step(
            nothing if signals.roll_rate is None else signals.roll_rate,
            nothing if signals.pitch_rate is None else signals.pitch_rate,
            ax - self.bias[..., 0],
            ay - self.bias[..., 1],
            motion_x=self.drive,
            motion_y=spin * self.speed[..., 0],
            yaw_rate=turn,
            grade=signals.grade,
            bank=signals.bank,
        )
        up = np.full(self.batch_shape, GRAVITY) if signals.az is None else entries(signals.az, self.batch_shape, "az")
        if any_missing(~np.isfinite(up)[..., None], self.batch_shape).any():
            up = np.where(np.isfinite(up), up, GRAVITY)
        own_x, own_y, _ = levelled(ax, ay, up, tilt.pitch, tilt.roll)
        return tilt, own_x, own_y, *without_gravity(ax, ay, tilt.total_roll, tilt.total_pitch)


def _possible(value: FloatArray) -> FloatArray:
    """NaN for what no accelerometer of a car reads."""
    if quiet(value) and np.maximum.reduce(np.absolute(value), None) <= _FASTEST_BODY:
        return value
    return np.where(np.absolute(value) <= _FASTEST_BODY, value, np.nan)
