"""Readings of the papers that a drive file or a constructor chooses: each against a closed form, and what it replaces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from estimators import EstimatorError, GainSchedule
from estimators.arrays import FloatArray
from estimators.forces import PidForceObserver, UnknownInputForceObserver, WheelForceFilter
from estimators.pipeline import (
    CornerObservers,
    CornerVelocity,
    EstimationPipeline,
    FourWheelSideslip,
    StiffnessSideslip,
    SwitchedCorners,
)
from estimators.sideslip import AdaptiveStiffnessObserver, FixedStiffnessObserver
from estimators.sideslip.stiffness import PUBLISHED_TIME
from estimators.velocity import BristleTire, LtvKalmanObserver, SuspensionParameters, slip_ratio
from estimators.velocity.ltv_kalman import NORMAL
from estimators.velocity.ltv_model import sampled
from estimators.velocity.rear_wheels import rear_wheel_speed
from studies.drives.chain import pipeline_of
from studies.drives.corner_inputs import dead_reckoning, wheel_forces
from studies.drives.drive_file import read_drive
from synthesis.errors import SpecError
from tests.support.pipeline_truth import CAR, TIME, run, sample, turning
from tests.support.schedule_content import schedule_content
from tests.support.sideslip_truth import AXLES
from tests.support.synthetic_drive import write_drive
from tests.unit.test_drive_estimators import STEERED, chosen

ALONG, ACROSS = (GainSchedule.from_content(schedule_content(n), n) for n in ("longitudinal", "lateral"))


# P2 (22): Q = q I beside q B B'


@pytest.mark.parametrize(("states", "process"), [(3, "identity"), (3, "input"), (2, "identity")])
def test_the_process_covariance_is_that_of_the_recursion_written_out(states: Any, process: str) -> None:
    """P2 (21)-(22) until the gain is steady at 40 rad/s, against the Riccati equation solved by Schur vectors."""
    tire, w = BristleTire(), np.array([40.0])
    observer = LtvKalmanObserver(tire, TIME, (1,), states=states, process=process)
    for _ in range(4000):
        step = observer.step(0.3, 0.1, w)
    A, _ = (matrix[0] for matrix in sampled(tire, w, np.zeros(1), TIME, states))
    C, B = tire.output(w, states)[0], np.array([0.0, 1.0, 1.0])[:states]

    def steady(Q: FloatArray) -> FloatArray:
        P = solve_discrete_are(A.T, C.T, Q, [[NORMAL[1]]])
        return np.asarray(A @ P @ C.T / (C @ P @ C.T + NORMAL[1]))[:, 0]

    both = {
        "identity": steady(NORMAL[0] * np.eye(states)),
        "input": steady(NORMAL[0] * np.outer(B, B) + 1e-12 * np.eye(states)),
    }
    np.testing.assert_allclose(step.gain[0], both[process], rtol=1e-4)
    other = both["input" if process == "identity" else "identity"]
    assert np.abs(step.gain[0, 1] / other[1] - 1.0) > 0.5


def test_the_identity_hardly_lets_the_force_correct_the_velocity() -> None:
    """The velocity gains of P2 notes 10: 1.6e-3 m/s against 0.47 m/s (there with the radius of the text, 0.35 m)."""
    gains = {}
    for process in ("identity", "input"):
        observer = LtvKalmanObserver(BristleTire(radius=0.35), TIME, (1,), process=process)
        for _ in range(4000):
            gains[process] = observer.step(0.0, 0.1, 40.0).gain[0, 1]
    assert gains["identity"] == pytest.approx(1.6e-3, abs=0.05e-3)
    assert gains["input"] == pytest.approx(0.47, abs=0.01)
    with pytest.raises(EstimatorError, match="unknown process 'identiy'; did you mean identity"):
        LtvKalmanObserver(BristleTire(), TIME, process="identiy")


# P2 (1): C_b


@pytest.mark.parametrize("kind", [UnknownInputForceObserver, WheelForceFilter, PidForceObserver])
def test_bearing_friction_is_no_force_of_the_tire(kind: Any) -> None:
    """I_w w' = T - R_e F - C_b w with w = w_0 + alpha t and constant F, P2 (1): the torque that makes it so is known."""
    friction, force, alpha = 0.8, 1200.0, 30.0
    told = replace(CAR, bearing_friction=friction)
    t = TIME * np.arange(400)
    w = 20.0 + alpha * t
    mean = w - 0.5 * alpha * TIME if kind is UnknownInputForceObserver else w  # over the sample before
    torque = CAR.wheel_inertia * alpha + CAR.radii[0] * force + friction * mean
    found = {}
    for name, car in (("told", told), ("untold", CAR)):
        observer = kind(car, TIME)
        for speed, moment in zip(w, torque, strict=True):
            given = (speed, alpha, moment) if kind is PidForceObserver else (speed, moment)
            step = observer.step(*(np.full(4, value) for value in given))
        found[name] = step.force
    tolerance = 1e-6 if kind is not WheelForceFilter else 1.0  # its function G has C_b w of the sample before
    np.testing.assert_allclose(found["told"], force, atol=tolerance)
    np.testing.assert_allclose(found["untold"] - force, friction * w[-1] / CAR.radii[0], rtol=0.02)  # 192 N
    rate, one = np.full((400, 4), alpha), np.ones((400, 4))
    exact = wheel_forces(
        (torque + friction * (w - mean))[:, None] * one, w[:, None] * one, rate, one, CAR.wheel_inertia,
        np.array(CAR.radii), 0.0, 1.0, friction,
    )  # fmt: skip
    np.testing.assert_allclose(exact, force)


