"""What the vehicle-level fusion returns: its state as arrays, mapped back to the corners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from estimators.arithmetic import Arithmetic, Number, Signals
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.faults import Flag
from estimators.velocity import lateral_fusion as lateral
from estimators.velocity import longitudinal_fusion as longitudinal
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.longitudinal_fusion import BIAS, GRADE
from estimators.velocity.slip import slips


class FusionStep(NamedTuple):
    """What one step returns, ready for a log; `...` is the batch shape."""

    vx: FloatArray  # (...) m/s at the centre of gravity, body frame
    vy: FloatArray  # (...) m/s, to the left
    vx_deviation: FloatArray  # (...) m/s, standard deviation
    vy_deviation: FloatArray  # (...) m/s
    yaw_rate: FloatArray  # (...) rad/s, without its estimated bias and scale error
    inertial: FloatArray  # (..., 3) a_x, a_y in m/s^2 and r in rad/s as used: the reading, or what it should have been
    inertial_used: BoolArray  # (..., 3) whether it is the reading
    force_contested: BoolArray  # (...) a_x and the wheels' forces contradict each other by half of what they may
    sensor_bias: FloatArray  # (..., 3) of a_x, a_y in m/s^2 and of r in rad/s
    gravity: FloatArray  # (..., 2) m/s^2 in a_x and a_y, from grade and bank
    radius: FloatArray  # (..., 4) effective radii, m, as learned
    slip: FloatArray  # (..., 4) slip ratio, positive when driving
    slip_angle: FloatArray  # (..., 4) rad, positive where v_yt is (P1)
    innovation: FloatArray  # (..., 4) m/s, wheels; NaN where there is no wheel speed
    used: BoolArray  # (..., 4)
    gated: BoolArray  # (..., 4) not used because further from the estimate than its model explains
    high_slip: BoolArray  # (..., 4) not used because the wheel accelerates away from the car
    axle_innovation: FloatArray  # (..., 2) m/s, front and rear axle condition
    axle_used: BoolArray  # (..., 2)
    standing: BoolArray  # (...) standstill was recognised
    flags: FlagArray  # (...) sums of `Flag`
    wheel_flags: FlagArray  # (..., 4)


_HIGH_SLIP, _GATED, _STOPPED = int(Flag.HIGH_SLIP), int(Flag.GATED), int(Flag.WHEEL_STOPPED)
_STANDING, _NOT_EXCITED = int(Flag.STANDING), int(Flag.NOT_EXCITED)


class Outcome(NamedTuple):
    """What one sample made of its measurements."""

    slipping: Signals
    wheel: longitudinal.WheelUpdate
    axle: lateral.AxleUpdate
    standing: Number
    stopped: Signals  # wheels that do not turn though the car moves
    hidden: tuple[Number, Number]  # m/s, deviations of V_x and V_y that no measurement can take away


def fusion_step(
    kit: Arithmetic,
    shape: tuple[int, ...],
    along: longitudinal.LongitudinalFusion,
    across: lateral.LateralFusion,
    seen: ConditionedInputs,
    course: tuple[Signals, Signals, Signals, Signals],
    outcome: Outcome,
    flags: Number,
    inertial: tuple[Number, Number, Number],
    used: tuple[Number, Number, Number, Number],
) -> FusionStep:
    """The step in the batch shape; `course` sine and cosine of the steering and x, y of the wheels."""
    choose, x, y = kit.where, along.filter.mean, across.filter.mean
    slipping, wheel, axle, standing, stopped, hidden = outcome
    turn, ahead_speed, left_speed = across.yaw_rate(inertial[2]), x[0], y[0]

    def mapped(
        w: Number,
        fresh: Number,
        off: Number,
        catalogue: Number,
        error: Number,
        sine: Number,
        cosine: Number,
        forward_arm: Number,
        side_arm: Number,
    ) -> tuple[Number, ...]:
        forward, left = ahead_speed - turn * side_arm, left_speed + turn * forward_arm
        ahead, beside = forward * cosine + left * sine, left * cosine - forward * sine
        radius = catalogue * (1.0 + error)
        return radius, *slips(kit, radius * w, ahead, beside), choose(fresh, off, math.nan)

    radius, slip, angle, innovation = kit.each(
        mapped, seen.wheel_speed, seen.fresh, wheel.innovation, along.radius, x[longitudinal.RADIUS :], *course
    )
    wheel_flags = seen.wheel_flags
    for found, flag in ((slipping, _HIGH_SLIP), (wheel.gated, _GATED), (stopped, _STOPPED)):
        if kit.some(found[0] | found[1] | found[2] | found[3]):
            (wheel_flags,) = kit.each(lambda sums, bad, bit=flag: (sums | choose(bad, bit, 0),), wheel_flags, found)
    flags = flags | choose(standing, _STANDING, 0) | choose(axle.excited, 0, _NOT_EXCITED)
    forward = kit.sqrt(along.filter.variance(0) + hidden[0] * hidden[0])
    sideways = kit.sqrt(across.filter.variance(0) + hidden[1] * hidden[1])
    speeds = (x[0], y[0], forward, sideways, turn)
    errors = (x[BIAS], y[lateral.BIAS], y[lateral.YAW_BIAS], x[GRADE], y[lateral.BANK])
    real = kit.table((speeds, errors, radius, slip, angle, innovation, axle.innovation, inertial), shape)
    true = kit.table((wheel.used, wheel.gated, slipping, axle.used, (standing,), used), shape)
    sums = kit.table((wheel_flags, (flags,)), shape).astype(np.int32)
    return _step_of(real, true, sums)


def joined_steps(steps: Sequence[FusionStep], shape: tuple[int, ...]) -> FusionStep:
    """Steps of single cars (batch shape ()) as the one of a batch of `shape`: their tables, side by side."""
    tables = [step.vx.base for step in steps], [step.used.base for step in steps], [step.flags.base for step in steps]
    return _step_of(*(np.array(table).reshape(*shape, -1) for table in tables))


def _step_of(real: FloatArray, true: BoolArray, sums: FlagArray) -> FusionStep:
    """All fields are views of three tables."""
    return FusionStep(
        vx=real[..., 0],
        vy=real[..., 1],
        vx_deviation=real[..., 2],
        vy_deviation=real[..., 3],
        yaw_rate=real[..., 4],
        inertial=real[..., 28:],
        inertial_used=true[..., 15:18],
        force_contested=true[..., 18],
        sensor_bias=real[..., 5:8],
        gravity=real[..., 8:10],
        radius=real[..., 10:14],
        slip=real[..., 14:18],
        slip_angle=real[..., 18:22],
        innovation=real[..., 22:26],
        used=true[..., :4],
        gated=true[..., 4:8],
        high_slip=true[..., 8:12],
        axle_innovation=real[..., 26:28],
        axle_used=true[..., 12:14],
        standing=true[..., 14],
        flags=sums[..., 4],
        wheel_flags=sums[..., :4],
    )
