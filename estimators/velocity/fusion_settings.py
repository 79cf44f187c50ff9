"""The constants of the vehicle-level fusion: one meaning a line, physically argued, the same for every car and drive."""

from __future__ import annotations

from dataclasses import dataclass

from estimators.arguments import positive_fields
from estimators.errors import EstimatorError


@dataclass(frozen=True)
class FusionSettings:
    """Standard deviations where nothing else is said. Times are correlation times of first-order Gauss-Markov processes.

    An error that stays the same for a while is not white: a channel whose model error has the deviation s and the
    correlation time T counts with the variance s^2 2 T/Ts per sample, the white noise of the same density.

    Raises:
        EstimatorError: names every value that is not a finite number above zero.
    """

    # inertial unit
    acceleration_noise: float = 0.1  # m/s^2 a sample: sensor noise of 0.05 and vibration of the body
    yaw_rate_noise: float = 0.002  # rad/s a sample
    acceleration_bias: float = 0.15  # m/s^2: an automotive MEMS unit over its temperature range
    yaw_rate_bias: float = 0.006  # rad/s, 0.35 deg/s
    scale: float = 0.01  # of both accelerations and of the yaw rate
    body_roll: float = (
        0.02  # rad per g, 1.1 deg: a body rolls by 3 to 6 deg per g, and attitude leaves part of it in a_y
    )
    sensor_memory: float = 3600.0  # s: biases and scales drift with temperature
    levelling_memory: float = 40.0  # s over which attitude, led by speeds that err, changes what it leaves in both
    missing_acceleration: float = 2.0  # m/s^2: how far a held acceleration may be off
    missing_yaw_rate: float = 0.1  # rad/s
    slowest_unit: float = 0.05  # s for which a live accelerometer may repeat itself: 20 Hz
    unseen_acceleration: float = 5.0  # m/s^2 of a car whose acceleration nothing tells: firm braking
    # what the tire forces say of a_x
    force_gap_floor: float = 0.8  # m/s^2 by which they may contradict: bias 0.15, drag 0.4 at 35 m/s, rolling 0.15
    force_gap_linear: float = 0.15  # the same per m/s^2: pads warm up, motors give 5 % less than they say
    force_gap_memory: float = 0.1  # s over which they are compared, above the lag of a force observer
    # road
    grade: float = 0.02  # rad: rural roads
    bank: float = 0.01  # rad
    road_length: float = 200.0  # m over which grade and bank change: vertical curves of rural roads are 100 to 300 m
    # wheels
    wheel_speed_noise: float = 0.05  # rad/s a sample
    steering_noise: float = 0.004  # rad: sensor 0.002, and the play of the linkage
    tooth_pitch: float = 0.05  # m of road between two pulses of the wheel-speed ring: 48 teeth on 0.35 m
    dead_speed: float = 0.3  # m/s below which a ring gives no pulses: a wheel that reads zero may roll as fast
    dead_band: float = 0.6  # m/s at which a passive wheel sensor may still read zero: creeping looks like standing
    radius_common: float = 0.015  # relative error of the effective radius, all wheels alike: pressure, wear, catalogue
    radius_single: float = 0.005  # relative, of each wheel for itself
    radius_memory: float = 3600.0  # s: tires warm up
    # longitudinal slip: slip = compliance * mu, plus an error that grows with the friction used
    slip_compliance: float = 0.03  # slip per unit of F_x/F_z: normalised stiffness 33, of a range from 15 to 80
    slip_compliance_spread: float = 0.02
    slip_bend_spread: float = 0.3  # relative, of the slip that side slip adds: not every tire is isotropic
    slip_memory: float = 90.0  # s: a road surface, one to two km
    slip_floor: float = 0.001  # slip error of a free-rolling wheel: asphalt, on a recorded drive 0.0008
    slip_load: float = 0.01  # the same per g sideways: a turn moves load, and a radius gives by 0.5 to 1 mm per kN
    slip_linear: float = 0.03  # slip error per unit of mu
    slip_cubic: float = 0.1  # slip error per unit of mu^3: the curve bends towards its peak
    slip_speed: float = 0.02  # m/s: floor of the slip velocity error
    free_rolling: float = 0.12  # |mu| below which a wheel teaches its radius
    # side slip: alpha = c_1 mu + c_3 mu^3 at each axle
    side_compliance: float = 0.09  # rad per unit of F_y/F_z, 5 deg/g: usual cornering compliance of an axle
    side_compliance_spread: float = 0.03
    side_cubic: float = 0.15  # rad per unit of mu^3: c_1 for a brush of peak friction 1, more for an axle of two tires
    side_cubic_spread: float = 0.12  # peak friction between 0.7 and 1.3
    side_memory: float = 300.0  # s
    side_floor: float = 0.002  # rad, 0.1 deg: toe and linkage
    side_linear: float = 0.02  # relative error of the slip angle
    relaxation_length: float = 0.3  # m of road within which a tire's side force follows its slip: 0.2 to 0.5
    side_excess_memory: float = 0.5  # s over which an axle shows that it slips further than its curve
    side_speed_spread: float = 2.0  # stated deviations by which V_y may be off as long: curves of tires differ
    side_speed_memory: float = 2.0  # s: how long an error of V_y stays the same, one turn
    side_error_memory: float = 0.1  # s: how long its error stays the same, one stroke of the steering
    # what may be believed
    error_memory: float = 0.2  # s: how long a slip error stays the same, one stroke of a brake or throttle
    gate: float = 3.0  # standard deviations beyond which a channel is slip, not noise
    wrong_way_gate: float = 6.0  # the same where slip would have to point against the force
    excess_acceleration: float = 3.0  # m/s^2 by which a wheel's surface may leave the car before it counts as slipping
    wheel_lag: float = 0.03  # s of the filter that differentiates wheel speeds
    high_slip_hold: float = 0.05  # s for which high slip is believed to last
    agreement: float = (
        0.03  # relative, within which the speeds of rolling wheels agree: radius, free-rolling slip, turn
    )
    rolling: float = 0.5  # m/s^2 by which rolling wheels and accelerometer may differ: its bias and the grade
    unloaded: float = 0.05  # |mu| below which a tire does not slip far on any road
    lost_time: float = 1.0  # s of rolling wheels that contradict the estimate: no wheel slips for as long unloaded
    still_time: float = 0.2  # s of silent wheels and a calm body before the car counts as standing
    still_speed: float = 0.05  # m/s below which a wheel is silent
    still_acceleration: float = 0.1  # m/s^2 of a body that stands: noise, idling engine
    still_yaw_rate: float = 0.02  # rad/s

    def __post_init__(self) -> None:
        positive_fields(self, "fusion settings")
        if self.wrong_way_gate < self.gate:
            raise EstimatorError(
                f"wrong_way_gate = {self.wrong_way_gate:g} is below gate = {self.gate:g}: slip never points against the "
                "force, so that side must be believed more readily"
            )
