"""A first drive file from a log alone: it must be read and run as it is, and never replace what is there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.cli import main
from studies.drives.drive_file import read_drive
from studies.drives.frames import check_frames
from studies.drives.guess import guess, write_guess
from studies.drives.guess_names import guess_column
from studies.drives.log import DriveLog, read_log
from studies.errors import LogError
from synthesis.errors import SpecError
from tests.support.turning_drive import turning, write_table

NAMES = {
    "t": "time", "v": "reference.vx", "ax": "signals.ax", "ay": "signals.ay", "az": "signals.az", "r": "signals.yaw_rate",
    "d": "signals.steering", **{f"w_{c}": f"signals.wheel_speed_{c}" for c in ("fl", "fr", "rl", "rr")},
}  # fmt: skip
GERMAN = {
    "t": "Zeit [ms]", "v": "Fahrzeuggeschwindigkeit [km/h]", "ax": "Längsbeschleunigung [m/s²]", "ay": "Querbeschleunigung [g]",
    "az": "Vertikalbeschleunigung [m/s²]", "r": "Gierrate [°/s]", "d": "Radlenkwinkel [°]", "w_fl": "Raddrehzahl VL [1/min]",
    "w_fr": "Raddrehzahl VR [1/min]", "w_rl": "Raddrehzahl HL [1/min]", "w_rr": "Raddrehzahl HR [1/min]",
}  # fmt: skip
IN_GERMAN = {"t": 1e3, "v": 3.6, "ay": 1 / 9.80665, "r": 180 / math.pi, "d": 180 / math.pi} | dict.fromkeys(
    ("w_fl", "w_fr", "w_rl", "w_rr"), 30 / math.pi
)
CAMEL = {
    "t": "timestamp", "v": "vehicleSpeed_mps", "ax": "LongAcc", "ay": "LatAcc", "az": "accZ", "r": "YawRate",
    "d": "steeringAngle",
    "w_fl": "WheelSpeedFL_kmh", "w_fr": "WheelSpeedFR_kmh", "w_rl": "WheelSpeedRL_kmh", "w_rr": "WheelSpeedRR_kmh",
}  # fmt: skip
IN_CAMEL = {"t": 1e9, "r": 180 / math.pi} | dict.fromkeys(("w_fl", "w_fr", "w_rl", "w_rr"), 3.6 * 0.33)


def renamed(names: dict[str, str], scales: dict[str, float]) -> dict[str, Any]:
    return {names[name]: scales.get(name, 1.0) * value for name, value in turning().items()}


def read_back(logs: Sequence[Path], target: Path) -> DriveLog:
    drive = read_drive(target)
    found = read_log(logs, drive)
    assert check_frames(found.signals, drive, found.files).complaint is None
    return found


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize(("names", "scales"), [(GERMAN, IN_GERMAN), (CAMEL, IN_CAMEL)], ids=["German", "camel case"])
def test_a_usual_log_is_read_as_it_is(
    tmp_path: Path, names: dict[str, str], scales: dict[str, float], decimal: str
) -> None:
    log = write_table(tmp_path / "log.csv", renamed(names, scales), ";" if decimal == "," else ",")
    if decimal == ",":
        log.write_bytes(log.read_text(encoding="utf-8").replace(".", ",").encode("cp1252"))
    target, guessed = write_guess([log], None)
    assert target == tmp_path / "log.toml"
    assert guessed.missing == ()
    assert "# CHECK: a usual car, not yours" in guessed.text
    found, truth = read_back([log], target), turning()
    keep = slice(0, 500)
    for name, column in (("ax", "ax"), ("ay", "ay"), ("yaw_rate", "r"), ("wheel_speed_rl", "w_rl"), ("steering", "d")):
        on_grid = np.interp(found.time, truth["t"] + found.time[0] - truth["t"][0], truth[column])
        scale = found.signals[name][keep] / on_grid[keep]
        assert np.median(scale) == pytest.approx(1.0, rel=0.06 if column == "w_rl" else 1e-3), name
    np.testing.assert_allclose(found.reference["vx"].max(), truth["v"].max(), rtol=1e-3)


def test_units_in_a_row_and_iso_time(tmp_path: Path) -> None:
    log = write_table(tmp_path / "log.csv", turning(3.0))
    lines = log.read_text().splitlines()
    lines[0] = "time,v,ax,ay,az,yaw_rate,steering," + ",".join(f"wheel_speed_{c}" for c in ("fl", "fr", "rl", "rr"))
    units = "-,m/s,m/s^2,m/s^2,m/s^2,rad/s,rad" + 4 * ",rad/s"
    rows = [f"2026-03-01T08:00:{0.01 * k:06.3f}," + line.split(",", 1)[1] for k, line in enumerate(lines[1:])]
    log.write_text("\n".join([lines[0], units, *rows]) + "\n")
    target, guessed = write_guess([log], tmp_path / "own.toml")
    assert "units_row = true" in guessed.text and 'time_format = "iso"' in guessed.text
    assert "CHECK: the unit is a guess" not in guessed.text
    assert read_back([log], target).time.size == 599


@pytest.mark.parametrize(
    ("column", "found"),
    [
        ("omega_fl", ("signals", "wheel_speed_fl", None)),
        ("v_wheel_rr", ("signals", "wheel_speed_rr", None)),
        ("Wheel Speed Front Left (rpm)", ("signals", "wheel_speed_fl", "rpm")),
        ("wheel_speed_LR [km/h]", ("signals", "wheel_speed_rl", "km/h")),
        ("T_fl", ("signals", "torque_fl", None)),
        ("delta_fr [deg]", ("signals", "steer_fr", "deg")),
        ("Acceleration_X", ("signals", "ax", None)),
        ("a_y (m/s²)", ("signals", "ay", "m/s^2")),
        ("Yaw_Velocity", ("signals", "yaw_rate", None)),
        ("Gierrate [°/s]", ("signals", "yaw_rate", "deg/s")),
        ("gyro_z", ("signals", "yaw_rate", None)),
        ("Lenkradwinkel [°]", ("signals", "hand_wheel", "deg")),
        ("steering_wheel_angle", ("signals", "hand_wheel", None)),
        ("t_s", ("time", "time", "s")),
        ("Velocity_X", ("reference", "vx", None)),
        ("reference_vy [km/h]", ("reference", "vy", "km/h")),
        ("true_vx", ("reference", "vx", None)),
        ("ESP_Laengsbeschl [g]", ("signals", "ax", "g")),
        ("ESP_VL_Radgeschw", ("signals", "wheel_speed_fl", None)),
        ("G_Lat", ("signals", "ay", None)),
        ("LRW", ("signals", "hand_wheel", None)),
        ("v_rad_vl@3", ("signals", "wheel_speed_fl", None)),
        ("log.wheel.fl", ("signals", "wheel_speed_fl", None)),
        ("out.signals.ax.values", ("signals", "ax", None)),
        ("wheelSpeed[2]", ("signals", "wheel_speed_rl", None)),
        ("/car/wheels.wheel_speed[3]", ("signals", "wheel_speed_rr", None)),
        ("/odom.twist.twist.linear.x", ("reference", "vx", None)),
        ("wheelSpeed[4]", None),
        ("/imu.angular_velocity_covariance[0]", None),
        ("torque[0]", None),
        ("true_ax", None),
        ("slip_FL", None),
        ("Fx_fl", None),
        ("kappa_rr", None),
        ("Engine_torque", None),
        ("brake pressure FL [bar]", None),
        ("", None),
        ("x" * 5000, None),
    ],
)
def test_names(column: str, found: tuple[str, str, str | None] | None) -> None:
    assert guess_column(column) == found


def test_a_guess_never_replaces_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = write_table(tmp_path / "log.csv", renamed(CAMEL, IN_CAMEL))
    assert main(["run", str(log), "--guess"]) == 0
    assert "--check" in capsys.readouterr().out
    before = (tmp_path / "log.toml").read_bytes()
    assert main(["run", str(log), "--guess"]) == 2
    assert "is there already, and a guess never replaces it" in capsys.readouterr().err
    assert (tmp_path / "log.toml").read_bytes() == before
    with pytest.raises(SpecError, match=r"cannot be written"):
        write_guess([log], tmp_path / "no" / "such.toml")


def test_what_is_not_found_is_asked_for(tmp_path: Path) -> None:
    table = turning(2.0)
    del table["ax"], table["w_rl"]
    log = write_table(tmp_path / "log.csv", table)
    found = guess([log])
    assert found.missing == ("wheel_speed_rl", "ax")
    assert '# ax = { column = "?", unit = "m/s^2" } # CHECK: not found' in found.text
    target, _ = write_guess([log], None)
    with pytest.raises(SpecError, match=r"signals\.wheel_speed_rl: missing"):
        read_drive(target)


def test_what_a_logger_says_of_itself_may_hold_numbers(tmp_path: Path) -> None:
    log = write_table(tmp_path / "log.csv", renamed(CAMEL, IN_CAMEL))
    said = ["Exported by Logger 3.2", "Car, test 7", ""] + [f"setting {k}: {k}" for k in range(25)]
    log.write_text("\n".join([*said, log.read_text(encoding="utf-8")]), encoding="utf-8")
    target, guessed = write_guess([log], None)
    assert f"header_line = {len(said) + 1}" in guessed.text
    assert read_back([log], target).time.size == 3999


@pytest.mark.parametrize("speed", ["m/s", "km/h", "mph"])
@pytest.mark.parametrize("pull", ["m/s^2", "g"])
def test_units_of_speed_and_acceleration_are_found_together(tmp_path: Path, speed: str, pull: str) -> None:
    """No name says a unit, and no a_z how large g is; wheels that read like the car are in its unit."""
    factors = {"m/s": 1.0, "km/h": 3.6, "mph": 1.0 / 0.44704, "m/s^2": 1.0, "g": 1.0 / 9.80665}
    table = turning()
    del table["az"]
    table |= {"v": factors[speed] * table["v"]} | {name: factors[pull] * table[name] for name in ("ax", "ay")}
    table |= {name: 0.33 * factors[speed] * table[name] for name in table if name.startswith("w_")}
    log = write_table(tmp_path / "log.csv", table)
    target, guessed = write_guess([log], None)
    for name, unit in (("vx", speed), ("wheel_speed_rr", speed), ("ax", pull), ("ay", pull)):
        line = next(line for line in guessed.text.splitlines() if line.startswith(f"{name} ="))
        assert f'unit = "{unit}" }} # CHECK' in line
    assert read_back([log], target).time.size == 3999


def test_units_are_not_found_together_where_nothing_changes(tmp_path: Path) -> None:
    """Negative control: 80 km/h all the time is 80 m/s to whoever sees no more; angular wheel speeds stay what they are."""
    table = turning()
    steady = table | {"v": np.full(2000, 80.0), "ax": table["ax"] - 2.1 * np.cos(0.6 * table["t"])}
    text = guess([write_table(tmp_path / "log.csv", steady)]).text
    assert 'vx = { column = "v", unit = "m/s" }' in text
    assert 'column = "w_fl", unit = "rad/s"' in text
    assert 'column = "w_fl", unit = "rad/s"' in guess([write_table(tmp_path / "log.csv", table)]).text


def test_units_are_not_found_together_in_noise(tmp_path: Path) -> None:
    """An accelerometer that hardly follows, of the size that it would have beside a speed in km/h."""
    table, noise = turning(), np.random.default_rng(3).normal(0.0, 1.0, 2000)
    gain = table["v"][100:] - table["v"][:-100]
    noise = np.cumsum(noise - np.mean(noise)) * np.std(gain) / 30.0
    table["ax"] = 0.6 * table["ax"] + noise
    felt = np.convolve(table["ax"], np.full(100, 0.01), "valid")
    table["ax"] *= np.std(gain) / (3.6 * np.std(felt))
    assert 'vx = { column = "v", unit = "m/s" }' in guess([write_table(tmp_path / "log.csv", table)]).text


def test_columns_that_were_taken_for_nothing_are_listed(tmp_path: Path) -> None:
    table = turning(2.0) | {"engine": np.zeros(200)} | {f"cov[{k}]": np.zeros(200) for k in range(3)}
    log = write_table(tmp_path / "log.csv", table)
    assert guess([log]).text.endswith("# not taken for a signal: d, engine, cov[]\n")
    assert "not taken" not in guess([write_table(tmp_path / "log.csv", renamed(GERMAN, IN_GERMAN))]).text


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "line 1 is empty"),
        (
            b"time,colour,smell\n1,2,3\n2,3,4\n",
            "no name says what is measured (colour, smell); write the drive file by hand",
        ),
        (b"a,b\n1,2\n3,4\n", "no column looks like a clock"),
        (b"time,ax\n1,2\n", "holds less than two stamps"),
        (b"time,ax\n1,2\n2,x\n", "line 3: column 'ax' holds 'x'"),
        (bytes(range(128, 256)) * 20, ""),
        (b"t" * 200_000 + b"\n1\n", "line 1 has more than 100000 characters"),
    ],
)
def test_what_is_no_log_is_one_line(tmp_path: Path, content: bytes, message: str) -> None:
    log = tmp_path / "log.csv"
    log.write_bytes(content)
    with pytest.raises(LogError) as caught:
        write_guess([log], None)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) <= 300
    assert not (tmp_path / "log.toml").exists()


def test_a_slow_log_with_other_wheels_says_how_to_get_schedules(tmp_path: Path) -> None:
    table = turning() | {name: 0.33 / 0.40 * value for name, value in turning().items() if name.startswith("w_")}
    slow = {name: value[::5] for name, value in table.items()}
    log = write_table(tmp_path / "log.csv", slow)
    target, guessed = write_guess([log], None)
    assert '--radius "0.4 m" --sample-time "50 ms" --out .' in guessed.text
    assert read_drive(target).schedules is None
    assert read_drive(target).vehicle.effective_radius_front == pytest.approx(0.40, rel=0.01)


@pytest.mark.parametrize(("lift", "unit"), [(1.0, "g"), (9.81, "m/s^2")])
def test_one_unit_of_accelerometers_as_gravity_shows_it(tmp_path: Path, lift: float, unit: str) -> None:
    table = turning()
    del table["v"]  # it would say that ax alone is in m/s^2
    log = write_table(tmp_path / "log.csv", table | {"az": table["az"] * lift / 9.81})
    _, guessed = write_guess([log], None)
    for name in ("ax", "ay", "az"):
        assert f'{name} = {{ column = "{name}", unit = "{unit}" }}' in guessed.text
