"""What a drive file must say, and the one line that says what is wrong with it."""

# ruff: noqa: E501
from __future__ import annotations

import math
from pathlib import Path

import pytest

from studies.drives.drive_file import Vehicle, read_drive
from studies.drives.quantities import factor_to, to_si
from synthesis.errors import SpecError
from tests.support.synthetic_drive import DRIVE, TORQUES

REPOSITORY = Path(__file__).parents[2]
TWO_LOGS = DRIVE.replace(
    "[signals]",
    '[[log]]\nname = "second"\nrate = "100 Hz"\nALIGN\n\n[signals]',
).replace('column = "', 'log = "log", column = "')


def refusal(folder: Path, text: str) -> str:
    path = folder / "drive.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        read_drive(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("drive.toml: ")
    return message.removeprefix("drive.toml: ")


def test_quantities_are_read_in_si(tmp_path: Path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(DRIVE.replace('unit = "m/s"', 'unit = "km/h", sign = "negative", factor = 2.0'), encoding="utf-8")
    drive = read_drive(path)
    assert drive.sample_time == pytest.approx(0.005)
    assert drive.vehicle.rear_axle_distance == pytest.approx(1.4)
    assert drive.reference["vx"].scale("m/s") == pytest.approx(-2 / 3.6)
    assert drive.log[0].allowed_gap == pytest.approx(5 / 200)


@pytest.mark.parametrize("path", sorted((REPOSITORY / "tests" / "drives").glob("*.toml")), ids=lambda path: path.stem)
def test_drive_files_in_the_repository_are_valid(path: Path) -> None:
    assert read_drive(path).sample_time == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [
        ("rad/s", "rad/s", 1.0),
        ("rpm", "rad/s", 2 * math.pi / 60),
        ("deg/s", "rad/s", math.pi / 180),
        ("deg", "rad", math.pi / 180),
        ("km/h", "m/s", 1 / 3.6),
        ("standard_gravity", "m/s^2", 9.80665),
        ("g", "m/s^2", 9.80665),
        ("kN", "N", 1e3),
        ("kN*m", "N*m", 1e3),
        ("ms", "s", 1e-3),
        ("m/s**2", "m/s^2", 1.0),
    ],
)
def test_units(unit: str, target: str, factor: float) -> None:
    assert factor_to(unit, target) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "target", "message"),
    [
        ("m/s", "rad/s", "has another dimension than rad/s; use one such as rad/s, deg/s, rpm"),
        ("Hz", "rad/s", "does not count angle"),
        ("fathoms_per_dog_watch", "m/s", "unknown unit"),
        ("m/s; import os", "m/s", "is not a unit"),
        ("m^9^9", "m", "has another dimension"),
        ("", "m", "is not a unit"),
        ("m" * 50, "m", "is not a unit"),
    ],
)
def test_wrong_units_are_refused(unit: str, target: str, message: str) -> None:
    with pytest.raises(ValueError, match=message.replace("^", r"\^")):
        factor_to(unit, target)


@pytest.mark.parametrize("text", ["fast", "5", "5 5 ms", "ms", "1e9999 s x", "--5 ms", "", True, None, [1]])
def test_what_is_no_quantity_is_refused(text: object) -> None:
    with pytest.raises(ValueError, match="unit"):
        to_si(text, "s")


def edited(old: str, new: str) -> str:
    assert old in DRIVE
    return DRIVE.replace(old, new)


