"""The papers' observers at every corner, and the velocity of the car that they agree on: P1 sections 5 to 7."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.errors import EstimatorError
from estimators.faults import FlagArray
from estimators.interpolate import FloatArray
from estimators.schedule import GainSchedule
from estimators.signals import FilteredDerivative
from estimators.signals.checks import batch, bounded, entries, mask
from estimators.signals.memory import Memory
from estimators.vehicle import VehicleParameters
from estimators.velocity.corners import CornerVectors, corner_acceleration, corner_velocity, tire_frame, vehicle_frame
from estimators.velocity.lpv import LpvVelocityObserver
from estimators.velocity.mapping import SlipWeights, to_centre
from estimators.velocity.slip import side_slip_angle, slip_ratio


class CornerSetStep(NamedTuple):
    """Leading axes `...` are those of the batch."""

    vx: FloatArray  # (...) m/s at the centre of gravity
    vy: FloatArray  # (...) m/s
    corner_vx: FloatArray  # (..., 4) V_x as each corner alone sees it; NaN where its wheel speed is missing
    corner_vy: FloatArray  # (..., 4) likewise V_y
    relative_velocity: FloatArray  # (..., 4) R_e w - v_xt, m/s
    innovation: FloatArray  # (..., 4) of the normalised F_x; NaN where missing
    used: npt.NDArray[np.bool_]  # (..., 4)
    flags: FlagArray  # (..., 4), longitudinal and lateral together


class CornerObservers(Memory):
    """A longitudinal observer at every corner, a lateral one where a schedule is given, and their mapping to the car.

    u_x = R_e w' - v_xt', u_y = -v_yt' with the velocities of the last step in the accelerations, P1 section 6. Without a
    lateral schedule V_y is what `step` is told. Axles are weighed by slip (`SlipWeights`), or equally.

    Args:
        vehicle: radii and lever arms.
        longitudinal: gain schedule.
        lateral: gain schedule, or None.
        batch_shape: () for one car; its corners are a last axis.
        weights: of the axles; None: a half each.
        lag: s, of the derivatives of wheel speeds, steering and yaw rate.

    Raises:
        EstimatorError: schedules for different sample times, or as `LpvVelocityObserver`.
    """

    memory = ("vx", "vy", "slip", "angle")
    unknowns = ("raw", "measurement", "reading", "vx")  # the first two are of the observers' screens

    def __init__(
        self,
        vehicle: VehicleParameters,
        longitudinal: GainSchedule,
        lateral: GainSchedule | None = None,
        batch_shape: tuple[int, ...] = (),
        weights: SlipWeights | None = None,
        lag: float = 0.01,
    ) -> None:
        self.vehicle, self.batch_shape, self.weights = vehicle, batch(batch_shape), weights
        if lateral is not None and abs(lateral.sample_time - longitudinal.sample_time) > 1e-9:
            raise EstimatorError(
                f"schedules '{longitudinal.name}' and '{lateral.name}' are for sample times "
                f"{longitudinal.sample_time:g} s and {lateral.sample_time:g} s; design both for one"
            )
        self.sample_time, four = longitudinal.sample_time, (*self.batch_shape, 4)
        self.along = LpvVelocityObserver(longitudinal, four)
        self.across = LpvVelocityObserver(lateral, four) if lateral is not None else None
        self.slope = FilteredDerivative(self.sample_time, lag, (*self.batch_shape, 9))
        self.parts: tuple[str, ...] = ("along", "slope") if lateral is None else ("along", "across", "slope")
        self.vx: FloatArray = np.full(self.batch_shape, np.nan)
        self.vy: FloatArray = np.zeros(self.batch_shape)
        self.slip: FloatArray = np.zeros(four)
        self.angle: FloatArray = np.zeros(four)

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
    ) -> CornerSetStep:
        """One sample: rad/s, rad (..., 4); m/s^2, m/s^2, rad/s (...); F_x/F_z and F_y/F_z (..., 4), NaN where unknown.

        `vy` (...) m/s serves where there is no lateral schedule.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        shape, four = self.batch_shape, (*self.batch_shape, 4)
        w, turned = entries(wheel_speed, four, "wheel_speed"), entries(steer, four, "steer")
        raw = np.concatenate([w, turned, entries(yaw_rate, shape, "yaw_rate")[..., None]], axis=-1)
        rate = self.slope.step(raw)
        angle, turn = rate.value[..., 4:8], rate.value[..., 8]
        surface = self.vehicle.radius * rate.value[..., :4]
        start = np.isnan(self.vx)
        vx = np.where(start, surface.mean(axis=-1), self.vx) if start.any() else self.vx
        left = self.vy if self.across is not None else entries(vy, shape, "vy")
        a, b = (np.where(bounded(v), v, 0.0) for v in (entries(ax, shape, "ax"), entries(ay, shape, "ay")))
        pull = corner_acceleration(
            self.vehicle, a, b, turn, rate.derivative[..., 8], vx, left, angle, rate.derivative[..., 4:8]
        )
        mu_x, mu_y = entries(longitudinal_use, four, "longitudinal_use"), entries(lateral_use, four, "lateral_use")
        found = self.along.step(self.vehicle.radius * rate.derivative[..., :4] - pull.x, mu_x, w)
        missing = ~bounded(w)
        relative, flags = found.estimate[..., 1], found.flags
        forward = np.where(missing, np.nan, surface - relative)
        if self.across is not None:
            side = self.across.step(-pull.y, mu_y, w)
            beside = -side.estimate[..., 1]
            flags = flags | side.flags
        else:
            beside = tire_frame(corner_velocity(self.vehicle, vx, left, turn), angle).y
        corner = vehicle_frame(CornerVectors(forward, beside), angle)
        share = self._weights()
        centre = to_centre(self.vehicle, corner, turn, *share)
        self.vx = np.where(np.isfinite(centre.vx), centre.vx, vx)
        self.vy = np.where(np.isfinite(centre.vy), centre.vy, left)
        self.slip = np.where(missing, 0.0, slip_ratio(surface, np.where(missing, 0.0, forward)))
        self.angle = side_slip_angle(np.where(missing, 0.0, forward), beside)
        spin = turn[..., None]
        own_x, own_y = corner.x + spin * self.vehicle.corner_y, corner.y - spin * self.vehicle.corner_x
        return CornerSetStep(
            self.vx.copy(), self.vy.copy(), own_x, own_y, relative, found.innovation, found.used, flags
        )

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh, without relative velocity."""
        chosen = mask(where, self.batch_shape, "where")
        corners = np.repeat(chosen[..., None], 4, axis=-1)
        for observer in (self.along, self.across):
            if observer is not None:
                observer.reset(corners)
        self.slope.reset(np.repeat(chosen[..., None], 9, axis=-1))
        self.vx, self.vy = np.where(chosen, np.nan, self.vx), np.where(chosen, 0.0, self.vy)
        self.slip, self.angle = np.where(corners, 0.0, self.slip), np.where(corners, 0.0, self.angle)

    def _weights(self) -> tuple[Any, Any]:
        if self.weights is None:
            return 0.5, 0.5
        return self.weights.front(self.slip), self.weights.front(self.angle)
