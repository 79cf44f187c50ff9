"""The steady average lumped LuGre tire (1), (2): force and friction disturbance at a held slip velocity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from studies.papers.resilient_velocity.setting import Setting
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray

SPEED = 40.0  # rad/s
FASTEST = 30.0  # m/s, where the search for the peak ends


class Steady(NamedTuple):
    """At slip velocities (...) in m/s: deflection m, normalised force 1, friction disturbance rho_z m/s."""

    deflection: FloatArray
    force: FloatArray
    disturbance: FloatArray


def stribeck(setting: Setting, velocity: ArrayLike) -> FloatArray:
    """g(v) = mu_c + (mu_s - mu_c) exp(-|v/V_s|^0.5), shape of `velocity`."""
    vehicle = setting.parameters.vehicle
    sliding, static = vehicle["friction_sliding"].value, vehicle["friction_static"].value
    ratio = np.abs(np.asarray(velocity, float)) / vehicle["stribeck_velocity"].value
    return np.asarray(sliding + (static - sliding) * np.exp(-np.sqrt(ratio)))


def steady(setting: Setting, direction: Direction, velocity: ArrayLike, road: float, speed: float = SPEED) -> Steady:
    """z' = 0 in (1) at slip velocities v, road parameter theta and a wheel speed in rad/s:

    z = v / (a + sigma0 |v| / (theta g)), f = sigma0 z + sigma2 v, rho_z = -sigma0 |v| z / (theta g)
    """
    tire, v = setting.parameters.tire[direction], np.asarray(velocity, float)
    pull = tire.sigma0.value * np.abs(v) / (road * stribeck(setting, v))
    z = v / (setting.rolling_rate(direction, speed) + pull)
    return Steady(z, tire.sigma0.value * z + tire.sigma2.value * v, -pull * z)


def peak(setting: Setting, direction: Direction, road: float, speed: float = SPEED) -> tuple[float, float]:
    """(slip velocity in m/s, normalised force) of the first maximum of the steady force.

    The first: on slippery roads the viscous term lifts the force above it again at slip velocities that no wheel reaches.
    Raises ValueError if the force rises all the way to 30 m/s.
    """
    grid = np.linspace(0.0, FASTEST, 3001)
    falls = np.flatnonzero(np.diff(steady(setting, direction, grid, road, speed).force) < 0.0)
    if not len(falls):
        raise ValueError(f"{direction}, theta = {road:g}: the steady force has no maximum below {FASTEST:g} m/s")
    found = minimize_scalar(
        lambda v: -float(steady(setting, direction, v, road, speed).force),
        bounds=(grid[max(falls[0] - 1, 0)], grid[falls[0] + 1]),
        method="bounded",
        options={"xatol": 1e-9},
    )
    return float(found.x), -float(found.fun)
