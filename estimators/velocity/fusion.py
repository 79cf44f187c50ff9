"""Vehicle-level fusion: V_x and V_y of the centre of gravity from wheels, inertial unit, steering and tire forces."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from estimators.errors import EstimatorError
from estimators.faults import BoolArray, Flag, FlagArray, raise_flag
from estimators.interpolate import FloatArray
from estimators.signals.checks import batch, entries, mask, setting
from estimators.signals.memory import Memory
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity import lateral_fusion as lateral
from estimators.velocity import longitudinal_fusion as longitudinal
from estimators.velocity.fusion_screen import FusionScreen, Screened
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.fusion_step import FusionStep
from estimators.velocity.slip import side_slip_angle, slip_ratio

_LARGEST_FRICTION = 1.5  # a larger |F/F_z| is no tire's
_FASTEST = 200.0  # m/s: an estimate beyond it is lost
_WIDEST = 50.0  # m/s of standard deviation: a wider one says no more, and is kept from growing


class VelocityFusion(Memory):
    """Wheels, weighted by slip and innovation, correct an inertial model that learns its own errors.

    Which wheel to believe is decided at every sample from what its force explains (`longitudinal_fusion`); V_y comes
    from the kinematics and from the side slip that the axle forces demand (`lateral_fusion`). At standstill both
    speeds and the yaw rate are zero, which gives the biases. Wheel speeds are signed: backwards is negative.

    Args:
        vehicle: masses and lengths; `effective_radius` is where learning starts.
        sample_time: s, between steps that do not say otherwise.
        batch_shape: leading axes of every input: () for one car, (20,) for twenty runs.
        settings: the constants; the default is for any car.

    Raises:
        EstimatorError: a sample time outside (0, 1] s, a batch without entries.
    """

    memory = ("new", "renewed", "start", "calm")
    parts = ("screen", "longitudinal_filter", "lateral_filter")
    unknowns = ("start",)

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
        count = math.prod(self.batch_shape)
        self.settings = settings if settings is not None else FusionSettings()
        self._x, self._y = vehicle.corner_x, vehicle.corner_y
        self._radius = vehicle.radius
        self._along = longitudinal.LongitudinalFusion(vehicle.radius, self.settings, count)
        self._across = lateral.LateralFusion(vehicle, self.settings, count)
        self.longitudinal_filter, self.lateral_filter = self._along.filter, self._across.filter
        self.screen = FusionScreen(vehicle.radius, self.settings, count)
        self.new: BoolArray = np.ones(count, dtype=np.bool_)  # waits for a first wheel speed
        self.renewed: BoolArray = np.zeros(count, dtype=np.bool_)
        self.start: FloatArray = np.full((count, 2), np.nan)  # V_x, V_y asked for by `reset`
        self.calm: FloatArray = np.zeros(count)  # s of silent wheels and calm body

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        steer: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        normalised_force: npt.ArrayLike | None = None,
        elapsed: npt.ArrayLike | None = None,
    ) -> FusionStep:
        """One sample on.

        Args:
            wheel_speed: (..., 4) rad/s, signed.
            steer: (..., 4) road-wheel angles, rad.
            ax: (...) m/s^2, accelerometer at the centre of gravity, level with the road as far as attitude is known.
            ay: (...) m/s^2, likewise.
            yaw_rate: (...) rad/s.
            normalised_force: (..., 4) F_x/F_z of the wheels; NaN (or None) where unknown: then a_x/g.
            elapsed: (...) s since the last step, if not `sample_time`: jitter, gaps.

        Whatever is not finite counts as missing and is flagged; the estimates stay finite.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        wheels, turned = self._entries(wheel_speed, "wheel_speed", 4), self._entries(steer, "steer", 4)
        named = ((ax, "ax"), (ay, "ay"), (yaw_rate, "yaw_rate"))
        inertial = np.concatenate([self._entries(value, name, 1) for value, name in named], axis=1)
        dt, odd = self._elapsed(elapsed)
        seen = self.screen(inertial, wheels, turned, dt)
        raise_flag(seen.flags, odd, Flag.MISSING_INPUT)
        self._begin(seen.wheel_speed, seen.fresh)
        a, b, r = seen.inertial.T
        along, across = self._along, self._across
        turn = across.yaw_rate(r)
        before = along.speed.copy()
        along.predict(dt, a, seen.noise[:, 0], turn, across.speed)
        across.predict(dt, b, seen.noise[:, 1], r, seen.noise[:, 2], before)
        force = self._force(normalised_force, a)
        swing = self.screen.slope[:, 4]
        left, spin = across.speed[:, None], turn[:, None]
        pull = along.acceleration(a)[:, None] + spin * left - swing[:, None] * self._y
        slipping = self.screen.slipping(pull, dt) & seen.fresh
        sine, cosine = np.sin(seen.steer), np.cos(seen.steer)
        shift = -spin * self._y * cosine + (left + spin * self._x) * sine
        wheel = along.correct(dt, seen.wheel_speed, seen.fresh, slipping, force, (cosine, shift), pull)
        standing = self._standing(seen.wheel_speed, seen.fresh, a, turn, seen.present, dt)
        along.stand(standing)
        usable = ~(slipping | wheel.gated).reshape(-1, 2, 2).any(axis=2) & seen.present[:, None]
        usable[:, 0] &= seen.steered
        steered = seen.steer.reshape(-1, 2, 2).mean(axis=2)
        axle = across.correct(dt, b, r, swing, steered, along.speed, a, usable)
        across.blind(dt, seen.blind)
        across.stand(standing, r)
        self._guard(seen.flags, seen.wheel_speed)
        return self._reported(seen, (sine, cosine), wheel, slipping, axle, standing)

    def reset(self, where: npt.ArrayLike | None = None, vx: npt.ArrayLike = np.nan, vy: npt.ArrayLike = 0.0) -> None:
        """Forgets the entries `where` (mask of the batch shape; None: all) and starts them at `vx`, `vy`, m/s.

        NaN for `vx`: from the wheel speeds of the next step, which carries the flag RESET.

        Raises:
            EstimatorError: a mask or speeds of another shape.
        """
        chosen = mask(where, self.batch_shape, "where").reshape(-1)
        start = entries(vx, self.batch_shape, "vx"), entries(vy, self.batch_shape, "vy")
        for row, value in enumerate(start):
            self.start[chosen, row] = value.reshape(-1)[chosen]
        self._forget(chosen)

    def _entries(self, value: npt.ArrayLike, what: str, width: int) -> FloatArray:
        """`value` as (b, width)."""
        shape = (*self.batch_shape, width) if width > 1 else self.batch_shape
        return entries(value, shape, what).reshape(-1, width)

    def _elapsed(self, elapsed: npt.ArrayLike | None) -> tuple[FloatArray, BoolArray]:
        """Seconds (b,), and where they were unusable and replaced by the sample time."""
        count = self.new.size
        if elapsed is None:
            return np.full(count, self.sample_time), np.zeros(count, dtype=np.bool_)
        given = entries(elapsed, self.batch_shape, "elapsed").reshape(-1)
        odd = ~((given > 0.0) & (given < 1e6))
        return np.where(odd, self.sample_time, given), odd

    def _begin(self, wheel_speed: FloatArray, fresh: BoolArray) -> None:
        """Entries that wait start from the mean wheel speed, or from what `reset` asked for."""
        if not self.new.any():
            return
        surface = np.where(fresh, self._radius * wheel_speed, 0.0).sum(axis=1) / np.maximum(fresh.sum(axis=1), 1)
        asked = np.isfinite(self.start[:, 0])
        first = np.where(asked, self.start[:, 0], surface)
        ready = self.new & (asked | fresh.any(axis=1))
        blind = self.new & ~ready
        unsure = np.where(blind, 30.0, 0.1 + 0.03 * np.absolute(first))  # without any wheel: any speed of a road
        self._along.filter.renew(self.new, first, unsure**2)
        beside = np.where(np.isfinite(self.start[:, 1]), self.start[:, 1], 0.0)
        self._across.filter.renew(self.new, beside, (0.05 + 0.02 * np.absolute(first)) ** 2)
        self.new = blind

    def _force(self, normalised_force: npt.ArrayLike | None, ax: FloatArray) -> FloatArray:
        """F_x/F_z (b, 4), of a size that a tire can have; a_x/g where unknown: all wheels use the same share."""
        x = self._along.filter.mean
        share = (ax * (1.0 - x[:, longitudinal.SCALE]) - x[:, longitudinal.BIAS]) / GRAVITY
        mu = np.repeat(share[:, None], 4, axis=1)
        if normalised_force is not None:
            given = self._entries(normalised_force, "normalised_force", 4)
            mu = np.where(np.isfinite(given), given, mu)
        return np.clip(mu, -_LARGEST_FRICTION, _LARGEST_FRICTION)

    def _standing(
        self,
        wheel_speed: FloatArray,
        fresh: BoolArray,
        ax: FloatArray,
        turn: FloatArray,
        present: BoolArray,
        elapsed: FloatArray,
    ) -> BoolArray:
        """All wheels that speak are silent, and the body is calm, for long enough: a sliding car would decelerate."""
        s = self.settings
        moving = (fresh & (np.absolute(self._radius * wheel_speed) >= s.still_speed)).any(axis=1)
        unsure = np.sqrt(self._across.filter.spread[:, lateral.YAW_BIAS, lateral.YAW_BIAS])
        calm = present & ~moving & (fresh.sum(axis=1) >= 2) & self._along.calm(ax)
        calm &= np.absolute(turn) < s.still_yaw_rate + 3.0 * unsure
        self.calm = np.where(calm, self.calm + elapsed, 0.0)
        out: BoolArray = self.calm > s.still_time
        return out

    def _forget(self, where: BoolArray) -> None:
        self.screen.forget(where)
        self.calm[where] = 0.0
        self.new |= where
        self.renewed |= where

    def _guard(self, flags: FlagArray, wheel_speed: FloatArray) -> None:
        """An estimate that is lost starts again at the next step, from the wheels; until then it is their mean."""
        if self.renewed.any():
            raise_flag(flags, self.renewed, Flag.RESET)
            self.renewed = np.zeros_like(self.renewed)
        lost = ~(np.absolute(self._along.speed) + np.absolute(self._across.speed) < _FASTEST)
        if lost.any():
            self.start[lost] = np.nan
            self._forget(lost)
            surface = np.clip((self._radius * wheel_speed).mean(axis=1), -0.5 * _FASTEST, 0.5 * _FASTEST)
            self.longitudinal_filter.renew(lost, surface, np.full(lost.size, _WIDEST**2))
            self.lateral_filter.renew(lost, np.zeros(lost.size), np.ones(lost.size))
        for speed in (self.longitudinal_filter, self.lateral_filter):
            unsure = ~(speed.spread[:, 0, 0] < _WIDEST**2)
            if unsure.any():
                speed.renew(unsure, speed.mean[:, 0].copy(), np.full(unsure.size, 0.25 * _WIDEST**2))

    def _reported(
        self,
        seen: Screened,
        direction: tuple[FloatArray, FloatArray],
        wheel: longitudinal.WheelVerdict,
        slipping: BoolArray,
        axle: lateral.AxleVerdict,
        standing: BoolArray,
    ) -> FusionStep:
        """The estimate, mapped back to the corners, in the batch shape; `direction` sine and cosine of the steering."""
        shape = self.batch_shape
        wheels, axles = (*shape, 4), (*shape, 2)
        sine, cosine = direction
        x, y = self.longitudinal_filter.mean, self.lateral_filter.mean
        turn = self._across.yaw_rate(seen.inertial[:, 2])
        spin = turn[:, None]
        forward, left = x[:, :1] - spin * self._y, y[:, :1] + spin * self._x
        along, across = forward * cosine + left * sine, left * cosine - forward * sine
        radius = self._radius * (1.0 + x[:, longitudinal.RADIUS :])
        return FusionStep(
            vx=x[:, 0].copy().reshape(shape),
            vy=y[:, 0].copy().reshape(shape),
            vx_deviation=np.sqrt(self.longitudinal_filter.spread[:, 0, 0]).reshape(shape),
            vy_deviation=np.sqrt(self.lateral_filter.spread[:, 0, 0]).reshape(shape),
            yaw_rate=turn.reshape(shape),
            sensor_bias=np.concatenate(
                [x[:, [longitudinal.BIAS]], y[:, [lateral.BIAS, lateral.YAW_BIAS]]], axis=1
            ).reshape(*shape, 3),
            gravity=np.concatenate([x[:, [longitudinal.GRADE]], y[:, [lateral.BANK]]], axis=1).reshape(axles),
            radius=radius.reshape(wheels),
            slip=slip_ratio(radius * seen.wheel_speed, along).reshape(wheels),
            slip_angle=side_slip_angle(along, across).reshape(wheels),
            innovation=wheel.innovation.reshape(wheels),
            used=wheel.used.reshape(wheels),
            gated=wheel.gated.reshape(wheels),
            high_slip=slipping.reshape(wheels),
            axle_innovation=axle.innovation.reshape(axles),
            axle_used=axle.used.reshape(axles),
            standing=standing.reshape(shape),
            flags=seen.flags.reshape(shape),
            wheel_flags=seen.wheel_flags.reshape(wheels),
        )
