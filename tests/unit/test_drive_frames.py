"""Signs, units and sides that contradict the rest of the log: refused with the column and the mend, and nothing else is."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.cli import main
from studies.drives.drive_file import DriveFile, read_drive
from studies.drives.evaluation import evaluate
from studies.drives.frames import FrameReport, check_frames
from studies.drives.log import read_log
from studies.drives.robust_line import robust_line
from studies.drives.run import replay_drive
from studies.errors import LogError
from studies.trials.estimation import TEST_CAR
from studies.truth import Measured, draw, load_manoeuvre, simulate_manoeuvres
from studies.truth import write_drive as write_truth_drive
from tests.support.schedule_content import EFFECTIVE_RADIUS
from tests.support.synthetic_drive import FRONT, REAR, TRACK, write_drive
from tests.support.turning_drive import TURNING, turning, write_table

Table = dict[str, Any]
GRAVITY = 9.80665


def look(folder: Path, text: str, table: Table) -> FrameReport:
    log = write_table(folder / "log.csv", table)
    drive = read_drive(write_drive(folder, text))
    found = read_log([log], drive)
    return check_frames(found.signals, drive, found.files)


def scaled(factor: float, *names: str) -> Callable[[Table], Table]:
    return lambda table: table | {name: factor * table[name] for name in names}


def exchanged(*axles: str) -> Callable[[Table], Table]:
    return lambda table: table | {f"w_{a}{s}": table[f"w_{a}{'lr'['rl'.index(s)]}"] for a in axles for s in "lr"}


def traded(a: str, b: str) -> Callable[[Table], Table]:
    return lambda table: table | {a: table[b], b: table[a]}


def declared(column: str, unit: str) -> str:
    start = TURNING.index(f'column = "{column}"')
    end = TURNING.index("}", start)
    return TURNING[:start] + f'column = "{column}", unit = "{unit}" ' + TURNING[end:]


WHEELS = ("w_fl", "w_fr", "w_rl", "w_rr")
RPM = 30.0 / math.pi
IN_RPM = TURNING
for wheel in WHEELS:
    IN_RPM = IN_RPM.replace(f'column = "{wheel}", unit = "rad/s"', f'column = "{wheel}", unit = "rpm"')
IN_METRES = IN_RPM.replace('unit = "rpm"', 'unit = "m/s"')
HAND = TURNING.replace("steering = {", "hand_wheel = {").replace("[schedules]", "steering_ratio = 15.0\n[schedules]")
SAME: Callable[[Table], Table] = dict
CASES: dict[str, tuple[str, Callable[[Table], Table], str, str]] = {
    "yaw rate negated": (TURNING, scaled(-1.0, "r"), "yaw_rate", 'likely sign = "negative" for signals.yaw_rate;'),
    "ay negated": (TURNING, scaled(-1.0, "ay"), "ay", 'likely sign = "negative" for signals.ay;'),
    "ax negated": (TURNING, scaled(-1.0, "ax"), "ax", 'likely sign = "negative" for signals.ax;'),
    "steering negated": (TURNING, scaled(-1.0, "d"), "steering", 'likely sign = "negative" for signals.steering;'),
    "az negated": (TURNING, scaled(-1.0, "az"), "az", 'likely sign = "negative" for signals.az;'),
    "no gravity": (TURNING, lambda t: t | {"az": t["az"] - GRAVITY}, "az", "likely az without gravity"),
    "accelerations in g": (TURNING, scaled(1 / GRAVITY, "ax", "ay", "az"), "ax", 'unit = "g" for signals.ax, ay, az;'),
    "g declared": (declared("ay", "g"), SAME, "ay", 'likely unit = "m/s^2" for signals.ay;'),
    "deg/s for rad/s": (TURNING, scaled(180 / math.pi, "r"), "yaw_rate", 'likely unit = "deg/s" for signals.yaw_rate;'),
    "deg/s declared": (declared("r", "deg/s"), SAME, "yaw_rate", 'likely unit = "rad/s" for signals.yaw_rate;'),
    "deg declared": (declared("d", "deg"), SAME, "steering", 'likely unit = "rad" for signals.steering;'),
    "steering wheel's angle": (
        TURNING,
        scaled(15.0, "d"),
        "steering",
        "name it hand_wheel, with vehicle.steering_ratio (near 1",
    ),
    "road wheels' angle": (
        HAND,
        SAME,
        "hand_wheel",
        "signals.hand_wheel holds the angle of the road wheels: name it steering;",
    ),
    "rpm declared": (IN_RPM, SAME, "wheel_speed_fl", 'likely unit = "rad/s" for signals.wheel_speed_*;'),
    "rad/s declared": (TURNING, scaled(RPM, *WHEELS), "wheel_speed_fl", 'unit = "rpm" for signals.wheel_speed_*;'),
    "one wheel in rpm": (TURNING, scaled(RPM, "w_rl"), "wheel_speed_rl", 'unit = "rpm" for signals.wheel_speed_rl;'),
    "one wheel negated": (
        TURNING,
        scaled(-1.0, "w_fr"),
        "wheel_speed_fr",
        'sign = "negative" for signals.wheel_speed_fr',
    ),
    "km/h for m/s": (
        IN_METRES,
        scaled(0.33 * 3.6, *WHEELS),
        "wheel_speed_fl",
        'unit = "km/h" for signals.wheel_speed_*;',
    ),
    "left and right": (
        TURNING,
        exchanged("f", "r"),
        "wheel_speed_fl",
        "signals.wheel_speed_*: left and right exchanged",
    ),
    "front sides": (TURNING, exchanged("f"), "wheel_speed_fl", "left and right exchanged at the front;"),
    "y right, z down": (TURNING, scaled(-1.0, "ay", "az", "r"), "ay", "(y axis to the right, z down)"),
    "doubled": (TURNING, scaled(2.0, "ay"), "ay", " times too large: divide factor by "),
    "two at once": (
        TURNING,
        lambda t: scaled(180 / math.pi, "d")(scaled(-1.0, "r")(t)),
        "yaw_rate",
        'sign = "negative" for signals.yaw_rate and unit = "deg" for signals.steering',
    ),
    "km/h for rad/s": (
        TURNING,
        scaled(0.33 * 3.6, *WHEELS),
        "wheel_speed_fl",
        'unit = "km/h" for signals.wheel_speed_*, or',
    ),
    "ax and ay": (TURNING, traded("ax", "ay"), "ax", "likely signals.ax and signals.ay exchanged;"),
    "unit turned by 90 degrees": (
        TURNING,
        lambda t: traded("ax", "ay")(scaled(-1.0, "ax")(t)),
        "ax",
        "signals.ax and signals.ay exchanged, and then the other sign for signals.ax;",
    ),
    "ay and az": (TURNING, traded("ay", "az"), "ay", "likely signals.ay and signals.az exchanged;"),
    "order fl, rl, fr, rr": (
        TURNING,
        traded("w_fr", "w_rl"),
        "wheel_speed_fr",
        "likely signals.wheel_speed_fr and signals.wheel_speed_rl exchanged;",
    ),
    "reversed": (
        TURNING,
        scaled(-1.0, *WHEELS),
        "wheel_speed_fl",
        "(or reversed with unsigned wheel speeds: unsigned_wheels = true)",
    ),
}


@pytest.mark.parametrize(("text", "change", "signal", "mend"), CASES.values(), ids=CASES.keys())
def test_what_contradicts_is_named_with_its_mend(
    tmp_path: Path, text: str, change: Callable[[Table], Table], signal: str, mend: str
) -> None:
    table = change(turning())
    # the reference is left out: it would refuse wrong wheels before
    found = look(tmp_path, text.split("[reference]", maxsplit=1)[0], table)
    assert found.complaint is not None
    assert found.complaint.startswith(f"log.csv: signals.{signal}: column '")
    assert mend in found.complaint
    assert "\n" not in found.complaint
    assert len(found.complaint) <= 300


def test_a_steering_wheel_that_is_one_is_no_mistake(tmp_path: Path) -> None:
    """Negative control; so is a car whose understeer takes two thirds of its yaw rate."""
    assert look(tmp_path, HAND, scaled(15.0, "d")(turning())).complaint is None
    assert look(tmp_path, TURNING, turning(understeer=7.0)).complaint is None


@pytest.mark.parametrize("seed", range(5))
def test_a_right_log_agrees_and_says_so(tmp_path: Path, seed: int) -> None:
    found = look(tmp_path, TURNING, turning(seed=seed, noise=2.0, understeer=20.0 + 3.0 * seed))
    assert found.complaint is None
    assert [row["verdict"] for row in found.rows()] == ["agrees"] * 7


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"r", unit = "rad/s"', '"r", unit = "rad/s", sign = "negative"'),
        ('"ay", unit = "m/s^2"', '"ay", unit = "g"'),
        ('"d", unit = "rad"', '"d", unit = "deg"'),
    ],
)
def test_the_mend_is_the_mend(tmp_path: Path, old: str, new: str) -> None:
    """A column that is negated or in another unit agrees once the drive file says so, and only then."""
    scales = {"r": -1.0, "ay": 1 / GRAVITY, "d": 180 / math.pi}
    name = old[1 : old.index('"', 1)]
    table = scaled(scales[name], name)(turning())
    assert look(tmp_path, TURNING, table).complaint is not None
    assert look(tmp_path, TURNING.replace(old, new), table).complaint is None


def test_what_is_not_excited_is_not_judged(tmp_path: Path) -> None:
    """Parked, straight ahead at constant speed, and 0.3 s: nothing can be told, nothing is refused."""
    rng = np.random.default_rng(3)
    for speed, duration in ((0.0, 10.0), (60.0, 10.0), (60.0, 0.3)):
        t = np.arange(0.0, duration, 0.01)
        table = {name: 0.01 * rng.standard_normal(t.size) for name in turning(0.02)}
        table |= {"t": t, "az": table["az"] + GRAVITY, "v": 0.33 * speed + 0 * t}
        table |= {name: speed + table[name] for name in WHEELS}
        found = look(tmp_path, TURNING, scaled(-1.0, "r", "ay", "ax")(table))
        assert found.complaint is None
        verdicts = {row["verdict"] for row in found.rows() if row["comparison"] != "az over gravity"}
        assert not verdicts & {"agrees", "contradicts"}


def test_a_column_in_its_place_is_not_given_away_for_one_that_follows_nothing(tmp_path: Path) -> None:
    """V r = V': a_y reads what a dead a_x should. In its place it would mend that line, and leave its own with nothing."""
    table, rng = turning(), np.random.default_rng(2)
    v, pull = table["v"], 2.1 * np.cos(0.6 * table["t"])
    r = pull / v
    for corner, side in (("fl", 1.0), ("fr", -1.0), ("rl", 1.0), ("rr", -1.0)):
        table[f"w_{corner}"] = (v - r * side * TRACK / 2.0) / EFFECTIVE_RADIUS + 0.05 * rng.standard_normal(v.size)
    table |= {"r": r, "ay": pull, "d": (FRONT + REAR) * r / v * (1.0 + (v / 30.0) ** 2)}
    assert look(tmp_path, TURNING, table | {"ax": pull}).complaint is None
    assert look(tmp_path, TURNING, table | {"ax": rng.standard_normal(v.size)}).complaint is None


