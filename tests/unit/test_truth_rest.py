"""Standing, parking on a slope, braking to a stop, driving backwards: where slips divide by nothing."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.vehicle import GRAVITY
from studies.truth import Truth, simulate
from tests.support.truth_cases import TIRES, course, ramp, suv

GRADE, BANK = float(np.arctan(0.15)), float(np.arctan(0.05))
FREE = {"rolling_resistance": 0.0, "drag_area": 0.0}
CASES = {
    "standing": ({}, {}),
    "parked": ({"brake_torque": lambda t: 6000.0 + 0.0 * t, "grade": ramp(0.0, 0.5, GRADE), "bank": ramp(0.0, 0.5, BANK)}, {}),
    "released": ({"grade": ramp(0.0, 0.01, 0.1)}, FREE),
    "stop": ({"speed": 8.0, "brake_torque": ramp(0.1, 0.3, 5000.0)}, {}),
    "back": ({"speed": -5.0, "steer": ramp(0.1, 0.4, 0.05), "drive_torque": ramp(0.7, 0.9, -800.0)}, {}),
    "turn round": ({"speed": 2.0, "drive_torque": lambda t: -1500.0 + 0.0 * t, "steer": lambda t: 0.1 + 0.0 * t}, {}),
}  # fmt: skip


@pytest.fixture(scope="module", params=TIRES)
def drives(request: pytest.FixtureRequest) -> Truth:
    courses = [course(tire=request.param, duration=3.0, name=name, **keys) for name, (keys, _) in CASES.items()]  # type: ignore[arg-type]
    cars = [suv(**changes) for _, changes in CASES.values()]
    return simulate(courses, cars, record_time=0.01)


def test_everything_stays_finite(drives: Truth) -> None:
    assert all(bool(np.isfinite(value).all()) for value in drives.signals.values())


def test_a_standing_car_stands(drives: Truth) -> None:
    truth = drives.only("standing")
    for name in ("vx", "vy", "yaw_rate", "roll", "pitch", "wheel_speed", "force_x", "force_y"):
        assert np.abs(truth[name]).max() < 1e-9, name
    assert truth["force_z"][0, -1] == pytest.approx(suv().parameters.static_loads)
    assert truth["az"][0] == pytest.approx(GRAVITY)


def test_brakes_hold_a_car_on_a_slope(drives: Truth) -> None:
    """On 15 % uphill and 5 % bank, once the body has settled: no creeping, and the tires carry m g sin(grade)."""
    truth = drives.only("parked")
    late = truth.time > 2.5
    weight = suv().parameters.mass * GRAVITY
    along, across = (truth[name][0, late].sum(axis=1).mean() for name in ("force_x", "force_y"))
    assert along == pytest.approx(weight * np.sin(GRADE), rel=3e-3)
    assert across == pytest.approx(weight * np.cos(GRADE) * np.sin(BANK), rel=1e-2)
    assert np.abs(truth["vx"][0, late]).max() < 5e-3
    assert np.ptp(truth["x"][0, late]) < 2e-3
    assert (truth["wheel_speed"][0, late] == 0.0).all()
    # at rest the accelerometers read gravity alone: nose up (road and body) forward, left side up to the left
    total = truth["pitch"][0, late] + GRADE
    assert truth["ax"][0, late].mean() == pytest.approx((GRAVITY * np.sin(total)).mean(), abs=0.02)
    assert truth["ay"][0, late].mean() == pytest.approx(
        (GRAVITY * np.sin(truth["roll"][0, late] + BANK)).mean(), abs=0.03
    )


def test_without_brakes_it_rolls_back(drives: Truth) -> None:
    truth, own = drives.only("released"), suv().parameters
    rolling_mass = own.mass + 4.0 * own.wheel_inertia / own.radius[0] ** 2
    expected = -own.mass * GRAVITY * np.sin(0.1) / rolling_mass
    assert np.polyfit(truth.time[50:], truth["vx"][0, 50:], 1)[0] == pytest.approx(expected, rel=2e-3)
    assert (truth["wheel_speed"][0, -1] < -5.0).all()
    assert truth["distance"][0, -1] < -2.0


def test_braking_to_a_stop_stays_there(drives: Truth) -> None:
    truth = drives.only("stop")
    stopped = truth.time > 2.0
    assert np.abs(truth["vx"][0, stopped]).max() < 0.1
    assert np.abs(truth["vx"][0, -50:]).max() < 3e-2
    assert (truth["wheel_speed"][0, stopped] == 0.0).all()
    assert np.abs(truth["torque"][0, stopped]).max() < 2000.0  # what it takes to hold, not what the brake could do
    assert truth["vx"][0].min() > -0.5  # springs give back a nod, no more


def test_backwards_is_forwards_turned_round(drives: Truth) -> None:
    """Steering left while backing turns the nose to the right; pushed backwards, wheels turn faster than they roll."""
    truth = drives.only("back")
    kinematic = truth["vx"][0, 65] * np.tan(0.05) / suv().parameters.wheelbase
    assert truth["vx"][0, 65] < -4.5 and truth["vx"][0, -1] < -6.0
    assert truth["yaw_rate"][0, 65] == pytest.approx(kinematic, rel=0.1)
    assert (truth["slip"][0, 100:] < 0.0).all()


def test_from_forwards_through_rest_to_backwards(drives: Truth) -> None:
    vx = drives.only("turn round")["vx"][0]
    assert vx[0] > 1.9 and vx[-1] < -2.0
    assert np.abs(np.diff(vx)).max() < 0.05  # no jump anywhere on the way
