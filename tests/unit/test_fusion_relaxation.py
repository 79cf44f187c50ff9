"""Tires whose side force follows their slip over a length of road."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.vehicle import GRAVITY
from estimators.velocity import FusionSettings, VelocityFusion
from tests.support.fusion_course import CAR, STEP, Signals
from tests.support.turning_course import Turn, run

AT_ONCE = 1e-6  # m


def slalom(relaxation: float, seconds: float = 12.0, speed: float = 10.0) -> Turn:
    """A single-track car on linear tires, 0.09 rad per F_y/F_z, that follow within `relaxation` m; strokes of 0.6 Hz, 4 m/s^2."""
    n, car, fine = round(seconds / STEP), CAR, 20
    dt, arms = STEP / fine, np.array([car.front_axle_distance, -car.rear_axle_distance])
    loads = car.mass * GRAVITY * arms[::-1] * np.array([-1.0, 1.0]) / car.wheelbase
    time = STEP * np.arange(n)
    delta = 0.1 * np.sin(1.2 * np.pi * time) * np.clip(time - 1.0, 0.0, 1.0)
    vy = turn = 0.0
    force = np.zeros(2)
    rows = np.zeros((n, 4))
    for k in range(n):
        for _ in range(fine):
            slip = np.array([delta[k], 0.0]) - np.arctan((vy + arms * turn) / speed)
            force += (1.0 - np.exp(-speed * dt / relaxation)) * (slip / 0.09 * loads - force)
            felt, spin = force.sum() / car.mass, float(arms @ force) / car.yaw_inertia
            vy, turn = vy + dt * (felt - speed * turn), turn + dt * spin
        rows[k] = vy, turn, felt, spin
    vy, turn, felt, _ = rows.T
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(3, n)) * np.array([[0.05], [0.05], [0.002]])
    steer = np.stack([delta, delta, 0.0 * delta, 0.0 * delta], axis=1)
    across = vy[:, None] + turn[:, None] * car.corner_x
    along = (speed - turn[:, None] * car.corner_y) * np.cos(steer) + across * np.sin(steer)
    wheels = along / car.radius + 0.05 * rng.normal(size=(n, 4))
    signals = Signals(wheels, steer, -turn * vy + noise[0], felt + noise[1], turn + noise[2], np.zeros((n, 4)))
    return Turn(signals, np.full(n, speed), vy)


def error(relaxation: float, assumed: float) -> float:
    """RMS of V_y, m/s, once the tires are learned."""
    found = run(slalom(relaxation), VelocityFusion(CAR, STEP, settings=FusionSettings(relaxation_length=assumed)))
    return float(np.sqrt(np.mean(found.error_y[round(4.0 / STEP) :] ** 2)))


@pytest.mark.parametrize("relaxation", [0.2, 0.4])
def test_slip_that_is_ahead_of_its_force_is_not_v_y(relaxation: float) -> None:
    """Beside a fusion that takes tires for ones that follow at once."""
    assert error(relaxation, FusionSettings().relaxation_length) < 0.5 * error(relaxation, AT_ONCE)


def test_tires_that_follow_at_once() -> None:
    """The negative control: what is assumed costs something where it is not so, as much as it gains where it is."""
    assert 0.015 < error(AT_ONCE, FusionSettings().relaxation_length) < 0.05
    assert error(AT_ONCE, AT_ONCE) < 0.01
