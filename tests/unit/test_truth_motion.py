"""Driving as textbooks have it: steady turns, launches, drivetrains, assists, drivers; ISO signs."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.forces import levelled
from estimators.vehicle import GRAVITY
from studies.truth import Assist, Drivetrain, Truth, load_vehicle, simulate
from studies.truth.course import Course
from studies.truth.profile import GRID, PathPiece, curvature
from synthesis.errors import SpecError
from tests.support.truth_cases import TIRES, course, ramp, run, suv


def fitted(**options: object) -> Drivetrain:
    return Drivetrain(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize("tire", TIRES)
def test_gentle_turn_to_the_left(tire: str) -> None:
    """Nearly neutral (equal tires, CG in the middle): r = V delta/L; signs of ISO 8855."""
    one = course(tire=tire, speed=8.0, duration=2.0, steer=ramp(0.1, 0.4, 0.02))
    truth = run(one, suv(rolling_resistance=0.0, drag_area=0.0), record_time=0.01)
    car = truth.vehicles[0].parameters
    vx, r, ay = truth["vx"][0, -1], truth["yaw_rate"][0, -1], truth["road_ay"][0, -1]
    assert r == pytest.approx(vx * 0.02 / car.wheelbase, rel=0.03)
    assert ay == pytest.approx(vx * r, rel=1e-2)
    load, side = truth["force_z"][0, -1], truth["force_y"][0, -1]
    assert (side > 0).all() and (truth["slip_angle"][0, -1] < 0).all()
    assert load[1] > load[0] and load[3] > load[2]
    transfer = (load[1] - load[0]) * car.front_track / 2 + (load[3] - load[2]) * car.rear_track / 2
    assert transfer == pytest.approx(car.mass * ay * car.cg_height, rel=0.02)
    assert truth["roll"][0, -1] > 0  # it leans out: left side up
    assert truth["ay"][0, -1] > ay  # and its accelerometer sees some gravity
    assert truth["y"][0, -1] > 0 and truth["yaw"][0, -1] > 0


def test_launch_on_dry() -> None:
    """a = (T/R - c_rr m g)/(m + 4 I_w/R^2) while slip is small, drag apart; the nose rises, the rear wheels carry more."""
    torque = 1500.0
    truth = run(course(duration=2.0, drive_torque=ramp(0.0, 0.1, torque)), suv(drag_area=0.0), record_time=0.01)
    car, body = truth.vehicles[0].parameters, truth.vehicles[0].chassis
    radius = car.radius[0]
    push = torque / radius - body.rolling_resistance * car.mass * GRAVITY
    expected = push / (car.mass + 4 * car.wheel_inertia / radius**2)
    assert np.polyfit(truth.time[100:], truth["vx"][0, 100:], 1)[0] == pytest.approx(expected, rel=5e-3)
    assert truth["pitch"][0, -1] > 0
    shift = truth["force_z"][0, -1, 2:].sum() - truth["force_z"][0, 0, 2:].sum()
    assert shift == pytest.approx(car.mass * truth["road_ax"][0, -1] * car.cg_height / car.wheelbase, rel=0.06)


@pytest.mark.parametrize(("layout", "driven"), [("AWD", (1, 1, 1, 1)), ("FWD", (1, 1, 0, 0)), ("RWD", (0, 0, 1, 1))])
def test_drivetrains(layout: str, driven: tuple[int, ...]) -> None:
    car = suv(drivetrain=fitted(layout=layout))
    truth = run(course(speed=5.0, duration=0.5, drive_torque=ramp(0.0, 0.1, 1000.0)), car, record_time=0.01)
    expected = 1000.0 * np.array(driven) / sum(driven)
    assert truth["torque"][0, -1] == pytest.approx(expected)
    # the others roll at the speed of the car
    slow = [k for k in range(4) if not driven[k]]
    assert truth["slip"][0, -1, slow] == pytest.approx(0.0, abs=1e-3)


def test_full_throttle_is_torque_then_power() -> None:
    car = suv(drivetrain=fitted(maximum_torque=3000.0, maximum_power=60e3))
    truth = run(course(speed=5.0, duration=1.5, drive_share=np.ones_like), car, record_time=0.01)
    torque = truth["torque"][0].sum(axis=1)
    mean = truth["wheel_speed"][0].mean(axis=1)
    assert torque[5] == pytest.approx(3000.0)
    fast = mean > 22.0
    assert fast.any() and (torque * mean)[fast] == pytest.approx(60e3, rel=0.02)


def test_poor_assists_limit_slip_late() -> None:
    poor = suv(drivetrain=fitted(traction_control=Assist(), anti_lock=Assist()))
    launch = course(duration=2.0, friction=0.2, drive_torque=ramp(0.1, 0.2, 3000.0))
    stop = course(speed=15.0, duration=2.0, friction=0.3, brake_torque=ramp(0.1, 0.2, 6000.0))
    truth = simulate([launch, launch, stop, stop], [suv(), poor, suv(), poor], record_time=0.01)
    free, held = truth["slip_velocity_x"][:2]
    assert held[-1].max() < 0.5 * free[-1].max()  # it acts once the car moves
    assert truth["slip"][1].max() > 0.3  # poor: it is late
    locked, saved = truth["wheel_speed"][2:]
    assert (locked[-1, :2] == 0.0).all() and saved[-30:].max() > 5.0


def test_the_imu_is_levelled_by_the_estimators_formula() -> None:
    """The truth tilts what the estimators' `levelled` untilts: two codes, one convention."""
    one = course(speed=15.0, duration=1.0, steer=ramp(0.1, 0.3, 0.06), brake_torque=ramp(0.3, 0.5, 4000.0))
    truth = run(one, record_time=0.01)
    signals = [truth[name][0] for name in ("ax", "ay", "az", "pitch", "roll")]
    along, across, up = levelled(*signals)
    assert along == pytest.approx(truth["road_ax"][0], abs=1e-9)
    assert across == pytest.approx(truth["road_ay"][0], abs=1e-9)
    mass = truth.vehicles[0].parameters.mass
    assert up == pytest.approx(truth["force_z"][0].sum(axis=1) / mass, abs=1e-9)