def test_an_exchange_that_mends_one_line_and_loses_another_is_none(tmp_path: Path) -> None:
    """An accelerometer that follows nothing is no exchange, nor is front with rear, which roll alike."""
    table, rng = turning(), np.random.default_rng(2)
    table |= {"ax": 2.0 * np.sin(2.7 * table["t"]) + 0.05 * rng.standard_normal(table["t"].size)}
    assert look(tmp_path, TURNING, table).complaint is None
    assert look(tmp_path, TURNING, traded("w_fl", "w_rl")(traded("w_fr", "w_rr")(turning()))).complaint is None


def test_a_mistake_must_not_silence_what_contradicts_it(tmp_path: Path) -> None:
    """At constant speed, wheels read as rpm would hardly move and so contradict nothing: that explains nothing."""
    table = turning()
    t, v, r = table["t"], 9.0, 0.12 * np.sin(0.9 * table["t"])
    sides = {"l": v - 0.75 * r, "r": v + 0.75 * r}
    table |= {name: sides[name[-1]] / 0.33 for name in WHEELS}
    table |= {"v": v + 0 * t, "ax": 0 * t, "ay": r * v, "r": -r, "d": 2.6 * r / v}
    complaint = look(tmp_path, TURNING.split("[reference]")[0], table).complaint
    assert complaint is not None
    assert 'likely sign = "negative" for signals.yaw_rate;' in complaint


