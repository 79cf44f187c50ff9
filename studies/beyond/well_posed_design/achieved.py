"""What gains really do: norms and poles at constant wheel speeds, whatever they were designed for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from analysis.norms.h2 import h2_norm
from analysis.norms.observer_error import error_hinf_norm, selection
from estimators.arrays import FloatArray
from studies.beyond.well_posed_design.cases import VELOCITY, Case
from studies.study import Cell

COLUMNS = (
    "friction gain [1]", "force noise gain [m/s]", "H2 gain, white force noise [m/s sqrt(Hz)]", "acceleration gain [s]",
    "slowest pole [1/s]", "fastest pole [1/s]",
)  # fmt: skip


class Achieved(NamedTuple):
    """Worst over the wheel speeds (held constant), arrays over the leading axes of the gains; `COLUMNS` of tables.

    friction, noise: H-infinity gains to the velocity error, 1 and m/s per unit of normalised force; noise_density: its H2
    norm, m/s for white force noise of unit two-sided density, 1 per sqrt(Hz); acceleration in s; slowest and fastest
    pole as distances from the imaginary axis, 1/s.
    """

    friction: FloatArray
    noise: FloatArray
    noise_density: FloatArray
    acceleration: FloatArray
    slowest: FloatArray
    fastest: FloatArray


def achieved(case: Case, gains: FloatArray, wheel_speed: FloatArray) -> Achieved:
    """For gains (..., g, 2) at wheel speeds (g,) rad/s, one gain vector for each of them; NaN gains give NaN."""
    lead, flat = gains.shape[:-2], gains.reshape(-1, 2, 1)
    points = np.tile(wheel_speed, len(flat) // len(wheel_speed))
    there = np.asarray(np.isfinite(flat).all(axis=(1, 2)))
    flat, points = flat[there], points[there]
    A_e, B_e = case.model.on(points).error_dynamics(flat)
    poles = -np.linalg.eigvals(A_e).real

    def worst(values: FloatArray) -> FloatArray:
        full = np.full(len(there), np.nan)
        full[there] = values
        return np.asarray(full.reshape(*lead, len(wheel_speed)).max(axis=-1))

    def norm(disturbance: str) -> FloatArray:
        return worst(error_hinf_norm(case.model, flat, points, (disturbance,), VELOCITY, tolerance=1e-8).norm)

    d, z = selection(case.model, ("force_noise",), VELOCITY)
    density, slowest, fastest = worst(h2_norm(A_e, B_e @ d, z)), -worst(-poles.min(axis=-1)), worst(poles.max(axis=-1))
    return Achieved(norm("friction"), norm("force_noise"), density, norm("acceleration_error"), slowest, fastest)


def printed_achieved(case: Case, points: int = 57) -> Achieved:
    """Of the printed gains, the same at every wheel speed."""
    grid = case.grid(points)
    return achieved(case, np.broadcast_to(case.printed, (len(grid), 2)), grid)


def short(values: Sequence[float]) -> list[Cell]:
    """Six digits for a table, empty cells for NaN."""
    return [None if np.isnan(value) else float(f"{value:.6g}") for value in values]
