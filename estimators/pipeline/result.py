"""What one step of the pipeline returns, ready for a log, and how well its parts agree."""

from __future__ import annotations

from enum import IntFlag
from typing import Any, NamedTuple

import numpy as np

from estimators.arrays import FlagArray, FloatArray
from estimators.display import counted, displayed, ends
from estimators.faults import Flag
from estimators.forces import AttitudeStep, LateralForceStep, LoadStep, Reconciled, WheelForceStep


class Check(IntFlag):
    """One bit for each cross-check that failed; `Check(int(step.consistency.failed))` names them."""

    NONE = 0
    FORCE_BALANCE = (
        1  # the wheel equations' sum of F_x and m a_x stay apart: torque scale, brake temperature, grade, mass
    )
    LATERAL_BALANCE = 2  # the sum of F_y and m a_y stay apart
    LOAD_SUM = 4  # the loads do not sum to m a_z: the car flies, or a load part is wrong
    CORNERS_DISAGREE = (
        8  # V_x of fusion and corner observers stay apart: slip that the corners cannot see, or a lost fusion
    )
    NO_WHEEL = 16  # no wheel supports V_x now: it is integrated acceleration
    UNKNOWN_FORCE = 32  # at least one corner's F_x is a share of m a_x, not its wheel equation
    LATE_SAMPLE = 64  # the time since the last sample is not the sample time


class Consistency(NamedTuple):
    """The gaps are low-passed (they would ring with every pulse of a brake otherwise); leading axes as the batch."""

    force_x_gap: FloatArray  # (...) m/s^2, (m a_x - sum of F_x)/m
    force_y_gap: FloatArray  # (...) m/s^2, a_y minus what the axle forces make of it
    load_gap: FloatArray  # (...) sum of F_z over m a_z, minus 1
    velocity_gap: FloatArray  # (...) m/s, V_x minus that of the corner observers; 0 without them
    failed: FlagArray  # (...) sums of `Check`


@displayed({})
class PipelineStep(NamedTuple):
    """Leading axes `...` are those of the batch; corners fl, fr, rl, rr. Everything above `consistency` is finite, but
    for deviations that the velocity part does not state."""

    vx: FloatArray  # (...) m/s at the centre of gravity
    vy: FloatArray  # (...) m/s, to the left
    vx_deviation: FloatArray  # (...) m/s, standard deviation
    vy_deviation: FloatArray  # (...) m/s
    sideslip: FloatArray  # (...) rad, atan(V_y/|V_x|), positive to the left; fades below 0.5 m/s
    yaw_rate: FloatArray  # (...) rad/s, without its estimated bias
    force_x: FloatArray  # (..., 4) N in the wheel planes, reconciled with m a_x
    force_x_deviation: FloatArray  # (..., 4) N
    force_y: FloatArray  # (..., 4) N, tire frame, to the left; front split from the model, rear split by load
    axle_force_y: FloatArray  # (..., 2) N, front and rear
    force_z: FloatArray  # (..., 4) N
    slip: FloatArray  # (..., 4) slip ratio, positive when driving
    slip_angle: FloatArray  # (..., 4) rad, positive where v_yt is (P1)
    roll: FloatArray  # (...) rad, of the body against the road; 0 without an attitude part
    pitch: FloatArray  # (...) rad, nose up
    consistency: Consistency
    flags: FlagArray  # (...) sums of `Flag` over the car's signals
    wheel_flags: FlagArray  # (..., 4) of the wheels' signals
    wheels: WheelForceStep  # the step of each part: innovation, what was used, and why not
    reconciled: Reconciled
    loads: LoadStep
    lateral: LateralForceStep
    velocity: Any  # `FusionStep`, or `CornerVelocityStep`
    attitude: AttitudeStep | None  # None without that part
    corners: Any  # `CornerSetStep`, None without that part
    sideslip_step: Any  # of the sideslip part, None without one

    def summary(self) -> tuple[str, ...]:
        """Velocities with their deviations, forces and loads of the wheels, flags by name."""
        speed = [
            f"V_x {ends(self.vx)} m/s (± {ends(self.vx_deviation)})", f"V_y {ends(self.vy)} m/s (± {ends(self.vy_deviation)})",
            f"sideslip {ends(self.sideslip)} rad",
        ]  # fmt: skip
        return (
            f"PipelineStep of {counted(np.asarray(self.vx).size, 'car')}",
            f"motion: {', '.join(speed)}",
            f"forces fl, fr, rl, rr: F_x {_wheels(self.force_x)} N, F_z {_wheels(self.force_z)} N",
            f"axles front, rear: F_y {_wheels(self.axle_force_y)} N; yaw rate {ends(self.yaw_rate)} rad/s",
            f"flags: {_raised(self.flags, Flag)}; failed checks: {_raised(self.consistency.failed, Check)}",
        )


def _raised(flags: FlagArray, names: type[IntFlag]) -> str:
    """Names of what any car of the batch carries."""
    found = int(np.bitwise_or.reduce(np.asarray(flags).ravel(), initial=0))
    return ", ".join(str(one.name).lower() for one in names if one.value & found) or "none"


def _wheels(force: FloatArray) -> str:
    """One car's wheels or axles in full."""
    return ends(force) if force.ndim > 1 else f"[{', '.join(f'{one:.5g}' for one in force)}]"
