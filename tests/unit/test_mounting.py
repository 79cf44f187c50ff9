"""Mounting of sensor units: a rigid body whose motion is known in closed form, seen from a point that is not its centre."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimators import EstimatorError, MountedUnit, Mounting, VehicleSignals
from estimators.arrays import FloatArray
from estimators.signals.mounting import lever_acceleration, lever_velocity
from estimators.vehicle import GRAVITY
from studies.drives.drive_file import read_drive
from studies.drives.mounted import Place, centred_reference, centred_signals
from studies.drives.run import check_drive, replay_drive
from studies.truth import PERFECT, draw, load_manoeuvre, simulate_manoeuvres
from studies.truth.export import write_drive
from synthesis.errors import SpecError

TIME = 0.005
NAMES = ("ax", "ay", "az", "roll_rate", "pitch_rate", "yaw_rate")
UNIT = Mounting(1.2, -0.3, 0.25, 0.05, -0.04, 0.12)


def motion(n: int = 400) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Acceleration of the centre with gravity, angular rate and its derivative (n, 3) in axes of the car."""
    t = TIME * np.arange(n)
    pull = np.stack([np.cos(3 * t), 4 * np.sin(2 * t), GRAVITY + 0.3 * np.sin(9 * t)], axis=1)
    rate = np.stack([0.1 * np.sin(5 * t), 0.05 * np.cos(4 * t), 0.5 * np.sin(2 * t)], axis=1)
    slope = np.stack([0.5 * np.cos(5 * t), -0.2 * np.sin(4 * t), np.cos(2 * t)], axis=1)
    return pull, rate, slope


def seen(unit: Mounting) -> FloatArray:
    """What a unit at `unit` reads, (n, 6), with the derivative as it is."""
    pull, rate, slope = motion()
    felt = pull + lever_acceleration(unit.lever, rate, slope)
    return np.concatenate([felt @ unit.rotation, rate @ unit.rotation], axis=1)


def stepped(unit: MountedUnit, readings: FloatArray, names: tuple[str, ...] = NAMES) -> FloatArray:
    """The output of `step` for each row (..., of the batch, 6)."""
    out = []
    for row in readings:
        given = {name: row[..., NAMES.index(name)] for name in names}
        moved = unit.step(VehicleSignals(np.zeros((*row.shape[:-1], 4)), **given))
        out.append(np.stack([np.asarray(getattr(moved, name)) for name in names], axis=-1))
    return np.array(out)


def test_a_point_of_a_turning_body_is_accelerated_as_its_path_says() -> None:
    """Second calculation: the position R(t) l of a point on a body that turns about z and x, differentiated numerically."""
    lever, h, at = np.array([1.2, -0.3, 0.25]), 1e-4, 0.7

    def attitude(t: float) -> FloatArray:
        return Mounting(roll=0.3 * np.sin(2 * t), yaw=0.8 * t * t).rotation

    here, d = attitude(at), (attitude(at + h) - attitude(at - h)) / (2 * h)
    skew = here.T @ d

    def rate(t: float) -> FloatArray:
        spin = attitude(t).T @ (attitude(t + h) - attitude(t - h)) / (2 * h)
        return np.array([spin[2, 1], spin[0, 2], spin[1, 0]])

    slope = (rate(at + h) - rate(at - h)) / (2 * h)
    curve = (attitude(at + h) - 2 * here + attitude(at - h)) @ lever / h**2
    np.testing.assert_allclose(lever_velocity(lever, rate(at)), skew @ lever, atol=1e-6)
    np.testing.assert_allclose(lever_acceleration(lever, rate(at), slope), here.T @ curve, atol=1e-5)


def test_angles_turn_as_iso_says() -> None:
    z = np.array([0.0, 0.0, 1.0])
    assert (Mounting(roll=0.1).rotation.T @ z)[1] > 0  # left side up: the unit's y axis has a part of what is up
    assert (Mounting(pitch=0.1).rotation.T @ z)[0] < 0  # nose down
    np.testing.assert_allclose(Mounting(yaw=np.pi / 2).rotation @ [1.0, 0, 0], [0, 1, 0], atol=1e-15)


