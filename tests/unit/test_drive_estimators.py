"""The `[estimators]` table: what is chosen is built, and what cannot be is refused in one line, before any log is read."""

from __future__ import annotations

from pathlib import Path

import pytest

from estimators.forces import VerticalLoads, WheelForceFilter
from estimators.pipeline import DifferentiatedPid, FourWheelSideslip, StiffnessSideslip
from estimators.schedule import write_content
from studies.drives.chain import pipeline_of
from studies.drives.drive_file import DriveFile, read_drive
from studies.drives.replay import load_schedule
from studies.drives.run import replay_drive
from synthesis.errors import SpecError
from tests.drives.synthetic_drive import DRIVE, TORQUES, write_drive
from tests.unit.schedule_content import schedule_content

TORQUE = DRIVE.replace("[reference]", TORQUES + "\n[reference]")
TIRES = (
    'yaw_inertia = "2600 kg*m^2"\ncornering_stiffness_front = "120 kN/rad"\ncornering_stiffness_rear = "130000 N/rad"\n'
)
EQUIPPED = TORQUE.replace("[schedules]", TIRES + 'relaxation_length = "50 cm"\n\n[schedules]')


def chosen(text: str, **names: str) -> str:
    return text + "\n[estimators]\n" + "".join(f'{key} = "{name}"\n' for key, name in names.items())


def read(folder: Path, text: str) -> DriveFile:
    return read_drive(write_drive(folder, text))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (chosen(DRIVE, longitudinal_force="unknwon-input"), "did you mean unknown-input"),
        (chosen(DRIVE, sideslip="four-wheel"), r"estimators\.sideslip: unknown estimator 'four-wheel'"),
        (chosen(DRIVE, longitudnal_force="pid"), "longitudinal_force"),
        (
            chosen(DRIVE, longitudinal_force="pid"),
            r"signals\.torque_fl: missing, but estimators\.longitudinal_force = 'pid'",
        ),
        (chosen(TORQUE, lateral_force="unscented"), r"vehicle\.yaw_inertia: missing, but estimators\.lateral_force"),
        (
            chosen(TORQUE.replace("[schedules]", TIRES + "\n[schedules]"), sideslip="four-wheel-extended"),
            r"vehicle\.relaxation_length: missing",
        ),
        (chosen(TORQUE, attitude="gyro"), r"signals\.roll_rate: missing, but estimators\.attitude = 'gyro'"),
    ],
)
def test_what_cannot_be_built_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_what_is_chosen_is_built(tmp_path: Path) -> None:
    schedule = load_schedule("schedule.json", write_drive(tmp_path).parent, 0.005)
    names = {"longitudinal_force": "unscented", "vertical_load": "quasi-static", "sideslip": "four-wheel-unscented"}
    pipeline, assumptions = pipeline_of(read(tmp_path, chosen(EQUIPPED, **names)), schedule)
    assert isinstance(pipeline.longitudinal_force, WheelForceFilter)
    assert isinstance(pipeline.loads, VerticalLoads)
    assert not pipeline.loads.dynamic
    assert isinstance(pipeline.sideslip, FourWheelSideslip)
    assert not assumptions
    names = {"longitudinal_force": "pid", "sideslip": "adaptive-stiffness"}
    pipeline, _ = pipeline_of(read(tmp_path, chosen(EQUIPPED, **names)), schedule)
    assert isinstance(pipeline.longitudinal_force, DifferentiatedPid)
    assert isinstance(pipeline.sideslip, StiffnessSideslip)
    _, assumptions = pipeline_of(read(tmp_path, DRIVE), schedule)
    assert assumptions == ("yaw inertia is not given: taken as m L_f L_r",)


def test_a_lateral_schedule_for_another_time_is_refused_before_the_log_is_read(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, DRIVE.replace('"schedule.json"', '"schedule.json"\nlateral = "side.json"'))
    write_content(tmp_path / "side.json", {**schedule_content("lateral"), "sample_time": 0.01})
    with pytest.raises(SpecError, match=r"schedules\.lateral: 'side\.json' was proved at sample_time = 0\.01 s"):
        replay_drive([tmp_path / "no-such-log.csv"], drive)
    write_content(tmp_path / "side.json", schedule_content("longitudinal"))
    with pytest.raises(SpecError, match="this run needs one of corner-velocity-lateral"):
        replay_drive([tmp_path / "no-such-log.csv"], drive)


def test_a_car_that_cannot_be_is_refused_before_the_log_is_read(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, DRIVE.replace("0.55 m", "55 m"))
    with pytest.raises(SpecError, match=r"cg_height = 55\.0 m is not in") as caught:
        replay_drive([tmp_path / "no-such-log.csv"], drive)
    assert "\n" not in str(caught.value)
