"""A velocity reference that stands or looks elsewhere than the drive file says is named with the likely place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.cli import main
from studies.drives.drive_file import read_drive
from studies.drives.frames import check_frames
from studies.drives.log import read_log
from tests.support.synthetic_drive import REAR, write_drive
from tests.support.turning_drive import TURNING, turning, write_table

BOTH = TURNING + 'vy = { column = "vy", unit = "m/s" }\n'


def seen_from(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, seed: int = 1, grip: float = 0.005) -> dict[str, Any]:
    """The kinematic drive with V_y = l_r r - grip r V^2, measured at (x, y), turned to the left by ``yaw`` degrees."""
    table, t = turning(seed=seed), np.arange(0.0, 20.0, 0.01)
    r, rng = 0.055 * np.sin(0.9 * t), np.random.default_rng(seed + 50)
    vx, vy = table["v"] - y * r, REAR * r - grip * r * table["v"] ** 2 + x * r
    cosine, sine = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
    noise = rng.normal(0.0, 0.01, (2, t.size))
    return table | {"v": cosine * vx + sine * vy + noise[0], "vy": cosine * vy - sine * vx + noise[1]}


def place(x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> str:
    return f'{BOTH}\n[mounting]\nreference = {{ x = "{x} m", y = "{y} m", yaw = "{yaw} deg" }}\n'


def complaint(folder: Path, text: str, table: dict[str, Any]) -> str | None:
    log = write_table(folder / "log.csv", table)
    drive = read_drive(write_drive(folder, text))
    found = read_log([log], drive)
    return check_frames(found.signals, drive, found.files, found.reference).complaint


MIRRORED = seen_from() | {"vy": -seen_from()["vy"]}
CASES: dict[str, tuple[str, dict[str, Any], str]] = {
    "left for right": (place(y=-0.6), seen_from(y=0.6), ".y: V_x less that of the wheels over the yaw rate is -1."),
    "ahead, not said": (BOTH, seen_from(x=2.0), "mounting.reference.x: V_y over the yaw rate is "),
    "behind, said ahead": (place(x=1.2), seen_from(x=-1.2), ' or reference = { x = "-1.'),
    "y to the right": (BOTH, MIRRORED, "likely the other sign for reference.vy (y axis to the right)"),
    "turned the other way": (place(yaw=-3.0), seen_from(yaw=3.0), "V_y / V_x is -6 deg on straights, should be 0; likely"),
    "turned, not said": (BOTH, seen_from(yaw=3.0), 'likely reference = { yaw = "3 deg" }'),
    "backward": (BOTH, seen_from(yaw=180.0), "V_x over the speed of the wheels is -1, should be 1; likely the other sign"),
    "turned to the left": (BOTH, seen_from(yaw=90.0), 'V_x and V_y exchanged, or reference = { yaw = "90 deg" }'),
}  # fmt: skip


@pytest.mark.parametrize(("text", "table", "said"), CASES.values(), ids=CASES.keys())
def test_a_reference_in_another_place_is_named_with_it(
    tmp_path: Path, text: str, table: dict[str, Any], said: str
) -> None:
    found = complaint(tmp_path, text, table)
    assert found is not None and said in found
    assert "\n" not in found and len(found) <= 300


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("grip", [0.0, 0.005, 0.012])
def test_a_reference_in_its_place_is_not_refused(tmp_path: Path, seed: int, grip: float) -> None:
    """Stiff tires and soft ones; a place and a turn that the drive file has."""
    assert complaint(tmp_path, BOTH, seen_from(seed=seed, grip=grip)) is None
    assert complaint(tmp_path, place(-1.2, 0.6, 30.0), seen_from(-1.2, 0.6, 30.0, seed, grip)) is None


def test_wheels_that_spin_give_no_other_axis(tmp_path: Path) -> None:
    from studies.drives.reference_place import reference_off

    drive = read_drive(write_drive(tmp_path, BOTH))
    found = read_log([write_table(tmp_path / "log.csv", seen_from())], drive)
    slid = {name: 0.2 * value for name, value in found.reference.items()}
    slid["vy"] = -slid["vy"]
    assert reference_off(found.signals, slid, drive) is None
    assert reference_off(found.signals, {name: -value for name, value in found.reference.items()}, drive) is not None


def test_the_command_refuses_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, drive = write_table(tmp_path / "log.csv", seen_from(y=0.6)), write_drive(tmp_path, place(y=-0.6))
    for rest in (["--check"], ["--out", str(tmp_path / "out")]):
        assert main(["run", str(log), "--drive", str(drive), *rest]) == 2
        assert 'likely reference = { y = "0.' in capsys.readouterr().err