def test_a_unit_away_and_turned_reads_as_one_at_the_centre() -> None:
    """What is left is the late derivative: lag 20 ms + Ts/2 of a slope of up to 2 rad/s^3, at 1.2 m."""
    pull, rate, _ = motion()
    found = stepped(MountedUnit(UNIT, TIME), seen(UNIT))
    np.testing.assert_allclose(found[:, 3:], rate, atol=1e-12)
    assert np.abs(found[20:, :3] - pull[20:]).max() < 0.08
    assert np.abs(seen(UNIT)[20:, :3] - pull[20:]).max() > 1.2  # negative control: uncorrected
    wrong = Mounting(-UNIT.x, UNIT.y, UNIT.z, UNIT.roll, UNIT.pitch, UNIT.yaw)
    assert np.abs(stepped(MountedUnit(wrong, TIME), seen(UNIT))[20:, :3] - pull[20:]).max() > 1.5
    faster = stepped(MountedUnit(UNIT, TIME, lag=0.0), seen(UNIT))
    assert np.abs(faster[20:, :3] - pull[20:]).max() < 0.02


def test_batches_logs_and_restored_units_give_the_same_numbers() -> None:
    readings = seen(UNIT)
    readings[100:105, 1] = np.nan
    readings[200:230, 5] = np.nan
    one = stepped(MountedUnit(UNIT, TIME), readings)
    many = stepped(MountedUnit(UNIT, TIME, (2, 3)), np.broadcast_to(readings[:, None, None], (400, 2, 3, 6)))
    np.testing.assert_allclose(many, np.broadcast_to(one[:, None, None], many.shape), rtol=1e-12, atol=1e-14)
    place = Place.model_validate(
        {
            name: f"{getattr(UNIT, name)} {'m' if name in 'xyz' else 'rad'}"
            for name in ("x", "y", "z", "roll", "pitch", "yaw")
        }
    )
    log = centred_signals(dict(zip(NAMES, readings.T, strict=True)), place, TIME)
    np.testing.assert_allclose(np.stack([log[name] for name in NAMES], axis=1), one, rtol=1e-12, atol=1e-14)
    first, second = MountedUnit(UNIT, TIME), MountedUnit(UNIT, TIME)
    stepped(first, readings[:210])
    second.restore(first.save())
    np.testing.assert_array_equal(stepped(first, readings[210:]), stepped(second, readings[210:]))
    second.reset()
    fresh = stepped(second, readings[:50])
    np.testing.assert_array_equal(fresh, stepped(MountedUnit(UNIT, TIME), readings[:50]))


def test_what_is_missing_stays_missing_and_spoils_nothing_else() -> None:
    readings = seen(UNIT)
    readings[100:300, 0] = np.nan  # a_x has a share of 0.12 in the y axis of the car: both are missing, a_z is not
    readings[150, 5] = np.inf
    found = stepped(MountedUnit(UNIT, TIME), readings)
    assert np.isnan(found[100:300, :2]).all()
    assert np.isfinite(found[100:300, 2]).all()
    assert np.isnan(found[150, 5])
    assert np.isfinite(np.delete(found[:, 3:], 150, axis=0)).all()
    assert np.isfinite(found[300:]).all()
    pull = motion()[0]
    straight = Mounting(x=1.2, yaw=0.05)
    lost = seen(straight)
    lost[:, 3:5] = 0.0
    lost[100:300, 5] = np.nan  # no yaw rate: a lever arm cannot be taken off, accelerations stay as they are
    found = stepped(MountedUnit(straight, TIME), lost)
    assert np.isfinite(found[:, :3]).all()
    np.testing.assert_allclose(found[150:300, :3], lost[150:300, :3] @ straight.rotation.T, atol=1e-12)
    assert np.abs(found[320:, :2] - pull[320:, :2]).max() < 0.1


