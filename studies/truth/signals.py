"""The signals of the truth: names, units, and how they follow from state and forces."""

from __future__ import annotations

from typing import Final

import numpy as np

from estimators.arrays import FloatArray
from estimators.velocity.slip import side_slip_angle, slip_ratio
from studies.truth.fleet import Fleet
from studies.truth.layout import B, W
from studies.truth.plant import Controls
from studies.truth.stepper import Step

CAR_UNITS: Final = {
    "x": "m", "y": "m", "yaw": "rad", "distance": "m",
    "vx": "m/s", "vy": "m/s", "yaw_rate": "rad/s", "yaw_acceleration": "rad/s^2", "sideslip": "rad",
    "road_ax": "m/s^2", "road_ay": "m/s^2",
    "ax": "m/s^2", "ay": "m/s^2", "az": "m/s^2",
    "roll_rate": "rad/s", "pitch_rate": "rad/s", "yaw_gyro": "rad/s",
    "roll": "rad", "pitch": "rad", "grade": "rad", "bank": "rad", "drag": "N",
}  # fmt: skip
"""(B, n) signals. ax, ay, az, roll_rate, pitch_rate, yaw_gyro: an ideal IMU fixed to the body at the centre of gravity
(specific force, +g up at rest; rates right-handed about x, y, z of the body). road_ax, road_ay: the same force along the
road, vx' - r vy + g sin(grade) and vy' + r vx + g cos(grade) sin(bank). roll: left side up, pitch: nose up, both of the
body against the road."""
WHEEL_UNITS: Final = {
    "wheel_speed": "rad/s", "wheel_angle": "rad", "steer": "rad",
    "torque": "N*m", "rolling_torque": "N*m",
    "force_x": "N", "force_y": "N", "force_z": "N",
    "slip": "1", "slip_angle": "rad", "slip_velocity_x": "m/s", "slip_velocity_y": "m/s",
    "wheel_vx": "m/s", "wheel_vy": "m/s",
    "friction": "1", "deflection_x": "m", "deflection_y": "m",
    "compliance_x_rate": "m/s", "compliance_y_rate": "m/s",
}  # fmt: skip
"""(B, n, 4) signals, fl fr rl rr. Forces, slips, wheel_vx and wheel_vy (of the wheel centre) in the tire frame. torque:
drive minus brake as it acted, I_w w' = torque - rolling_torque - R_e force_x. slip, slip_angle as in P1 notes 1."""
UNITS: Final = {**CAR_UNITS, **WHEEL_UNITS}  # Unit of every signal


def signals_of(fleet: Fleet, step: Step, controls: Controls) -> dict[str, FloatArray]:
    """Every signal at the end of a step, (B,) or (4, B): states as they are, forces as means over the step."""
    s, f = step.state, step.forces
    vx, vy, r = s[B["vx"]], s[B["vy"]], s[B["yaw_rate"]]
    drag = fleet.drag * vx * np.absolute(vx)
    along, across = (f.body[0].sum(axis=0) - drag) / fleet.mass, f.body[1].sum(axis=0) / fleet.mass
    up = f.load.sum(axis=0) / fleet.mass
    roll, pitch = s[B["roll"]], s[B["pitch"]]
    ax, ay, az = _in_body(along, across, up, roll, pitch)
    spin_x, spin_y, spin_z = _in_body(s[B["roll_speed"]], -s[B["pitch_speed"]], r, roll, pitch)
    moving = step.slide
    out = {name: s[B[name]] for name in ("x", "y", "yaw", "distance", "vx", "vy", "yaw_rate", "roll", "pitch")}
    out |= {
        "yaw_acceleration": step.rates[B["yaw_rate"]], "sideslip": np.arctan2(vy, np.maximum(np.absolute(vx), 1e-3)),
        "road_ax": along, "road_ay": across, "ax": ax, "ay": ay, "az": az,
        "roll_rate": spin_x, "pitch_rate": spin_y, "yaw_gyro": spin_z,
        "grade": controls.grade, "bank": controls.bank, "drag": drag, "friction": controls.friction,
        "steer": controls.steer, "torque": step.torque, "rolling_torque": step.rolling,
        "force_x": f.tire[0], "force_y": f.tire[1], "force_z": f.load,
        "slip": slip_ratio(moving.surface, moving.velocity[0]), "slip_angle": side_slip_angle(*moving.velocity),
        "slip_velocity_x": moving.slip[0], "slip_velocity_y": moving.slip[1],
        "wheel_vx": moving.velocity[0], "wheel_vy": moving.velocity[1],
    }  # fmt: skip
    wheels = ("wheel_speed", "wheel_angle", "deflection_x", "deflection_y", "compliance_x_rate", "compliance_y_rate")
    return out | {name: s[W[name]] for name in wheels}


def _in_body(
    x: FloatArray, y: FloatArray, z: FloatArray, roll: FloatArray, pitch: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A vector of the road's axes in those of the body: the inverse of `estimators.forces.levelled`."""
    left = y * np.cos(roll) + z * np.sin(roll)
    up = z * np.cos(roll) - y * np.sin(roll)
    return x * np.cos(pitch) + up * np.sin(pitch), left, up * np.cos(pitch) - x * np.sin(pitch)