def test_wheels_that_spin_or_lock_or_are_dead_are_no_frames(tmp_path: Path) -> None:
    table = turning()
    spin = table | {name: table[name] * (1.0 + 0.8 * (np.sin(3.0 * table["t"]) > 0)) for name in ("w_fl", "w_rl")}
    locked = table | {name: table[name] * (np.sin(2.0 * table["t"]) > 0) for name in WHEELS}
    dead = table | {"w_rr": 0.0 * table["t"]}
    stuck = {name: 0.001 * value if name != "t" else value for name, value in table.items()} | {"az": table["az"]}
    stuck |= {name: np.full_like(table["t"], 30.0 if name[-1] == "l" else 0.0) for name in WHEELS}
    for case in (spin, locked, dead, stuck):
        assert look(tmp_path, TURNING.split("[reference]")[0], case).complaint is None, case


def test_a_constant_turn_is_compared_with_rest(tmp_path: Path) -> None:
    t = np.arange(0.0, 5.0, 0.01)
    v, r = 12.0, 0.4
    table = {"t": t, "v": v + 0 * t, "ax": 0 * t, "ay": r * v + 0 * t, "az": GRAVITY + 0 * t, "r": r + 0 * t}
    sides = {"l": v - 0.75 * r, "r": v + 0.75 * r}
    table |= {"d": 3.1 * r / v + 0 * t, **{name: sides[name[-1]] / 0.33 + 0 * t for name in WHEELS}}
    assert look(tmp_path, TURNING, table).complaint is None
    complaint = look(tmp_path, TURNING, scaled(-1.0, "ay")(table)).complaint
    assert complaint is not None and 'sign = "negative" for signals.ay' in complaint


