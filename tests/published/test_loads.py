"""Vertical loads: P1 (14)-(17), P2 (13)-(14), P3 (26)-(27) (references P1-loads, P3-26)."""

from __future__ import annotations

from dataclasses import fields
from functools import partial

import numpy as np
import pytest

from analysis import loads
from analysis.errors import AnalysisError
from synthesis.models.parameter_set import load_parameter_set

GRAVITY = 9.81  # m/s^2, with which the papers compute
vertical_loads = partial(loads.vertical_loads, gravity=GRAVITY)
P1 = load_parameter_set("corner-estimation")
P2 = load_parameter_set("longitudinal-speed")
P3 = load_parameter_set("resilient-velocity")


def test_static_loads_are_the_lever_rule() -> None:
    rest = vertical_loads(P1, 0.0, 0.0)
    np.testing.assert_allclose([rest.front, rest.rear], [11173.4, 11095.3], atol=0.05)
    assert rest.front == pytest.approx(2270 * GRAVITY * 1.43 / 2.85, rel=1e-14)
    assert rest.rear == pytest.approx(2270 * GRAVITY * 1.42 / 2.85, rel=1e-14)
    assert rest.front_left == rest.front_right == pytest.approx(float(rest.front) / 2)
    rest = vertical_loads(P3, 0.0, 0.0)
    np.testing.assert_allclose([rest.front, rest.rear], [11468.8, 11388.5], atol=0.06)


def test_transfer_per_unit_of_acceleration() -> None:
    """Longitudinal m h / L a_x = 517.7 N per m/s^2; lateral m_i h / T_i each side."""
    rest, driving, turning = (vertical_loads(P1, *a) for a in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    assert driving.rear - rest.rear == pytest.approx(2270 * 0.65 / 2.85, rel=1e-12)
    assert driving.rear - rest.rear == pytest.approx(517.72, abs=5e-3)
    assert driving.front - rest.front == pytest.approx(-517.72, abs=5e-3)
    shift = float(rest.front) / GRAVITY * 0.65 / 1.62
    assert turning.front_right - rest.front_right == pytest.approx(shift, rel=1e-10)
    assert turning.front_left - rest.front_left == pytest.approx(-shift, rel=1e-10)
    assert shift == pytest.approx(457.0, abs=0.05)


def test_sums_hold_for_any_motion() -> None:
    """Axles add to m a_tz; the two corners of an axle to m_i a_fz (P1 notes 11 item 12)."""
    random = np.random.default_rng(0)
    ax, ay, az, pitch, roll = random.normal([0, 0, 9.81, 0, 0], [3, 4, 0.5, 0.05, 0.08], (200, 5)).T
    for vehicle in (P1, P2, P3):
        found = vertical_loads(vehicle, ax, ay, az, pitch, roll)
        mass = vehicle.vehicle["mass"].value
        np.testing.assert_allclose(
            found.front + found.rear, mass * (az * np.cos(pitch) - ax * np.sin(pitch)), rtol=1e-12
        )
        upright = az * np.cos(roll) - ay * np.sin(roll)
        np.testing.assert_allclose(found.front_left + found.front_right, found.front / GRAVITY * upright, rtol=1e-12)
        np.testing.assert_allclose(found.rear_left + found.rear_right, found.rear / GRAVITY * upright, rtol=1e-12)


def test_p1_p2_and_p3_print_the_same_formulas() -> None:
    same = [vertical_loads(vehicle, 1.0, -2.0, 9.7, 0.02, 0.03) for vehicle in (P1, P2)]
    for entry in fields(same[0]):
        assert getattr(same[0], entry.name) == getattr(same[1], entry.name)


def test_printed_signs_double_gravity_instead_of_removing_it() -> None:
    """(11) makes a_y read +g sin(roll) at rest; (16) then gives g sin(2 roll), 1.03 m/s^2 at 3 degrees."""
    roll = np.deg2rad(3.0)
    read = GRAVITY * np.sin(roll), GRAVITY * np.cos(roll)
    printed = vertical_loads(P1, 0.0, read[0], read[1], 0.0, roll)
    opposite = vertical_loads(P1, 0.0, read[0], read[1], 0.0, -roll)
    across = GRAVITY * np.sin(2 * roll)
    assert across == pytest.approx(1.03, abs=5e-3)
    transfer = float(printed.front_right - printed.front_left)
    lever = (
        2 * float(printed.front) / GRAVITY / 1.62 * (0.54 * np.sin(roll) * GRAVITY * np.cos(2 * roll) + across * 0.65)
    )
    assert transfer == pytest.approx(lever, rel=1e-12)
    level = float(opposite.front_right - opposite.front_left)
    assert level == pytest.approx(-2 * float(opposite.front) / 1.62 * 0.54 * np.sin(roll), rel=1e-12)


def test_loads_are_vectorised_and_name_what_is_missing() -> None:
    found = vertical_loads(P1, np.zeros((4, 1)), np.linspace(-5, 5, 3))
    assert found.front_left.shape == found.front.shape == (4, 3)
    without = P1.model_copy(update={"vehicle": {k: v for k, v in P1.vehicle.items() if k != "cg_height"}})
    with pytest.raises(AnalysisError, match=r"no vehicle\.cg_height"):
        vertical_loads(without, 0.0, 0.0)
