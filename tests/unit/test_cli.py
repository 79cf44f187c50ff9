"""The command line: exit codes, one-line errors, drift, machine output."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimators.schedule import read_content, write_content
from studies.cli import main
from studies.schedules import ScheduleRun, compare, run_spec
from studies.spec import load_spec, shipped_specs
from synthesis.lmi.clarabel_backend import RawAnswer, solve_with_clarabel
from synthesis.lmi.conic import ConicData

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "estimators" / "schedules"
SPEC = (ROOT / "studies" / "specs" / "corner-estimation-longitudinal.toml").read_text()


def test_list_names_everything(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["schedules"]) == set(found["specifications"]) == set(shipped_specs())
    assert len(found["parameter sets"]) == 3
    for name, words in (found["specifications"] | found["examples"]).items():
        assert words == load_spec(name)[0].description
    assert main(["list"]) == 0
    assert "resilient-velocity-lateral" in capsys.readouterr().out


def test_certify_exit_codes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = FOLDER / "longitudinal-speed.json"
    assert main(["certify", str(good)]) == 0
    content = read_content(good)
    content["gain"]["table"][1][1][0] *= -1
    write_content(tmp_path / "bad.json", content)
    assert main(["certify", str(tmp_path / "bad.json")]) == 1
    (tmp_path / "cut.json").write_bytes(good.read_bytes()[:-200])
    assert main(["certify", "--json", str(tmp_path / "cut.json")]) == 2
    assert main(["certify", str(tmp_path / "absent.json")]) == 2
    assert "absent.json" in capsys.readouterr().out


def test_schedules_write_check_and_drift(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "longitudinal-speed"
    monkeypatch.setattr("studies.report.schedules.schedules_page", lambda runs: f"a page of {runs[0].name}")
    out = ["--out", str(tmp_path)]
    assert main(["schedules", name, *out, "--check"]) == 1
    assert "does not exist" in capsys.readouterr().err
    report = ["--report", str(tmp_path / "pages" / "report.html")]
    assert main(["schedules", name, *out, "--json", "--figures", str(tmp_path / "figures"), *report]) == 0
    assert (tmp_path / "pages" / "report.html").read_text() == f"a page of {name}"
    row = json.loads(capsys.readouterr().out)[0]
    assert row["state"] == "written" and all(proof["proved"] for proof in row["proofs"])
    assert (tmp_path / "figures" / f"{name}.svg").stat().st_size > 1000
    before = (tmp_path / f"{name}.json").read_bytes()
    assert main(["schedules", name, *out]) == 0
    assert "kept" in capsys.readouterr().out
    assert (tmp_path / f"{name}.json").read_bytes() == before
    content = read_content(tmp_path / f"{name}.json")
    content["gain"]["table"][3][1][0] += (
        0.0625  # other gains, and every claim still proved: claims are judged, gains reported
    )
    write_content(tmp_path / f"{name}.json", content)
    assert main(["schedules", name, *out, "--check", "--json"]) == 0
    row = json.loads(capsys.readouterr().out)[0]
    assert row["state"] == "same"
    assert row["gains_moved"] == pytest.approx(0.0625 / max(gain[1][0] for gain in content["gain"]["table"]), rel=0.01)


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> ScheduleRun:
    """What the specification gives now."""
    return run_spec("longitudinal-speed", tmp_path_factory.mktemp("fresh"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda content: content["claims"][0].update(level=70.0), "can be had at 80"),
        (lambda content: content["claims"].pop(0), "the file does not claim it"),
        (lambda content: content["claims"][0].update(level=90.0), "is not proved at wheel_speed"),
        (lambda content: content["gain"]["table"][3][1].__setitem__(0, -60.0), "is not proved at wheel_speed"),
        (lambda content: content["provenance"].update(spec_sha256="0" * 64), "another specification"),
        (
            lambda content: content["model"]["constants"]["sigma0"].update(value=700.0),
            "the formula and the constants give",
        ),
    ],
    ids=["weaker level", "claim removed", "overstated", "flipped gain", "other specification", "other constant"],
)
def test_a_worse_file_is_drift(tmp_path: Path, fresh: ScheduleRun, change: Any, words: str) -> None:
    stored, path = read_content(FOLDER / "longitudinal-speed.json"), tmp_path / "longitudinal-speed.json"
    write_content(path, stored)
    assert compare(path, fresh.content, fresh.proofs)[0] == "same"
    change(stored)
    write_content(path, stored)
    state, message, *_ = compare(path, fresh.content, fresh.proofs)
    assert state == "drift" and words in message


def test_drift_is_an_exit_code_and_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content = read_content(FOLDER / "longitudinal-speed.json")
    content["claims"][0]["level"] = 70.0
    write_content(tmp_path / "longitudinal-speed.json", content)
    assert main(["schedules", "longitudinal-speed", "--out", str(tmp_path), "--check"]) == 1
    captured = capsys.readouterr()
    assert "drift" in captured.out and "can be had at 80" in captured.err


@pytest.mark.parametrize("seed", range(2))
def test_a_solver_that_rounds_differently_changes_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """All of Clarabel's data off by 1e-9, as another processor would have it: the file is kept byte for byte."""
    name, rng, exact = "corner-estimation-lateral", np.random.default_rng(seed), solve_with_clarabel
    shutil.copy(FOLDER / f"{name}.json", tmp_path)

    def off(array: np.ndarray) -> np.ndarray:
        return np.asarray(array * (1.0 + 1e-9 * rng.uniform(-1.0, 1.0, array.shape)))

    def perturbed(data: ConicData, *rest: Any) -> RawAnswer:
        A = data.A.copy()
        A.data = off(A.data)
        return exact(replace(data, A=A, b=off(data.b), q=off(data.q)), *rest)

    monkeypatch.setattr("synthesis.lmi.solve.solve_with_clarabel", perturbed)
    done = run_spec(name, tmp_path)
    assert done.state == "kept" and all(proof.proved for proof in done.proofs)
    assert (tmp_path / f"{name}.json").read_bytes() == (FOLDER / f"{name}.json").read_bytes()
    fresh = run_spec(name, tmp_path / "fresh")  # and what such a machine makes by itself is proved and as good
    assert fresh.state == "written"
    levels = {proof.claim: proof.level for proof in done.proofs}
    for proof in fresh.proofs:
        assert proof.level == pytest.approx(levels[proof.claim], rel=0.02)


