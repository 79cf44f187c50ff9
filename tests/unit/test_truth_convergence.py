"""The step of the truth: against an adaptive stiff integrator of scipy on the same equations, and its order."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from estimators.arrays import FloatArray
from studies.truth.course import Course
from studies.truth.layout import B, W, rolling
from studies.truth.profile import GRID
from studies.truth.road import Zone
from studies.truth.simulate import STEP
from tests.support.truth_cases import TIRES, course, plant_of, ramp, run, suv

AT = 0.05 * np.arange(1, 10)
PATCH = Zone(0.3, (True, False, True, False), from_place=3.0, to_place=7.0)
CASES = {
    "turn and drive": {"speed": 15.0, "steer": ramp(0.1, 0.3, 0.06), "drive_torque": ramp(0.1, 0.4, 3000.0)},
    "brake on split": {"speed": 20.0, "brake_torque": ramp(0.05, 0.3, 1700.0), "zones": (PATCH,)},
    "launch on ice": {"speed": 0.0, "drive_torque": ramp(0.1, 0.2, 2500.0), "friction": 0.2},
}
BOUNDS = {"vx": 2e-4, "vy": 1e-4, "yaw_rate": 5e-5, "roll": 1e-5, "pitch": 1e-5, "wheel_speed": 2e-2}
"""At the default step: m/s, m/s, rad/s, rad, rad, rad/s."""


def case(tire: str, name: str) -> Course:
    return course(tire=tire, duration=0.5, **CASES[name])  # type: ignore[arg-type]


@cache
def reference(tire: str, name: str) -> FloatArray:
    """(STATES, times) of LSODA at tight tolerances."""
    one = case(tire, name)
    plant, controls = plant_of(one, suv())

    def slope(time: float, y: FloatArray) -> FloatArray:
        state = y[:, None]
        return np.asarray(plant.derivative(state, controls(state, time))[0][:, 0])

    start = rolling([one.initial_speed], plant.fleet.radius)[:, 0]
    end = one.duration
    done = solve_ivp(slope, (0.0, end), start, "LSODA", AT, rtol=1e-7, atol=1e-9, max_step=GRID)
    assert done.success
    return np.asarray(done.y)


def errors(tire: str, name: str, step: float) -> dict[str, float]:
    found = run(case(tire, name), step=step, record_time=0.05)
    exact = reference(tire, name)
    out = {q: np.abs(found[q][0, 1:-1] - exact[B[q]]).max() for q in BOUNDS if q != "wheel_speed"}
    return out | {"wheel_speed": np.abs(found["wheel_speed"][0, 1:-1] - exact[W["wheel_speed"]].T).max()}


@pytest.mark.parametrize("tire", TIRES)
@pytest.mark.parametrize("name", CASES)
def test_default_step_is_fine_enough(tire: str, name: str) -> None:
    found = errors(tire, name, STEP)
    assert all(found[q] < bound for q, bound in BOUNDS.items()), found
    assert np.ptp(reference(tire, name)[B["vx"]]) > 0.25  # something happened


@pytest.mark.parametrize("tire", TIRES)
def test_error_falls_with_the_square_of_the_step(tire: str) -> None:
    coarse, fine = (errors(tire, "turn and drive", step) for step in (0.002, 0.0005))
    assert fine["yaw_rate"] < coarse["yaw_rate"] / 8.0  # 16 for second order, 4 for first
    assert fine["wheel_speed"] < coarse["wheel_speed"] / 8.0


def test_a_coarse_step_fails_the_bounds() -> None:
    found = errors("lugre", "brake on split", 0.005)
    assert any(found[q] > bound for q, bound in BOUNDS.items())
