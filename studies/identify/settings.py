"""The constants of the identification: one meaning a line, physically argued, the same for every car and drive."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from studies.errors import IdentifyError


@dataclass(frozen=True)
class IdentifySettings:
    """Raises IdentifyError naming every value that is not a finite number above zero, or limits that do not fall."""

    filter_lag: float = 0.02  # s, 8 Hz: above what a driver and a brake valve do, below the noise of a derivative
    slow_lag: float = 0.05  # s, 3 Hz: a car turns slower, and noise of a yaw acceleration would pull at its coefficient
    mounting_lag: float = 0.12  # s, 1.3 Hz: a body on its springs still follows; noise of w' falls as lag^-1.5
    settling: float = 8.0  # filter lags until a bad sample is forgotten: (1 + 8) exp(-8) = 3e-3 of it is left
    least_speed: float = 0.75  # m/s: below it a ring of 48 teeth gives less than one pulse in two filter lags
    least_seconds: float = 1.0  # s of usable driving: a hundred relaxation times at 12 m/s
    stopped_below: float = 1.0  # rad/s: a held wheel carries any torque up to its friction
    slip_limits: tuple[float, ...] = (0.08, 0.045, 0.028, 0.016)  # dry tires peak near 0.1; steps of about sqrt 3
    same_stiffness: float = 0.05  # two slip limits agree when their stiffnesses differ by less (or by their errors)
    confidence: float = 0.95  # of every interval
    least_freedom: float = 5.0  # independent stretches without which an interval is a guess
    comparisons: float = 1.4  # errors to agree within: six pairs of four limits at 95 % together (Bonferroni)
    residual_floor: float = 1e-3  # m/s: resolution of any velocity reference; simulated logs have no noise of their own
    # largest half width of the confidence interval at which a parameter counts as identified
    stiffness_width: float = 0.2  # relative; the catalogue of tires spans 15 to 80
    relaxation_width: float = 0.3  # relative; enough to tell a patch of 0.14 m from a relaxation length of 0.3 m
    damping_width: float = 0.3  # relative
    radius_width: float = 0.005  # relative; pressure, wear and catalogue leave 1.5 %
    saturation_width: float = 0.3  # of s [1]: at a tenth of friction 1 it is worth 3 % of stiffness
    inertia_width: float = 0.2  # relative, wheel and yaw; rim and tire catalogues are no better
    arm_width: float = 0.15  # m, lever arm of the inertial unit
    mounting_width: float = 0.01  # rad, its angles
    # standard deviations of what is held at its prior, and of nuisances
    stiffness_spread: float = 0.8  # natural logarithm: 15 to 80 about the middle
    relaxation_spread: float = 0.6  # natural logarithm: 0.08 to 0.4 m
    radius_spread: float = 0.015  # relative
    inertia_spread: float = 0.3  # relative
    saturation_spread: float = 0.5  # of s = 1/friction [1]: 0 is a tire straight up to its peak, 1 LuGre at friction 1
    saturation_apart: float = 1.5  # half widths of s from 0 from which a tire bends like LuGre: three deviations
    curvature: float = 0.1  # of s [1] where it is not told: what load and camber bend, to first order in the force
    bend: float = 0.4  # c [1]: Magic Formulas at friction 1 have 0.4 to 0.7, LuGre has none
    bend_spread: float = 0.3  # of c [1]
    torque_scale_spread: float = 0.1  # relative: engine maps and brake linings
    pitch_frequency: float = 1.5  # Hz: the body pitches on its springs at 1 to 2.5 Hz
    pitch_frequency_spread: float = 0.4  # natural logarithm
    pitch_damping: float = 0.45  # of critical: 0.3 to 0.7
    pitch_damping_spread: float = 0.5  # natural logarithm
    torque_delay: float = 0.01  # s between torque and acceleration in a log: bus cycles, half a sample of a held torque
    clock_skew: float = 0.001  # s between sensors of one bus
    side_spread: float = 0.003  # relative: left against right radius, by pressure and wear
    axle_spread: float = 0.05  # natural logarithm: stiffness of an axle against their mean: load, camber, compliance
    angle_spread: float = 0.01  # rad: zero of steering and of the sideslip reference
    drag_prior: float = 0.45  # N s^2/m^2: half air density, frontal area 2.4 m^2, coefficient 0.3
    drag_spread: float = 0.3
    acceleration_bias: float = 0.2  # m/s^2: accelerometer bias, and grade of 1 %
    arm_spread: float = 1.0  # m: from the middle of a car to its ends
    mounting_spread: float = 0.05  # rad: units are fitted by hand, or stand on a seat
    tilt_spread: float = 0.004  # rad/(m/s^2): a body rolls by 3 to 8 deg/g and pitches by 1 to 3 deg/g
    tilt_delay: float = 0.05  # s, of roll and pitch against the accelerations
    sway: float = 0.003  # (rad/s)/(m/s^2) of the body in phase with a_y: what a delay leaves of a second-order motion
    heave_arm: float = (
        0.2  # m: a body pitches about a point ahead of or behind its centre of gravity, and rolls beside it
    )
    jacking: float = 0.01  # of 1: vertical acceleration of a body in proportion to a_y
    scale_spread: float = 0.01  # relative, of accelerometers
    reference_delay: float = 0.01  # s, of the reference against the inertial unit, and of the body's roll against a_y
    rate_bias: float = 0.005  # rad/s, of gyros
    free_rolling: float = 0.05  # |mu| below which wheels may be told apart though only the sum of forces is known
    cross_force: float = 0.2  # share of the load used sideways (lengthways): a friction ellipse of radius 1 loses 2 %
    least_load: float = 0.2  # of the static load: a lighter wheel is about to lift

    def __post_init__(self) -> None:
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "slip_limits"}
        values |= {f"slip_limits[{i}]": value for i, value in enumerate(self.slip_limits)}
        bad = [name for name, value in values.items() if not (math.isfinite(value) and value > 0)]
        if bad:
            raise IdentifyError(f"settings: {', '.join(bad)} must be finite and above 0")
        if not self.slip_limits or any(b >= a for a, b in zip(self.slip_limits, self.slip_limits[1:], strict=False)):
            raise IdentifyError("settings: slip_limits must fall, from the widest to the narrowest")
        if self.confidence >= 1:
            raise IdentifyError(f"settings: confidence = {self.confidence:g} must be below 1")