def test_committed_schedules_do_not_drift(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schedules", "--out", str(FOLDER), "--check", "--json"]) == 0, capsys.readouterr()
    assert {row["state"] for row in json.loads(capsys.readouterr().out)} == {"same"}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("decay_rate = 80.0", "decay_rtae = 80.0", "did you mean decay_rate"),
        ("decay_rate = 80.0", 'decay_rate = "80"', "design.decay_rate"),
        ("decay_rate = 80.0", "decay_rate = nan", "decay_rate"),
        ("degree = 1", "degree = 12", "degree 12"),
        ("wheel_speed_maximum = 140.0", "wheel_speed_maximum = -1.0", "wheel_speed_maximum"),
        ('parameters = "corner-estimation"', 'parameters = "corner-estimaton"', "did you mean corner-estimation"),
        ('parameters = "corner-estimation"', 'parameters = "absent.toml"', "absent.toml: cannot be read"),
        ('id = "corner-velocity-longitudinal"', 'id = "corner-velocity"', "did you mean corner-velocity-l"),
        ('disturbances = ["friction"]', 'disturbances = ["frictoin"]', "did you mean friction"),
        ("[deploy]", "[deploy", "Expected"),
        ("sample_time = 0.005", "sample_time = 0.0", "sample time"),
    ],
)
def test_bad_specifications_are_one_clear_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, words: str
) -> None:
    path = tmp_path / "mine.toml"
    assert old in SPEC
    path.write_text(SPEC.replace(old, new, 1))
    code = main(["schedules", str(path), "--out", str(tmp_path / "out")])
    captured = capsys.readouterr()
    assert code in (1, 2)
    line = captured.err.strip()
    assert words in line
    assert len(line.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_unknown_names_are_refused_before_anything_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schedules", "corner-estimation-longitudnal", "--out", str(tmp_path / "out")]) == 2
    assert "did you mean corner-estimation-longitudinal" in capsys.readouterr().err
    assert main(["schedules", str(tmp_path / "none.toml")]) == 2
    assert not (tmp_path / "out").exists()


def test_literal_specification_is_reported_and_not_exported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head, tail = SPEC.split("[design]")[0], "[deploy]" + SPEC.split("[deploy]")[1]
    literal = '[design]\n[[design.channels]]\ndisturbances = ["friction", "acceleration_error"]\n'
    literal += 'errors = ["bristle_deflection", "relative_velocity"]\n\n'
    (tmp_path / "literal.toml").write_text(head + literal + tail)
    assert main(["schedules", str(tmp_path / "literal.toml"), "--out", str(tmp_path / "out")]) == 1
    assert "ill-posed: the infimum gamma = 1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_own_tire_beside_the_specification(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tire = (ROOT / "synthesis" / "models" / "parameters" / "corner-estimation.toml").read_text()
    (tmp_path / "my-tire.toml").write_text(tire.replace("value = 632.1", "value = 500.0"))
    spec = SPEC.replace('parameters = "corner-estimation"', 'parameters = "my-tire.toml"')
    (tmp_path / "mine.toml").write_text(spec.replace('name = "corner-estimation-longitudinal"', 'name = "mine"'))
    assert main(["schedules", str(tmp_path / "mine.toml"), "--out", str(tmp_path)]) == 0
    assert read_content(tmp_path / "mine.json")["model"]["constants"]["sigma0"]["value"] == 500.0
    capsys.readouterr()


def test_output_folder_that_cannot_be_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert main(["schedules", "longitudinal-speed", "--out", str(tmp_path / "file" / "below")]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


@pytest.mark.parametrize("command", ["run", "identify"])
def test_an_output_that_is_a_file_is_refused_before_anything_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    (tmp_path / "file").write_text("")
    missing = [str(tmp_path / "no-such-log.csv"), "--drive", str(tmp_path / "no-such-drive.toml")]
    assert main([command, *missing, "--out", str(tmp_path / "file")]) == 2
    assert "cannot be a folder for results (file is a file)" in capsys.readouterr().err


def test_killed_in_the_middle_leaves_whole_files(tmp_path: Path) -> None:
    """kill -9 at several moments: what is in the folder is either the old file or the new one, never half of one."""
    name = "longitudinal-speed"
    shutil.copy(FOLDER / f"{name}.json", tmp_path)
    content = read_content(tmp_path / f"{name}.json")
    content["description"] = "older"
    write_content(tmp_path / f"{name}.json", content)
    for delay in (0.8, 1.8):
        command = [sys.executable, "-m", "studies.cli", "schedules", name, "--out", str(tmp_path)]
        process = subprocess.Popen(
            command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(delay)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert main(["certify", str(tmp_path / f"{name}.json")]) == 0


DRIVE = (ROOT / "tests" / "drives" / "ocd_suv_step_steer_22mps.toml").read_text()


@pytest.mark.parametrize(
    ("drive", "log", "words"),
    [
        (DRIVE, "t_s,vx\n0.0,1.0\n", "t_s,vx"),
        (DRIVE.replace("[vehicle]", "[vehcile]"), "", "vehcile"),
        ("schema = ", "", "drive.toml"),
    ],
)
def test_bad_replays_exit_with_two(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], drive: str, log: str, words: str
) -> None:
    (tmp_path / "drive.toml").write_text(drive)
    (tmp_path / "ocd_suv_step_steer_22mps_200hz.csv").write_text(log)
    logs = str(tmp_path / "ocd_suv_step_steer_22mps_200hz.csv")
    assert main(["run", logs, "--drive", str(tmp_path / "drive.toml"), "--out", str(tmp_path / "out")]) == 2
    line = capsys.readouterr().err.strip()
    assert len(line.splitlines()) == 1
    assert words in line or "column" in line
    assert not (tmp_path / "out").exists()
