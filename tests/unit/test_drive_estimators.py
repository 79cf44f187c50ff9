"""The `[estimators]` table: what is chosen is built, and what cannot be is refused in one line, before any log is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimators import GainSchedule, LpvVelocityObserver
from estimators.forces import VerticalLoads, WheelForceFilter
from estimators.pipeline import (
    CornerSample,
    CornerVelocity,
    DifferentiatedPid,
    FourWheelSideslip,
    KalmanCorners,
    StiffnessSideslip,
    SwitchedCorners,
)
from estimators.pipeline.corner_kinds import CornerKind
from estimators.schedule import write_content
from estimators.velocity import BristleTire, LtvKalmanObserver, SwitchedVelocityObserver
from studies.drives.chain import pipeline_of
from studies.drives.drive_file import DriveFile, read_drive
from studies.drives.evaluation import evaluate
from studies.drives.run import replay_drive
from studies.drives.schedules import corner_observer, load_schedule
from synthesis.errors import SpecError
from tests.support.schedule_content import EFFECTIVE_RADIUS, PUBLISHED, schedule_content
from tests.support.synthetic_drive import DRIVE, TORQUES, columns, write_drive, write_log

TORQUE = DRIVE.replace("[reference]", TORQUES + "\n[reference]")
TIRES = (
    'yaw_inertia = "2600 kg*m^2"\ncornering_stiffness_front = "120 kN/rad"\ncornering_stiffness_rear = "130000 N/rad"\n'
)
EQUIPPED = TORQUE.replace("[schedules]", TIRES + 'relaxation_length = "50 cm"\n\n[schedules]')
LATERAL = "".join(
    f'{name} = {{ column = "{name}", unit = "{unit}" }}\n'
    for name, unit in (("ay", "m/s^2"), ("yaw_rate", "rad/s"), ("steering", "rad"))
)
STEERED = EQUIPPED.replace("[reference]", LATERAL + "[reference]")
SIDEWAYS = EQUIPPED.replace('"schedule.json"', '"schedule.json"\nlateral = "side.json"')


def chosen(text: str, **names: str) -> str:
    return text + "\n[estimators]\n" + "".join(f'{key} = "{name}"\n' for key, name in names.items())


def read(folder: Path, text: str) -> DriveFile:
    return read_drive(write_drive(folder, text))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (chosen(DRIVE, longitudinal_force="unknwon-input"), "did you mean unknown-input"),
        (chosen(DRIVE, sideslip="four-wheel"), r"estimators\.sideslip: unknown estimator 'four-wheel'"),
        (chosen(DRIVE, longitudnal_force="pid"), "longitudinal_force"),
        (
            chosen(DRIVE, longitudinal_force="pid"),
            r"signals\.torque_fl: missing, but estimators\.longitudinal_force = 'pid'",
        ),
        (chosen(TORQUE, lateral_force="unscented"), r"vehicle\.yaw_inertia: missing, but estimators\.lateral_force"),
        (
            chosen(TORQUE.replace("[schedules]", TIRES + "\n[schedules]"), sideslip="four-wheel-extended"),
            r"vehicle\.relaxation_length: missing",
        ),
        (chosen(DRIVE, corner_velocity="gain-swiched"), "did you mean gain-switched"),
        (chosen(DRIVE, corner_velocity="kalman"), r"estimators\.corner_velocity: unknown estimator 'kalman'"),
        (chosen(EQUIPPED, velocity="corners"), r"schedules\.lateral: missing, but estimators\.velocity = 'corners'"),
        *(
            (
                chosen(STEERED.replace(f"{lost} = {{", f"{other} = {{"), sideslip=kind),
                rf"signals\.{lost}: missing, but estimators\.sideslip = '{kind}' needs it; add {lost} = ",
            )
            for kind in ("four-wheel-extended", "four-wheel-unscented", "adaptive-stiffness", "fixed-stiffness")
            for lost, other in (("yaw_rate", "roll_rate"), ("ay", "az"))
        ),
        (
            chosen(
                STEERED.replace("steering = {", "pitch_rate = {").replace('"rad" }\n[ref', '"rad/s" }\n[ref'),
                sideslip="fixed-stiffness",
            ),
            r"signals\.steering: missing, but estimators\.sideslip = 'fixed-stiffness' needs it.*or hand_wheel, or steer_fl and",
        ),
        (
            chosen(EQUIPPED, lateral_force="linear"),
            r"signals\.yaw_rate: missing, but estimators\.lateral_force = 'linear'",
        ),
        (chosen(TORQUE, attitude="gyro"), r"signals\.roll_rate: missing, but estimators\.attitude = 'gyro'"),
    ],
)
def test_what_cannot_be_built_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_what_is_chosen_is_built(tmp_path: Path) -> None:
    schedule = load_schedule("schedule.json", write_drive(tmp_path).parent, 0.005)
    names = {"longitudinal_force": "unscented", "vertical_load": "quasi-static", "sideslip": "four-wheel-unscented"}
    pipeline, assumptions = pipeline_of(read(tmp_path, chosen(STEERED, **names)), schedule)
    assert isinstance(pipeline.longitudinal_force, WheelForceFilter)
    assert isinstance(pipeline.loads, VerticalLoads)
    assert not pipeline.loads.dynamic
    assert isinstance(pipeline.sideslip, FourWheelSideslip)
    assert not assumptions
    assert pipeline.longitudinal_force.method == "unscented"
    pipeline, _ = pipeline_of(read(tmp_path, chosen(STEERED, longitudinal_force="linear")), schedule)
    assert pipeline.longitudinal_force.method == "linear"
    names = {"longitudinal_force": "pid", "sideslip": "adaptive-stiffness"}
    pipeline, _ = pipeline_of(read(tmp_path, chosen(STEERED, **names)), schedule)
    assert isinstance(pipeline.longitudinal_force, DifferentiatedPid)
    assert isinstance(pipeline.sideslip, StiffnessSideslip)
    _, assumptions = pipeline_of(read(tmp_path, DRIVE), schedule)
    assert assumptions == ("yaw inertia is not given: taken as m L_f L_r",)


@pytest.mark.parametrize("kind", ["lpv", "gain-switched", "kalman-three-state"])
def test_the_corners_alone_give_the_velocities_where_a_drive_asks_for_them(tmp_path: Path, kind: str) -> None:
    """The closed-form drive through the whole run: V_x of the pipeline is that of the corner observers."""
    write_content(tmp_path / "side.json", schedule_content("lateral"))
    log = write_log(tmp_path / "log.csv", columns(duration=1.5))
    drive = write_drive(tmp_path, chosen(SIDEWAYS, velocity="corners", corner_velocity=kind))
    data = replay_drive([log], drive)
    assert data.chain is not None
    late = data.log.time > 0.5
    assert np.abs(data.chain.vx - data.log.reference["vx"])[late].max() < 0.05
    assert np.isfinite(data.chain.vy).all()
    pipeline, _ = pipeline_of(
        read(tmp_path, chosen(SIDEWAYS, velocity="corners", corner_velocity=kind)),
        corner_observer_of(tmp_path, kind),
        load_schedule("side.json", tmp_path, 0.005, "lateral"),
    )
    assert isinstance(pipeline.velocity, CornerVelocity)
    assert pipeline.corner_observers is None
    along = pipeline.velocity.corners.along
    assert isinstance(along, {"gain-switched": SwitchedCorners, "kalman-three-state": KalmanCorners}.get(kind, object))
    assert pipeline.velocity.corners.weights is None


def test_every_chain_of_the_papers_can_be_chosen(tmp_path: Path) -> None:
    """Weights by slip (P1), the kinematic filter behind the corners (P2), sliding-mode forces (P5)."""
    write_content(tmp_path / "side.json", schedule_content("lateral"))
    side = load_schedule("side.json", tmp_path, 0.005, "lateral")
    names = {"velocity": "kinematic", "axle_weights": "slip", "sideslip": "sliding-mode"}
    drive = read(tmp_path, chosen(SIDEWAYS.replace("[reference]", LATERAL + "[reference]"), **names))
    pipeline, _ = pipeline_of(drive, corner_observer_of(tmp_path, "kalman-three-state"), side)
    assert isinstance(pipeline.velocity, CornerVelocity)
    assert pipeline.velocity.kinematic is not None
    assert pipeline.velocity.corners.weights is not None
    assert isinstance(pipeline.sideslip, StiffnessSideslip)
    assert pipeline.sideslip.sliding is not None


def test_a_lateral_schedule_for_another_time_is_refused_before_the_log_is_read(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, DRIVE.replace('"schedule.json"', '"schedule.json"\nlateral = "side.json"'))
    write_content(tmp_path / "side.json", schedule_content("lateral", sample_time=0.01))
    with pytest.raises(SpecError, match=r"schedules\.lateral: 'side\.json' was proved at sample_time = 0\.01 s"):
        replay_drive([tmp_path / "no-such-log.csv"], drive)
    write_content(tmp_path / "side.json", schedule_content("longitudinal"))
    with pytest.raises(SpecError, match="this run needs one of corner-velocity-lateral"):
        replay_drive([tmp_path / "no-such-log.csv"], drive)


def test_a_car_that_cannot_be_is_refused_before_the_log_is_read(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, DRIVE.replace("0.55 m", "55 m"))
    with pytest.raises(SpecError, match=r"cg_height = 55\.0 m is not in") as caught:
        replay_drive([tmp_path / "no-such-log.csv"], drive)
    assert "\n" not in str(caught.value)


def corner_observer_of(folder: Path, name: str) -> CornerKind:
    drive = read(folder, chosen(DRIVE, corner_velocity=name))
    return corner_observer(drive, folder, load_schedule("schedule.json", folder, 0.005))


def sample(slip: float = 0.0) -> CornerSample:
    return CornerSample(*(np.full(4, value) for value in (2.0, 0.3, 40.0, 6.0, slip)), 2.0, 0.0)


def test_corner_observers_are_those_of_the_runtime(tmp_path: Path) -> None:
    """Calm driving, then high slip: sample by sample what the estimators themselves make of it."""
    schedule = GainSchedule.from_content(schedule_content())
    sigma0, sigma1, sigma2, kappa = PUBLISHED["longitudinal"]["constants"]
    tire = BristleTire(sigma0, sigma1, sigma2, kappa, EFFECTIVE_RADIUS)
    lpv, switched = LpvVelocityObserver(schedule), SwitchedVelocityObserver(schedule)
    kalman = {
        f"kalman-{word}-state": LtvKalmanObserver(tire, 0.005, states=n) for word, n in (("three", 3), ("two", 2))
    }  # type: ignore[arg-type]
    chosen_ones = {name: corner_observer_of(tmp_path, name) for name in ("lpv", "gain-switched", *kalman)}
    for k in range(40):
        given = sample(0.3 if k >= 20 else 0.01)
        u, mu, w, dw, slip = given[:5]
        expected = {"lpv": lpv.step(u, mu, w).estimate, "gain-switched": switched.step(u, mu, w, slip).estimate}
        expected |= {name: one.step(u, mu, w, dw, k >= 20).estimate for name, one in kalman.items()}
        found = {name: one.step(given) for name, one in chosen_ones.items()}
        for name, value in expected.items():
            np.testing.assert_allclose(found[name].relative_velocity, value[:, 1], rtol=1e-12, atol=1e-15)
            assert not found[name].flags[0] or k == 0
    assert len({round(float(step.relative_velocity[0]), 6) for step in found.values()}) >= 3


@pytest.mark.parametrize("name", ["gain-switched", "kalman-three-state", "kalman-two-state"])
def test_every_corner_observer_finds_the_velocity_of_the_closed_form(tmp_path: Path, name: str) -> None:
    log = write_log(tmp_path / "log.csv", columns(duration=1.5))
    data = replay_drive([log], write_drive(tmp_path, chosen(TORQUE, corner_velocity=name)))
    error = np.abs(data.replay.velocity - data.log.reference["vx"])[data.log.time > 0.5]
    assert error.max() < 5e-3
    assert not data.replay.flags.any()
    assert evaluate(data)["pipeline"]["estimators"]["corner_velocity"] == name


def test_a_schedule_without_a_tire_is_refused_before_the_log_is_read(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, chosen(DRIVE, corner_velocity="kalman-two-state"))
    content = schedule_content()
    del content["model"]["constants"]["sigma1"]
    write_content(tmp_path / "schedule.json", content)
    with pytest.raises(
        SpecError, match=r"the model of 'schedule\.json' has no constant sigma1, which the Kalman"
    ) as caught:
        replay_drive([tmp_path / "no-such-log.csv"], drive)
    assert "\n" not in str(caught.value)
    content["model"]["constants"]["sigma1"] = {"value": -1.0, "unit": "s/m"}
    write_content(tmp_path / "schedule.json", content)
    with pytest.raises(
        SpecError, match=r"'schedule\.json': tire constants must be finite and above zero: sigma1 = -1\.0"
    ):
        replay_drive([tmp_path / "no-such-log.csv"], drive)