def test_a_frozen_reading_repeats_in_the_axes_of_the_car() -> None:
    """Turned by 25 degrees the living a_x would make a frozen a_y look alive; a dead roll gyro must not stop the yaw rate."""
    unit = Mounting(x=0.5, pitch=0.2, yaw=np.radians(25.0))
    readings = seen(unit)
    alive = stepped(MountedUnit(unit, TIME), readings)
    assert (np.diff(alive, axis=0) != 0.0).all()
    readings[100:200, 1] = readings[100, 1]  # share of a_y: 0.9 in a_y of the car, 0.4 in a_x
    readings[:, 3] = 0.0
    found = stepped(MountedUnit(unit, TIME), readings)
    assert (found[100:200, 1] == found[100, 1]).all()
    assert (np.diff(found[:, [0, 2, 5]], axis=0) != 0.0).all()
    assert (np.diff(found[200:, 1]) != 0.0).all()
    place = Place.model_validate({"x": "0.5 m", "pitch": "0.2 rad", "yaw": "25 deg"})
    log = centred_signals(dict(zip(NAMES, readings.T, strict=True)), place, TIME)
    np.testing.assert_allclose(np.stack([log[name] for name in NAMES], axis=1), found, rtol=1e-12, atol=1e-14)


def test_axes_without_a_sensor_are_those_of_a_level_car() -> None:
    """No a_z, no roll and pitch rates: exact for a car that has g upwards and turns about z alone."""
    unit = Mounting(roll=0.2, pitch=-0.1, yaw=0.3)
    car = np.array([1.0, 2.0, GRAVITY, 0.0, 0.0, 0.7])
    reading = np.concatenate([car[:3] @ unit.rotation, car[3:] @ unit.rotation])
    found = stepped(MountedUnit(unit, TIME), reading[None], ("ax", "ay", "yaw_rate"))
    np.testing.assert_allclose(found[0], [1.0, 2.0, 0.7], atol=1e-13)
    moved = MountedUnit(unit, TIME).step(VehicleSignals(np.zeros(4), 1.0))
    assert moved.az is moved.roll_rate is moved.pitch_rate is None
    with pytest.raises(EstimatorError, match="too far for axis z not to be measured"):
        stepped(MountedUnit(Mounting(roll=1.3), TIME), reading[None], ("ax", "ay", "yaw_rate"))


def test_late_samples_give_no_derivative() -> None:
    unit = MountedUnit(Mounting(x=1.0), TIME)
    for k in range(3):
        step = unit.step(VehicleSignals(np.zeros(4), 0.0, 1e-9 * k, 0.1 * k, elapsed=TIME))
    assert float(np.asarray(step.ay)) == pytest.approx(-20.0)
    late = unit.step(VehicleSignals(np.zeros(4), 0.0, 1e-8, 0.9, elapsed=10 * TIME))
    assert float(np.asarray(late.ay)) == pytest.approx(-20.0)  # 0.7 rad/s in one sample would be -140


@pytest.mark.parametrize(("name", "value"), [("x", 120.0), ("yaw", 90.0), ("roll", np.nan), ("pitch", 2.0)])
def test_impossible_mountings_are_refused(name: str, value: float) -> None:
    with pytest.raises(EstimatorError, match=rf"mounting: {name} = .* must be within"):
        Mounting(**{name: value})


def test_a_reference_elsewhere_is_moved_to_the_centre() -> None:
    """v of the point = V + w x l, closed form; the other sign of the arm misses."""
    n, turn = 50, np.linspace(-0.5, 0.5, 50)
    unit = Mounting(-1.5, 0.4, yaw=-0.1)
    true = np.stack([np.full(n, 20.0), np.linspace(0, 1, n), np.zeros(n)], axis=1)
    rate = np.stack([np.zeros(n), np.zeros(n), turn], axis=1)
    vx, vy, _ = ((true + lever_velocity(unit.lever, rate)) @ unit.rotation).T
    place = Place.model_validate({"x": "-1.5 m", "y": "40 cm", "yaw": "-0.1 rad"})
    found = centred_reference({"vx": vx, "vy": vy, "ax": turn}, {"yaw_rate": turn}, place)
    np.testing.assert_allclose(np.stack([found["vx"], found["vy"]], axis=1), true[:, :2], atol=1e-12)
    assert found["ax"] is turn
    missed = centred_reference({"vx": vx, "vy": vy}, {"yaw_rate": -turn}, place)
    assert np.abs(missed["vy"] - true[:, 1]).max() > 1.0
    speed = centred_reference({"vx": true[:, 0] - 0.4 * turn}, {"yaw_rate": turn}, Place.model_validate({"y": "0.4 m"}))
    np.testing.assert_allclose(speed["vx"], 20.0, atol=1e-12)