REFUSALS = [
    (edited('mass = "1600.0 kg"\n', ""), 'vehicle.mass: missing; add it, such as mass = "1600 kg"'),
    (edited("mass =", "mas ="), "vehicle: unknown key 'mas'; did you mean mass? (and 1 more)"),
    (edited('rate = "200 Hz"\n', ""), 'log[0].rate: missing; add it, such as rate = "200 Hz"'),
    (edited('sample_time = "5 ms"\n', ""), 'sample_time: missing; add it, such as sample_time = "5 ms"'),
    (edited('[schedules]\nlongitudinal = "schedule.json"\n', '[estimators]\ncorner_velocity = "lpv"\n'), "schedules: missing, but estimators.corner_velocity = 'lpv' runs on gain schedules; add a table [schedules] with longitudinal = \"corner-estimation-longitudinal\""),
    (edited('[schedules]\nlongitudinal = "schedule.json"\n', '[estimators]\ncorner_velocity = "kalman-two-state"\n'), "schedules: missing, but estimators.corner_velocity = 'kalman-two-state' has its tire from a gain schedule; add a table [schedules] with longitudinal = \"corner-estimation-longitudinal\""),
    (edited('[schedules]\nlongitudinal = "schedule.json"\n', '[estimators]\nvelocity = "corners"\n'), "schedules: missing, but estimators.velocity = 'corners' runs on gain schedules; add a table [schedules] with longitudinal = \"corner-estimation-longitudinal\""),
    (edited('name = "closed form"', "name = 5"), 'name: 5 is not text; write it in quotes, such as "brake test"'),
    (edited('name = "closed form"', 'name = ""'), 'name: is empty; write at least one character, such as "brake test"'),
    (edited('time = "t"', 'time = "t"\nsort = 1'), "log[0].sort: 1 is not a truth value; write true or false"),
    (edited("[vehicle]", '[vehicle]\nrolling_resistance = "0.012"'), "vehicle.rolling_resistance: '0.012' is not a number; write one without quotes, such as 0.012"),
    (edited("[vehicle]", "[vehicle]\nrolling_resistance = 3.0"), "vehicle.rolling_resistance: 3.0 is out of range; it must be at most 0.2, such as 0.012"),
    (edited("[vehicle]", "[vehicle]\nsteering_ratio = -2.0"), "vehicle.steering_ratio: -2.0 is out of range; it must be above 0, such as 15.0"),
    (edited("[reference]", 'steer_fl = { column = "s", unit = "rad" }\n[reference]'), 'signals.steer_fr: missing, but steer_fl is given; add steer_fr = { column = "...", unit = "rad" }, or give steering for both front wheels'),
    (edited("[reference]", 'steer_rr = { column = "s", unit = "rad" }\n[reference]'), 'signals.steer_rl: missing, but steer_rr is given; add steer_rl = { column = "...", unit = "rad" }'),
    (edited("[vehicle]", "[vehicel]"), "top level: unknown key 'vehicel'; did you mean vehicle? (and 1 more)"),
    (edited('"1600.0 kg"', '"1600.0 m"'), "vehicle.mass: unit 'm' has another dimension than kg; use one such as kg, t"),
    (edited('"1600.0 kg"', "1600.0"), 'vehicle.mass: 1600.0 has no unit; write it in quotes with its unit, such as "1600.0 kg"'),
    (edited('"1600.0 kg"', '"-1600 kg"'), "vehicle.mass: '-1600 kg' is out of range; it must be finite and above 0 kg, at most 1e+06"),
    (edited('"5 ms"', '"0 ms"'), "sample_time: '0 ms' is out of range; it must be finite and above 0 s, at most 1e+07"),
    (edited('derivative_lag = "0 s"', 'derivative_lag = "1e308 s"'), "observer.derivative_lag: '1e308 s' is out of range; it must be finite and at least 0 s, at most 10"),
    (edited("drive/1", "drive/7"), "schema: 'gainsmith.drive/7' is not known; write 'gainsmith.drive/1'"),
    (edited('ax = {', 'axe = {'), "signals.axe: unknown signal 'axe'; did you mean ax?"),
    (edited('ax = { column = "ax", unit = "m/s^2" }\n', ""), 'signals.ax: missing; add ax = { column = "...", unit = "m/s^2" }'),
    (edited('column = "ax", unit = "m/s^2"', 'column = "ax", unit = "rad/s^2"'), "signals.ax.unit: unit 'rad/s^2' has another dimension than m/s^2; use one such as m/s^2, g"),
    (edited('column = "ax", unit', 'column = "ax", units'), "signals.ax: unknown key 'units'; did you mean unit? (and 1 more)"),
    (edited('column = "ax",', 'column = "ax", factor = 0.0,'), "signals.ax.factor: 0 is not a scale; use a finite number other than zero"),
    (edited('column = "ax",', 'column = "ax", factor = nan,'), "signals.ax.factor: nan is not finite; write a finite number, such as 0.5"),
    (edited('column = "ax",', 'column = "ax", sign = "minus",'), "signals.ax.sign: 'minus' is not known; write 'positive' or 'negative'"),
    (edited('column = "ax",', 'log = "lok", column = "ax",'), "signals.ax.log: unknown log 'lok'; did you mean log?"),
    (edited('time = "t"', 'time = "t"\ntime_unit = "m"'), "log[0].time_unit: unit 'm' has another dimension than s; use one such as s, ms, us, min"),
    (edited('time = "t"', 'time = "t"\nmax_gab = "1 s"'), "log[0]: unknown key 'max_gab'; did you mean max_gap?"),
    (edited("[reference]", TORQUES + "[reference]").replace('wheel_inertia = "1.5 kg*m^2"\n', ""), 'vehicle.wheel_inertia: missing, but wheel torques are given; add it, such as "1.6 kg*m^2"'),
    (edited("[reference]", 'hand_wheel = { column = "hw", unit = "deg" }\n[reference]'), "vehicle.steering_ratio: missing, but hand_wheel is given; add it, such as 15.0"),
    (edited("[reference]", 'steering = { column = "s", unit = "rad" }\nsteer_fl = { column = "s", unit = "rad" }\n[reference]'), "signals: steering and steer_fl say the same thing; keep steering, hand_wheel, or steer_fl and steer_fr"),
    (edited("[signals]", '[[log]]\nname = "log"\nrate = "1 Hz"\n[signals]'), "log: two entries are called 'log'; give every log its own name"),
    (edited("[signals]", '[[log]]\nname = "b"\nrate = "1 Hz"\n[signals]'), "signals.wheel_speed_fl.log: missing; say which log holds column 'w_fl': log, b"),
    (TWO_LOGS.replace("ALIGN", 'align = { to = "lag" }'), "log 'second'.align.to: unknown log 'lag'; did you mean log? (a log with a clock of its own)"),
    (TWO_LOGS.replace("ALIGN", 'align = { to = "log" }\nclock_offset = "1 s"'), "log 'second'.align: clock_offset is given as well; keep one of the two"),
    (TWO_LOGS.replace("ALIGN", 'align = { to = "log", velocity = "vxx" }'), "log 'second'.align: unknown signal 'vxx'; did you mean vx?"),
    (TWO_LOGS.replace("ALIGN", 'align = { to = "log" }'), "log 'second'.align: one of vx, ax must be in log 'second', the other in 'log'"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), REFUSALS, ids=[message[:40] for _, message in REFUSALS])
