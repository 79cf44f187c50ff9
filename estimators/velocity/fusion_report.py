"""The state of the fusion as arrays, mapped back to the corners."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from estimators.arithmetic import Arithmetic, Number, Signals
from estimators.faults import Flag
from estimators.velocity import lateral_fusion as lateral
from estimators.velocity import longitudinal_fusion as longitudinal
from estimators.velocity.fusion_screen import Screened
from estimators.velocity.fusion_step import FusionStep
from estimators.velocity.longitudinal_fusion import BIAS, GRADE
from estimators.velocity.slip import slips

_HIGH_SLIP, _GATED, _STOPPED = int(Flag.HIGH_SLIP), int(Flag.GATED), int(Flag.WHEEL_STOPPED)
_STANDING, _NOT_EXCITED = int(Flag.STANDING), int(Flag.NOT_EXCITED)


class Judged(NamedTuple):
    """What one sample made of its measurements."""

    slipping: Signals
    wheel: longitudinal.WheelVerdict
    axle: lateral.AxleVerdict
    standing: Number
    stopped: Signals  # wheels that do not turn though the car moves


def reported(
    kit: Arithmetic,
    shape: tuple[int, ...],
    along: longitudinal.LongitudinalFusion,
    across: lateral.LateralFusion,
    seen: Screened,
    course: tuple[Signals, Signals, Signals, Signals],
    judged: Judged,
    flags: Number,
) -> FusionStep:
    """The step in the batch shape; `course` sine and cosine of the steering and x, y of the wheels."""
    choose, x, y = kit.where, along.filter.mean, across.filter.mean
    slipping, wheel, axle, standing, stopped = judged
    turn, ahead_speed, left_speed = across.yaw_rate(seen.inertial[2]), x[0], y[0]

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
    speeds = (x[0], y[0], kit.sqrt(along.filter.variance(0)), kit.sqrt(across.filter.variance(0)), turn)
    errors = (x[BIAS], y[lateral.BIAS], y[lateral.YAW_BIAS], x[GRADE], y[lateral.BANK])
    real = kit.table((speeds, errors, radius, slip, angle, innovation, axle.innovation), shape)
    true = kit.table((wheel.used, wheel.gated, slipping, axle.used, (standing,)), shape)
    sums = kit.table((wheel_flags, (flags,)), shape).astype(np.int32)
    return FusionStep(
        vx=real[..., 0],
        vy=real[..., 1],
        vx_deviation=real[..., 2],
        vy_deviation=real[..., 3],
        yaw_rate=real[..., 4],
        sensor_bias=real[..., 5:8],
        gravity=real[..., 8:10],
        radius=real[..., 10:14],
        slip=real[..., 14:18],
        slip_angle=real[..., 18:22],
        innovation=real[..., 22:26],
        used=true[..., :4],
        gated=true[..., 4:8],
        high_slip=true[..., 8:12],
        axle_innovation=real[..., 26:],
        axle_used=true[..., 12:14],
        standing=true[..., 14],
        flags=sums[..., 4],
        wheel_flags=sums[..., :4],
    )
