"""The corner observers as the velocity part of the pipeline: the chain of a paper as it stands, without the fusion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import mask, setting
from estimators.arithmetic import Number, arithmetic
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.memory import Memory
from estimators.pipeline.corner_set import CornerObservers, CornerSetStep
from estimators.pipeline.parts import check_parts
from estimators.signals import limits
from estimators.velocity.corners import at_wheel, rotated
from estimators.velocity.kinematic import KinematicKalman
from estimators.velocity.slip import slips


class CornerVelocityStep(NamedTuple):
    """What the pipeline reads of a velocity part; leading axes `...` are those of the batch."""

    vx: FloatArray  # (...) m/s at the centre of gravity
    vy: FloatArray  # (...) m/s, to the left
    vx_deviation: FloatArray  # (...) m/s; NaN without the kinematic filter: the papers' observers state none
    vy_deviation: FloatArray  # (...) m/s, likewise
    yaw_rate: FloatArray  # (...) rad/s as measured, the last one where it is missing
    sensor_bias: FloatArray  # (..., 3) of a_x, a_y in m/s^2 by the kinematic filter, zero without; of r always zero
    slip: FloatArray  # (..., 4) slip ratio of the car's velocity, positive when driving
    slip_angle: FloatArray  # (..., 4) rad, positive where v_yt is (P1)
    innovation: FloatArray  # (..., 4) of the normalised F_x; NaN where missing
    used: BoolArray  # (..., 4) whether the wheel supports V_x: its speed is there, and its force was used
    high_slip: BoolArray  # (..., 4) see `CornerStep`
    standing: BoolArray  # (...) never: a standstill is not recognised
    flags: FlagArray  # (...) MISSING_INPUT where a_x, a_y or the yaw rate is missing; RESET of the kinematic filter
    wheel_flags: FlagArray  # (..., 4)
    corners: CornerSetStep


class CornerVelocity(Memory):
    """Slips, slip angles, V_x and V_y from `CornerObservers` alone: P1 notes 5 to 7, P3 notes 3.

    With saturated friction, observers of this structure hardly see how fast a wheel slips; the fusion does. This part is
    for what a paper says, beside it. It runs at the sample time of its observers, whatever time has passed.

    With `kinematic`, what the corners find corrects the kinematic model with bias states, P2 (15): its velocities are the
    result. A sample in which no wheel supports V_x, or every one slips much, does not correct it.

    Args:
        corners: with a lateral observer, for nothing else says V_y.
        kinematic: for the same batch and sample time, or None.
        deviation: m/s, standard deviation of the corners' V_x and V_y as measurements; a declared choice.

    Raises:
        EstimatorError: no lateral observer, a kinematic filter that does not fit, a deviation that is not positive.
    """

    memory = ("waits",)
    uses_lateral_force = True  # the pipeline gives F_y/F_z of the wheels as `lateral_use`

    def __init__(
        self,
        corners: CornerObservers,
        kinematic: KinematicKalman | None = None,
        deviation: tuple[float, float] = (0.2, 0.2),
    ) -> None:
        if corners.across is None:
            raise EstimatorError("corner observers without a lateral one say nothing of V_y; give a lateral schedule")
        self.corners, self.batch_shape, self.sample_time = corners, corners.batch_shape, corners.sample_time
        self.kinematic = kinematic
        self.parts = ("corners",) if kinematic is None else ("corners", "kinematic")
        pair = [setting(value, "deviation", "m/s") for value in deviation]
        self._deviation = np.broadcast_to(np.array(pair), (*self.batch_shape, 2))
        if kinematic is not None:
            check_parts({"kinematic": kinematic}, self.batch_shape, self.sample_time, ())
        self.waits: BoolArray = np.ones(self.batch_shape, dtype=np.bool_)  # the filter starts at the next velocities
        self._kit = kit = arithmetic(self.batch_shape)
        car = corners.vehicle
        self._wheels = [kit.signals(v) for v in (car.radii, car.corner_x.tolist(), car.corner_y.tolist())]
        self._unsaid = np.full(self.batch_shape, math.nan)
        self._still: BoolArray = np.zeros(self.batch_shape, dtype=np.bool_)
        self._unbiased = np.zeros((*self.batch_shape, 3))
        self._unflagged: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        for constant in (self._unsaid, self._still, self._unbiased, self._unflagged):
            constant.flags.writeable = False

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        steer: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        normalised_force: npt.ArrayLike,
        elapsed: npt.ArrayLike | None = None,
        lateral_use: npt.ArrayLike = math.nan,
        forces: tuple[npt.ArrayLike, npt.ArrayLike] = (math.nan, math.nan),
    ) -> CornerVelocityStep:
        """One sample, as `VelocityFusion.step`; `lateral_use` (..., 4) F_y/F_z, NaN where unknown; `elapsed` is not used.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        kit, shape = self._kit, self.batch_shape
        uses = normalised_force, lateral_use
        found = self.corners.step(wheel_speed, steer, ax, ay, yaw_rate, *uses, forces=forces)
        used = found.used & np.isfinite(found.corner_vx)
        moved = self._moved(found, used, ax, ay, yaw_rate)
        held = kit.rows(self.corners.slope.value, 9)
        vx, vy, turn = kit.own(moved.vx), kit.own(moved.vy), held[8]

        moves = (kit.rows(found.suspension_velocity[..., k], 4) for k in (0, 1))  # P3 (15)

        def mapped(
            w: Number, angle: Number, radius: float, x: float, y: float, along: Number, across: Number
        ) -> tuple[Number, Number]:
            forward, left = at_wheel(vx, vy, turn, x, y)
            ahead, beside = rotated(forward + along, left + across, kit.sin(angle), kit.cos(angle))
            return slips(kit, radius * w, ahead, beside)

        outputs = kit.table(kit.each(mapped, held[:4], held[4:8], *self._wheels, *moves), shape)
        pulls = kit.car(ax, shape, "ax"), kit.car(ay, shape, "ay")
        lost = kit.no(abs(kit.car(yaw_rate, shape, "yaw_rate")) <= limits.YAW_RATE)
        for value in pulls:
            lost = lost | kit.no(abs(value) <= limits.ACCELERATION)
        missing: FlagArray = np.asarray(kit.where(lost, int(Flag.MISSING_INPUT), 0), dtype=np.int32).reshape(shape)
        return CornerVelocityStep(
            vx=moved.vx,
            vy=moved.vy,
            vx_deviation=moved.vx_deviation,
            vy_deviation=moved.vy_deviation,
            yaw_rate=np.asarray(turn).reshape(shape),
            sensor_bias=moved.sensor_bias,
            slip=outputs[..., :4],
            slip_angle=outputs[..., 4:],
            innovation=found.innovation,
            used=used,
            high_slip=found.high_slip,
            standing=self._still,
            flags=missing | moved.flags,
            wheel_flags=found.flags,
            corners=found,
        )

    def reset(self, where: npt.ArrayLike | None = None, vx: npt.ArrayLike = math.nan, vy: npt.ArrayLike = 0.0) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh at `vx`, `vy` (...), m/s.

        NaN for `vx`: from the wheel speeds of the next step.

        Raises:
            EstimatorError: a mask or speeds of another shape.
        """
        chosen = mask(where, self.batch_shape, "where")
        self.corners.reset(chosen, vx, vy)
        self.waits = self.waits | chosen

    def _moved(
        self, found: CornerSetStep, used: BoolArray, ax: npt.ArrayLike, ay: npt.ArrayLike, yaw_rate: npt.ArrayLike
    ) -> _Moved:
        """Velocities of the corners, or those of the kinematic model that they correct."""
        if self.kinematic is None:
            return _Moved(found.vx, found.vy, self._unsaid, self._unsaid, self._unbiased, self._unflagged)
        seen = np.stack((found.vx, found.vy), axis=-1)
        if self.waits.any():
            self.kinematic.reset(self.waits, seen)
            self.waits = np.zeros(self.batch_shape, dtype=np.bool_)
        supported = (used & ~found.high_slip).any(axis=-1, keepdims=True)
        step = self.kinematic.step(ax, ay, yaw_rate, np.where(supported, seen, math.nan), self._deviation)
        bias = np.concatenate((-step.bias, np.zeros((*self.batch_shape, 1))), axis=-1)
        spread = np.sqrt(step.covariance[..., [0, 1], [0, 1]])
        flags = step.flags & ~np.int32(Flag.MISSING_MEASUREMENT)  # of the corners, which have flags of their own
        return _Moved(step.velocity[..., 0], step.velocity[..., 1], spread[..., 0], spread[..., 1], bias, flags)


class _Moved(NamedTuple):
    """The first fields of the step."""

    vx: FloatArray
    vy: FloatArray
    vx_deviation: FloatArray
    vy_deviation: FloatArray
    sensor_bias: FloatArray
    flags: FlagArray
