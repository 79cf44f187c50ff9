"""Readings of the papers in a drive file: what is chosen is built, and what nothing would follow is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from estimators import EstimatorError
from estimators.pipeline import (
    CornerObservers,
    CornerVelocity,
    KalmanCorners,
    StiffnessSideslip,
)
from estimators.vehicle import VehicleParameters
from studies.drives.chain import pipeline_of
from studies.drives.drive_file import read_drive
from studies.drives.schedules import corner_observer, load_schedule
from synthesis.errors import SpecError
from tests.support.schedule_content import schedule_content
from tests.support.synthetic_drive import write_drive
from tests.unit.test_drive_estimators import DRIVE, LATERAL, SIDEWAYS, STEERED, chosen


def test_choices_of_a_drive_file_are_built(tmp_path: Path) -> None:
    from estimators.schedule import write_content

    write_content(tmp_path / "side.json", schedule_content("lateral"))
    side = load_schedule("side.json", write_drive(tmp_path).parent, 0.005, "lateral")
    vehicle = 'bearing_friction = "0.4 N*m*s/rad"\n[vehicle.suspension]\nstiffness_x = "450 kN/m"\n\n[schedules]'
    text = SIDEWAYS.replace("[reference]", LATERAL + "[reference]").replace("[schedules]", vehicle)
    names = {
        "velocity": "corners", "corner_velocity": "kalman-three-state", "process_covariance": "identity",
        "suspension": "compliant", "sideslip": "adaptive-stiffness", "sideslip_speed": "rear-wheels",
        "stiffness_noise": "per-time",
    }  # fmt: skip
    drive = read_drive(write_drive(tmp_path, chosen(text, **names)))
    kind = corner_observer(drive, tmp_path, load_schedule("schedule.json", tmp_path, 0.005))
    pipeline, _ = pipeline_of(drive, kind, side)
    assert isinstance(kind, KalmanCorners)
    assert kind.observer.filter.identity
    assert isinstance(pipeline.velocity, CornerVelocity)
    suspension = pipeline.velocity.corners.suspension
    assert suspension is not None
    assert (suspension.parameters.stiffness_x, suspension.parameters.unsprung_mass) == (450e3, 46.0)
    assert pipeline._rear
    assert isinstance(pipeline.sideslip, StiffnessSideslip)
    assert pipeline.sideslip.observer._share == 0.5
    assert pipeline.vehicle.bearing_friction == 0.4
    plain, _ = pipeline_of(read_drive(write_drive(tmp_path, chosen(text, sideslip="adaptive-stiffness"))), kind, side)
    assert isinstance(plain.corner_observers, CornerObservers)
    assert plain.corner_observers.suspension is None
    assert not plain._rear
    assert isinstance(plain.sideslip, StiffnessSideslip)
    assert plain.sideslip.observer._share == 1.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (chosen(DRIVE, process_covariance="identity"), "process_covariance: belongs to corner_velocity = kalman-three-state or"),
        (chosen(DRIVE, suspension="compliant"), r"schedules\.lateral: missing, but estimators\.suspension = 'compliant'"),
        (chosen(DRIVE, sideslip_speed="rear-wheels"), "sideslip_speed: belongs to sideslip = four-wheel-extended or"),
        (chosen(STEERED, sideslip="four-wheel-extended", stiffness_noise="per-time"), "and sideslip is 'four-wheel-extended'"),
        (DRIVE.replace("[schedules]", 'bearing_friction = "0.4 N*m"\n[schedules]'), "unit 'N.m' has another dimension"),
    ],
)  # fmt: skip
def test_choices_that_nothing_would_follow_are_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        read_drive(write_drive(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_impossible_bearing_friction_is_refused() -> None:
    with pytest.raises(EstimatorError, match="bearing_friction"):
        replace(VehicleParameters.published_suv(), bearing_friction=-1.0)
