"""One step in time: midpoint rule for the body, exact bristles, and wheels that brakes can stop.

1. Tire forces averaged over the step with the velocities at its start (`stepped_deflection`): a first guess of its end.
2. The same with the mean of the velocities at start and guessed end, and the body by the rates of change at their middle.

Bristles, with rates up to 2e4 1/s when they slide on ice, are stepped exactly; the rest is slow against a millisecond. Brake
and rolling resistance act on a wheel as dry friction, w = sign(w*) max(|w*| - h T_c/I_w, 0) with w* the wheel without them
(Moreau): a braked wheel stops and stays stopped, exactly, and I_w dw/dt = T - R_e F_x holds over every step with the torque
that acted. Second order away from such stops.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from studies.truth.layout import DEFLECTION, W
from studies.truth.plant import Controls, Forces, Plant, Slide, SteerAngles

_SMALL = 1e-3  # below, psi by its series, whose error is s^3/120


def stepped_deflection(
    z: FloatArray, v: FloatArray, a: FloatArray, h: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """z after the step, its mean and the mean of z' (same shapes); m, m/s, 1/s (not negative), s.

    What both tires have in common is a deflection with z' = v - a z, stepped exactly for v and a held over the step:

        z(h) = z e^-s + h v phi,   mean z = z phi + h v psi,   s = a h, phi = (1 - e^-s)/s, psi = (1 - phi)/s
        mean z' = (z(h) - z)/h = v - a (mean z),

    regular where a is 2e4 1/s (sliding on ice) and at a = 0 (a wheel at rest).
    """
    s = a * h
    few = s < _SMALL
    if few.any():
        safe = np.where(few, 1.0, s)
        phi = np.where(few, 1.0 - s * (0.5 - s / 6.0), -np.expm1(-safe) / safe)
        psi = np.where(few, 0.5 - s * (1.0 / 6.0 - s / 24.0), (1.0 - phi) / safe)
    else:
        phi = -np.expm1(-s) / s
        psi = (1.0 - phi) / s
    mean = z * phi + (h * v) * psi
    rate = v - a * mean
    return z + h * rate, mean, rate


class Step(NamedTuple):
    """State at the end of a step, and means over it."""

    state: FloatArray  # (STATES, B)
    rates: FloatArray  # (STATES, B) of the body; zero for wheel speeds and deflections
    forces: Forces
    torque: FloatArray  # (4, B) N m, drive minus brake, as it acted: what a torque sensor in the half shaft shows
    rolling: FloatArray  # (4, B) N m, rolling resistance, positive against forward rolling
    slide: Slide


def advance(plant: Plant, state: FloatArray, controls: Controls, h: float) -> Step:
    """One step of ``h`` seconds under controls that are held over it (best: those at its middle)."""
    car, tire, friction = plant.fleet, plant.tire, controls.friction
    steered = SteerAngles(np.sin(controls.steer), np.cos(controls.steer))
    start, load = plant.slide(state, steered), plant.loads(state)
    z, before = state[DEFLECTION].reshape(2, 4, -1), state[W["wheel_speed"]]

    def contact(at: FloatArray, moving: Slide, load: FloatArray) -> tuple[FloatArray, Forces]:
        """Deflections (2, 4, B) at the end of the step and mean forces over it; rates are taken at the deflections `at`."""
        transport = plant.transport(moving)
        a, push = tire.rates(at, moving.slip, np.absolute(moving.surface), transport, friction)
        after, mean, rate = stepped_deflection(z, push, a, h)
        return after, plant.in_body_axes(tire.forces(mean, rate, moving.slip, transport, load, friction), load, steered)

    def wheels(forces: Forces) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Wheel speeds at the end of the step, and torque and rolling resistance as they acted."""
        rolling = car.radius * car.rolling_resistance * forces.load
        most = controls.brake + rolling
        free = before + h * (controls.drive - car.radius * forces.tire[0]) / car.wheel_inertia
        after = np.sign(free) * np.maximum(np.absolute(free) - h * most / car.wheel_inertia, 0.0)
        hold = (free - after) * car.wheel_inertia / h
        share = controls.brake / np.where(most > 0.0, most, 1.0)
        return after, controls.drive - hold * share, hold * (1.0 - share)

    end_z, forces = contact(z, start, load)
    w, torque, rolling = wheels(forces)
    guess = state + h * plant.body_rates(state, forces, torque, controls)
    guess[W["wheel_speed"]] = w
    middle = Slide(*(0.5 * (a + b) for a, b in zip(start, plant.slide(guess, steered), strict=True)))
    load = 0.5 * (load + plant.loads(guess))
    end_z, forces = contact(0.5 * (z + end_z), middle, load)
    w, torque, rolling = wheels(forces)
    rates = plant.body_rates(0.5 * (state + guess), forces, torque, controls)
    out = state + h * rates
    out[W["wheel_angle"]] += 0.5 * h * (before + w)
    out[W["wheel_speed"]] = w
    out[DEFLECTION] = end_z.reshape(8, -1)
    return Step(out, rates, forces, torque, rolling, middle)
