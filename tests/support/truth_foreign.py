"""A third vehicle, by other people: the multi-body and the single-track drift model of commonroad-vehicle-models.

They are driven through the same courses and leave the same `Truth` behind, as far as they know the signals. The frame of
the multi-body model has z down and y right; it is symmetric, so left and right are exchanged by reading it as y left.
Both take steering rate and longitudinal acceleration as inputs, and have the torque m R a at their wheels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.suspension import SuspensionParameters
from studies.truth import Chassis, Drivetrain, Truth, TruthVehicle
from studies.truth.course import Course
from studies.truth.magic_formula import MagicFormulaParameters
from studies.truth.profile import GRID
from tests.support.truth_cases import published

RECORD = 0.01


def bmw_320i() -> Any:
    from vehiclemodels.parameters_vehicle2 import parameters_vehicle2

    return parameters_vehicle2()


def as_truth_vehicle(p: Any) -> TruthVehicle:
    """Our double-track car with the foreign one's masses, lengths and tire; what ours adds is switched off."""
    tire = p.tire
    wide = 100.0  # p_Ky2: the foreign tire's stiffness is proportional to load
    same = MagicFormulaParameters(
        shape=(tire.p_cx1, tire.p_cy1),
        peak=(tire.p_dx1, tire.p_dy1),
        peak_load=(0.0, 0.0),
        curve=(tire.p_ex1, tire.p_ey1),
        curve_load=(0.0, 0.0),
        curve_load2=(0.0, 0.0),
        stiffness_x=(tire.p_kx1, 0.0, 0.0),
        stiffness_y=(-tire.p_ky1 * wide / 2.0, wide),
        relaxation=(0.05, 0.05),
        nominal_friction=1.0,
    )
    car = VehicleParameters(
        mass=p.m,
        yaw_inertia=p.I_z,
        wheel_inertia=p.I_y_w,
        front_axle_distance=p.a,
        rear_axle_distance=p.b,
        cg_height=p.h_cg,
        front_track=p.T_f,
        rear_track=p.T_r,
        effective_radius=p.R_w,
        roll_center_height=(p.h_raf + p.h_rar) / 2.0,
    )
    stiff = SuspensionParameters(stiffness_x=1e7, stiffness_y=1e7, damping_x=2e4, damping_y=2e4)
    return TruthVehicle(
        "bmw-320i",
        car,
        published().lugre,
        drivetrain=Drivetrain(layout="RWD"),
        chassis=Chassis(rolling_resistance=0.0, drag_area=0.0),
        suspension=stiff,
        magic_formula=same,
    )


def drive_foreign(course: Course, model: str, p: Any) -> Truth:
    """The course with the "mb" (multi-body) or "std" (single-track drift) model; steering and drive torque alone."""
    from vehiclemodels.init_mb import init_mb
    from vehiclemodels.init_std import init_std
    from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
    from vehiclemodels.vehicle_dynamics_std import vehicle_dynamics_std

    t = GRID * np.arange(course.steer.size)
    rate = np.diff(course.steer, append=course.steer[-1]) / GRID
    start = [0.0, 0.0, float(course.steer[0]), course.initial_speed, 0.0, 0.0, 0.0]
    made: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {
        "mb": (vehicle_dynamics_mb, init_mb),
        "std": (vehicle_dynamics_std, init_std),
    }
    dynamics, initial = made[model]

    def inputs(time: float) -> list[float]:
        k = min(int(time / GRID + 1e-9), rate.size - 1)
        torque = float(np.interp(time, t, course.drive_torque))
        return [float(rate[k]), torque / (p.m * p.R_w)]

    def slope(time: float, x: Any) -> Any:
        return dynamics(list(x), inputs(time), p)

    at = RECORD * np.arange(round(course.duration / RECORD) + 1)
    done = solve_ivp(slope, (0.0, at[-1]), initial(start, p), "LSODA", at, rtol=1e-6, atol=1e-8, max_step=GRID)
    assert done.success
    x, rates = done.y, np.array([slope(time, row) for time, row in zip(at, done.y.T, strict=True)]).T
    if model == "mb":
        vx, vy, w = x[3], x[10], x[23:27]
        along, across = rates[3] - x[5] * vy, rates[10] + x[5] * vx
        speeds = w.T
        lean = x[6]
    else:
        vx, vy = x[3] * np.cos(x[6]), x[3] * np.sin(x[6])
        dvx = rates[3] * np.cos(x[6]) - x[3] * np.sin(x[6]) * rates[6]
        dvy = rates[3] * np.sin(x[6]) + x[3] * np.cos(x[6]) * rates[6]
        along, across = dvx - x[5] * vy, dvy + x[5] * vx
        speeds = np.stack([x[7], x[7], x[8], x[8]], axis=1)
        lean = np.zeros_like(vx)
    push = np.interp(at, t, course.drive_torque)
    share = 0.5 * np.array([p.T_se, p.T_se, 1.0 - p.T_se, 1.0 - p.T_se])
    angles = np.zeros((at.size, 4))
    angles[:, :2] = x[2][:, None]
    level = np.zeros_like(vx)
    signals = {
        "vx": vx,
        "vy": vy,
        "yaw_rate": x[5],
        "road_ax": along,
        "road_ay": across,
        "ax": along,
        "ay": across * np.cos(lean) + GRAVITY * np.sin(lean),
        "az": level + GRAVITY,
        "yaw_gyro": x[5],
        "roll_rate": level,
        "pitch_rate": level,
        "roll": lean,
        "wheel_speed": speeds,
        "steer": angles,
        "torque": push[:, None] * share,
    }
    return Truth(
        at,
        {name: value[None] for name, value in signals.items()},
        (course.name,),
        np.array([course.duration]),
        (as_truth_vehicle(p),),
        (f"commonroad {model}",),
    )
