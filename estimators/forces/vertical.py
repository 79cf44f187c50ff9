"""Vertical wheel loads from the accelerations of the body: P1 (14)-(17), P2 (13)-(14), P3 (26)-(27), one model.

IMU convention (ISO, x forward, y left, z up): the accelerometers read specific force, a_z = +g at rest. Pitch is positive
nose up, roll positive left side up (leaning right), so a body tilted at rest reads a_x = g sin(pitch), a_y = g sin(roll)
as in P1 (11). Levelling must take that off, P1 section 11: the signs of (14) and (16) are turned here.

Angles are those of the body against the road; on a slope the road frame keeps its share of gravity, and that loads the
lower wheels, as it should. Left out: unsprung masses, aerodynamic lift, the stiffness of springs and bars (each axle
takes the lateral transfer of its own mass share), anti-dive.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from estimators.arguments import any_missing, batch, mask, number, pair
from estimators.faults import BoolArray, Flag, FlagArray, raise_flag
from estimators.forces.body_response import PITCH, ROLL, BodyResponse
from estimators.interpolate import FloatArray
from estimators.memory import Renewable
from estimators.signals import limits
from estimators.signals.held import Held
from estimators.vehicle import GRAVITY, VehicleParameters

LEAST_GRAVITY = 0.1 * GRAVITY
"""m/s^2: below this vertical specific force the car flies, and lateral transfer no longer has the meaning of (17)."""

Number = TypeVar("Number", float, FloatArray)


class LoadStep(NamedTuple):
    """What one step returns; leading axes are those of the batch."""

    load: FloatArray  # (..., 4) N, never negative
    lifted: BoolArray  # (..., 4) the model asked for a load below zero: 0, and the other wheel of the axle carries it
    flags: FlagArray  # (...) MISSING_MEASUREMENT: an acceleration was held; MISSING_INPUT: an angle was; RESET


def levelled(
    ax: FloatArray, ay: FloatArray, az: FloatArray, pitch: FloatArray, roll: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Specific force in the road frame, P1 (14), (16) with turned signs: pitch first, then roll.

    a_x' = a_x cos(pitch) - a_z sin(pitch), a_z' = a_z cos(pitch) + a_x sin(pitch); the same with a_y, a_z' and roll.
    """
    return _levelled(ax, ay, az, np.sin(pitch), np.cos(pitch), np.sin(roll), np.cos(roll))


def _levelled(
    ax: Number, ay: Number, az: Number, sin_p: Number, cos_p: Number, sin_r: Number, cos_r: Number
) -> tuple[Number, Number, Number]:
    """`levelled` of numbers or of arrays, from the sines and cosines of pitch and roll."""
    up = az * cos_p + ax * sin_p
    return ax * cos_p - az * sin_p, ay * cos_r - up * sin_r, up * cos_r + ay * sin_r


def vertical_loads(
    vehicle: VehicleParameters,
    ax: FloatArray | float,
    ay: FloatArray | float,
    az: FloatArray | float = GRAVITY,
    pitch: FloatArray | float = 0.0,
    roll: FloatArray | float = 0.0,
) -> FloatArray:
    """Quasi-static wheel loads (..., 4), N, from (...) accelerations of the body (m/s^2) and its angles (rad).

        F_zf = m (L_r a_z - h a_x)/L,  F_zr = m (L_f a_z + h a_x)/L
        F_z,iL = F_zi (1/2 - h_rc sin(roll)/T_i) - (F_zi/a_z) a_y h/T_i,  F_z,iR with the other signs.

    The axle's mass is m_i = F_zi/a_z, where the papers write F_zi/g: on a bump a_z would enter squared. Then the loads
    sum to m a_z whatever the rest. h_rc as lever is the papers'; physically it is the roll arm h_CG - h_rc (P1 section
    11): give that as `roll_center_height` if you prefer it. Nothing is limited here: loads may come out negative.
    """
    given = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (ax, ay, az, pitch, roll)))
    a_x, a_y, a_z = levelled(*given)
    lean = vehicle.roll_center_height * np.sin(given[4]) + vehicle.cg_height * a_y / np.maximum(a_z, LEAST_GRAVITY)
    return _Transfer(vehicle)(a_x, lean, a_z)


class _Transfer:
    """Loads from road-frame accelerations and the lateral shift `lean` of the centre of pressure, m."""

    def __init__(self, vehicle: VehicleParameters) -> None:
        mass, base = vehicle.mass, vehicle.wheelbase
        front, rear = mass / base * vehicle.rear_axle_distance, mass / base * vehicle.front_axle_distance
        self.up = np.array([front, front, rear, rear])
        self.along = mass / base * vehicle.cg_height * np.array([-1.0, -1.0, 1.0, 1.0])
        tracks = np.array([vehicle.front_track, vehicle.front_track, vehicle.rear_track, vehicle.rear_track])
        self.across = np.array([-1.0, 1.0, -1.0, 1.0]) / tracks

        self._wheels = list(zip(self.up.tolist(), self.along.tolist(), self.across.tolist(), strict=True))

    def __call__(self, ax: FloatArray, lean: FloatArray, az: FloatArray) -> FloatArray:
        load: FloatArray = self.up * az[..., None] + self.along * ax[..., None]
        load *= 0.5 + self.across * lean[..., None]
        return load

    def of(self, ax: float, lean: float, az: float) -> list[float]:
        """The same of one car's numbers."""
        return [(up * az + along * ax) * (0.5 + across * lean) for up, along, across in self._wheels]


