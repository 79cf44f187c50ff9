"""Small drives whose answer is known in closed form, and drive files for them.

Constant acceleration a and constant slip: v = v0 + a t, R w = (1 + s) v. Then v_r = s v, and the bristles rest,
z = s/(kappa (1 + s)), because dz/dt = v_r - kappa R w z = 0 (P1 (20) without friction). So (23) gives
mu = sigma0 z + sigma2 v_r exactly: observers with these tire values must find v, the mean wheel speed is off by s v
and the integrated acceleration, which starts from it, by s v0.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from estimators.schedule import write_content
from studies.drives.quantities import CORNERS
from tests.support.schedule_content import EFFECTIVE_RADIUS, PUBLISHED, schedule_content

SIGMA0, _, SIGMA2, KAPPA = PUBLISHED["longitudinal"]["constants"]
MASS, GRAVITY = 1600.0, 9.80665
FRONT, REAR, HEIGHT, TRACK, INERTIA = 1.2, 1.4, 0.55, 1.5, 1.5
START, SLIP = 5.0, 0.008

DRIVE = f"""
schema = "gainsmith.drive/1"
name = "closed form"
sample_time = "5 ms"

[vehicle]
mass = "{MASS} kg"
front_axle_distance = "{FRONT} m"
rear_axle_distance = "{REAR * 100} cm"
cg_height = "{HEIGHT} m"
front_track = "{TRACK} m"
rear_track = "{TRACK} m"
effective_radius_front = "{EFFECTIVE_RADIUS} m"
effective_radius_rear = "{EFFECTIVE_RADIUS} m"
wheel_inertia = "{INERTIA} kg*m^2"

[schedules]
longitudinal = "schedule.json"

[observer]
derivative_lag = "0 s"

[[log]]
name = "log"
time = "t"
rate = "200 Hz"

[signals]
wheel_speed_fl = {{ column = "w_fl", unit = "rad/s" }}
wheel_speed_fr = {{ column = "w_fr", unit = "rad/s" }}
wheel_speed_rl = {{ column = "w_rl", unit = "rad/s" }}
wheel_speed_rr = {{ column = "w_rr", unit = "rad/s" }}
ax = {{ column = "ax", unit = "m/s^2" }}

[reference]
vx = {{ column = "v", unit = "m/s" }}
"""
TORQUES = "".join(f'torque_{c} = {{ column = "T_{c}", unit = "N*m" }}\n' for c in CORNERS)


def acceleration() -> float:
    """The a for which m a_x shared by load is right: mu = a/g = sigma0 s/(kappa (1 + s)) at every wheel, sigma2 small."""
    return float(GRAVITY * SIGMA0 * SLIP / (KAPPA * (1 + SLIP)))


def columns(duration: float = 3.0, rate: float = 200.0, start: float = START) -> dict[str, np.ndarray[Any, Any]]:
    """A log of the closed form: time, wheel speeds, torques, acceleration and velocity, SI."""
    a = acceleration()
    t = np.arange(round(duration * rate) + 1) / rate
    v = start + a * t
    w = (1 + SLIP) * v / EFFECTIVE_RADIUS
    mu = SIGMA0 * SLIP / (KAPPA * (1 + SLIP)) + SIGMA2 * SLIP * v
    base = FRONT + REAR
    front = MASS / base * (REAR * GRAVITY - HEIGHT * a) / 2
    rear = MASS / base * (FRONT * GRAVITY + HEIGHT * a) / 2
    loads = dict(zip(CORNERS, (front, front, rear, rear), strict=True))
    spin = INERTIA * (1 + SLIP) * a / EFFECTIVE_RADIUS
    return {
        "t": t,
        "v": v,
        "ax": np.full_like(t, a),
        **{f"w_{c}": w for c in CORNERS},
        **{f"T_{c}": mu * loads[c] * EFFECTIVE_RADIUS + spin for c in CORNERS},
    }


def write_log(path: Path, table: dict[str, np.ndarray[Any, Any]]) -> Path:
    """A CSV file of the columns."""
    rows = np.stack(list(table.values()), axis=1)
    lines = [",".join(table), *(",".join(repr(float(x)) for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_drive(folder: Path, text: str = DRIVE) -> Path:
    """A drive file with a schedule of the published gains beside it."""
    write_content(folder / "schedule.json", schedule_content())
    path = folder / "drive.toml"
    path.write_text(text, encoding="utf-8")
    return path
