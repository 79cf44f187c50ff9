"""Units of the right dimension and the wrong size: refused before the run, with the unit that explains them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.drives.drive_file import read_drive
from studies.drives.log import DriveLog, read_log
from studies.drives.plausible import LIMITS
from studies.drives.quantities import CORNERS, SIGNALS, factor_to
from studies.drives.run import run_drive
from studies.errors import LogError
from tests.support.synthetic_drive import DRIVE, TORQUES, columns, write_drive, write_log

EXTRA = {
    "ay": "m/s^2",
    "yaw_rate": "rad/s",
    "roll_rate": "rad/s",
    "hand_wheel": "rad",
    "steering": "rad",
    "steer_fl": "rad",
}


def with_signal(name: str, unit: str) -> str:
    """The drive file of the tests with one more signal, or with another unit of one that is there."""
    pair = 'steer_fr = { column = "zero", unit = "rad" }\n' if name == "steer_fl" else ""
    text = DRIVE.replace("[vehicle]", "[vehicle]\nsteering_ratio = 15.0")
    if name == "ax":
        return text.replace('column = "ax", unit = "m/s^2"', f'column = "probe", unit = "{unit}"')
    return text.replace("[reference]", f'{name} = {{ column = "probe", unit = "{unit}" }}\n{pair}[reference]')


def read(folder: Path, text: str, table: dict[str, Any] | None = None) -> DriveLog:
    log = write_log(folder / "log.csv", columns() if table is None else table)
    return read_log([log], read_drive(write_drive(folder, text)))


def probe(folder: Path, name: str, peak: float, unit: str) -> DriveLog:
    """A triangle up to ``peak`` in the column's own numbers."""
    table = columns()
    table["zero"] = np.zeros_like(table["t"])
    table["probe"] = np.linspace(-peak, peak, table["t"].size)
    return read(folder, with_signal(name, unit), table)


@pytest.mark.parametrize(
    ("name", "declared", "peak", "likely"),
    [
        ("ax", "standard_gravity", 9.0, "m/s^2"),
        ("ay", "m/s^2", 900.0, "cm/s^2"),
        ("yaw_rate", "rad/s", 25.0, "deg/s"),
        ("roll_rate", "rad/s", 15.0, "deg/s"),
        ("steering", "rad", 8.0, "deg"),
        ("steer_fl", "rad", 8.0, "deg"),
        ("hand_wheel", "rad", 200.0, "deg"),
    ],
)
def test_the_column_its_unit_its_largest_value_and_the_likely_unit_are_named(
    tmp_path: Path, name: str, declared: str, peak: float, likely: str
) -> None:
    with pytest.raises(LogError) as caught:
        probe(tmp_path, name, peak, declared)
    unit = SIGNALS[name]
    message = str(caught.value)
    assert message.startswith(
        f"log.csv: signals.{name}: column 'probe' in {declared} reaches {peak * factor_to(declared, unit):.4g} {unit}, "
    )
    assert message.endswith(f'; likely unit = "{likely}": correct it in the drive file')
    assert "\n" not in message
    probe(tmp_path, name, peak, likely)  # and with that unit the log is read


@pytest.mark.parametrize("name", EXTRA)
def test_a_limit_is_a_limit(tmp_path: Path, name: str) -> None:
    probe(tmp_path, name, 0.99 * LIMITS[name].largest, EXTRA[name])
    with pytest.raises(LogError, match=rf"signals\.{name}: "):
        probe(tmp_path, name, 1.1 * LIMITS[name].largest, EXTRA[name])


def test_torques_in_kilonewtons_that_are_newtons(tmp_path: Path) -> None:
    wrong = DRIVE.replace("[reference]", TORQUES.replace('"N*m"', '"kN*m"') + "\n[reference]")
    table = columns()
    with pytest.raises(LogError, match=r"signals\.torque_fl: column 'T_fl' in kN\*m reaches .*likely unit = \"N\*m\""):
        read(tmp_path, wrong, table)
    read(tmp_path, wrong.replace('"kN*m"', '"N*m"'), table)


def test_a_factor_may_be_the_culprit(tmp_path: Path) -> None:
    text = with_signal("yaw_rate", "rad/s").replace('unit = "rad/s" }\n[ref', 'unit = "rad/s", factor = 57.3 }\n[ref')
    table = columns() | {"probe": np.full(601, 0.4)}
    with pytest.raises(LogError, match=r"correct its unit or factor \(now 57\.3\) in the drive file$"):
        read(tmp_path, text, table)


