"""A log of a car that reverses, with wheel speeds that have no sign: the gear tells the way, and the comparisons know it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.drives.direction import Gear
from studies.drives.drive_file import read_drive
from studies.drives.frames import check_frames
from studies.drives.log import read_log
from studies.drives.run import replay_drive
from studies.errors import LogError
from synthesis.errors import SpecError
from tests.support.schedule_content import EFFECTIVE_RADIUS
from tests.support.synthetic_drive import TRACK, write_drive
from tests.support.turning_drive import TURNING, write_table

ALONE = "\n".join(
    line
    for line in TURNING.replace('[schedules]\nlongitudinal = "schedule.json"\n', "").splitlines()
    if not line.startswith(("az =", "steering ="))
)
UNSIGNED = "unsigned_wheels = true\n"
GEAR = 'direction = { column = "gear", backward = [7] }\n'
WHEELS = ("w_fl", "w_fr", "w_rl", "w_rr")


def reversing(seconds: float = 8.0) -> dict[str, Any]:
    """Out of a parking lot: from rest backward to -5 m/s in bends, and to a stop again; wheels count teeth."""
    t = np.arange(round(100 * seconds) + 1) / 100
    v = -2.5 * (1.0 - np.cos(2.0 * np.pi * t / seconds))
    r = 0.2 * np.sin(2.0 * np.pi * t / 4.0) * np.abs(v) / 5.0
    side = r * TRACK / 2.0
    left, right = (np.abs(v - side) / EFFECTIVE_RADIUS, np.abs(v + side) / EFFECTIVE_RADIUS)
    gear = np.where((t > 0.2) & (t < seconds - 0.2), 7.0, 0.0)
    table = {"t": t, "v": v, "ax": np.gradient(v, t), "ay": r * v, "r": r, "gear": gear}
    return table | {name: left if name.endswith("l") else right for name in WHEELS}


def parked(signed: bool, way: float = -1.0) -> dict[str, Any]:
    """A drive that ends two metres backward into a gap: 20 s forward to 10 m/s, a stop, 4 s backward at up to 1.2 m/s."""
    t = np.arange(2600) / 100
    v = np.where(t < 20.0, 5.0 * (1.0 - np.cos(2.0 * np.pi * t / 20.0)), 0.0)
    v = np.where((t > 21.0) & (t < 25.0), 0.6 * way * (1.0 - np.cos(2.0 * np.pi * (t - 21.0) / 4.0)), v)
    noise = np.random.default_rng(1).normal(0.0, 0.05, t.size)
    table = {"t": t, "v": v, "ax": np.gradient(v, t) + noise, "ay": 0.0 * t, "r": 0.0 * t, "gear": 1.0 + 0.0 * t}
    return table | dict.fromkeys(WHEELS, (v if signed else np.abs(v)) / EFFECTIVE_RADIUS)


def looked(folder: Path, text: str, table: dict[str, Any] | None = None) -> str | None:
    log = write_table(folder / "log.csv", table or reversing())
    drive = read_drive(write_drive(folder, text))
    found = read_log([log], drive)
    return check_frames(found.signals, drive, found.files).complaint


def test_the_gear_gives_the_wheels_their_sign(tmp_path: Path) -> None:
    log = write_table(tmp_path / "log.csv", reversing())
    data = replay_drive([log], write_drive(tmp_path, UNSIGNED + GEAR + ALONE))
    assert data.chain is not None
    error = data.chain.vx - data.log.reference["vx"]
    assert np.abs(error).max() < 0.15
    wheels = data.baselines["mean_wheel_speed"] - data.log.reference["vx"]
    assert np.abs(wheels[60:-60]).max() < 0.05


def test_without_a_gear_the_accelerometer_does(tmp_path: Path) -> None:
    log = write_table(tmp_path / "log.csv", reversing())
    data = replay_drive([log], write_drive(tmp_path, UNSIGNED + ALONE))
    assert data.chain is not None
    assert np.abs(data.chain.vx - data.log.reference["vx"])[200:].max() < 0.3


def test_the_comparisons_know_the_way_or_leave_it_open(tmp_path: Path) -> None:
    assert looked(tmp_path, UNSIGNED + GEAR + ALONE) is None
    assert looked(tmp_path, UNSIGNED + ALONE) is None


def test_signs_that_are_missing_without_a_word_are_refused_and_so_is_the_wrong_gear(tmp_path: Path) -> None:
    """Negative controls: the same log taken as signed, and with reverse read as forward."""
    said = looked(tmp_path, ALONE)
    assert said is not None and "unsigned_wheels = true" in said
    forward = UNSIGNED + 'direction = { column = "gear", backward = [-1] }\n'
    assert looked(tmp_path, forward + ALONE) is not None
    with pytest.raises(LogError, match="should be 1"):
        replay_drive([tmp_path / "log.csv"], write_drive(tmp_path, forward + ALONE))


def test_a_few_metres_backward_that_read_as_forward_are_found_in_a_long_drive(tmp_path: Path) -> None:
    said = looked(tmp_path, ALONE, parked(signed=False))
    assert said is not None
    assert "from 21.7 to 24.3 s, ax over the slope of the wheel speed is -" in said
    assert "likely unsigned_wheels = true at the top" in said
    assert len(said) <= 300
    creeps = parked(signed=False, way=0.3)  # too little to tell anything
    rolls_back = UNSIGNED + GEAR + ALONE  # in a forward gear
    right = [
        (parked(True), ALONE),
        (parked(False), UNSIGNED + ALONE),
        (parked(False), rolls_back),
        (parked(False, 1.0), ALONE),
    ]
    for table, text in [*right, (creeps, ALONE)]:
        assert looked(tmp_path, text, table) is None


def test_readings_of_a_gear() -> None:
    reading = np.array([-1.0, 0.0, 1.0, 6.0, 14.0, np.nan])
    np.testing.assert_array_equal(Gear(column="g").ways(reading), [-1, 0, 1, 1, 1, 0])
    coded = Gear(column="g", backward=[14.0], forward=[1.0, 2.0])
    np.testing.assert_array_equal(coded.ways(reading), [0, 0, 1, 0, -1, 0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GEAR + ALONE, r"direction: belongs to wheel speeds without a sign; add unsigned_wheels = true"),
        (UNSIGNED + GEAR.replace('"gear"', '"gear", log = "can"') + ALONE, r"direction.log: unknown log 'can'"),
    ],
)
def test_a_gear_that_means_nothing_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        read_drive(write_drive(tmp_path, text))


def test_what_the_mean_of_the_wheels_cannot_know_is_said(tmp_path: Path) -> None:
    log = write_table(tmp_path / "log.csv", reversing())
    said = "mean wheel speed is forward where no gear tells the way; the pipeline has it from the accelerometer"
    assert said in replay_drive([log], write_drive(tmp_path, UNSIGNED + ALONE)).inputs.assumptions
    always = reversing() | {"gear": np.full(801, 7.0)}
    log = write_table(tmp_path / "log.csv", always)
    assert said not in replay_drive([log], write_drive(tmp_path, UNSIGNED + GEAR + ALONE)).inputs.assumptions