def test_refusals_name_the_key_and_the_remedy(tmp_path: Path, text: str, message: str) -> None:
    assert refusal(tmp_path, text) == message


@pytest.mark.parametrize("key", [name for name, field in Vehicle.model_fields.items() if field.is_required()])
def test_every_missing_quantity_of_the_car_is_asked_for_with_an_example_that_is_one(tmp_path: Path, key: str) -> None:
    lines = [line for line in DRIVE.splitlines() if not line.startswith(f"{key} =")]
    message = refusal(tmp_path, "\n".join(lines))
    assert message.startswith(f"vehicle.{key}: missing; add it, such as {key} = ")
    path = tmp_path / "drive.toml"
    path.write_text(DRIVE.replace(f"{key} = ", f"{message.split('such as ')[1]} # "), encoding="utf-8")
    read_drive(path)


def test_a_pair_of_steering_angles_is_one(tmp_path: Path) -> None:
    both = "".join(f'steer_{corner} = {{ column = "s_{corner}", unit = "deg" }}\n' for corner in ("fl", "fr"))
    path = tmp_path / "drive.toml"
    path.write_text(DRIVE.replace("[reference]", both + "[reference]"), encoding="utf-8")
    assert {"steer_fl", "steer_fr"} <= set(read_drive(path).signals)


def test_not_toml_and_not_there(tmp_path: Path) -> None:
    assert refusal(tmp_path, "name = ").startswith("not a TOML file: ")
    with pytest.raises(SpecError, match=r"^nowhere\.toml: cannot be read \(No such file or directory\)"):
        read_drive(tmp_path / "nowhere.toml")
