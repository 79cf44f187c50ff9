"""Vehicle-level fusion: V_x and V_y of the centre of gravity from wheels, inertial unit, steering and tire forces."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, mask, setting
from estimators.arithmetic import Number, Signals, arithmetic
from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.memory import CarsMemory, Memory
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity import lateral_fusion as lateral
from estimators.velocity import longitudinal_fusion as longitudinal
from estimators.velocity.consistency_reset import LateralReset, LongitudinalReset
from estimators.velocity.fusion_inputs import ConditionedInputs, FusionInputs
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.fusion_step import FusionStep, Outcome, fusion_step
from estimators.velocity.signal_monitor import SignalMonitor
from estimators.velocity.soft_tire_monitor import SoftTireMonitor
from estimators.velocity.zero_velocity import ZeroVelocityDetector

_MISSING_INPUT, _RESET, _GATED = int(Flag.MISSING_INPUT), int(Flag.RESET), int(Flag.GATED)
_FASTEST = 200.0  # m/s: an estimate beyond it is lost
_FORGET = 0.05  # s after which parameters forget; they remember for 5 s at least, the slopes of the road at 40 m/s
_SLIDES = 0.3  # sideslip, rad: deviation of a car whose V_x was lost
_WIDEST = 50.0  # m/s of standard deviation: a wider one says no more, and is kept from growing


class VelocityFusion(Memory):
    """Wheels, weighted by slip and innovation, correct an inertial model that learns its own errors.

    Which wheel to believe is decided at every sample from what its force explains (`longitudinal_fusion`); V_y comes
    from the kinematics and from the side slip that the axle forces demand (`lateral_fusion`). At standstill a zero-velocity
    update of both speeds and the yaw rate gives the biases (`zero_velocity`). A signal that the others contradict, that freezes
    or is missing is replaced by what they say (`signal_monitor`). An estimate that rolling wheels contradict for long is lost,
    and starts again from them (`consistency_reset`). Wheel speeds are signed: backwards is negative.

    One car runs on plain numbers, several on arrays, by the same formulas (`arithmetic`).

    Args:
        vehicle: masses and lengths; `effective_radius` is where learning starts.
        sample_time: s, between steps that do not say otherwise.
        batch_shape: leading axes of every input: () for one car, (20,) for twenty runs.
        settings: the constants; the default is for any car.

    Raises:
        EstimatorError: a sample time outside (0, 1] s, a batch without entries.

    >>> import numpy as np
    >>> fusion = VelocityFusion(VehicleParameters.published_suv(), sample_time=0.005)
    >>> step = fusion.step(np.full(4, 60.0), steer=0.0, ax=0.0, ay=0.0, yaw_rate=0.0)
    >>> bool(step.vx > 15.0)  # m/s
    True
    """

    memory = ("new", "renewed", "start")
    parts = (
        "_along", "_across", "inputs", "longitudinal_filter", "lateral_filter", "signal_monitor",
        "longitudinal_reset", "lateral_reset", "zero_velocity", "soft_tire_monitor",
    )  # fmt: skip
    unknowns = ("start",)
    uses_gravity = True  # `step` takes it

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        settings: FusionSettings | None = None,
    ) -> None:
        self.vehicle, self.batch_shape = vehicle, batch(batch_shape)
        self.sample_time = setting(sample_time, "sample_time", "s")
        if self.sample_time > 1.0:
            raise EstimatorError(f"sample_time = {self.sample_time:g} s is above 1 s; 0.005 s is usual, give seconds")
        self._count = count = math.prod(self.batch_shape)
        self.settings = settings if settings is not None else FusionSettings()
        self._kit = kit = arithmetic((count,))
        self._radius = kit.signals(vehicle.radii)
        self._places = kit.signals(vehicle.corner_x.tolist()), kit.signals(vehicle.corner_y.tolist())
        every = max(1, round(_FORGET / self.sample_time))
        self._along = longitudinal.LongitudinalFusion(self._radius, self.settings, every, count)
        self._across = lateral.LateralFusion(vehicle, self.settings, every, count)
        self.longitudinal_filter, self.lateral_filter = self._along.filter, self._across.filter
        self.inputs = FusionInputs(self._radius, self.settings, count)
        self.signal_monitor = SignalMonitor(vehicle, self._along, self._across, count)
        self.longitudinal_reset = LongitudinalReset(self.settings, count)
        self.lateral_reset = LateralReset(self.settings, self._across, count)
        self.zero_velocity = ZeroVelocityDetector(self.settings, self._along, self._across, count)
        self.soft_tire_monitor = SoftTireMonitor(self.settings, self._along, self._across, count)
        self.new: Number = kit.full(True)  # waits for a first wheel speed
        self.renewed: Number = kit.full(False)
        self.start: Signals = kit.stacked([kit.full(math.nan)] * 2)  # V_x, V_y asked for by `reset`
        self._usual, self._never = kit.full(self.sample_time), kit.full(False)

    def like(self, batch_shape: tuple[int, ...]) -> VelocityFusion:
        """The same for another batch, as new."""
        return VelocityFusion(self.vehicle, self.sample_time, batch_shape, self.settings)

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        steer: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        normalised_force: npt.ArrayLike | None = None,
        elapsed: npt.ArrayLike | None = None,
        gravity: npt.ArrayLike | None = None,
    ) -> FusionStep:
        """One sample on.

        Args:
            wheel_speed: (..., 4) rad/s, signed. steer: (..., 4) road-wheel angles, rad. ax: (...) m/s^2, accelerometer at the
            centre of gravity. ay: (...) m/s^2, likewise. yaw_rate: (...) rad/s. normalised_force: (..., 4) F_x/F_z of the
            wheels; NaN (or None) where unknown: then a_x/g. elapsed: (...) s since the last step, if not `sample_time`:
            jitter, gaps. gravity: (..., 4) m/s^2, finite, of attitude where it is known: its share in `ax` and `ay`, and of
            these what the road
                is tilted, not the body: the tires carry that. None: a level car, whose tilt counts as bias, grade and bank.

        Whatever is not finite counts as missing and is flagged; the estimates stay finite. A car of which a signal
        contradicts the others carries the flag GATED.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        kit, along, across = self._kit, self._along, self._across
        shape = self.batch_shape
        wheels, turned = kit.wheels(wheel_speed, shape, "wheel_speed"), kit.wheels(steer, shape, "steer")
        named = ((ax, "ax"), (ay, "ay"), (yaw_rate, "yaw_rate"))
        inertial = kit.stacked([kit.car(value, shape, name) for value, name in named])
        dt, odd = self._elapsed(elapsed)
        seen = self.inputs(inertial, wheels, turned, dt)
        heavy = None if gravity is None else kit.wheels(gravity, shape, "gravity")
        if heavy is not None:
            a, b, r = seen.inertial
            seen = seen._replace(inertial=kit.stacked((a - heavy[0], b - heavy[1], r)))
        self._begin(seen)
        given = None if normalised_force is None else kit.wheels(normalised_force, shape, "normalised_force")
        validated = self.signal_monitor(dt, seen, given, self.inputs.slope, heavy)
        (a, b, r), noise, used, doubt, taken, road, mu, blind, unknown, steered, gated, contested = validated
        turn, before = across.yaw_rate(r), along.speed
        unsure = 1.0 * across.filter.variance(lateral.SPEED)  # of arrays a copy: prediction writes into the covariance
        along.predict(dt, a, noise[0], turn, (across.speed, unsure), doubt[0] > 0.0, heavy is not None)
        across.predict(dt, b, noise[1], r, noise[2], before, (doubt[1] == 0.0) & used[2], seen.present)
        yaw_acceleration, left, felt = self.signal_monitor.turn.yaw_acceleration, across.speed, b + road[1]
        own = along.acceleration(a) + turn * left

        def moves(angle: Number, x: Number, y: Number) -> tuple[Number, ...]:
            sine, cosine = kit.sin(angle), kit.cos(angle)
            return cosine, (left + turn * x) * sine - turn * y * cosine, own - yaw_acceleration * y, sine

        course = longitudinal.WheelMotion._make((*kit.each(moves, seen.steer, *self._places), across.wheel_bend))
        slipping = self.inputs.slipping(course.acceleration, seen.fresh, dt, doubt[0])
        wheel = along.correct(dt, seen, slipping, mu, felt / GRAVITY, unsure, course, blind)
        self.soft_tire_monitor(dt, seen, course, mu, felt / GRAVITY, unsure, turn, slipping, blind)
        standing, lost = self.zero_velocity(seen, a, b, turn, dt)
        lost = lost | self.longitudinal_reset(dt, standing, seen, wheel, slipping, mu, self._radius)
        along.zero_velocity_update(standing)
        front, rear = (slipping[i] | slipping[i + 1] | wheel.gated[i] | wheel.gated[i + 1] for i in (0, 2))
        # wheels that slide sideways do not turn, and have no slip angle; no road is so slippery that the car feels nothing
        known, calm, silent = kit.no(unknown), across.friction(b) < self.settings.unloaded, seen.silent
        front_rolls, rear_rolls = (calm | kit.no(silent[i] & silent[i + 1]) for i in (0, 2))
        rolling = (known & seen.steered & front_rolls & kit.no(front), known & rear_rolls & kit.no(rear))
        # one that repeats itself is believed where the rear axle can contradict it
        usable = kit.stacked((rolling[0] & steered & (rolling[1] | kit.no(seen.locked)), rolling[1]))
        fl, fr, rl, rr = seen.steer
        angles = kit.stacked((0.5 * (fl + fr), 0.5 * (rl + rr)))
        axle = across.correct(
            dt, felt, r, yaw_acceleration, angles, along.speed, a + road[0], usable, rolling, doubt[1]
        )
        self.signal_monitor.learn(dt, seen, wheel.innovation, along.speed, r, axle, rolling)
        restarted = self.lateral_reset(dt, along.speed, axle, usable)
        across.blind(dt, unknown)
        across.zero_velocity_update(standing, r)
        flags = seen.flags | kit.where(odd, _MISSING_INPUT, 0) | kit.where(gated, _GATED, 0)
        flags = flags | kit.where(self.renewed | restarted, _RESET, 0)
        self.renewed = self._never
        self._guard(seen, lost)
        outcome = Outcome(slipping, wheel, axle, standing, self.zero_velocity.stopped(seen.silent), self._hidden())
        geometry = (course.beside, course.along, *self._places)
        inertial = (a + taken[0], b + taken[1], r)
        return fusion_step(kit, shape, along, across, seen, geometry, outcome, flags, inertial, (*used, contested))

    def reset(self, where: npt.ArrayLike | None = None, vx: npt.ArrayLike = np.nan, vy: npt.ArrayLike = 0.0) -> None:
        """Forgets the entries `where` (mask of the batch shape; None: all) and starts them at `vx`, `vy`, m/s.

        NaN for `vx`: from the wheel speeds of the next step, which carries the flag RESET.

        Raises:
            EstimatorError: a mask or speeds of another shape.
        """
        shape = self.batch_shape
        chosen = self._kit.rows(mask(where, shape, "where"), 1)[0]
        asked = self._kit.car(vx, shape, "vx"), self._kit.car(vy, shape, "vy")
        start = [self._kit.where(chosen, new, old) for new, old in zip(asked, self.start, strict=True)]
        self.start = self._kit.stacked(start)
        self._forget(chosen)

    def _hidden(self) -> tuple[Number, Number]:
        """What none of the measurements tells: speeds below the dead band of the wheels, and which of two pairs is right."""
        slow = self.zero_velocity.hidden()
        return self._kit.maximum(slow, self.longitudinal_reset.split / 3.0), slow

    def _elapsed(self, elapsed: npt.ArrayLike | None) -> tuple[Number, Number]:
        """Seconds, and where they were unusable and replaced by the sample time."""
        if elapsed is None:
            return self._usual, self._never
        given = self._kit.car(elapsed, self.batch_shape, "elapsed")
        odd = self._kit.no((given > 0.0) & (given < 1e6))
        return self._kit.where(odd, self._usual, given), odd

    def _begin(self, seen: ConditionedInputs) -> None:
        """Cars that wait start from the middle of the wheel speeds, or from what `reset` asked for."""
        kit, choose = self._kit, self._kit.where
        if not kit.some(self.new):
            return
        fresh = seen.fresh[0] | seen.fresh[1] | seen.fresh[2] | seen.fresh[3]
        asked = abs(self.start[0]) < math.inf
        first = choose(asked, self.start[0], self._middle(seen))
        blind = self.new & kit.no(asked | fresh)
        unsure = choose(blind, 30.0, 0.1 + 0.03 * abs(first))  # without any wheel: any speed of a road
        self.longitudinal_filter.renew(self.new, first, unsure * unsure)
        given = abs(self.start[1]) < math.inf
        beside = choose(given, self.start[1], 0.0)
        # a car that was lost may slide
        unsure = choose(self.renewed & kit.no(given), _SLIDES, 0.02) * abs(first) + 0.05
        self.lateral_filter.renew(self.new, beside, unsure * unsure)
        self.zero_velocity.begin(self.new, asked & (abs(first) + abs(beside) > self.settings.dead_speed))
        self.new = blind

    def _middle(self, seen: ConditionedInputs) -> Number:
        """Median surface speed of the fresh wheels, m/s: one that stands or spins alone does not count; 0 without any.

        Two that spin and two that stand have no middle: a car that stands on ice is more usual than one with two dead wheels.
        """
        surfaces = np.array([R * w for R, w in zip(self._radius, seen.wheel_speed, strict=True)])
        known = np.where(np.array(seen.fresh), surfaces, math.nan).reshape(4, -1)
        known = np.where(np.isfinite(known).any(axis=0), known, 0.0)
        low, high = (np.nanquantile(known, 0.5, axis=0, method=side) for side in ("lower", "higher"))
        size = np.maximum(np.abs(low), np.abs(high))
        apart = high - low > self.settings.agreement * size + self.settings.dead_speed
        middle = np.where(apart, np.where(np.abs(low) < np.abs(high), low, high), 0.5 * (low + high))
        return middle.item() if self._count == 1 else middle

    def _forget(self, where: Number) -> None:
        for name in self.parts:
            part = getattr(self, name)
            if isinstance(part, CarsMemory):
                part.forget(where)
        self.new, self.renewed = self.new | where, self.renewed | where

    def _guard(self, seen: ConditionedInputs, lost: Number) -> None:
        """An estimate that is lost starts again at the next step, from the wheels; until then it is their middle."""
        kit, choose = self._kit, self._kit.where
        lost = lost | kit.no(abs(self._along.speed) + abs(self._across.speed) < _FASTEST)
        if kit.some(lost):
            self.start = kit.stacked([choose(lost, math.nan, value) for value in self.start])
            middle = self._middle(seen)
            self._forget(lost)
            surface = kit.maximum(kit.minimum(middle, 0.5 * _FASTEST), -0.5 * _FASTEST)
            self.longitudinal_filter.renew(lost, surface, _WIDEST**2)
            self.lateral_filter.renew(lost, 0.0, 1.0)
        for speed in (self.longitudinal_filter, self.lateral_filter):
            unsure = kit.no(speed.variance(0) < _WIDEST**2)
            if kit.some(unsure):
                speed.renew(unsure, speed.mean[0], 0.25 * _WIDEST**2)
