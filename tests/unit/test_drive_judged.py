"""What a run says about itself: reference slips, total force beside its baseline, columns and pictures of every part."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from estimators.schedule import write_content
from studies.commands.run import remarks, summary_rows
from studies.drives import plots
from studies.drives.evaluation import DriveData, evaluate
from studies.drives.quantities import CORNERS
from studies.drives.run import RunResult, estimate_columns, replay_drive, run_drive
from studies.plots import Figure, Line, colours
from tests.support.schedule_content import EFFECTIVE_RADIUS, schedule_content
from tests.support.synthetic_drive import DRIVE, FRONT, MASS, REAR, TORQUES, TRACK, columns, write_drive, write_log

STEER, TURN, VX, VY = 0.1, 0.4, 10.0, -1.2
MEASURED = """steering = { column = "steer", unit = "rad" }
yaw_rate = { column = "r_imu", unit = "rad/s" }
ay = { column = "ay", unit = "m/s^2" }
"""
KNOWN = """vy = { column = "vy", unit = "m/s" }
yaw_rate = { column = "r", unit = "rad/s" }
"""
TURNING = DRIVE.replace("[reference]\n", MEASURED + "\n[reference]\n")
PARTS = """wheel_inertia = "1.5 kg*m^2"
yaw_inertia = "2600 kg*m^2"
cornering_stiffness_front = "120 kN/rad"
cornering_stiffness_rear = "130 kN/rad"
"""


def turn(slip: float = 0.0, gyro_bias: float = 0.0) -> dict[str, Any]:
    """A steady turn, of a rigid body: each wheel has the slip ratio ``slip`` beside its own velocity along the tyre."""
    t = np.arange(101) / 200
    one = np.ones_like(t)
    x, y = np.array([FRONT, FRONT, -REAR, -REAR]), np.array([TRACK, -TRACK, TRACK, -TRACK]) / 2
    angle = np.array([STEER, STEER, 0.0, 0.0])
    along = (VX - TURN * y) * np.cos(angle) + (VY + TURN * x) * np.sin(angle)
    speed = along / (1 - slip) / EFFECTIVE_RADIUS
    return {
        "t": t, "v": VX * one, "vy": VY * one, "r": TURN * one, "r_imu": (TURN + gyro_bias) * one,
        "ax": -TURN * VY * one, "ay": TURN * VX * one, "steer": STEER * one,
        **{f"w_{corner}": speed[k] * one for k, corner in enumerate(CORNERS)},
    }  # fmt: skip


def replayed(folder: Path, text: str, table: dict[str, Any]) -> DriveData:
    return replay_drive([write_log(folder / "log.csv", table)], write_drive(folder, text))


@pytest.mark.parametrize("slip", [0.0, 0.05])
def test_the_reference_slip_of_a_steered_wheel_is_that_of_the_rigid_body(tmp_path: Path, slip: float) -> None:
    """V_y and the yaw rate are the reference's own: neither the gyro's bias nor an unmeasured V_y enters."""
    data = replayed(tmp_path, TURNING + KNOWN, turn(slip, gyro_bias=0.05))
    assert data.reference_slip is not None
    np.testing.assert_allclose(data.reference_slip, slip, atol=1e-9)


def test_without_a_reference_of_v_y_steered_wheels_have_no_reference_slip(tmp_path: Path) -> None:
    data = replayed(tmp_path, TURNING, turn(0.05))
    assert data.reference_slip is not None
    assert np.isnan(data.reference_slip[:, :2]).all()
    np.testing.assert_allclose(data.reference_slip[:, 2:], 0.05, atol=1e-9)
    straight = replayed(tmp_path, TURNING, turn(0.05) | {"steer": np.zeros(101)})
    assert straight.reference_slip is not None
    assert np.isfinite(straight.reference_slip).all()
    no_reference = replayed(tmp_path, TURNING.split("[reference]")[0], turn(0.05))
    assert no_reference.reference_slip is None


def with_total(column: str) -> str:
    return DRIVE.replace("[reference]", TORQUES + "[reference]") + f'ax = {{ column = "{column}", unit = "m/s^2" }}\n'


def pulsed() -> dict[str, Any]:
    """Little acceleration for a while; the reference has a column of its own, 0.05 m/s^2 off the sensor."""
    table = columns()
    table["ax"] = np.where(table["t"] < 1.0, 0.3, table["ax"])
    return table | {"ax_true": table["ax"] + 0.05}


def test_the_total_force_obeys_the_rule_beside_it_and_has_a_baseline(tmp_path: Path) -> None:
    found = evaluate(replayed(tmp_path, with_total("ax_true"), pulsed()))["pipeline"]
    rows, table = found["signals"]["total_force_x"], pulsed()
    counted = int(np.count_nonzero(MASS * table["ax_true"] > 1000.0))
    assert 0 < counted < table["t"].size
    assert set(rows) == {"pipeline", "quasi_static"}
    assert {entry["samples"] for entry in rows.values()} == {counted}
    assert rows["quasi_static"]["rms"] == pytest.approx(MASS * 0.05, rel=1e-9)
    assert rows["quasi_static"]["nrms_percent"] == pytest.approx(100 * 0.05 / table["ax_true"].max(), rel=1e-9)
    assert found["notes"] == {}


@pytest.mark.usefixtures("blank_figures")
def test_a_total_force_that_is_judged_against_its_own_input_says_so(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log.csv", pulsed())
    own = run_drive([log], write_drive(tmp_path, with_total("ax")), tmp_path / "out")
    assert own.metrics["pipeline"]["notes"]["total_force_x"].startswith(
        "circular: the reference is m times column 'ax'"
    )
    assert "its forces come from the wheel torques" in own.metrics["pipeline"]["notes"]["total_force_x"]
    assert {"total force x: pipeline (*)", "total force x: quasi static (*)"} <= {row[0] for row in summary_rows(own)}
    assert remarks(own)[0].startswith("(*) total force x: circular: ")
    shares = with_total("ax").replace(TORQUES, "")
    assert (
        "its forces are shares of it"
        in evaluate(replayed(tmp_path, shares, pulsed()))["pipeline"]["notes"]["total_force_x"]
    )
    assert own.replaced == ""
    other = run_drive([log], write_drive(tmp_path, with_total("ax_true")), tmp_path / "out")
    assert other.replaced == own.metrics["drive"]
    assert not any("(*)" in line for line in (*remarks(other), *(row[0] for row in summary_rows(other))))


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> tuple[DriveData, RunResult, pl.DataFrame]:
    """A turn with lateral corner observers and a sideslip estimator, and references of F_y and F_z."""
    folder = tmp_path_factory.mktemp("everything")
    forces = "".join(
        f'force_{axis}_{corner} = {{ column = "F{axis}", unit = "kN" }}\n' for axis in "yz" for corner in CORNERS
    )
    text = (TURNING + KNOWN + forces).replace('wheel_inertia = "1.5 kg*m^2"\n', PARTS)
    text = text.replace('"schedule.json"', '"schedule.json"\nlateral = "side.json"')
    text += '\n[estimators]\nsideslip = "fixed-stiffness"\n'
    table = turn() | {"Fy": np.full(101, 1.6), "Fz": np.full(101, 3.9)}
    write_content(folder / "side.json", schedule_content("lateral"))
    log, drive = write_log(folder / "log.csv", table), write_drive(folder, text)
    result = run_drive([log], drive, folder / "out")
    return replay_drive([log], drive), result, pl.read_csv(folder / "out" / "estimates.csv")


@pytest.mark.usefixtures("blank_figures")
def test_every_part_that_runs_has_its_columns(
    everything: tuple[DriveData, RunResult, pl.DataFrame], tmp_path: Path
) -> None:
    data, _, table = everything
    assert data.chain is not None
    for name, value in (
        ("sideslip_part_rad", data.chain.sideslip_part),
        ("corner_observers_vy_mps", data.chain.corner_vy),
    ):
        assert np.isfinite(value).any()
        np.testing.assert_allclose(table[name].to_numpy(), value, atol=1e-6)
    np.testing.assert_allclose(table["reference_yaw_rate_radps"].to_numpy(), TURN, atol=1e-6)
    without = estimate_columns(replayed(tmp_path, TURNING + KNOWN, turn()))
    assert not {"sideslip_part_rad", "corner_observers_vy_mps"} & set(without)
    assert {"pipeline_vy_mps", "pipeline_sideslip_rad"} <= set(without)


def lines(figure: Figure, panel: int, field: str = "y") -> dict[str, Any]:
    """What a panel shows: label of a line to its values, or to its colour."""
    shown = [panel for row in figure.rows for panel in row if panel is not None][panel]
    return {mark.label: getattr(mark, field) for mark in shown.marks if isinstance(mark, Line)}


def test_pictures_show_estimates_beside_their_references(everything: tuple[DriveData, RunResult, pl.DataFrame]) -> None:
    data, result, _ = everything
    chain = data.chain
    assert chain is not None
    assert {path.stem for path in result.paths} >= {"lateral", "axle_forces", "loads"}
    motion = plots.lateral(data, chain)
    sideways, angle = lines(motion, 0), lines(motion, 1)
    np.testing.assert_allclose(sideways["reference"], VY)
    np.testing.assert_array_equal(sideways["pipeline"], chain.vy)
    np.testing.assert_array_equal(sideways["corner observers"], chain.corner_vy)
    np.testing.assert_allclose(angle["reference"], np.degrees(np.arctan2(VY, VX)))
    np.testing.assert_allclose(angle["fixed stiffness estimator"], np.degrees(chain.sideslip_part))
    axle = lines(plots.axle_forces(data, chain), 1)
    np.testing.assert_allclose(axle["reference"], 3.2)
    np.testing.assert_allclose(axle["quasi-static"], MASS * TURN * VX * FRONT / (FRONT + REAR) / 1e3)
    load = lines(plots.loads(data, chain), 3)
    np.testing.assert_allclose(load["reference"], 3.9)
    np.testing.assert_allclose(load["pipeline"], chain.force_z[:, 3] / 1e3)
    colour = lines(motion, 0, "color")
    assert colour["pipeline"] == colours.PIPELINE
    assert colour["corner observers"] == colours.OWN_OBSERVERS
    assert colour["reference"] == colours.TRUTH


def test_pictures_show_nothing_that_is_not_there(tmp_path: Path) -> None:
    data = replayed(tmp_path, TURNING, turn())
    assert data.chain is not None
    assert set(lines(plots.lateral(data, data.chain), 0)) == {"pipeline"}
    assert set(lines(plots.loads(data, data.chain), 0)) == {"pipeline", "quasi-static"}