def test_bearing_friction_over_slow_and_missing_speeds() -> None:
    """A speed that is new at every fourth sample alone: the mean of both ends is the mean of the interval."""
    observer = UnknownInputForceObserver(replace(CAR, bearing_friction=2.0), TIME)
    w = 30.0 + 20.0 * TIME * np.arange(200)
    for k, speed in enumerate(w):
        torque = CAR.wheel_inertia * 20.0 + CAR.radii[0] * 800.0 + 2.0 * (speed - 10.0 * TIME)
        step = observer.step(np.full(4, w[k - k % 4]), np.full(4, torque), fresh=np.full(4, k % 4 == 0))
    np.testing.assert_allclose(step.force, 800.0, atol=1e-6)


# P4 (5) and (9)


def test_friction_of_the_road_is_that_of_the_drive_file(tmp_path: Path) -> None:
    for text, friction in ((STEERED, 1.0), (STEERED.replace("[schedules]", "friction = 0.35\n\n[schedules]"), 0.35)):
        drive = read_drive(write_drive(tmp_path, chosen(text, sideslip="four-wheel-extended")))
        part = pipeline_of(drive, None)[0].sideslip
        assert isinstance(part, FourWheelSideslip)
        assert part.observer.vehicle.friction == friction
        for _ in range(400):  # a large slip angle at 20 m/s: forces end at mu F_z, P4 (3)-(5)
            step = part.observer.step(0.6, part.observer.vehicle.static_loads, [np.nan, 20.0, np.nan, np.nan])
        assert np.abs(step.used_friction[:2]).max() == pytest.approx(friction, rel=0.1)
    with pytest.raises(SpecError, match=r"vehicle\.friction: -0\.2 is out of range"):
        read_drive(write_drive(tmp_path, STEERED.replace("[schedules]", "friction = -0.2\n\n[schedules]")))


def test_speed_of_the_rear_wheels() -> None:
    """Rolling wheels of a turning car, closed form; one missing wheel costs nothing where the yaw rate is known."""
    speed, turn = np.array([20.0, -3.0]), np.array([0.4, 0.1])
    w = (speed[:, None] - turn[:, None] * CAR.corner_y) / CAR.radius
    w[:, :2] *= 1.2  # spinning front wheels
    np.testing.assert_allclose(rear_wheel_speed(CAR, w), speed, atol=1e-12)
    w[0, 2], w[1, 3] = np.nan, 1e7
    np.testing.assert_allclose(rear_wheel_speed(CAR, w, turn), speed, atol=1e-12)
    assert np.abs(rear_wheel_speed(CAR, w) - speed).min() > 0.05
    w[0, 3] = np.nan
    assert np.isnan(rear_wheel_speed(CAR, w, turn)[0])


