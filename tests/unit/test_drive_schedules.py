"""Schedules of another car are refused before the run; of a similar one they run, and the run says so."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from estimators.schedule import write_content
from studies.cli import main
from studies.commands.run import remarks
from studies.drives.drive_file import read_drive
from studies.drives.evaluation import evaluate
from studies.drives.plots import figures
from studies.drives.run import estimate_columns, replay_drive, run_drive
from studies.drives.schedules import Direction, check_radii, load_schedule
from studies.spec import Variant, load_spec
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
            r"vehicle\.effective_radius_front is 0\.33 m, -27 % \(at most 10 %\); correct the radius, or run gainsmith sch",
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


@pytest.mark.usefixtures("blank_figures")
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


@pytest.mark.parametrize(
    ("direction", "radius", "step"), [("longitudinal", "0.4 m", "5 ms"), ("lateral", "0.33 m", "10 ms")]
)
def test_the_command_of_the_refusal_makes_the_schedule(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, direction: Direction, radius: str, step: str
) -> None:
    """Another wheel, another sample time: what the message says is typed, and what it names is then taken."""
    name = f"corner-estimation-{direction}"
    text = DRIVE.replace('"0.33 m"', f'"{radius}"').replace("5 ms", step).replace("schedule.json", name)
    path = tmp_path / "drive.toml"
    path.write_text(text.replace('longitudinal = "corner-estimation-lateral"', 'longitudinal = "x.json"'))
    drive = read_drive(path)
    with pytest.raises(SpecError) as caught:
        load_schedule(name, tmp_path, drive.sample_time, direction, drive)
        check_radii(drive, tmp_path)
    message = str(caught.value)
    assert len(message) <= 400
    command = re.search(r"run gainsmith (.*) and name \"(.*)\"$", message)
    assert command is not None
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command[1])) == 0
    made = load_schedule(command[2], tmp_path, drive.sample_time, direction, drive)
    assert made.sample_time == drive.sample_time
    text = text.replace(f'"{name}"', f'"{command[2]}"')
    if direction == "longitudinal":
        path.write_text(text)
        assert check_radii(read_drive(path), tmp_path) == ()


def test_a_variant_keeps_the_fastest_pole_below_what_sampling_allows() -> None:
    base, _ = load_spec("corner-estimation-longitudinal")  # 600 1/s at 5 ms
    for step, fastest in ((0.0025, 600.0), (0.005, 600.0), (0.01, 300.0), (0.02, 150.0)):
        made = Variant(sample_time=step).spec(base)
        assert made.gains.fastest_pole == pytest.approx(fastest)
        assert made.deploy.sample_time == step
    assert Variant(0.4, 0.0025).name("x") == "x-400mm-2p5ms"
    radius = base.plant(radius=0.4).parameters.vehicle["effective_radius"]
    assert (radius.value, radius.unit) == (0.4, "m")
    assert Variant().spec(base) == base


@pytest.mark.parametrize(("option", "value"), [("--radius", "0.4"), ("--radius", "-1 m"), ("--sample-time", "3 m")])
def test_options_of_the_command_want_units(
    option: str, value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["schedules", f"{option}={value}", "--out", str(tmp_path / "new")]) == 2
    assert capsys.readouterr().err.startswith(f"gainsmith: {option}: ")
    assert not (tmp_path / "new").exists()


def test_without_schedules_the_pipeline_runs_alone(tmp_path: Path) -> None:
    """At any sample time and with any wheel: the fusion needs no gains."""
    text = DRIVE.replace('[schedules]\nlongitudinal = "schedule.json"\n', "").replace('"0.33 m"', '"0.40 m"')
    larger = {name: value * 0.33 / 0.40 if name.startswith("w_") else value for name, value in columns(0.5).items()}
    log = write_log(tmp_path / "log.csv", larger)
    data = replay_drive([log], write_drive(tmp_path, text.replace('"5 ms"', '"10 ms"')))
    assert data.replay is None
    metrics = evaluate(data)
    assert metrics["schedule"] is None
    assert {"pipeline", "mean_wheel_speed"} <= metrics["velocity"].keys()
    assert not any("corner" in name for name in metrics["velocity"])
    found = estimate_columns(data)
    assert "pipeline_vx_mps" in found and "vx_mps" not in found
    assert {len(column) for column in found.values()} == {51}
    assert {figure.name for figure in figures(data)} >= {"velocity", "slip", "forces"}