def test_single_spikes_and_missing_samples_are_for_the_estimators(tmp_path: Path) -> None:
    table = columns()
    table["ax"][::150] = 1e4
    table["w_fr"][50:55] = 1e6
    table["w_rl"][:] = np.nan
    found = read(tmp_path, DRIVE, table)
    assert found.signals["ax"].max() == 1e4
    table["ax"][::50] = 1e4  # two per cent are no spikes
    with pytest.raises(LogError, match=r"signals\.ax: .* reaches 1e\+04 m/s\^2"):
        read(tmp_path, DRIVE, table)


def units(wheels: str, velocity: str = "m/s") -> str:
    text = re.sub(r'(column = "w_.*?unit = )"rad/s"', rf'\1"{wheels}"', DRIVE)
    return text.replace('column = "v", unit = "m/s"', f'column = "v", unit = "{velocity}"')


FAST = columns(duration=1.0, start=6.0)


@pytest.mark.parametrize(
    ("text", "scale", "ratio", "remedy"),
    [
        (units("rpm"), 1.0, "0.106", 'likely unit = "rad/s": correct it'),
        (units("rad/s"), 60 / (2 * np.pi), "9.63", 'likely unit = "rpm": correct it'),
        (units("rad/s"), 1 / (2 * np.pi), "0.16", 'likely unit = "turn/s": correct it'),
        (units("rad/s", "km/h"), 1.0, "3.63", 'likely unit = "m/s" for reference.vx: correct it'),
        (units("rad/s"), -1.0, "-1.01", 'likely sign = "negative": correct it'),
        (units("rad/s"), 1.9, "1.92", "correct its unit or factor (now 1) or effective_radius in the drive file"),
    ],
)
def test_wheels_that_do_not_roll_beside_the_reference(
    tmp_path: Path, text: str, scale: float, ratio: str, remedy: str
) -> None:
    table = columns(duration=1.0, start=30.0) if "km/h" in text else FAST  # above 5 m/s in whatever unit is declared
    table = table | {f"w_{corner}": scale * table[f"w_{corner}"] for corner in CORNERS}
    with pytest.raises(LogError) as caught:
        read(tmp_path, text, table)
    message = str(caught.value)
    assert f"R_e w / V_x is {ratio} at the median of all wheels" in message
    assert remedy in message
    assert message.startswith("log.csv: signals.wheel_speed_fl: column 'w_fl' in ")
    assert "\n" not in message


def test_rolling_wheels_in_km_h_are_no_rad_s_and_slipping_ones_stay(tmp_path: Path) -> None:
    """1.19 rad/s a km/h on this wheel: less than slip may be, but slip does not stay the same."""
    km_h = FAST | {f"w_{corner}": 3.6 * 0.33 * FAST[f"w_{corner}"] for corner in CORNERS}
    with pytest.raises(LogError, match=r"R_e w / V_x is 1\.2 .* 0\.89 to 1\.12; likely unit = \"km/h\""):
        read(tmp_path, DRIVE, km_h)
    slip = np.linspace(1.05, 1.35, FAST["t"].size)
    read(tmp_path, DRIVE, FAST | {f"w_{corner}": slip * FAST[f"w_{corner}"] for corner in CORNERS})


def test_one_wheel_among_good_ones(tmp_path: Path) -> None:
    text = DRIVE.replace('"w_rr", unit = "rad/s"', '"w_rr", unit = "rpm"')
    with pytest.raises(LogError, match=r"signals\.wheel_speed_rr: column 'w_rr' in rpm .*likely unit = \"rad/s\""):
        read(tmp_path, text, FAST)
    read(tmp_path, DRIVE, FAST)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.6, 1.5])
def test_a_dead_locked_sliding_or_spinning_wheel_is_no_unit(tmp_path: Path, share: float) -> None:
    read(tmp_path, DRIVE, FAST | {"w_fl": share * FAST["w_fl"]})


def test_wheels_tell_nothing_at_a_walk_or_without_a_reference(tmp_path: Path) -> None:
    slow = columns(duration=0.5, start=1.0)
    assert slow["v"].max() < 5.0
    read(tmp_path, units("rpm"), slow)
    read(tmp_path, units("rpm").split("[reference]")[0], FAST)


def test_nothing_is_written_where_a_unit_is_wrong(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log.csv", FAST)
    with pytest.raises(LogError, match="R_e w / V_x"):
        run_drive([log], write_drive(tmp_path, units("rpm")), tmp_path / "out")
    assert not (tmp_path / "out").exists()
