"""Schedules of another car are refused before the run; of a similar one they run, and the run says so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from estimators.schedule import write_content
from studies.commands.run import remarks
from studies.drives.evaluation import evaluate
from studies.drives.run import replay_drive, run_drive
from synthesis.errors import SpecError
from tests.support.schedule_content import EFFECTIVE_RADIUS, schedule_content
from tests.support.synthetic_drive import DRIVE, columns, write_drive, write_log

BOTH = DRIVE.replace('"schedule.json"', '"schedule.json"\nlateral = "side.json"')


def content(radius: float | None, direction: str = "longitudinal") -> dict[str, Any]:
    """A schedule whose model says ``radius`` m, or does not say; the dynamics stay those of the tests."""
    found = schedule_content(direction)
    del found["model"]["constants"]["effective_radius"]
    for rows in found["model"]["matrices"].values():
        rows[:] = [[text.replace("effective_radius", str(EFFECTIVE_RADIUS)) for text in row] for row in rows]
    if radius is not None:
        found["model"]["constants"]["effective_radius"] = {"value": radius, "unit": "m"}
    return found


def prepare(folder: Path, text: str, radius: float | None, lateral: float | None = EFFECTIVE_RADIUS) -> Path:
    drive = write_drive(folder, text)
    write_content(folder / "schedule.json", content(radius))
    write_content(folder / "side.json", content(lateral, "lateral"))
    return drive


@pytest.mark.parametrize(
    ("text", "radius", "lateral", "message"),
    [
        (
            DRIVE,
            0.45,
            None,
            r"^schedules\.longitudinal: 'schedule\.json' is for effective_radius = 0\.45 m, "
            r"vehicle\.effective_radius_front is 0\.33 m, -27 % \(at most 10 %\); correct the radius, or make a schedule",
        ),
        (
            DRIVE.replace('rear = "0.33 m"', 'rear = "37 cm"'),
            0.33,
            None,
            r"vehicle\.effective_radius_rear is 0\.37 m, \+12 %",
        ),
        (BOTH, 0.33, 0.25, r"^schedules\.lateral: 'side\.json' is for effective_radius = 0\.25 m"),
        (
            BOTH,
            0.33,
            0.35,
            r"^schedules: 'schedule\.json' is for effective_radius = 0\.33 m, 'side\.json' for 0\.35 m; name two",
        ),
        (DRIVE, 0.0, None, r"has effective_radius = 0 m; no wheel has"),
    ],
)
def test_a_schedule_of_another_car_is_refused_before_the_log_is_read(
    tmp_path: Path, text: str, radius: float, lateral: float | None, message: str
) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        run_drive([tmp_path / "no-such-log.csv"], prepare(tmp_path, text, radius, lateral), tmp_path / "out")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("radius", "said"),
    [
        (EFFECTIVE_RADIUS, None),
        (
            0.35,
            "longitudinal schedule 'schedule.json' is for effective_radius = 0.35 m, the car has up to 0.33 m (-5.7 %)",
        ),
        (None, "longitudinal schedule 'schedule.json' does not say for which effective_radius"),
    ],
)
def test_a_schedule_of_a_similar_car_runs_and_is_an_assumption(
    tmp_path: Path, radius: float | None, said: str | None
) -> None:
    log = write_log(tmp_path / "log.csv", columns(0.1))
    result = run_drive([log], prepare(tmp_path, DRIVE, radius), tmp_path / "out")
    for lines in (result.metrics["assumptions"], remarks(result)):
        found = [line for line in lines if "schedule" in line]
        assert len(found) == (said is not None)
        assert said is None or said in found[0]


def test_two_schedules_of_one_car_need_no_word(tmp_path: Path) -> None:
    """The limits are limits: one per cent between the two, a thousandth from the car."""
    log = write_log(tmp_path / "log.csv", columns(0.1))
    data = replay_drive([log], prepare(tmp_path, BOTH, 0.33, 0.3301))
    assert data.assumptions == ()
    assert not [line for line in evaluate(data)["assumptions"] if "schedule" in line]
    data = replay_drive([log], prepare(tmp_path, BOTH, 0.33, 0.333))
    assert [line.split(" is for")[0] for line in data.assumptions] == ["lateral schedule 'side.json'"]


def test_a_schedule_file_that_is_not_there(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, DRIVE.replace("schedule.json", "absent.json"))
    with pytest.raises(SpecError) as caught:
        replay_drive([tmp_path / "no-such-log.csv"], drive)
    assert str(caught.value).startswith(
        "schedules.longitudinal: no file 'absent.json' beside the drive file; give its path from there, or the name of a "
        "shipped schedule: corner-estimation-lateral, "
    )