def test_the_line_bears_outliers_and_refuses_noise() -> None:
    rng = np.random.default_rng(5)
    x = rng.normal(size=400)
    y = 0.3 - 1.7 * x + 0.05 * rng.normal(size=400)
    y[:20] += rng.normal(size=20) * 20.0
    line = robust_line(x, y, 0.5)
    assert line is not None and line.clear and line.slope == pytest.approx(-1.7, rel=0.1)
    other = robust_line(x, rng.normal(size=400), 0.5)
    assert other is not None and not other.clear
    assert robust_line(0.001 * x, 0.001 * y, 0.5) is None
    assert robust_line(np.full(9, np.nan), np.zeros(9), 0.5) is None


def run(folder: Path, text: str, *more: str) -> int:
    log = write_table(folder / "log.csv", scaled(-1.0, "r")(turning(8.0)))
    return main(["run", str(log), "--drive", str(write_drive(folder, text)), *more])


def test_the_command_refuses_checks_and_lets_itself_be_overruled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, out = TURNING, tmp_path / "out"
    assert run(tmp_path, text, "--out", str(out)) == 2
    assert not out.exists()
    assert capsys.readouterr().err.count("\n") == 1
    assert run(tmp_path, text, "--check") == 2
    said = capsys.readouterr()
    assert "contradicts" in said.out and "signals.yaw_rate" in said.err
    assert not out.exists()


