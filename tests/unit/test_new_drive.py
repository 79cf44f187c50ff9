"""`gainsmith new NAME --drive`: a drive file and the log of a simulated car, in the units and signs that the file says."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from studies.cli import main
from studies.commands import new
from studies.commands.new import DRIVEN, run_new
from studies.drives.drive_file import read_drive
from studies.drives.guess import guess
from studies.truth import Measured, Sensors, draw, load_manoeuvre, simulate_manoeuvres
from studies.truth.export import write_log
from synthesis.errors import SpecError

MANOEUVRE = load_manoeuvre(DRIVEN).model_copy(update={"duration": 4.0})


@pytest.fixture(scope="module")
def measured() -> Measured:
    return draw(simulate_manoeuvres([MANOEUVRE]), Sensors(), seeds=[0])


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("new")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(new, "SECONDS", MANOEUVRE.duration)
        assert run_new("my-car", folder, drive=True, as_json=False) == 0
    assert sorted(path.name for path in folder.iterdir()) == ["my-car-drive.toml", "my-car-log.csv"]
    return folder / "my-car-log.csv", folder / "my-car-drive.toml"


def test_the_log_is_in_the_units_of_the_file(written: tuple[Path, Path], measured: Measured) -> None:
    """By hand: revolutions a minute, degrees, km/h."""
    log = np.genfromtxt(written[0], delimiter=",", names=True)
    at = {name: value[0, 0] for name, value in measured.signals.items()}
    turned = log["wheel_speed_rl"] * 2.0 * np.pi / 60.0
    np.testing.assert_allclose(turned, at["wheel_speed"][:, 2], atol=1e-6)
    np.testing.assert_allclose(np.radians(log["yaw_rate"]), at["yaw_rate"], atol=1e-7)
    np.testing.assert_allclose(np.radians(log["steer_fr"]), at["steer"][:, 1], atol=1e-7)
    np.testing.assert_allclose(log["acceleration_z"], at["az"], atol=1e-6)
    np.testing.assert_allclose(log["reference_vx"] / 3.6, measured.truth["vx"][0], atol=1e-6)


def test_the_file_has_the_car_that_made_the_log(written: tuple[Path, Path], measured: Measured) -> None:
    there, true = read_drive(written[1]).vehicle.parameters, measured.truth.vehicles[0].parameters
    for field in fields(true):
        assert getattr(there, field.name) == getattr(true, field.name), field.name


def test_its_signals_agree_and_a_wrong_unit_does_not(
    written: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, drive = written
    assert main(["run", str(log), "--drive", str(drive), "--check"]) == 0
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(drive.read_text().replace('"yaw_rate", unit = "deg/s"', '"yaw_rate", unit = "rad/s"'))
    capsys.readouterr()
    assert main(["run", str(log), "--drive", str(wrong), "--check"]) == 2
    assert "yaw_rate" in capsys.readouterr().err


def test_a_guess_finds_the_columns_of_the_file(written: tuple[Path, Path]) -> None:
    """From names and ranges alone; the roll rate, though small, has the unit of the other rates."""
    guessed, known = guess([written[0]]), read_drive(written[1])
    assert guessed.missing == ()
    assert guessed.found == {name: one.column for name, one in (known.signals | known.reference).items()}
    rates = [line for line in guessed.text.splitlines() if "_rate = " in line]
    assert len(rates) == 3 and all('unit = "deg/s"' in line for line in rates)


def test_nothing_is_replaced_or_left_half_written(
    written: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = [path.read_bytes() for path in written]
    assert main(["new", "my-car", "--drive", "--out", str(written[0].parent)]) == 2
    assert "exists; choose another name or folder" in capsys.readouterr().err
    assert [path.read_bytes() for path in written] == before

    def stopped(*_args: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(new, "_simulate_log", stopped)
    assert main(["new", "other", "--drive", "--out", str(tmp_path)]) == 130
    assert not list(tmp_path.iterdir())


def test_a_signal_that_no_simulation_has(written: tuple[Path, Path], measured: Measured, tmp_path: Path) -> None:
    drive = read_drive(written[1])
    other = drive.model_copy(update={"signals": {**drive.signals, "vy": drive.signals["ay"]}})
    with pytest.raises(SpecError, match="unknown simulated signal 'vy'"):
        write_log(tmp_path / "log.csv", other, measured)