def without_negative(load: FloatArray) -> FloatArray:
    """Loads (..., 4) with lifted wheels at zero: their axle's other wheel, then the other axle, takes over; same sum.

    A total below zero (in flight) leaves all four at zero.
    """
    axles = load[..., 0] + load[..., 1], load[..., 2] + load[..., 3]
    total = np.maximum(axles[0] + axles[1], 0.0)
    front = np.clip(axles[0], 0.0, total)
    fl, rl = np.clip(load[..., 0], 0.0, front), np.clip(load[..., 2], 0.0, total - front)
    return np.stack((fl, front - fl, rl, total - front - rl), axis=-1)


class VerticalLoads(Renewable):
    """`vertical_loads` sample by sample: missing signals held, lifted wheels at zero, the body's own dynamics.

    Args:
        vehicle: mass and lengths.
        sample_time: s.
        batch_shape: one entry a car; () for one.
        dynamic: whether the transfer follows the body (`BodyResponse`) or comes at once, as in the papers.
        pitch, roll: frequency (Hz) and damping of the body.

    Raises:
        EstimatorError: a setting that is not positive.
    """

    parts = ("along", "up", "angles", "response")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        dynamic: bool = True,
        pitch: tuple[float, float] = PITCH,
        roll: tuple[float, float] = ROLL,
    ) -> None:
        super().__init__(batch(batch_shape))
        self.vehicle, self.dynamic = vehicle, dynamic
        self.response = BodyResponse(sample_time, self.batch_shape, (pitch, roll))
        self.along = Held((*self.batch_shape, 2), "ax and ay", limit=limits.ACCELERATION)
        self.up = Held(self.batch_shape, "az", GRAVITY, limits.ACCELERATION)
        self.angles = Held((*self.batch_shape, 2), "pitch and roll", limit=limits.ANGLE)
        self._transfer = _Transfer(vehicle)
        self._level = np.full(self.batch_shape, GRAVITY)
        self._nowhere: BoolArray = np.zeros((*self.batch_shape, 4), dtype=np.bool_)
        self._single = math.prod(self.batch_shape) == 1

    def step(
        self,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        az: npt.ArrayLike | None = None,
        pitch: npt.ArrayLike | None = None,
        roll: npt.ArrayLike | None = None,
    ) -> LoadStep:
        """Takes one sample of the batch shape: specific forces of the body, m/s^2, and its angles to the road, rad.

        a_z None is g; an angle None is 0.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        shape = self.batch_shape
        flags: FlagArray = np.zeros(shape, dtype=np.int32)
        if self._single and not self._any_renewed:
            calm = self._calm(ax, ay, az, pitch, roll)
            if calm is not None:
                load = np.array(calm).reshape(*shape, 4)
                return LoadStep(load, self._nowhere.copy(), flags) if min(calm) >= 0.0 else self._limited(load, flags)
        both, missing = self.along(pair(ax, ay, shape, "ax", "ay"))
        if missing is not None:
            raise_flag(flags, any_missing(missing, shape), Flag.MISSING_MEASUREMENT)
        a_z = self._level
        if az is not None:
            a_z, lost = self.up(az)
            if lost is not None:
                raise_flag(flags, lost, Flag.MISSING_MEASUREMENT)
        sway: FloatArray | None = None
        if pitch is not None or roll is not None:
            zero = 0.0
            angles, missing = self.angles(pair(zero if pitch is None else pitch, zero if roll is None else roll, shape))
            if missing is not None:
                raise_flag(flags, any_missing(missing, shape), Flag.MISSING_INPUT)
            a_x, a_y, a_z = levelled(both[..., 0], both[..., 1], a_z, angles[..., 0], angles[..., 1])
            both = np.stack((a_x, a_y), axis=-1)
            sway = self.vehicle.roll_center_height * np.sin(angles[..., 1])
        self._flag_renewed(flags)
        if self.dynamic:
            both = self.response.step(both)
        lean = self.vehicle.cg_height * both[..., 1] / np.maximum(a_z, LEAST_GRAVITY)
        return self._limited(self._transfer(both[..., 0], lean if sway is None else lean + sway, a_z), flags)

    def _calm(
        self,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        az: npt.ArrayLike | None,
        pitch: npt.ArrayLike | None,
        roll: npt.ArrayLike | None,
    ) -> list[float] | None:
        """The loads of one car, in plain numbers and not limited; None where something is missing."""
        shape = self.batch_shape
        along, across = number(ax, shape, "ax"), number(ay, shape, "ay")
        up = GRAVITY if az is None else number(az, shape, "az")
        nose, lean = (0.0 if angle is None else number(angle, shape, "angle") for angle in (pitch, roll))
        if not (abs(along) + abs(across) + abs(up) <= limits.ACCELERATION and abs(nose) + abs(lean) <= limits.ANGLE):
            return None
        self.along.last = np.array((along, across)).reshape(*shape, 2)
        if az is not None:
            self.up.last = np.full(shape, up)
        if pitch is not None or roll is not None:
            self.angles.last = np.array((nose, lean)).reshape(*shape, 2)
        sine = math.sin(lean)
        along, across, up = _levelled(along, across, up, math.sin(nose), math.cos(nose), sine, math.cos(lean))
        if self.dynamic:
            along, across = self.response.one([along, across])
        shift = self.vehicle.cg_height * across / max(up, LEAST_GRAVITY) + self.vehicle.roll_center_height * sine
        return self._transfer.of(along, shift, up)

    def _limited(self, load: FloatArray, flags: FlagArray) -> LoadStep:
        if np.minimum.reduce(load, None) >= 0.0:
            return LoadStep(load, self._nowhere.copy(), flags)
        return LoadStep(without_negative(load), load < 0.0, flags)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh; flagged RESET at the next step."""
        chosen = mask(where, self.batch_shape, "where")
        self.along.forget(chosen[..., None])
        self.up.forget(chosen)
        self.angles.forget(chosen[..., None])
        self.response.reset(chosen)
        self._renew(chosen)