@pytest.mark.parametrize(("text", "check"), [(TURNING, False), ("check = false\n" + TURNING, True)])
def test_the_check_may_be_switched_off_and_that_is_said(tmp_path: Path, text: str, check: bool) -> None:
    log = write_table(tmp_path / "log.csv", scaled(-1.0, "r")(turning(2.0)))
    data = replay_drive([log], write_drive(tmp_path, text), check=check)
    said = "signs, units and sides of the signals are right: not checked (--no-check, or check = false)"
    assert said in evaluate(data)["assumptions"]


def test_the_flag_reaches_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[bool] = []

    def stop(*_: Any, check: bool, **__: Any) -> None:
        asked.append(check)
        raise LogError("stopped")

    monkeypatch.setattr("studies.commands.run.run_drive", stop)
    for more in ([], ["--no-check"]):
        assert run(tmp_path, TURNING, "--out", str(tmp_path / "out"), *more) == 2
    assert asked == [True, False]


DATA = Path(__file__).parents[3] / "shared" / "data"
NAMES = ("p1-launch-split", "p2-turn-throttle-low", "p2-double-lane-change-snow")


@pytest.fixture(scope="module")
def driven() -> Measured:
    """Split friction with spinning wheels, drifting on snow, a lane change on snow: six seconds of each, three seeds."""
    manoeuvres = [load_manoeuvre(name) for name in NAMES]
    short = [one.model_copy(update={"duration": min(one.duration, 6.0)}) for one in manoeuvres]
    return draw(simulate_manoeuvres(short, record_time=0.005), TEST_CAR, range(3))


@pytest.mark.parametrize("run_", range(len(NAMES)), ids=NAMES)
def test_no_false_alarm_on_slippery_roads(tmp_path: Path, driven: Measured, run_: int) -> None:
    for seed in range(2):
        log, file = write_truth_drive(tmp_path, driven, seed=seed, run=run_)
        drive = read_drive(file)
        found = read_log([log], drive)
        assert check_frames(found.signals, drive, found.files, found.reference).complaint is None
        for start in range(0, 1000, 250):  # and 2.5 s of it, which may show nothing but a slide
            part = {name: value[start : start + 500] for name, value in found.signals.items()}
            assert check_frames(part, drive, found.files).complaint is None, start
        negated = found.signals | {"yaw_rate": -found.signals["yaw_rate"], "az": -found.signals["az"]}
        assert check_frames(negated, drive, found.files).complaint is not None


@pytest.mark.shared
@pytest.mark.skipif(not DATA.is_dir(), reason="the recorded drives (shared/data beside the checkout) are absent")
@pytest.mark.parametrize("path", sorted((Path(__file__).parents[1] / "drives").glob("*.toml")), ids=lambda p: p.stem)
def test_no_false_alarm_on_recorded_and_foreign_drives(path: Path) -> None:
    drive = read_drive(path)
    found = read_log([DATA], drive)
    assert check_frames(found.signals, drive, found.files, found.reference).complaint is None
    wrong = found.signals | {"ax": -found.signals["ax"], "yaw_rate": -found.signals["yaw_rate"]}
    assert check_frames(wrong, drive, found.files).complaint is not None


def test_what_the_command_needs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "log.csv"]) == 2
    assert "--drive is missing" in capsys.readouterr().err
    assert main(["run", "log.csv", "--drive", "drive.toml"]) == 2
    assert "--out is missing" in capsys.readouterr().err
    assert isinstance(DriveFile.model_fields["check"].default, bool)
