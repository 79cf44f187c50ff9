"""Mounting of the inertial unit from a drive: a rigid body of known motion, what its intervals hold, and what no log can say."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.signals.mounting import Mounting, lever_acceleration
from estimators.vehicle import GRAVITY
from studies.drives.drive_file import DriveFile, read_drive
from studies.drives.log import DriveLog
from studies.drives.mounted import PULLS, RATES, Mountings
from studies.identify.mounting import MountingFit, fit_mounting
from studies.identify.parameters import mounting_parameters
from studies.identify.result import mounting_file
from studies.identify.settings import IdentifySettings
from tests.support.synthetic_drive import write_drive

STEP = 0.01
UNIT = Mounting(1.2, -0.3, 0.25, 0.03, -0.02, 0.05)
ROLL, PITCH = 0.006, 0.003  # rad/(m/s^2), of the body
SETTINGS = IdentifySettings()


def log_of(
    kind: str = "slalom", seed: int = 1, names: tuple[str, ...] = (*PULLS, *RATES), seconds: float = 20.0
) -> DriveLog:
    """Slalom while accelerating and braking, straight braking, or rolling straight on; readings with noise and biases."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, seconds, STEP)
    speed, surge = {"slalom": (15.0, 3.0), "straight": (15.0, 4.0), "rolling": (15.0, 0.0)}[kind]
    turn = 0.45 if kind == "slalom" else 0.0
    vx = speed + surge * np.sin(0.6 * t)
    r = turn * np.sin(2.2 * t) * np.cos(0.3 * t)
    vy = 0.6 * r + 0.1 * turn * np.sin(1.3 * t)
    ax, ay = np.gradient(vx, STEP) - r * vy, np.gradient(vy, STEP) + r * vx
    roll, pitch = ROLL * ay, PITCH * ax
    rate = np.stack([np.gradient(roll, STEP) + r * pitch, -np.gradient(pitch, STEP) + r * roll, r], axis=1)
    up = GRAVITY * np.ones_like(t)
    pull = np.stack([ax + up * pitch, ay + up * roll, up - ax * pitch - ay * roll], axis=1)
    pull += lever_acceleration(UNIT.lever, rate, np.gradient(rate, STEP, axis=0))
    pull, rate = pull @ UNIT.rotation, rate @ UNIT.rotation
    pull += rng.normal(0.0, 0.05, pull.shape) + rng.normal(0.0, 0.05, 3)
    rate += rng.normal(0.0, 0.002, rate.shape) + rng.normal(0.0, 0.002, 3)
    readings = dict(zip((*PULLS, *RATES), np.concatenate([pull, rate], axis=1).T, strict=True))
    unit: dict[str, FloatArray] = {name: readings[name] for name in names}
    reference = {name: value + rng.normal(0.0, 0.01, t.size) for name, value in (("vx", vx), ("vy", vy))}
    return DriveLog(t, dict(unit), reference, {}, unit)


def drive_of(folder: Path, text: str = "") -> DriveFile:
    path = write_drive(folder)
    names = {"ay": "m/s^2", "yaw_rate": "rad/s", "roll_rate": "rad/s", "pitch_rate": "rad/s"}
    signals = "".join(f'{name} = {{ column = "{name}", unit = "{unit}" }}\n' for name, unit in names.items())
    content = path.read_text(encoding="utf-8").replace('"5 ms"', '"10 ms"').replace("200 Hz", "100 Hz")
    path.write_text(content.replace("[reference]", signals + "[reference]") + text, encoding="utf-8")
    return read_drive(path)


def found_in(log: DriveLog, drive: DriveFile) -> MountingFit:
    found = fit_mounting(log, drive, SETTINGS)
    assert found.fit is not None
    return found


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_drive_that_turns_and_brakes_says_how_the_unit_is_mounted(tmp_path: Path, seed: int) -> None:
    fit = found_in(log_of(seed=seed), drive_of(tmp_path)).fit
    assert fit is not None
    for name, model in (("x", 0.02), ("y", 0.02), ("z", 0.02), ("roll", 0.002), ("pitch", 0.002), ("yaw", 0.002)):
        assert fit.excited[name]
        # what the model leaves out (products of small angles) beside 95 %
        assert abs(fit.value(name) - getattr(UNIT, name)) < fit.half[name] + model
        assert abs(fit.value(name) + getattr(UNIT, name)) > 2.0 * fit.half[name]  # the other sign is outside


def test_what_the_drive_file_has_is_where_the_fit_starts_and_not_where_it_ends(tmp_path: Path) -> None:
    """A drive file with another mounting: its priors move nothing that the log says."""
    log = log_of()
    plain = found_in(log, drive_of(tmp_path)).fit
    told = found_in(log, drive_of(tmp_path, '\n[mounting.inertial]\nx = "0.4 m"\nyaw = "-3 deg"\n')).fit
    assert plain is not None and told is not None
    for name in ("x", "y", "yaw"):
        assert abs(told.value(name) - plain.value(name)) < 0.5 * plain.half[name]


def test_straight_driving_leaves_the_lever_arm_at_its_prior(tmp_path: Path) -> None:
    """Braking says the yaw angle; without turns nothing says x and y, and they are held where the drive file has them."""
    given = drive_of(tmp_path, '\n[mounting.inertial]\nx = "0.7 m"\n')
    found = found_in(log_of("straight", seconds=12.0), given)
    entries = mounting_parameters(named(found))
    assert entries["yaw"].excited
    assert entries["yaw"].value == pytest.approx(UNIT.yaw, abs=0.01)
    for name in ("x", "y"):
        assert not entries[name].excited
        assert entries[name].interval is None
    assert entries["x"].value == 0.7
    assert "not excited by log.csv; prior: drive file" in entries["x"].source
    rolling = mounting_parameters(named(found_in(log_of("rolling", seconds=6.0), given)))
    assert not any(entry.excited for entry in rolling.values())


def test_without_gyros_of_roll_and_pitch_the_lever_arm_is_still_found(tmp_path: Path) -> None:
    fit = found_in(log_of(names=("ax", "ay", "yaw_rate")), drive_of(tmp_path)).fit
    assert fit is not None
    assert fit.excited["x"]
    assert abs(fit.value("x") - UNIT.x) < max(0.1, 1.5 * fit.half["x"])
    assert not any(fit.excited[name] for name in ("z", "roll", "pitch"))


def test_what_a_fit_cannot_do_without_is_named(tmp_path: Path) -> None:
    log, drive = log_of(), drive_of(tmp_path)
    del log.reference["vy"]
    found = fit_mounting(log, drive, SETTINGS)
    assert (found.fit, found.absent) == (None, "not fitted: reference.vy missing")
    assert mounting_parameters(named(found)) == {}


def test_the_file_is_a_table_of_a_drive_file(tmp_path: Path) -> None:
    text = mounting_file(named(found_in(log_of(), drive_of(tmp_path))))
    place = Mountings.model_validate(tomllib.loads(text)["mounting"]).inertial
    assert place.x == pytest.approx(UNIT.x, abs=0.1)
    assert place.yaw == pytest.approx(UNIT.yaw, abs=0.008)
    assert "95 % [" in text


def named(found: MountingFit) -> Any:
    """As far as an identification goes here."""
    return SimpleNamespace(mounting=found, logs=("log.csv",))
