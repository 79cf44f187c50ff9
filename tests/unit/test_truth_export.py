"""A truth drive written as a recorded one is replayed like one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.drives.drive_file import read_drive
from studies.drives.evaluation import evaluate
from studies.drives.log import read_log
from studies.drives.run import replay_drive
from studies.truth import PERFECT, Channel, Drops, Measured, Sensors, draw, simulate, write_drive
from synthesis.errors import SpecError
from tests.support.truth_cases import course, ramp, suv


@pytest.fixture(scope="module")
def measured() -> Measured:
    one = course(speed=10.0, duration=1.5, steer=ramp(0.2, 0.5, 0.04), drive_torque=ramp(0.5, 0.7, 1500.0), name="own")
    sensors = Sensors(wheel_speed=Channel(noise=0.02, drops=Drops(0.05)))
    return draw(simulate([one], [suv(rolling_resistance=0.0)]), sensors, [11, 12])


def test_the_log_reads_back(measured: Measured, tmp_path: Path) -> None:
    log, drive = write_drive(tmp_path, measured, seed=1)
    assert (log.name, drive.name) == ("own.csv", "own.toml")
    read = read_log([log], read_drive(drive))
    car = measured.truth.vehicles[0].parameters
    assert read_drive(drive).vehicle.yaw_inertia == car.yaw_inertia
    for name in ("ax", "ay", "yaw_rate", "pitch_rate"):
        assert read.signals[name] == pytest.approx(measured.signals[name][1, 0], abs=1e-6)
    assert read.signals["torque_rl"] == pytest.approx(measured.signals["torque"][1, 0, :, 2], abs=1e-5)
    assert read.reference["vx"] == pytest.approx(measured.truth["vx"][0], abs=1e-6)
    assert read.reference["force_y_fr"] == pytest.approx(measured.truth["force_y"][0, :, 1], abs=1e-5)


def test_the_drive_replays(measured: Measured, tmp_path: Path) -> None:
    log, drive = write_drive(tmp_path, measured)
    data = replay_drive([log], drive)
    velocity = evaluate(data)["velocity"]
    assert velocity["pipeline"]["nrms_percent"] < 2.0
    assert velocity["pipeline"]["reference_peak"] == pytest.approx(float(np.abs(measured.truth["vx"]).max()))
    assert data.chain is not None and np.abs(data.chain.vy - measured.truth["vy"][0]).max() < 0.3


def test_what_is_not_there(measured: Measured, tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="2 seeds and 1 runs"):
        write_drive(tmp_path, measured, seed=2)
    with pytest.raises(SpecError, match="truth: unknown manoeuvre"):
        draw(measured.truth.only("owm"), PERFECT, [0])
