"""The error of the sliding-mode observer while the true forces are constant: P5 (A.1), Euler steps, many starts at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from analysis.bounds_sliding_mode import PUBLISHED, SlidingModeGains, Vehicle
from synthesis.models.catalogue.single_track import PEUGEOT_307
from synthesis.polynomials.matrix import FloatArray

CAR = Vehicle.of(PEUGEOT_307)
STATES = ("yaw rate", "front lateral force", "rear lateral force", "front longitudinal force")
# Largest measured values of Table 1, at which the observer is started: rad/s, N, N, N.
LARGEST = np.array([np.radians(33.6), 6282.0, 3663.0, 6181.0])
INITIAL_FRONT_FORCE = 5448.0  # N, the one initial value that is printed


def matrices(car: Vehicle = CAR) -> tuple[FloatArray, FloatArray]:
    """Model (4, 4) and outputs (3, 4) of P5 (1)-(4)."""
    model, outputs = np.zeros((4, 4)), np.zeros((3, 4))
    model[0, 1:3] = car.front_axle_distance / car.yaw_inertia, -car.rear_axle_distance / car.yaw_inertia
    outputs[0, 0], outputs[1, 1:3], outputs[2, 3] = 1.0, 1.0 / car.mass, 1.0 / car.mass
    return model, outputs


def error_motion(
    start: ArrayLike,
    seconds: float,
    sample_time: float = 0.01,
    widths: ArrayLike | None = None,
    gains: SlidingModeGains = PUBLISHED,
) -> FloatArray:
    """Errors (n, ..., 4) after each step from `start` (..., 4); `widths` (3,) of the linear zones, None: the bare sign."""
    model, outputs = matrices()
    error, path = np.array(start, float), []
    for _ in range(round(seconds / sample_time)):
        y = error @ outputs.T
        switching = np.sign(y) if widths is None else np.clip(y / np.asarray(widths), -1.0, 1.0)
        error = error + sample_time * (error @ model.T - switching @ gains.matrix.T)
        path.append(error)
    return np.array(path)


def split(error: FloatArray) -> FloatArray:
    """L_1 x_2 - L_2 x_3 in N m: the yaw moment that the error of the split stands for."""
    return np.asarray(CAR.front_axle_distance * error[..., 1] - CAR.rear_axle_distance * error[..., 2])


def split_tracking(frequency: ArrayLike, yaw_width: float, gains: SlidingModeGains = PUBLISHED) -> FloatArray:
    r"""|error / true| of the split L_1 F_y1 - L_2 F_yw2 that oscillates with `frequency` [Hz], inside the yaw rate zone.

    s (s + d) / (s^2 + d s + k) with d = Omega_1 / width and k = Omega_4 (L_1 + L_2) / (width I_z), from (1) and (6) with s(e) =
    e / width. For slow motion it is |s| d / k = |s| Omega_1 I_z / (Omega_4 (L_1 + L_2)): a lag of 0.29 s for every width.
    """
    s = 2j * np.pi * np.asarray(frequency, float)
    d = gains[1] / yaw_width
    k = gains[4] * (CAR.front_axle_distance + CAR.rear_axle_distance) / (yaw_width * CAR.yaw_inertia)
    return np.abs(s * (s + d) / (s**2 + d * s + k))
