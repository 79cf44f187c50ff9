"""The papers' observers at every corner, and the velocity of the car that they agree on: P1 notes 5 to 7."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, entries, mask
from estimators.arithmetic import Number, Signals, arithmetic
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.memory import Memory
from estimators.pipeline.corner_kinds import CornerKind, CornerSample, ScheduledCorners
from estimators.schedule import GainSchedule
from estimators.signals import FilteredDerivative, limits
from estimators.vehicle import VehicleParameters
from estimators.velocity.corners import CornerVectors, at_wheel, rotated, tire_motion, vehicle_frame
from estimators.velocity.mapping import SlipWeights, weighed
from estimators.velocity.slip import slips
from estimators.velocity.suspension import SuspensionCompliance, SuspensionParameters

_MOST = np.array([limits.WHEEL_SPEED] * 4 + [limits.ANGLE] * 4 + [limits.YAW_RATE])


class CornerSetStep(NamedTuple):
    """Leading axes `...` are those of the batch."""

    vx: FloatArray  # (...) m/s at the centre of gravity
    vy: FloatArray  # (...) m/s
    corner_vx: FloatArray  # (..., 4) V_x as each corner alone sees it; NaN where its wheel speed is missing
    corner_vy: FloatArray  # (..., 4) likewise V_y
    relative_velocity: FloatArray  # (..., 4) R_e w - v_xt, m/s
    innovation: FloatArray  # (..., 4) of the normalised F_x; NaN where missing
    used: BoolArray  # (..., 4)
    flags: FlagArray  # (..., 4), longitudinal and lateral together
    high_slip: BoolArray  # (..., 4) whether the longitudinal observer took the wheel for one that slips much
    suspension_velocity: (
        FloatArray  # (..., 4, 2) psi' of the wheels against the body, m/s, body frame; zero on rigid ones
    )


class CornerObservers(Memory):
    """A longitudinal observer at every corner, a lateral one where one is given, and their mapping to the car.

    u_x = R_e w' - v_xt', u_y = -v_yt' with the velocities of the last step in the accelerations, P1 notes 6. Without a
    lateral observer V_y is what `step` is given. Axles are weighed by slip (`SlipWeights`), or equally. One car runs on
    plain numbers, several on arrays, by the same formulas (`arithmetic`). What no car measures (`signals.limits`) is missing;
    a missing steering angle or yaw rate is held and flagged MISSING_INPUT at the corners concerned, a missing
    acceleration counts as zero.

    With `suspension`, slips (the ones by which axles are weighed and gains switched) are those of the wheel centres, which
    move against the body, V_xc = Vbar_xc + psi_x', P3 (14)-(15); the centre of gravity does not (P3 notes 9 item 11).

    Args:
        vehicle: radii and lever arms.
        longitudinal: a gain schedule, or one of `corner_kinds`.
        lateral: likewise, or None.
        batch_shape: () for one car; its corners are a last axis.
        weights: of the axles; None: a half each.
        lag: s, of the derivatives of wheel speeds, steering and yaw rate.

    Raises:
        EstimatorError: observers for different sample times or for another batch, or as `ScheduledCorners`.

    >>> import numpy as np
    >>> schedule = GainSchedule.shipped("corner-estimation-longitudinal")
    >>> corners = CornerObservers(VehicleParameters.published_suv(), longitudinal=schedule)
    >>> step = corners.step(np.full(4, 60.0), 0.0, 0.0, 0.0, 0.0, np.ones(4), np.ones(4))
    >>> bool(15.0 < step.vx < 25.0)  # m/s
    True
    """

    memory = ("vx", "vy", "slip", "angle")
    unknowns = ("reading", "vx")

    def __init__(
        self,
        vehicle: VehicleParameters,
        longitudinal: GainSchedule | CornerKind,
        lateral: GainSchedule | CornerKind | None = None,
        batch_shape: tuple[int, ...] = (),
        weights: SlipWeights | None = None,
        lag: float = 0.01,
        suspension: SuspensionParameters | None = None,
    ) -> None:
        self.vehicle, self.batch_shape, self.weights = vehicle, batch(batch_shape), weights
        self.along = self._observer(longitudinal)
        self.sample_time = self.along.sample_time
        self.across = None if lateral is None else self._observer(lateral)
        if self.across is not None and abs(self.across.sample_time - self.sample_time) > 1e-9:
            raise EstimatorError(
                f"the longitudinal and the lateral observer are for sample times {self.sample_time:g} s and "
                f"{self.across.sample_time:g} s; design both for one"
            )
        self.suspension: SuspensionCompliance | None = None
        if suspension is not None:
            self.suspension = SuspensionCompliance(suspension, self.sample_time, self.batch_shape)
        self.uses_forces = suspension is not None  # the pipeline gives F_x and F_y of the tires as `forces`
        self._rigid = np.zeros((*self.batch_shape, 4, 2))
        self._rigid.flags.writeable = False
        self._uses_slip = self.along.uses_slip or (self.across is not None and self.across.uses_slip)
        self._no_slip = np.zeros((*self.batch_shape, 4))
        self.slope = FilteredDerivative(self.sample_time, lag, (*self.batch_shape, 9))
        self.parts: tuple[str, ...] = ("along", "across", "slope", "suspension")  # without what is None
        self._count = math.prod(self.batch_shape)
        self._kit = kit = arithmetic((self._count,))
        lever_x, lever_y = vehicle.corner_x.tolist(), vehicle.corner_y.tolist()
        self._wheels = kit.signals(vehicle.radii), kit.signals(lever_x), kit.signals(lever_y)
        self.vx: Number = kit.full(math.nan)
        self.vy: Number = kit.full(0.0)
        nothing = kit.stacked([kit.full(0.0)] * 4)
        self.slip: Signals = nothing  # slips and angles of the last sample, where somebody asks for them
        self.angle: Signals = nothing

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        steer: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        longitudinal_use: npt.ArrayLike,
        lateral_use: npt.ArrayLike,
        vy: npt.ArrayLike = 0.0,
        forces: tuple[npt.ArrayLike, npt.ArrayLike] = (math.nan, math.nan),
    ) -> CornerSetStep:
        """One sample: rad/s, rad (..., 4); m/s^2, m/s^2, rad/s (...); F_x/F_z and F_y/F_z (..., 4), NaN where unknown.

        `vy` (...) m/s serves where there is no lateral observer, `forces` F_x, F_y (..., 4) N in the tire frame where the
        suspension is compliant.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        kit, shape, choose = self._kit, self.batch_shape, self._kit.where
        four, radius, *levers = (*shape, 4), *self._wheels
        w = entries(wheel_speed, four, "wheel_speed")
        speed, angles = kit.rows(w, 4), kit.wheels(steer, shape, "steer")
        raw = kit.table((speed, angles, (kit.car(yaw_rate, shape, "yaw_rate"),)), shape)
        good = np.absolute(raw) <= _MOST  # False for NaN
        calm = np.count_nonzero(good) == good.size
        if not calm:
            raw = np.where(good, raw, math.nan)
            w = raw[..., :4]
            speed = kit.rows(w, 4)
        rate = self.slope.step(raw)
        held, slope = kit.rows(rate.value, 9), kit.rows(rate.derivative, 9)
        turn, yaw_acceleration = held[8], slope[8]
        left = self.vy if self.across is not None else kit.car(vy, shape, "vy")
        vx = self._started(held)
        given = kit.car(ax, shape, "ax"), kit.car(ay, shape, "ay")
        own_x, own_y = (choose(abs(value) <= limits.ACCELERATION, value, 0.0) for value in given)
        forward, leftward = own_x + turn * left, own_y - turn * vx

        def driven(
            w: Number, angle: Number, w_slope: Number, swivel: Number, R: float, x: float, y: float
        ) -> tuple[Number, ...]:
            """Sine and cosine of the steering, v_yt, and the inputs of both observers (`corner_acceleration`)."""
            sine, cosine = kit.sin(angle), kit.cos(angle)
            velocity = at_wheel(vx, left, turn, x, y)
            acceleration = at_wheel(forward, leftward, yaw_acceleration, x, y)
            _, beside, pull_x, pull_y = tire_motion(velocity, acceleration, sine, cosine, swivel)
            return sine, cosine, beside, R * w_slope - pull_x, -pull_y

        sine, cosine, beside, push_x, push_y = kit.each(
            driven, held[:4], held[4:8], slope[:4], slope[4:8], radius, *levers
        )
        rest = (
            *(w, rate.derivative[..., :4]),
            kit.table((self.slip,), shape) if self._uses_slip else self._no_slip,
            *(ax, ay),
        )
        use = entries(longitudinal_use, four, "longitudinal_use")
        along = self.along.step(CornerSample(kit.table((push_x,), shape), use, *rest))
        relative, flags = along.relative_velocity, along.flags
        if self.across is not None:
            use = entries(lateral_use, four, "lateral_use")
            side = self.across.step(CornerSample(kit.table((push_y,), shape), use, *rest))
            beside, flags = kit.rows(-side.relative_velocity, 4), flags | side.flags

        def placed(
            given: Number,
            w: Number,
            slip_speed: Number,
            beside: Number,
            sine: Number,
            cosine: Number,
            R: float,
            x: float,
            y: float,
        ) -> tuple[Number, ...]:
            """V_x, V_y of the centre of gravity as the corner sees them, and v_xt, NaN without a wheel speed."""
            ahead = choose(abs(given) < math.inf, R * w - slip_speed, math.nan)
            return *at_wheel(*rotated(ahead, beside, -sine, cosine), -turn, x, y), ahead

        seen_x, seen_y, ahead = kit.each(
            placed, speed, held[:4], kit.rows(relative, 4), beside, sine, cosine, radius, *levers
        )
        share_x, share_y = self._shares()
        found_x, found_y = weighed(kit, seen_x, share_x)[0], weighed(kit, seen_y, share_y)[0]
        self.vx, self.vy = choose(kit.known(found_x), found_x, vx), choose(kit.known(found_y), found_y, left)
        wheels = self._compliant(steer, forces)
        self._remember(held[:4], ahead, beside, sine, cosine, wheels)
        outputs = kit.table(((self.vx, self.vy), seen_x, seen_y), shape)
        if not calm:
            no_angle = np.logical_not(good[..., 4:8] & good[..., 8:])
            flags = flags | np.where(no_angle, np.int32(Flag.MISSING_INPUT), np.int32(0))
        corners = outputs[..., 2:6], outputs[..., 6:], relative, along.innovation, along.used
        return CornerSetStep(outputs[..., 0], outputs[..., 1], *corners, flags, along.high_slip, wheels)

    def reset(self, where: npt.ArrayLike | None = None, vx: npt.ArrayLike = math.nan, vy: npt.ArrayLike = 0.0) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh, without relative velocity.

        `vx`, `vy` (...) m/s; NaN for `vx`: the mean surface speed of the wheels at the next step.

        Raises:
            EstimatorError: a mask or speeds of another shape.
        """
        chosen = mask(where, self.batch_shape, "where")
        corners = np.repeat(chosen[..., None], 4, axis=-1)
        for observer in (self.along, self.across):
            if observer is not None:
                observer.reset(corners)
        self.slope.reset(np.repeat(chosen[..., None], 9, axis=-1))
        if self.suspension is not None:
            self.suspension.reset(chosen)
        kit, here = self._kit, self._kit.rows(chosen, 1)[0]
        start = kit.car(vx, self.batch_shape, "vx"), kit.car(vy, self.batch_shape, "vy")
        self.vx, self.vy = kit.where(here, start[0], self.vx), kit.where(here, start[1], self.vy)
        self.slip, self.angle = kit.each(
            lambda slip, angle: (kit.where(here, 0.0, slip), kit.where(here, 0.0, angle)), self.slip, self.angle
        )

    def _compliant(self, steer: npt.ArrayLike, forces: tuple[npt.ArrayLike, npt.ArrayLike]) -> FloatArray:
        """psi' (..., 4, 2), m/s, from the forces of the tires turned into the body frame; a missing one is held."""
        if self.suspension is None:
            return self._rigid
        four = (*self.batch_shape, 4)
        tires = CornerVectors(*(entries(value, four, "forces") for value in forces))
        body = vehicle_frame(tires, entries(steer, four, "steer"))
        return self.suspension.step(body.x, body.y).velocity

    def _remember(
        self, speed: Signals, ahead: Signals, beside: Signals, sine: Signals, cosine: Signals, wheels: FloatArray
    ) -> None:
        """Slips and slip angles for the next sample, if somebody asks for them; `wheels` are psi'."""
        if self.weights is None and not self._uses_slip:
            return
        if self.suspension is not None:
            psi = (self._kit.rows(wheels[..., k], 4) for k in (0, 1))
            ahead, beside = self._kit.each(_at_wheel, ahead, beside, *psi, sine, cosine)
        self.slip, self.angle = self._kit.each(self._slips, speed, ahead, beside, self._wheels[0])

    def _observer(self, given: GainSchedule | CornerKind) -> CornerKind:
        """A schedule becomes its observer; one that is given must fit."""
        four = (*self.batch_shape, 4)
        if isinstance(given, GainSchedule):
            return ScheduledCorners(given, four)
        if given.batch_shape != four:
            raise EstimatorError(f"corner observer has batch_shape {given.batch_shape}, expected {four}")
        return given

    def _started(self, wheel_speed: Signals) -> Number:
        """V_x of the last sample, m/s; the mean of the wheels' surface speeds at the first one."""
        known = self._kit.known(self.vx)
        if not self._kit.some(self._kit.no(known)):
            return self.vx
        (surface,) = self._kit.each(lambda w, R: (R * w,), wheel_speed[:4], self._wheels[0])
        return self._kit.where(known, self.vx, sum(surface) / 4.0)

    def _shares(self) -> tuple[Number, Number]:
        """W_f along and across, by the slips and slip angles of the last sample."""
        if self.weights is None:
            return 0.5, 0.5
        sums = ((abs(v[0]) + abs(v[1]), abs(v[2]) + abs(v[3])) for v in (self.slip, self.angle))
        along, across = (self.weights.of_axles(self._kit, *axles) for axles in sums)
        return along, across

    def _slips(self, w: Number, ahead: Number, beside: Number, radius: float) -> tuple[Number, Number]:
        """Slip ratio and slip angle of a corner; no slip, and the car not moving, without a wheel speed."""
        known = self._kit.known(ahead)
        ahead = self._kit.where(known, ahead, 0.0)
        slip, angle = slips(self._kit, radius * w, ahead, beside)
        return self._kit.where(known, slip, 0.0), angle


def _at_wheel(
    ahead: Number, beside: Number, along: Number, across: Number, sine: Number, cosine: Number
) -> tuple[Number, Number]:
    """Velocity of a wheel centre in the tire frame: that of the body there and psi' of the body frame, P3 (15)."""
    more_x, more_y = rotated(along, across, sine, cosine)
    return ahead + more_x, beside + more_y
