"""Whole runs on drives whose answer is known, and everything that must be refused on the way."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from estimators.schedule import write_content
from studies.commands.run import HEADER, summary_rows
from studies.drives.evaluation import DriveData, evaluate
from studies.drives.quantities import CORNERS
from studies.drives.run import RunResult, replay_drive, run_drive
from synthesis.errors import SpecError
from tests.support.schedule_content import schedule_content
from tests.support.synthetic_drive import (
    DRIVE,
    MASS,
    SLIP,
    START,
    TORQUES,
    acceleration,
    columns,
    write_drive,
    write_log,
)

WITH_TORQUE = DRIVE.replace("[reference]", TORQUES + "\n[reference]")
BACKWARDS = WITH_TORQUE.replace('unit = "rad/s"', 'unit = "rad/s", sign = "negative"')


def replayed(folder: Path, text: str, table: dict[str, Any] | None = None) -> DriveData:
    log = write_log(folder / "log.csv", columns() if table is None else table)
    return replay_drive([log], write_drive(folder, text))


def worst(data: DriveData, after: float = 0.2) -> float:
    """The largest error of V_x, m/s, once the start has died out."""
    error = np.abs(data.replay.velocity - data.log.reference["vx"])[data.log.time > after]
    return float(np.nanmax(error))


@pytest.fixture(scope="module")
def whole_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunResult, Path, list[float]]:
    folder = tmp_path_factory.mktemp("run")
    log = write_log(folder / "log.csv", columns())
    seen: list[float] = []
    return (
        run_drive([log], write_drive(folder, WITH_TORQUE), folder / "out", progress=seen.append),
        folder / "out",
        seen,
    )


@pytest.mark.parametrize(("text", "tolerance"), [(WITH_TORQUE, 2e-3), (DRIVE, 2e-2)], ids=["torque", "shared by load"])
def test_observers_find_the_velocity_that_no_baseline_finds(tmp_path: Path, text: str, tolerance: float) -> None:
    data = replayed(tmp_path, text)
    settled = data.log.time > 0.2
    truth = data.log.reference["vx"][settled]
    assert worst(data) < tolerance
    assert np.abs(data.replay.corner_velocity[settled] - truth[:, None]).max() < tolerance
    np.testing.assert_allclose(data.baselines["mean_wheel_speed"][settled] - truth, SLIP * truth, atol=1e-9)
    np.testing.assert_allclose(data.baselines["integrated_acceleration"][settled] - truth, SLIP * START, atol=1e-9)
    np.testing.assert_allclose(data.slip[settled], SLIP / (1 + SLIP), atol=tolerance / START)
    assert not data.replay.flags.any()


@pytest.mark.usefixtures("blank_figures")
def test_metrics_are_those_of_the_closed_form(whole_run: tuple[RunResult, Path, list[float]]) -> None:
    result, out, _ = whole_run
    assert json.loads((out / "metrics.json").read_text()) == result.metrics
    velocity = result.metrics["velocity"]
    peak = START + 3.0 * acceleration()
    assert velocity["mean_wheel_speed"]["max_error"] == pytest.approx(SLIP * peak, rel=1e-9)
    assert velocity["integrated_acceleration"]["rms"] == pytest.approx(SLIP * START, rel=1e-9)
    assert velocity["integrated_acceleration"]["nrms_percent"] == pytest.approx(100 * SLIP * START / peak, rel=1e-9)
    assert velocity["corner_observers"]["rms"] < 0.1 * velocity["mean_wheel_speed"]["rms"]
    assert velocity["corner_observers"]["samples"] == 601
    assert result.metrics["flagged_samples"] == {corner: {} for corner in CORNERS}
    assert "yaw rate is not measured: taken as 0" in result.metrics["assumptions"]
    rows = summary_rows(result)
    first = ["vx: pipeline", "vx: corner observers", "vx: mean wheel speed", "vx: integrated acceleration"]
    assert [row[0] for row in rows[:4]] == first
    # this drive's constant slip is what a wrong radius looks like too: the fusion cannot know, the tire model can
    assert velocity["pipeline"]["rms"] < velocity["mean_wheel_speed"]["rms"]
    assert {len(row) for row in rows} == {len(HEADER)}


def test_every_file_is_written_and_nothing_else(whole_run: tuple[RunResult, Path, list[float]]) -> None:
    result, out, seen = whole_run
    names = {path.name for path in out.iterdir()}
    assert names == {path.name for path in result.paths}
    assert names == {
        *("estimates.csv", "metrics.json", "velocity.svg", "velocity.png"),
        *("slip.svg", "slip.png", "forces.svg", "forces.png", "lateral.svg", "lateral.png"),
        *("axle_forces.svg", "axle_forces.png", "loads.svg", "loads.png", "flags.svg", "flags.png"),
    }
    assert (out / "velocity.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (out / "velocity.svg").read_text()
    table = pl.read_csv(out / "estimates.csv")
    assert table.height == 601
    assert {"time_s", "vx_mps", "slip_rr", "force_x_fl_N", "flags_rl", "reference_vx_mps"} <= set(table.columns)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_sign_convention_is_undone(tmp_path: Path) -> None:
    flipped = {name: -value if name.startswith("w_") else value for name, value in columns().items()}
    there, back = replayed(tmp_path, WITH_TORQUE), replayed(tmp_path, BACKWARDS, flipped)
    np.testing.assert_array_equal(there.replay.velocity, back.replay.velocity)


def test_reverse_drive_mirrors_forward_drive(tmp_path: Path) -> None:
    flat = WITH_TORQUE.replace("0.55 m", "5 cm")  # hardly any load transfer, which is what tells forward from backward
    table = columns()
    mirrored = {name: value if name == "t" else -value for name, value in table.items()}
    forward, reverse = replayed(tmp_path, flat, table), replayed(tmp_path, flat, mirrored)
    np.testing.assert_allclose(reverse.replay.velocity, -forward.replay.velocity, atol=5e-3)
    np.testing.assert_allclose(reverse.replay.corner_velocity, -forward.replay.corner_velocity, atol=0.03)


def test_gap_is_flagged_coasted_and_not_compared(tmp_path: Path) -> None:
    table = columns()
    keep = (table["t"] < 0.999) | (table["t"] > 1.099)
    data = replayed(tmp_path, WITH_TORQUE, {name: value[keep] for name, value in table.items()})
    metrics = evaluate(data)
    report = data.log.report
    assert report["logs"]["log"]["gaps"] == 1
    assert report["logs"]["log"]["largest_gap_s"] == pytest.approx(0.105)
    assert report["grid"]["missing_samples"]["wheel_speed_fl"] == 20
    assert metrics["velocity"]["corner_observers"]["samples"] == 601 - 20
    flags = metrics["flagged_samples"]["fl"]
    assert flags["missing_measurement"] == flags["missing_input"] == 21  # the difference quotient needs a neighbour
    assert flags["missing_parameter"] == 20
    assert worst(data) < 4e-3


def test_one_lost_wheel_sensor_leaves_the_others_at_work(tmp_path: Path) -> None:
    table = columns()
    table["w_fl"] = np.where(table["t"] > 1.0, np.nan, table["w_fl"])
    data = replayed(tmp_path, WITH_TORQUE, table)
    metrics = evaluate(data)
    assert data.log.report["logs"]["log"]["not_finite"] == {"w_fl": 400}
    assert worst(data) < 2e-3
    assert np.isfinite(data.replay.velocity).all()
    assert np.isnan(data.replay.corner_velocity[:, 0]).sum() == 400
    assert metrics["flagged_samples"]["fl"]["missing_parameter"] == 400
    assert metrics["flagged_samples"]["rr"] == {}


def test_torque_at_two_wheels_leaves_the_rest_of_the_force_to_the_others(tmp_path: Path) -> None:
    """Here m a_x = m g mu up to sigma2: what the rear wheels do not do is what the front wheels do."""
    rear = "".join(line + "\n" for line in TORQUES.splitlines() if line.startswith("torque_r"))
    data = replayed(tmp_path, DRIVE.replace("[reference]", rear + "\n[reference]"))
    assert data.inputs.force_sources == ("m*a_x shared by load",) * 2 + ("wheel dynamics",) * 2
    total = data.inputs.force[1:].sum(axis=1)
    np.testing.assert_allclose(total, MASS * acceleration(), rtol=1e-9)
    assert worst(data) < 2e-2


def test_mass_only_scales_the_forces(tmp_path: Path) -> None:
    """m a_x shared by load is normalised by load again: the velocity must not depend on the mass."""
    light, heavy = (replayed(tmp_path, DRIVE.replace(f"{MASS} kg", mass)) for mass in ("1.6 t", "3200 kg"))
    np.testing.assert_allclose(light.replay.velocity, heavy.replay.velocity, rtol=1e-12)
    np.testing.assert_allclose(2 * light.inputs.force, heavy.inputs.force, rtol=1e-12)


@pytest.mark.parametrize(
    ("direction", "change", "message"),
    [
        ("longitudinal", {"sample_time": 0.01}, "was proved at sample_time = 0.01 s, the drive file asks for 0.005 s"),
        ("lateral", {}, "is a schedule of corner-velocity-lateral; this run needs one of corner-velocity-longitudinal"),
    ],
)
def test_schedule_that_does_not_fit_is_refused(
    tmp_path: Path, direction: str, change: dict[str, Any], message: str
) -> None:
    log, drive = write_log(tmp_path / "log.csv", columns(0.5)), write_drive(tmp_path)
    write_content(tmp_path / "schedule.json", schedule_content(direction, **change))
    with pytest.raises(ValueError, match=message) as caught:
        run_drive([log], drive, tmp_path / "out")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_unknown_shipped_schedule_lists_those_there_are(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, DRIVE.replace('"schedule.json"', '"no-such-schedule"'))
    with pytest.raises(ValueError, match=r"schedules\.longitudinal: no shipped schedule 'no-such-schedule'; there are"):
        run_drive([write_log(tmp_path / "log.csv", columns(0.5))], drive, tmp_path / "out")


def test_out_that_is_a_file_is_refused(tmp_path: Path) -> None:
    """At once: the log, which is not there either, is not even looked for."""
    (tmp_path / "out").write_text("mine")
    with pytest.raises(SpecError, match="give another --out"):
        run_drive([tmp_path / "no-such-log.csv"], write_drive(tmp_path), tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"
