"""The whole chain on one car, or on a batch of them: raw signals in, forces, slips, velocities and sideslip out."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, entries, mask, setting
from estimators.arithmetic import Number, arithmetic
from estimators.arrays import BoolArray, FlagArray
from estimators.faults import Flag
from estimators.forces import (
    AttitudeStep,
    LateralForceEstimator,
    UnknownInputForceObserver,
    VerticalLoads,
    normalised,
    reconcile,
)
from estimators.memory import Memory
from estimators.pipeline.car_by_car import FEW, CarByCar
from estimators.pipeline.checks import Forces
from estimators.pipeline.motion import CarMotion
from estimators.pipeline.parts import (
    CORNER_PARTS,
    AttitudePart,
    CornerPart,
    LateralForcePart,
    LoadPart,
    LongitudinalForcePart,
    Parts,
    SideslipPart,
    VelocityPart,
    check_parts,
    divides,
)  # fmt: skip
from estimators.pipeline.readings import WheelReadings
from estimators.pipeline.result import PipelineStep
from estimators.pipeline.signals import VehicleSignals
from estimators.signals import FilteredDerivative
from estimators.vehicle import VehicleParameters
from estimators.velocity import VelocityFusion
from estimators.velocity.rear_wheels import rear_wheel_speed

REAL_SENSORS = (0.3, 0.1, 0.3)
"""m/s^2, m/s^2, rad/s^2: deviations of a_x, a_y, dr/dt for the lateral forces, sensors and model together."""
_LATE = 0.5  # relative error of the sample time beyond which a difference quotient of wheel speeds is no acceleration


class EstimationPipeline(Memory):
    """Loads, longitudinal forces, velocities and lateral forces of the four corners, sample by sample.

    1. attitude (optional): roll and pitch, and the accelerations without their share of gravity;
    2. loads F_z from the accelerations, less the accelerometer bias that the velocity part found up to the last sample;
    3. F_x of each wheel from torque and wheel speed, made to agree with m a_x = sum F_x - F_yf sin(delta) (`reconcile`):
       what a stopped wheel or a lost torque leaves open is its share of m a_x by load;
    4. V_x, V_y, slips and slip angles, with F_x/F_z as what says how much a wheel may slip;
    5. F_y of both axles from planar dynamics; front split from the model, rear split by load; before 4 where 4 asks for it;
    6. corner observers and a sideslip part (optional), beside the chain: for comparison and cross-check.

    Each part is replaced by any object that follows its protocol (`parts`). Up to four cars run on plain numbers, one after the
    other (`car_by_car`), more cars on arrays: results agree to rounding. Loads, attitude and velocity of few cars are then
    copies `like` the part given, one for each (`divides`), and not that part itself.

    Estimates are finite whatever comes in; what was wrong is in the flags, and what does not fit together in
    `consistency`. A wheel speed that repeats bit for bit is the old one read again, for up to `repeat_time`.

    Args:
        vehicle: masses, lengths, radii.
        sample_time: s.
        batch_shape: leading axes of every signal; () for one car.
        longitudinal_force, loads, lateral_force, velocity: parts; None: the default one.
        attitude, corner_observers, sideslip: parts; None: without. The car is then level, and tilt counts as bias.
        speed_of_rear_wheels: V_g of the sideslip part is the mean of the rear wheels, P4 (9), and not the V_x that was found.
        acceleration_deviation: m/s^2, how wrong a_x may be where it corrects the sum of the wheels' forces.
        repeat_time: s, the longest interval of the wheel speed sensors.
        unsigned_wheels: the sensors do not tell backward from forward (most cars): `direction` does, or the accelerometer.

    Raises:
        EstimatorError: a setting that is not positive, a part for another batch or sample time.

    >>> import numpy as np
    >>> pipeline = EstimationPipeline(VehicleParameters.published_suv(), sample_time=0.005)
    >>> for _ in range(20):
    ...     step = pipeline.step(VehicleSignals(wheel_speed=np.full(4, 60.0), ax=0.0))
    >>> bool(15.0 < step.vx < 25.0)  # m/s
    True
    """

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        longitudinal_force: LongitudinalForcePart | None = None,
        loads: LoadPart | None = None,
        attitude: AttitudePart | None = None,
        lateral_force: LateralForcePart | None = None,
        velocity: VelocityPart | None = None,
        corner_observers: CornerPart | None = None,
        sideslip: SideslipPart | None = None,
        speed_of_rear_wheels: bool = False,
        acceleration_deviation: float = 0.15,
        repeat_time: float = 0.025,
        unsigned_wheels: bool = False,
    ) -> None:
        shape = self.batch_shape = batch(batch_shape)
        time = self.sample_time = setting(sample_time, "sample_time", "s")
        given = Parts(longitudinal_force, loads, attitude, lateral_force, velocity, corner_observers, sideslip)
        check_parts(given._asdict(), shape, time, CORNER_PARTS)
        self.vehicle, self._rear, four = vehicle, speed_of_rear_wheels, (*shape, 4)
        self.longitudinal_force: LongitudinalForcePart = longitudinal_force or UnknownInputForceObserver(
            vehicle, time, four
        )
        self.lateral_force: LateralForcePart = lateral_force or LateralForceEstimator(
            vehicle, time, shape, "linear", measurement_deviation=REAL_SENSORS
        )
        self.corner_observers, self.sideslip = corner_observers, sideslip
        self.yaw_slope = FilteredDerivative(time, 0.02, shape)
        self.readings = WheelReadings(four, max(1, round(setting(repeat_time, "repeat_time", "s") / time)))

        def motion(shape: tuple[int, ...], loads: Any, velocity: Any, attitude: Any) -> CarMotion:
            return CarMotion(vehicle, time, shape, loads, velocity, attitude, repeat_time, unsigned_wheels)

        chosen = (
            loads or VerticalLoads(vehicle, time, shape),
            velocity or VelocityFusion(vehicle, time, shape),
            attitude,
        )
        apart = 1 < math.prod(shape) <= FEW and divides(chosen[0], shape) and divides(attitude, shape)
        self.motion = CarByCar(shape, partial(motion, ()), *chosen) if apart else motion(shape, *chosen)
        if isinstance(self.motion, CarMotion):
            self.loads, self.velocity, self.attitude = self.motion.loads, self.motion.velocity, self.motion.attitude
        own = ("longitudinal_force", "lateral_force", "corner_observers", "sideslip", "yaw_slope", "readings")
        self._own = tuple(name for name in own if getattr(self, name) is not None)
        self.parts = tuple(name for name in self._own if hasattr(getattr(self, name), "save"))
        self._lateral_first = bool(getattr(velocity, "uses_lateral_force", False))
        self._compliant = bool(getattr(corner_observers, "uses_forces", False))
        self._use_across = self._lateral_first or self.corner_observers is not None
        self._total_deviation = vehicle.mass * setting(acceleration_deviation, "acceleration_deviation", "m/s^2")
        self._kit, self._static = arithmetic(shape), vehicle.static_loads
        self._level, self._never = np.zeros(shape), self._kit.full(False)

    def step(self, signals: VehicleSignals) -> PipelineStep:
        """One sample on.

        Raises:
            EstimatorError: a signal of another shape, or not numbers.
        """
        kit, shape, car, choose = self._kit, self.batch_shape, self.vehicle, self._kit.where
        w, steer, torque, *body = signals.arrays(shape)
        ax, ay, turn = (kit.own(value) for value in body)
        late = self._late(signals.elapsed)
        if (signed := self.motion.signed(w, ax, signals.direction)) is not None:
            w = signed.wheel_speed
        fresh = self.readings.step(w)
        loads, own_x, own_y, turned, angle, total, attitude = self.motion.before_forces(ax, ay, turn, steer, signals)
        wheels = self.longitudinal_force.step(w, torque, loads.load, fresh=fresh)
        delayed = kit.some(late)
        unknown = wheels.unknown | np.asarray(late)[..., None] if delayed else wheels.unknown
        agreed = reconcile(wheels.force, wheels.deviation, total, self._total_deviation, loads.load, unknown)
        use = normalised(agreed.force, loads.load, self._static, unknown)
        yaw_acceleration = self.yaw_slope.step(choose(late, math.nan, turned) if delayed else turned).derivative
        if kit.some(lost := kit.no(abs(turned) < math.inf)):
            yaw_acceleration = choose(lost, math.nan, kit.own(yaw_acceleration))
        lateral = self.lateral_force.step(own_x, own_y, yaw_acceleration, angle, agreed.force, loads.load)
        across = normalised(lateral.corner_force, loads.load, self._static) if self._use_across else None
        pulls = {"forces": (agreed.force, lateral.corner_force)}
        more: dict[str, Any] = {"lateral_use": across, **pulls} if self._lateral_first else {}
        forces = Forces(
            gap=kit.own(agreed.innovation),
            side_gap=kit.own(lateral.innovation[..., 1]),
            front=kit.own(lateral.axle_force[..., 0]),
            push=kit.own(np.add.reduce(wheels.force, -1)),
            unknown=self._any_wheel(unknown),
            late=late,
        )
        moved = self.motion.after_forces(w, use, forces, more)
        corners = None
        if self.corner_observers is not None and across is not None:
            corners = self.corner_observers.step(
                *(w, steer, own_x, own_y, turn, use, across, moved.vy), **(pulls if self._compliant else {})
            )
        beside = None
        if self.sideslip is not None:
            steered, turning, speed, pull_x, pull_y = (
                np.asarray(v).reshape(shape)
                for v in (angle, turned, rear_wheel_speed(car, w, turned) if self._rear else moved.vx, own_x, own_y)
            )
            beside = self.sideslip.step(
                steered, turning, speed, pull_x, pull_y, agreed.force, loads.load, lateral.axle_force
            )
        corner_speed = None if corners is None else kit.own(corners.vx)
        consistency, sideslip = self.motion.checked(corner_speed)
        return PipelineStep(
            vx=moved.vx,
            vy=moved.vy,
            vx_deviation=moved.vx_deviation if signed is None else np.hypot(moved.vx_deviation, signed.open_deviation),
            vy_deviation=moved.vy_deviation,
            sideslip=np.asarray(sideslip).reshape(shape),
            yaw_rate=moved.yaw_rate,
            force_x=agreed.force,
            force_x_deviation=agreed.deviation,
            force_y=lateral.corner_force,
            axle_force_y=lateral.axle_force,
            force_z=loads.load,
            slip=moved.slip,
            slip_angle=moved.slip_angle,
            roll=self._level if attitude is None else attitude.roll,
            pitch=self._level if attitude is None else attitude.pitch,
            consistency=consistency,
            flags=self._flags(moved.flags | loads.flags | lateral.flags, attitude, late),
            wheel_flags=moved.wheel_flags | wheels.flags,
            wheels=wheels,
            reconciled=agreed,
            loads=loads,
            lateral=lateral,
            velocity=moved,
            attitude=attitude,
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
        self.motion.reset(chosen, vx, vy)
        corners = np.repeat(chosen[..., None], 4, axis=-1)
        for name in self._own:
            part = getattr(self, name)
            if hasattr(part, "reset"):
                part.reset(corners if name in CORNER_PARTS else chosen)

    def _members(self) -> Iterator[tuple[str, Any]]:
        yield "", self.motion  # its names stand beside those of the other parts
        yield from super()._members()

    def _flags(self, flags: FlagArray, attitude: AttitudeStep | None, late: Number) -> FlagArray:
        """Of the whole car: `flags` of the parts, those of the attitude, and samples that came late."""
        if attitude is not None:
            flags = flags | attitude.flags
        if not self._kit.some(late):
            return flags
        return flags | np.asarray(self._kit.where(late, int(Flag.STALE_MEASUREMENT), 0), dtype=np.int32)

    def _any_wheel(self, where: BoolArray) -> Number:
        """Cars with a wheel `where` (..., 4)."""
        if not np.count_nonzero(where):
            return self._never
        return self._kit.own(where.any(axis=-1))

    def _late(self, elapsed: npt.ArrayLike | None) -> Number:
        """Where the sample came so early or late that a difference quotient over it is no derivative."""
        if elapsed is None:
            return self._never
        given = self._kit.own(entries(elapsed, self.batch_shape, "elapsed"))
        return self._kit.no(abs(given / self.sample_time - 1.0) <= _LATE)