def test_gyros_are_the_derivatives_of_the_angles() -> None:
    truth = run(course(speed=15.0, duration=1.5, steer=lambda t: 0.05 * np.sin(5.0 * t)), record_time=0.001)
    roll, pitch, r = truth["roll"][0], truth["pitch"][0], truth["yaw_rate"][0]
    # AttitudeObserver's kinematics: phi' = p - r sin(theta), theta' = -q + r sin(phi)
    assert np.gradient(roll, 0.001)[5:-5] == pytest.approx((truth["roll_rate"][0] - r * np.sin(pitch))[5:-5], abs=2e-4)
    assert np.gradient(pitch, 0.001)[5:-5] == pytest.approx(
        (-truth["pitch_rate"][0] + r * np.sin(roll))[5:-5], abs=2e-4
    )
    assert np.abs(truth["roll_rate"]).max() > 0.01


def followed(pieces: list[dict[str, object]], speed: float, duration: float) -> Truth:
    n = int(np.ceil(duration / GRID)) + 2
    zero = np.zeros(n)
    path = curvature([PathPiece.model_validate(p) for p in pieces])
    one = Course("path", duration, speed, "lugre", *[zero] * 7, friction=1.0, speed=np.full(n, speed), curvature=path)
    return simulate([one], [load_vehicle("corner-estimation")], step=0.002, record_time=0.01)


def test_the_driver_holds_path_and_speed() -> None:
    """A quarter circle to the left with a radius of 20 m at 7 m/s: where it should end, within half a metre."""
    truth = followed(
        [{"kind": "straight", "length": "7 m"}, {"kind": "arc", "radius": "20 m", "angle_deg": 90.0},
         {"kind": "straight", "length": "60 m"}], 7.0, 8.0,
    )  # fmt: skip
    assert truth["vx"][0] == pytest.approx(7.0, abs=0.25)
    assert truth["yaw"][0, -1] == pytest.approx(np.pi / 2, abs=0.03)
    assert truth["x"][0, -1] == pytest.approx(7.0 + 20.0, abs=0.5)
    assert truth["yaw_rate"][0].max() == pytest.approx(7.0 / 20.0, rel=0.15)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mas": 2000.0}, "did you mean mass"),
        ({"ride_damping": -1.0}, "above 0"),
        ({"drivetrain": "XWD"}, ""),
    ],
)
def test_cars_that_cannot_be(change: dict[str, object], message: str) -> None:
    if "drivetrain" in change:
        with pytest.raises(SpecError, match="unknown layout 'XWD'"):
            Drivetrain(layout="XWD")
        return
    with pytest.raises(SpecError, match=message):
        suv(**change)
