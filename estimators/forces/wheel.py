"""What the wheel equation needs at each corner, and when it says nothing: shared by the longitudinal force observers.

Wheel dynamics, P1 (1), P2 (1), with rolling resistance and bearing friction as options (the papers have c_rr = C_b = 0):

    I_w dw/dt = T - C_b w - R_e (F_x + c_rr F_z sign(w))

F_x along the wheel plane, forward positive; T drive minus brake; w positive forward, so a car in reverse has w < 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, mask, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.faults import Flag, raise_flag
from estimators.memory import Renewable
from estimators.signals import limits
from estimators.signals.held import Held
from estimators.vehicle import VehicleParameters


class WheelForceStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch, corners fl, fr, rl, rr on the last."""

    force: FloatArray  # N, F_x in the wheel plane; always finite
    deviation: FloatArray  # N, standard deviation: of the sensors and of what changes between two samples
    innovation: FloatArray  # see the observer; NaN where nothing was measured
    used: BoolArray  # whether the measurement corrected the force
    stopped: BoolArray  # wheel at rest or locked: the brake holds whatever friction asks, the force is unknown
    unknown: BoolArray  # nothing determines the force (stopped, torque lost, no speed yet): it fades; see `reconcile`
    flags: FlagArray  # MISSING_MEASUREMENT (speed), MISSING_INPUT (torque, acceleration, load), RESET


class WheelSignals(NamedTuple):
    """One sample of the four corners, finite throughout."""

    speed: FloatArray  # rad/s
    torque: FloatArray  # N m, T - R_e c_rr F_z sign(w): what the force and the inertia have to balance
    load: FloatArray  # N
    no_speed: BoolArray  # the speed is missing
    broken: BoolArray  # stopped, or the torque is missing: nothing determines the force
    stopped: BoolArray
    flags: FlagArray
    calm: bool  # nothing is missing, and no wheel stopped


class WheelInputs(Renewable):
    """Holds what is missing, takes off the rolling resistance, and finds the wheels that stand still.

    A wheel below `stopped_below` is stopped, and for one sample more: dw/dt behind a stop spans a time with the wheel
    still held. A missing load is held, from the static one on.

    Args:
        vehicle: radii, wheel inertia, rolling resistance, bearing friction, static loads.
        sample_time: s.
        batch_shape: ends with the four corners.
        stopped_below: rad/s.
        fade_time: s, with which a force that nothing determines any more goes to zero.

    Raises:
        EstimatorError: a shape without corners, a setting that is not positive.
    """

    memory = ("slow", "renewed")
    parts = ("speed", "torque", "load")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        stopped_below: float = 1.0,
        fade_time: float = 0.2,
    ) -> None:
        super().__init__(batch(batch_shape, corners=True))
        self.sample_time = setting(sample_time, "sample_time", "s")
        self.stopped_below = setting(stopped_below, "stopped_below", "rad/s")
        self.fade = math.exp(-self.sample_time / setting(fade_time, "fade_time", "s"))
        self.radius, self.inertia = vehicle.radius, vehicle.wheel_inertia
        self.sensor_gain: FloatArray = np.sqrt(2.0) * self.inertia / (self.radius * self.sample_time)  # N s/rad
        self.friction = vehicle.bearing_friction  # C_b, N m s/rad
        self._resistance = vehicle.radius * vehicle.rolling_resistance
        self._rolls = vehicle.rolling_resistance > 0
        self.speed = Held(self.batch_shape, "wheel_speed", limit=limits.WHEEL_SPEED)
        self.torque = Held(self.batch_shape, "torque", limit=limits.TORQUE)
        self.load = Held(self.batch_shape, "vertical_load", vehicle.static_loads, limits.FORCE)
        self.slow: BoolArray = np.zeros(self.batch_shape, dtype=np.bool_)
        self._any_slow = False
        self._none: BoolArray = np.zeros(self.batch_shape, dtype=np.bool_)
        self._none.flags.writeable = False

    def __call__(
        self, wheel_speed: npt.ArrayLike, torque: npt.ArrayLike, vertical_load: npt.ArrayLike | None
    ) -> WheelSignals:
        """Checks one sample; `vertical_load` None: the last known one, at first the static one.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        speed, no_speed = self.speed(wheel_speed)
        moment, no_torque = self.torque(torque)
        flags: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        if vertical_load is None:
            load = self.load.last
        else:
            load, no_load = self.load(vertical_load)
            if no_load is not None and self._rolls:
                raise_flag(flags, no_load, Flag.MISSING_INPUT)
        if self._rolls:
            moment = moment - self._resistance * load * np.sign(speed)
        slow = np.absolute(speed) < self.stopped_below
        turning = not (self._any_slow or np.count_nonzero(slow))
        if turning and no_speed is None and no_torque is None and not self._any_renewed:
            none = self._none
            return WheelSignals(speed, moment, load, none, none, none, flags, True)
        stopped = slow | self.slow
        self.slow, self._any_slow = slow, bool(slow.any())
        if no_speed is None:
            no_speed = np.zeros(self.batch_shape, dtype=np.bool_)
        else:
            raise_flag(flags, no_speed, Flag.MISSING_MEASUREMENT)
        broken = stopped
        if no_torque is not None:
            raise_flag(flags, no_torque, Flag.MISSING_INPUT)
            broken = stopped | no_torque
        self._flag_renewed(flags)
        return WheelSignals(speed, moment, load, no_speed, broken, stopped, flags, False)

    def forget(self, where: npt.ArrayLike | None) -> BoolArray:
        """Starts the entries `where` afresh and flags RESET at the next step; returns the mask."""
        chosen = mask(where, self.batch_shape, "where")
        for part in (self.speed, self.torque, self.load):
            part.forget(chosen)
        self.slow = self.slow & ~chosen
        self._renew(chosen)
        return chosen

    def _recall(self) -> None:
        super()._recall()
        self._any_slow = bool(self.slow.any())