@pytest.fixture(scope="module")
def lane_change(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A lane change as a car with its unit 1.2 m ahead of the centre of gravity records it; no other sensor error."""
    truth = simulate_manoeuvres([load_manoeuvre("p1-lane-change-dry")])
    measured = draw(truth, PERFECT, [0])
    signals = measured.signals
    rate = np.stack([signals[name] for name in ("roll_rate", "pitch_rate", "yaw_rate")], axis=-1)
    slope = np.gradient(rate, TIME, axis=2)
    felt = lever_acceleration(np.array([1.2, 0.0, 0.0]), rate, slope)
    for k, name in enumerate(("ax", "ay", "az")):
        signals[name] = signals[name] + felt[..., k]
    return write_drive(tmp_path_factory.mktemp("ahead"), measured)


def lateral_error(log: Path, drive: Path, text: str = "") -> float:
    """RMS error of V_y, m/s."""
    given = drive.with_name("given.toml")
    given.write_text(drive.read_text(encoding="utf-8") + text, encoding="utf-8")
    data = replay_drive([log], given)
    assert data.chain is not None
    return float(np.sqrt(np.mean((data.chain.vy - data.log.reference["vy"]) ** 2)))


def test_a_lever_arm_in_the_drive_file_mends_the_lateral_velocity(lane_change: tuple[Path, Path]) -> None:
    log, drive = lane_change
    without, given = lateral_error(log, drive), lateral_error(log, drive, '\n[mounting.inertial]\nx = "1.2 m"\n')
    assert given < 0.04  # as with a unit at the centre
    assert without > 5.0 * given


def test_the_frame_check_sees_the_signals_in_the_axes_of_the_car(
    lane_change: tuple[Path, Path], tmp_path: Path
) -> None:
    """A unit that looks backwards contradicts the wheels, and agrees with them once its yaw angle is given."""
    log, drive = lane_change
    text = drive.read_text(encoding="utf-8")
    for name in ("ax", "ay", "roll_rate", "pitch_rate"):
        text = text.replace(f'\n{name} = {{ column = "{name}",', f'\n{name} = {{ column = "{name}", sign = "negative",')
    for yaw, agrees in (("0 deg", False), ("180 deg", True), ("-180 deg", True)):
        path = tmp_path / "backwards.toml"
        path.write_text(text + f'\n[mounting.inertial]\nx = "1.2 m"\nyaw = "{yaw}"\n', encoding="utf-8")
        rows = {row["comparison"]: row for row in check_drive([log], path).rows()}
        compared = rows["ay over yaw rate times speed"]
        assert (compared["slope"] > 0.0) == agrees
        assert (compared["verdict"] == "agrees") == agrees


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[mounting.inertial]\nx = "1200 m"\n', r"mounting\.inertial: mounting: x = 1200 m must be within 20 m"),
        ('[mounting.inertial]\nx = 1.2\n', r'mounting\.inertial\.x: 1\.2 has no unit'),
        ('[mounting.inertial]\nyaw = "3 m"\n', r"mounting\.inertial\.yaw: unit 'm' has another dimension"),
        ('[mounting.antenna]\nx = "1 m"\n', r"mounting: unknown key 'antenna'; known: inertial, reference"),
    ],
)  # fmt: skip
def test_mountings_that_cannot_be_are_refused(
    lane_change: tuple[Path, Path], tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(lane_change[1].read_text(encoding="utf-8") + "\n" + text, encoding="utf-8")
    with pytest.raises(SpecError, match=message) as caught:
        read_drive(path)
    assert "\n" not in str(caught.value)


def test_lever_arms_without_the_rates_that_act_on_them_are_refused(
    lane_change: tuple[Path, Path], tmp_path: Path
) -> None:
    kept = [line for line in lane_change[1].read_text(encoding="utf-8").splitlines() if not line.startswith("yaw_rate")]
    path = tmp_path / "drive.toml"
    for unit in ("inertial", "reference"):
        path.write_text("\n".join(kept) + f'\n[mounting.{unit}]\ny = "0.3 m"\n', encoding="utf-8")
        with pytest.raises(
            SpecError, match=rf"mounting\.{unit}\.y: a lever arm along y does nothing without signals\.yaw_rate"
        ):
            read_drive(path)