class Listener:
    """A sideslip part that keeps the speed it is given."""

    def __init__(self) -> None:
        self.speed = np.nan

    def step(self, steer: Any, yaw_rate: Any, vx: Any, *rest: Any) -> Any:
        self.speed = float(vx)
        return StiffnessSideslip(AXLES, TIME).step(steer, yaw_rate, vx, *rest)


def test_the_sideslip_part_gets_the_speed_of_the_rear_wheels_where_it_is_chosen() -> None:
    truth = turning(40)
    truth = truth._replace(wheel_speed=truth.wheel_speed * np.array([1.0, 1.0, 1.04, 1.04]))
    for rear in (False, True):
        part: Any = Listener()
        pipeline = EstimationPipeline(CAR, TIME, sideslip=part, speed_of_rear_wheels=rear)
        pipeline.reset(vx=truth.vx[0], vy=truth.vy[0])
        steps = run(pipeline, truth)
        mean = float(rear_wheel_speed(CAR, truth.wheel_speed[-1]))
        assert part.speed == (mean if rear else float(steps[-1].vx))
        assert abs(mean - float(steps[-1].vx)) > 0.2


# P5 notes 5: covariances by time


def correction_rate(time: float, noise_time: float | None) -> float:
    """1/s: sum of gain times measurement row over the sample time, of the fixed-stiffness filter in its steady state."""
    observer = FixedStiffnessObserver(AXLES, sample_time=time, noise_time=noise_time)
    for _ in range(round(3.0 / time)):
        step = observer.step(0.02, 0.1, 20.0, 0.0, [1300.0, 1200.0, 1.7])
    rows = np.array(
        [-AXLES.front_stiffness, -AXLES.rear_stiffness, -(AXLES.front_stiffness + AXLES.rear_stiffness) / AXLES.mass]
    )
    return float(step.filter.gain[0] @ rows) / time


def test_variances_by_time_give_one_filter_at_every_sample_time() -> None:
    """-2 a P + q - P^2 J = 0 with J = sum h^2/r of densities, the continuous filter: it corrects with P J per second."""
    stiff = AXLES.front_stiffness + AXLES.rear_stiffness
    density = PUBLISHED_TIME * 0.1
    J = (AXLES.front_stiffness**2 + AXLES.rear_stiffness**2 + (stiff / AXLES.mass) ** 2) / density
    a, q = stiff / (AXLES.mass * 20.0), 1e-13 / PUBLISHED_TIME
    expected = -a + np.sqrt(a * a + q * J)
    found = {time: correction_rate(time, PUBLISHED_TIME) for time in (0.01, 0.005, 0.001)}
    assert found[0.001] == pytest.approx(expected, rel=0.02)
    assert found[0.005] == pytest.approx(expected, rel=0.06)
    assert correction_rate(0.01, None) == found[0.01]  # the paper's own sample time
    assert correction_rate(0.001, None) > 5.0 * expected  # per sample: another filter
    adaptive = AdaptiveStiffnessObserver(AXLES, sample_time=0.005, noise_time=PUBLISHED_TIME)
    assert adaptive._share == 0.5
    with pytest.raises(EstimatorError, match="noise_time = 0 s"):
        AdaptiveStiffnessObserver(AXLES, noise_time=0.0)


# P3 (14)-(15)


