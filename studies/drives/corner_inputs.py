"""From recorded signals to the inputs of the four corner observers.

Pure functions of arrays: n samples, four corners in the order fl, fr, rl, rr, SI units, frame x forward, y left, z up.
Vertical load and force before friction: no road parameter enters anywhere. Source: P1 (1), (13)-(17) and section 6.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.vehicle import GRAVITY

Array = npt.NDArray[np.float64]
LEAST_LOAD = 0.05
"""Share of the static load below which a wheel counts as lifted and its normalised force as unknown."""


def derivative(value: Array, sample_time: float, lag: float) -> Array:
    """Causal first-order derivative of (n,) samples: y' = (x' - y)/lag, per second.

    Exact for piecewise linear x: y[k] = a y[k-1] + (1 - a) (x[k] - x[k-1])/Ts with a = exp(-Ts/lag); lag 0 is the
    backward difference. The derivative comes late by lag + Ts/2; the first difference is taken as it is. NaN where x or
    its predecessor is missing; the filter starts afresh behind.
    """
    slope = np.diff(value, prepend=np.nan) / sample_time
    a = float(np.exp(-sample_time / lag)) if lag > 0 else 0.0
    out = np.empty(value.shape)
    last = np.nan
    for k, new in enumerate(slope):
        last = new if np.isnan(last) else a * last + (1.0 - a) * new
        out[k] = last
    return out


def vertical_loads(
    ax: Array,
    ay: Array,
    mass: float,
    front_axle_distance: float,
    rear_axle_distance: float,
    cg_height: float,
    front_track: float,
    rear_track: float,
) -> Array:
    """Quasi-static wheel loads (n, 4), N, from accelerations (n,), m/s^2, of a level car: P1 (14)-(17) at zero angles.

    Fz_f = m (L_r g - h a_x)/L,  Fz_r = m (L_f g + h a_x)/L,  Fz_iL,R = Fz_i (1/2 -+ h a_y/(g T_i)),  L = L_f + L_r.
    Leaves out roll and pitch dynamics (their overshoot, about 0.1 to 0.3 s after a step) and road grade.
    """
    base = front_axle_distance + rear_axle_distance
    front = mass / base * (rear_axle_distance * GRAVITY - cg_height * ax)
    rear = mass / base * (front_axle_distance * GRAVITY + cg_height * ax)
    shift_front = cg_height * ay / (GRAVITY * front_track)
    shift_rear = cg_height * ay / (GRAVITY * rear_track)
    return np.stack(
        [
            front * (0.5 - shift_front),
            front * (0.5 + shift_front),
            rear * (0.5 - shift_rear),
            rear * (0.5 + shift_rear),
        ],
        axis=-1,
    )


def wheel_forces(
    torque: Array,
    wheel_speed: Array,
    wheel_acceleration: Array,
    vertical_load: Array,
    inertia: float,
    radius: Array,
    rolling_resistance: float,
    stopped_below: float,
) -> Array:
    """Longitudinal forces (n, 4), N, from wheel dynamics: F_x = (T - I_w dw/dt)/R_e - c_rr F_z sign(w), P1 (1).

    ``torque`` N m (drive minus brake), ``wheel_acceleration`` rad/s^2, ``radius`` (4,) m. P1 has no rolling
    resistance (c_rr = 0). NaN where the torque is unknown and where the wheel stands still (|w| < ``stopped_below``,
    rad/s): a stopped brake holds whatever friction asks of it, so its commanded torque says nothing about the force.
    """
    force = (torque - inertia * wheel_acceleration) / radius - rolling_resistance * vertical_load * np.sign(wheel_speed)
    stopped = np.abs(wheel_speed) < stopped_below
    stopped[1:] |= stopped[:-1]  # dw/dt behind a stop spans an interval with the wheel still held
    return np.where(stopped, np.nan, force)


def shared_forces(ax: Array, vertical_load: Array, mass: float, dynamics: Array, known: npt.NDArray[np.bool_]) -> Array:
    """Longitudinal forces (n, 4), N: what m a_x leaves, shared by load: F_i = (m a_x - sum of known) F_zi / sum F_z.

    ``dynamics`` (n, 4) counts at the corners marked in ``known`` (4,); the sum of loads runs over the others. With none
    known this is m a_x F_zi / sum F_z: right in sum, and at each corner only if all wheels use the same share of their
    load. Leaves out the drag of air and the steering angle (1 - cos delta).
    """
    forces = dynamics.copy()
    rest = mass * ax - dynamics[:, known].sum(axis=1)
    share = vertical_load[:, ~known] / vertical_load[:, ~known].sum(axis=1, keepdims=True)
    forces[:, ~known] = rest[:, None] * share
    return forces


def normalised_forces(force: Array, vertical_load: Array, static_load: float) -> Array:
    """mu = F_x/F_z (n, 4), P1 (13); NaN where a wheel carries less than 5 % of ``static_load``, N."""
    lifted = vertical_load < LEAST_LOAD * static_load
    return np.where(lifted, np.nan, force / np.where(lifted, 1.0, vertical_load))


def corner_positions(
    front_axle_distance: float, rear_axle_distance: float, front_track: float, rear_track: float
) -> tuple[Array, Array]:
    """x_c and y_c (4,) of the wheel centres from the centre of gravity, m: x_f = L_f, x_r = -L_r, y_L = +T/2."""
    x = np.array([front_axle_distance, front_axle_distance, -rear_axle_distance, -rear_axle_distance])
    y = np.array([front_track, -front_track, rear_track, -rear_track]) / 2
    return x, y


def corner_acceleration(
    ax: Array,
    ay: Array,
    yaw_rate: Array,
    yaw_acceleration: Array,
    vy: Array,
    steer: Array,
    steer_rate: Array,
    x: Array,
    y: Array,
) -> tuple[Array, Array]:
    """Acceleration of the wheel centres along the tyre's x axis, m/s^2, as (n, 4) arrays p, q of p + q V_x.

    P1 section 6 with the steering-rate term: d(v_xt)/dt = v'_xc cos d + v'_yc sin d + d' v_yt,
    v'_xc = a_x + r V_y - r' y_c,  v'_yc = a_y - r V_x + r' x_c,  v_yt = -(V_x - r y_c) sin d + (V_y + r x_c) cos d.
    The only unknown in it is V_x, which the observers estimate: hence the split. Accelerations are those of the
    centre of gravity, without gravity; ``steer``, ``steer_rate`` (n, 4), the rest (n,); V_y is 0 where nobody knows it.
    """
    r, dr, v = yaw_rate[:, None], yaw_acceleration[:, None], vy[:, None]
    sine, cosine = np.sin(steer), np.cos(steer)
    along = ax[:, None] + r * v - dr * y
    across = ay[:, None] + dr * x
    free = along * cosine + across * sine + steer_rate * (r * y * sine + (v + r * x) * cosine)
    return free, -(r + steer_rate) * sine
