"""Vertical wheel loads from the accelerations of the body: P1 (14)-(17), P2 (13)-(14), P3 (26)-(27), one model.

IMU convention (ISO, x forward, y left, z up): the accelerometers read specific force, a_z = +g at rest. Pitch is positive
nose up, roll positive left side up (leaning right), so a body tilted at rest reads a_x = g sin(pitch), a_y = g sin(roll)
as in P1 (11). Levelling must take that off, P1 notes 11: the signs of (14) and (16) are turned here.

Angles are those of the body against the road; on a slope the road frame keeps its share of gravity, and that loads the
lower wheels, as it should. Left out: unsprung masses, aerodynamic lift, the stiffness of springs and bars (each axle
takes the lateral transfer of its own mass share), anti-dive.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, mask
from estimators.arithmetic import Arithmetic, ManyCars, Number, Signals, arithmetic
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.faults import Flag
from estimators.forces.body_response import PITCH, ROLL, BodyResponse
from estimators.memory import Renewable
from estimators.signals import limits
from estimators.vehicle import GRAVITY, VehicleParameters

LEAST_GRAVITY = 0.1 * GRAVITY
"""m/s^2: below this vertical specific force the car flies, and lateral transfer no longer has the meaning of (17)."""


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
    return _levelled(ManyCars(np.shape(ax)), ax, ay, az, pitch, roll)


def _levelled(
    kit: Arithmetic, ax: Number, ay: Number, az: Number, pitch: Number, roll: Number
) -> tuple[Number, Number, Number]:
    sine, cosine, sin_r, cos_r = kit.sin(pitch), kit.cos(pitch), kit.sin(roll), kit.cos(roll)
    up = az * cosine + ax * sine
    return ax * cosine - az * sine, ay * cos_r - up * sin_r, up * cos_r + ay * sin_r


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
    sum to m a_z whatever the rest. h_rc as lever is the papers'; physically it is the roll arm h_CG - h_rc (P1 notes 11):
    give that as `roll_center_height` if you prefer it. Nothing is limited here: loads may come out negative.
    """
    given = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (ax, ay, az, pitch, roll)))
    a_x, a_y, a_z = levelled(*given)
    lean = vehicle.roll_center_height * np.sin(given[4]) + vehicle.cg_height * a_y / np.maximum(a_z, LEAST_GRAVITY)
    return np.stack(_transferred(_wheels(vehicle), a_x, lean, a_z), axis=-1)


def _wheels(vehicle: VehicleParameters) -> list[tuple[float, float, float]]:
    """Of each wheel: share of m a_z, N per m/s^2 of a_x, and +-1/T."""
    mass, base = vehicle.mass, vehicle.wheelbase
    front, rear = mass / base * vehicle.rear_axle_distance, mass / base * vehicle.front_axle_distance
    along = mass / base * vehicle.cg_height
    ahead, behind = 1.0 / vehicle.front_track, 1.0 / vehicle.rear_track
    return [(front, -along, -ahead), (front, -along, ahead), (rear, along, -behind), (rear, along, behind)]


def _transferred(wheels: list[tuple[float, float, float]], ax: Number, lean: Number, az: Number) -> list[Number]:
    """Loads from road-frame accelerations and the lateral shift `lean` of the centre of pressure, m."""
    return [(up * az + along * ax) * (0.5 + across * lean) for up, along, across in wheels]


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

    >>> loads = VerticalLoads(VehicleParameters.published_suv(), sample_time=0.005, dynamic=False)
    >>> step = loads.step(ax=3.0, ay=0.0)
    >>> bool(step.load[:2].sum() < step.load[2:].sum())  # the car squats
    True
    """

    memory = ("felt", "angles", "renewed")
    parts = ("response",)

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
        self._sample_time, self._modes = sample_time, (pitch, roll)
        self.response = BodyResponse(sample_time, self.batch_shape, self._modes)
        self._wheels, self._kit = _wheels(vehicle), arithmetic(self.batch_shape)
        self.felt: Signals = self._at_rest()  # the last known a_x, a_y, a_z
        self.angles: Signals = self._kit.stacked([self._kit.full(0.0)] * 2)  # and pitch, roll
        self._nowhere: BoolArray = np.zeros((*self.batch_shape, 4), dtype=np.bool_)

    def like(self, batch_shape: tuple[int, ...]) -> VerticalLoads:
        """The same for another batch, as new."""
        return VerticalLoads(self.vehicle, self._sample_time, batch_shape, self.dynamic, *self._modes)

    def _at_rest(self) -> Signals:
        return self._kit.stacked([self._kit.full(value) for value in (0.0, 0.0, GRAVITY)])

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
        shape, kit = self.batch_shape, self._kit
        given = (ax, ay) if az is None else (ax, ay, az)
        felt, lost = self._held(given, ("ax", "ay", "az"), self.felt, limits.ACCELERATION)
        self.felt = kit.stacked([*felt, *self.felt[len(felt) :]])
        reasons = kit.where(lost, int(Flag.MISSING_MEASUREMENT), 0)
        along, across, up = (*felt, kit.full(GRAVITY))[:3]
        sway: Number = 0.0
        if pitch is not None or roll is not None:
            given = (0.0 if pitch is None else pitch, 0.0 if roll is None else roll)
            angles, lost = self._held(given, ("pitch", "roll"), self.angles, limits.ANGLE)
            self.angles = kit.stacked(angles)
            reasons = reasons | kit.where(lost, int(Flag.MISSING_INPUT), 0)
            along, across, up = _levelled(kit, along, across, up, *angles)
            sway = self.vehicle.roll_center_height * kit.sin(angles[1])
        if self.dynamic:
            along, across = self.response.follow([along, across])
        lean = self.vehicle.cg_height * across / kit.maximum(up, LEAST_GRAVITY) + sway
        load = _transferred(self._wheels, along, lean, up)
        carried = (load[0] >= 0.0) & (load[1] >= 0.0) & (load[2] >= 0.0) & (load[3] >= 0.0)
        flags: FlagArray = np.array(reasons, dtype=np.int32).reshape(shape)
        self._flag_renewed(flags)
        loads = kit.table((load,), shape)
        if kit.some(kit.no(carried)):
            return LoadStep(without_negative(loads), loads < 0.0, flags)
        return LoadStep(loads, self._nowhere.copy(), flags)

    def _held(
        self, given: tuple[npt.ArrayLike, ...], names: tuple[str, ...], last: Signals, limit: float
    ) -> tuple[list[Number], Number]:
        """The signals, at their last known values where missing; and where any of them is."""
        kit, lost, held = self._kit, self._kit.full(False), []
        for value, name, old in zip(given, names, last, strict=False):
            new = kit.car(value, self.batch_shape, name)
            good = abs(new) <= limit  # False for NaN
            held.append(kit.where(good, new, old))
            lost = lost | kit.no(good)
        return held, lost

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh; flagged RESET at the next step."""
        chosen = mask(where, self.batch_shape, "where")
        kit, here = self._kit, self._kit.own(chosen)
        self.felt = kit.stacked(
            [kit.where(here, new, old) for new, old in zip(self._at_rest(), self.felt, strict=True)]
        )
        self.angles = kit.replaced(here, 0.0, self.angles)
        self.response.reset(chosen)
        self._renew(chosen)
