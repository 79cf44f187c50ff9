"""The friction floor: closed form against the bristle at rest, the runtime observers and the truth vehicle."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from studies.beyond.friction_floor.launches import launches
from studies.beyond.friction_floor.resting_tire import FRICTIONS, hidden_ratio, missed_by, missed_share, resting_force
from studies.beyond.friction_floor.study import STUDY
from studies.beyond.observers import SHIPPED
from studies.study import Scope
from synthesis.models.parameter_set import load_parameter_set

VALUES = load_parameter_set("corner-estimation")
TIRE, RADIUS = VALUES.tire["longitudinal"], VALUES.vehicle["effective_radius"].value


def test_share_is_a_half_where_slip_is_friction_over_stiffness() -> None:
    slip = 0.5 * TIRE.kappa.value / TIRE.sigma0.value
    assert hidden_ratio(TIRE, slip, 0.5) == pytest.approx(1.0)
    assert missed_share(TIRE, RADIUS, 0.0, slip, 0.5) == pytest.approx(0.5)
    assert missed_share(TIRE, RADIUS, 40.0, [1e-9, 1e6], 0.5) == pytest.approx([0.0, 1.0], abs=0.02)


def test_resting_force_is_where_the_bristle_equation_ends() -> None:
    """Independent check: P1 (18) integrated until it rests."""
    speed, slip, friction = 40.0, 0.03, 0.35
    relative = slip * RADIUS * speed

    def rate(_: float, z: np.ndarray) -> np.ndarray:
        fall = TIRE.kappa.value * RADIUS * speed + TIRE.sigma0.value * relative / friction
        return np.asarray(relative - fall * z)

    z = solve_ivp(rate, (0.0, 2.0), [0.0], rtol=1e-10, atol=1e-14).y[0, -1]
    force = TIRE.sigma0.value * z + TIRE.sigma2.value * relative
    assert resting_force(TIRE, RADIUS, speed, slip, friction) == pytest.approx(force, rel=1e-7)


@pytest.mark.parametrize("schedule", SHIPPED)
def test_every_shipped_observer_misses_just_that(schedule: str) -> None:
    found = missed_by(schedule, np.array([0.2, 1.0]), np.array([0.005, 0.05, 0.5]))
    assert found.largest_gap < 1e-9


def test_another_tire_is_not_what_it_misses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative control: the closed form of another tire is refuted."""
    monkeypatch.setitem(SHIPPED, "corner-estimation-longitudinal", ("resilient-velocity", "longitudinal"))
    assert missed_by("corner-estimation-longitudinal", np.array([0.5]), np.array([0.02])).largest_gap > 1e-3


def test_truth_vehicle_agrees_where_slip_changes_slowly_and_fusion_recovers() -> None:
    found = launches(Scope(quick=True, seeds=4))
    assert [launch.friction for launch in found] == list(FRICTIONS)
    for launch in found:
        known = np.isfinite(launch.predicted) & np.isfinite(launch.missed)
        assert known.any()
        assert np.median(launch.missed[known]) == pytest.approx(np.median(launch.predicted[known]), abs=0.08)
        assert (
            launch.errors["fusion"].mean
            < launch.errors["corner observers"].mean
            < launch.errors["mean wheel speed"].mean
        )


def test_study_names_its_parts_once() -> None:
    names = [part.name for part in STUDY.parts]
    assert len(names) == len(set(names))