def test_slips_on_compliant_suspensions_are_those_of_the_wheel_centres() -> None:
    """A sine of force: psi' is s F/(M s^2 + C s + K) at s = 6i, P3 (14). V_x of the centre of gravity stays as it is."""
    soft, pull, s = SuspensionParameters(stiffness_x=1e5), 1500.0, 6.0j
    time = TIME * np.arange(600)
    found: dict[str, list[Any]] = {}
    for name, suspension in (("rigid", None), ("compliant", soft)):
        corners = CornerObservers(CAR, SwitchedCorners(ALONG), ACROSS, suspension=suspension)
        velocity, still = CornerVelocity(corners), np.zeros(4)
        found[name] = [
            velocity.step(
                np.full(4, 45.0), still, 0.0, 0.0, 0.0, 0.0, lateral_use=still, forces=(np.full(4, force), still)
            )
            for force in pull * np.sin(6.0 * time)
        ]
        last = found[name][-1].corners
        along = CAR.radius * 45.0 - last.relative_velocity + last.suspension_velocity[:, 0]
        np.testing.assert_allclose(
            corners.slip, slip_ratio(CAR.radius * 45.0, along), atol=1e-12
        )  # what switches the gains
    wheels = np.array([step.corners.suspension_velocity for step in found["compliant"]])
    answer = s / (soft.unsprung_mass * s * s + soft.damping_x * s + soft.stiffness_x)
    expected = pull * np.imag(answer * np.exp(s * (time + 0.5 * TIME)))[:, None]  # held forces: half a sample
    late = slice(100, None)
    assert np.abs(wheels[late, :, 0] - expected[late]).max() < 0.02 * np.abs(expected).max()
    assert not wheels[..., 1].any()
    for rigid, moved in zip(found["rigid"][late], found["compliant"][late], strict=True):
        assert moved.vx == rigid.vx
        surface = CAR.radius * 45.0
        np.testing.assert_allclose(
            moved.slip, slip_ratio(surface, moved.vx + moved.corners.suspension_velocity[:, 0]), atol=1e-12
        )
        np.testing.assert_allclose(rigid.slip, slip_ratio(surface, rigid.vx), atol=1e-12)
    assert np.abs(found["rigid"][300].slip - found["compliant"][300].slip).max() > 1e-3


def test_compliance_through_the_pipeline_in_a_turn() -> None:
    """A steady turn: forces rest, so do the wheels; where the turn begins, psi' is turned with the steering, body frame."""
    truth = turning(200)
    corners = CornerObservers(CAR, ALONG, ACROSS, suspension=SuspensionParameters())
    beside = EstimationPipeline(CAR, TIME, corner_observers=corners)
    beside.reset(vx=truth.vx[0], vy=truth.vy[0])
    steps = run(beside, truth)
    assert np.abs(steps[0].corners.suspension_velocity[..., 1]).max() > 0.01
    assert np.abs(steps[-1].corners.suspension_velocity).max() < 1e-3
    saved = beside.save()
    assert any("suspension.state" in key for key in saved)
    again = beside.step(sample(truth, 10)).corners.suspension_velocity
    beside.restore(saved)
    np.testing.assert_array_equal(beside.step(sample(truth, 10)).corners.suspension_velocity, again)
    beside.reset()
    assert not np.asarray(corners.suspension.state if corners.suspension else 1).any()


# planar dead reckoning


def test_planar_dead_reckoning_turns_with_the_car() -> None:
    """V_x' = a_x + r V_y, V_y' = a_y - r V_x, P2 (15), of a motion that is known: to the trapezoidal rule."""
    t = np.arange(0, 4, 0.005)
    vx, vy, r = 10 + np.sin(t), 0.8 * np.sin(2 * t), 0.5 * np.sin(t) + 0.3
    ax, ay = np.cos(t) - r * vy, 1.6 * np.cos(2 * t) + r * vx
    found = dead_reckoning(ax, ay, r, 0.005, 10.0)
    np.testing.assert_allclose(found, [vx, vy], atol=2e-4)
    assert np.abs(dead_reckoning(ax, ay, -r, 0.005, 10.0)[1] - vy).max() > 5.0  # another sense of rotation
    assert np.abs(dead_reckoning(ax, 0 * ay, r, 0.005, 10.0)[0] - vx).max() > 1.0  # a_x alone: r V_y is missing
    ax[100] = np.nan
    assert np.isfinite(dead_reckoning(ax, ay, r, 0.005, 10.0)).all()
