"""The whole chain on drives whose answer is known; batches, saved states, replaced parts, refused settings."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError, Flag, GainSchedule
from estimators.faults import DRIVING
from estimators.forces import AttitudeObserver, LateralForceEstimator, VerticalLoads, WheelForceFilter
from estimators.pipeline import (
    Check,
    CornerObservers,
    DifferentiatedPid,
    EstimationPipeline,
    FourWheelSideslip,
    PipelineStep,
    StiffnessSideslip,
    VehicleSignals,
)
from estimators.pipeline.car_by_car import FEW
from estimators.sideslip import FourWheel, SingleTrack
from estimators.vehicle import GRAVITY
from estimators.velocity import SlipWeights, VelocityFusion
from tests.support.pipeline_truth import CAR, TIME, Truth, finite, flat, noisy, run, sample, straight, turning
from tests.support.schedule_content import schedule_content

DRIVE = straight(np.repeat([2.0, -3.0], 400), 10.0)


def corner_set(batch: tuple[int, ...] = (), lateral: bool = True) -> CornerObservers:
    along, across = (GainSchedule.from_content(schedule_content(name), name) for name in ("longitudinal", "lateral"))
    return CornerObservers(CAR, along, across if lateral else None, batch, SlipWeights())


def four_wheel() -> FourWheel:
    return FourWheel(2270.0, 4650.0, 1.42, 1.43, 1.59, 9e4, 9e4, 0.5, 0.5)


def full(batch: tuple[int, ...] = ()) -> EstimationPipeline:
    """Everything there is."""
    return EstimationPipeline(
        CAR,
        TIME,
        batch,
        attitude=AttitudeObserver(TIME, batch),
        corner_observers=corner_set(batch),
        sideslip=FourWheelSideslip(four_wheel(), TIME, batch),
    )


def test_straight_drive_is_found_in_all_its_parts() -> None:
    truth = straight(np.full(600, 2.0), 10.0)
    steps = run(EstimationPipeline(CAR, TIME), truth)
    late = slice(200, None)
    vx = np.array([s.vx for s in steps])[late]
    assert np.abs(vx - truth.vx[late]).max() < 0.03
    np.testing.assert_allclose(np.array([s.force_z for s in steps])[late], truth.force_z[late], rtol=2e-3)
    np.testing.assert_allclose(np.array([s.force_x for s in steps])[late], truth.force_x[late], rtol=0.02)
    slip = np.array([s.slip for s in steps])[late]
    np.testing.assert_allclose(slip, 0.03 * 2.0 / GRAVITY / (1 + 0.03 * 2.0 / GRAVITY), atol=2e-3)
    assert np.abs([s.axle_force_y for s in steps]).max() < 60.0
    assert not any(s.consistency.failed for s in steps[10:])
    assert not any(
        s.flags & ~(Flag.STALE_MEASUREMENT | DRIVING) for s in steps
    )  # a constant a_x looks like a dead sensor, and is


def test_steady_turn_is_found_in_all_its_parts() -> None:
    truth = turning(400)
    pipeline = EstimationPipeline(CAR, TIME)
    pipeline.reset(vx=truth.vx[0], vy=truth.vy[0])
    last = run(pipeline, noisy(truth, 3))[-1]
    assert last.vx == pytest.approx(truth.vx[-1], abs=0.1)
    assert last.vy == pytest.approx(truth.vy[-1], abs=0.15)  # a_y has a bias of 0.1 m/s^2, and 2 s are a short time
    assert abs(last.vy - truth.vy[-1]) < 2.0 * last.vy_deviation
    assert last.sideslip == pytest.approx(np.arctan(truth.vy[-1] / truth.vx[-1]), abs=0.0075)
    np.testing.assert_allclose(last.axle_force_y, truth.axle_force_y[-1], rtol=0.04)
    np.testing.assert_allclose(last.force_z, truth.force_z[-1], rtol=0.02)
    assert last.force_y.sum() == pytest.approx(last.axle_force_y.sum(), rel=1e-9)
    assert last.force_z.sum() == pytest.approx(CAR.mass * GRAVITY, rel=1e-9)
    assert (last.slip_angle < 0).all()  # to the left: positive forces, negative angles (P1)


@pytest.mark.parametrize("seeds", [FEW + 1, 3], ids=["default", "all parts"])
def test_a_batch_equals_a_loop(seeds: int) -> None:
    runs = [noisy(DRIVE, seed, (0.05 * seed, 0.0, 0.0)) for seed in range(seeds)]
    runs[1].torque[80:110] = np.nan
    runs[2].ax[50:60] = np.nan
    together = Truth(*(np.stack(column) for column in zip(*runs, strict=True)))

    def make(batch: tuple[int, ...]) -> EstimationPipeline:
        return EstimationPipeline(CAR, TIME, batch) if seeds > FEW else full(batch)

    batch = run(make((seeds,)), together, 0, 120)
    for seed, one in enumerate(runs):
        for k, alone in enumerate(run(make(()), one, 0, 120)):
            for name in ("vx", "vy", "force_x", "force_z", "force_y", "slip", "sideslip"):
                np.testing.assert_allclose(
                    getattr(batch[k], name)[seed], getattr(alone, name), rtol=1e-7, atol=1e-7, err_msg=f"{name} {k}"
                )
            assert batch[k].flags[seed] == alone.flags
            assert batch[k].consistency.failed[seed] == alone.consistency.failed


@pytest.mark.parametrize("build", [lambda: EstimationPipeline(CAR, TIME), full], ids=["default", "all parts"])
def test_a_restored_state_continues_byte_by_byte(build: Any) -> None:
    truth = noisy(DRIVE, 1)
    truth.wheel_speed[95:105, 2] = np.nan
    first, second = build(), build()
    run(first, truth, 0, 100)
    second.restore({name: array.copy() for name, array in first.save().items()})
    for mine, other in zip(run(first, truth, 100, 200), run(second, truth, 100, 200), strict=True):
        assert flat(mine) == flat(other)


def test_restoring_refuses_what_does_not_fit() -> None:
    pipeline = EstimationPipeline(CAR, TIME)
    saved = pipeline.save()
    with pytest.raises(EstimatorError, match=r"lacks 'last\.bias'"):
        pipeline.restore({name: array for name, array in saved.items() if name != "last.bias"})
    with pytest.raises(EstimatorError, match=r"expected float64 \(2,\)"):
        EstimationPipeline(CAR, TIME, (2,)).restore(saved)


def test_reset_starts_some_entries_afresh_and_leaves_the_others() -> None:
    pipeline, other = EstimationPipeline(CAR, TIME, (2,)), EstimationPipeline(CAR, TIME, (2,))
    both = Truth(*(np.stack([column, column]) for column in noisy(DRIVE, 4)))
    run(pipeline, both, 0, 100)
    run(other, both, 0, 100)
    pipeline.reset(np.array([True, False]), vx=11.0)
    step, kept = pipeline.step(sample(both, 100)), other.step(sample(both, 100))
    assert step.flags[0] & Flag.RESET
    assert not step.flags[1] & ~DRIVING
    assert step.vx[0] == pytest.approx(11.0, abs=0.2)
    assert step.vx[1] == kept.vx[1]
    np.testing.assert_array_equal(step.force_x[1], kept.force_x[1])
    fresh = EstimationPipeline(CAR, TIME, (2,))
    fresh.reset(vx=11.0)
    pipeline.reset(vx=11.0)
    for k in range(5):
        one, two = pipeline.step(sample(both, k)), fresh.step(sample(both, k))
        np.testing.assert_allclose(one.force_x, two.force_x)
        np.testing.assert_allclose(one.vx, two.vx)


class Constant:
    """A part that always says the same: it has nothing but a step."""

    def __init__(self, **answer: Any) -> None:
        self.answer, self.calls = SimpleNamespace(**answer), 0

    def step(self, *_: Any, **__: Any) -> Any:
        self.calls += 1
        return self.answer


NO = np.zeros(4, dtype=np.bool_)
STUBS: dict[str, tuple[Constant, str, Any]] = {
    "longitudinal_force": (
        Constant(force=np.full(4, 500.0), deviation=np.full(4, 1e-3), unknown=NO, flags=np.zeros(4, dtype=np.int32)),
        "force_x",
        500.0,
    ),
    "loads": (Constant(load=np.full(4, 5000.0), flags=np.int32(0)), "force_z", 5000.0),
    "lateral_force": (
        Constant(
            axle_force=np.array([10.0, 20.0]), corner_force=np.full(4, 7.0), innovation=np.zeros(3), flags=np.int32(0)
        ),
        "force_y",
        7.0,
    ),
    "velocity": (
        Constant(
            vx=np.float64(12.5),
            vy=np.float64(0.5),
            vx_deviation=np.float64(0.1),
            vy_deviation=np.float64(0.1),
            yaw_rate=np.float64(0.0),
            sensor_bias=np.zeros(3),
            slip=np.zeros(4),
            slip_angle=np.zeros(4),
            used=~NO,
            standing=np.bool_(False),
            flags=np.int32(0),
            wheel_flags=np.zeros(4, dtype=np.int32),
        ),
        "vx",
        12.5,
    ),
    "attitude": (
        Constant(
            roll=np.float64(0.0),
            pitch=np.float64(0.01),
            total_roll=np.float64(0.0),
            total_pitch=np.float64(0.01),
            flags=np.int32(0),
        ),
        "pitch",
        0.01,
    ),
}


@pytest.mark.parametrize("name", STUBS)
def test_every_part_can_be_replaced_by_anything_with_its_step(name: str) -> None:
    part, output, value = STUBS[name]
    chosen: dict[str, Any] = {name: part}
    pipeline = EstimationPipeline(CAR, TIME, **chosen)
    for step in run(pipeline, DRIVE, 0, 30):
        np.testing.assert_allclose(getattr(step, output), value, atol=1e-3)
        assert finite(step)
    assert part.calls >= 30
    assert not any(key.startswith(f"{name}.") for key in pipeline.save())
    pipeline.reset()


@pytest.mark.parametrize("name", ["corner_observers", "sideslip"])
def test_optional_parts_are_stepped_and_reported(name: str) -> None:
    part = Constant(vx=np.float64(3.0), sideslip=np.float64(0.1), flags=np.int32(0))
    chosen: dict[str, Any] = {name: part}
    steps = run(EstimationPipeline(CAR, TIME, **chosen), DRIVE, 0, 400)
    reported = steps[-1].corners if name == "corner_observers" else steps[-1].sideslip_step
    assert reported is part.answer
    failed = Check(int(steps[-1].consistency.failed))
    assert (Check.CORNERS_DISAGREE in failed) == (name == "corner_observers")


@pytest.mark.parametrize(
    "part", [WheelForceFilter(CAR, TIME), DifferentiatedPid(CAR, TIME)], ids=["unscented", "differentiated PID"]
)
def test_all_longitudinal_force_observers_agree(part: Any) -> None:
    truth = noisy(straight(np.full(300, 2.0), 10.0), 2)
    mine = np.array([s.force_x for s in run(EstimationPipeline(CAR, TIME, longitudinal_force=part), truth)])[100:]
    np.testing.assert_allclose(mine.mean(axis=0), truth.force_x[0], rtol=0.05)


def test_both_forms_of_the_lateral_filter_agree() -> None:
    truth = noisy(turning(200), 2)
    unscented = LateralForceEstimator(CAR, TIME, measurement_deviation=(0.3, 0.1, 0.3))
    one = run(EstimationPipeline(CAR, TIME, lateral_force=unscented), truth)
    two = run(EstimationPipeline(CAR, TIME), truth)
    np.testing.assert_allclose([s.force_y for s in one], [s.force_y for s in two], atol=1e-4)


def test_corner_observers_see_the_same_car() -> None:
    for lateral in (True, False):
        steps = run(EstimationPipeline(CAR, TIME, corner_observers=corner_set((), lateral)), DRIVE)
        gap = np.array([s.consistency.velocity_gap for s in steps])
        assert np.abs(gap).max() < 0.5
        assert np.isfinite([s.corners.corner_vx for s in steps]).all()


def test_sideslip_parts_follow_the_turn() -> None:
    """Tires with the stiffness of the turn's own axles; a dozen relaxation lengths later sideslips agree."""
    truth = turning(600, 20.0, 0.08)
    mu = truth.ay[0] / GRAVITY
    angle = 0.09 * mu + 0.09 * mu**3
    front, rear = (float(force) / angle for force in truth.axle_force_y[0])
    track = SingleTrack(CAR.mass, CAR.yaw_inertia, 1.42, 1.43, front, rear)
    wheels = FourWheel(CAR.mass, CAR.yaw_inertia, 1.42, 1.43, 1.59, front / 2, rear / 2, 0.5, 0.5)
    parts: list[Any] = [
        FourWheelSideslip(wheels, TIME),
        StiffnessSideslip(track, TIME, adaptive=False),
        StiffnessSideslip(track, TIME, adaptive=False, sliding=True),
    ]
    expected = np.arctan(truth.vy[0] / truth.vx[0])
    for part in parts:
        last = run(EstimationPipeline(CAR, TIME, sideslip=part), truth)[-1]
        assert float(last.sideslip_step.sideslip) == pytest.approx(expected, abs=0.004)
        assert last.sideslip == pytest.approx(expected, abs=0.004)


def test_attitude_takes_gravity_off() -> None:
    """A body that stands 0.05 rad nose up reads g sin(0.05) of acceleration; the wheels roll at constant speed."""
    n = 1600
    truth = straight(np.zeros(n), 15.0)
    live = 0.02 * np.random.default_rng(0).normal(size=n)  # a reading that repeats itself is a frozen one
    tilted = truth._replace(ax=truth.ax + GRAVITY * np.sin(0.05) + live)
    pipeline = EstimationPipeline(CAR, TIME, attitude=AttitudeObserver(TIME))
    last: PipelineStep | None = None
    for k in range(n):
        last = pipeline.step(sample(tilted, k)._replace(roll_rate=0.0, pitch_rate=0.0, az=GRAVITY * np.cos(0.05)))
    assert last is not None
    assert last.vx == pytest.approx(15.0, abs=0.1)
    assert last.pitch + last.velocity.sensor_bias[0] / GRAVITY == pytest.approx(0.05, abs=0.02)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sample_time": 0.0}, "sample_time"),
        ({"repeat_time": -1.0}, "repeat_time"),
        ({"acceleration_deviation": np.nan}, "acceleration_deviation"),
        ({"velocity": VelocityFusion(CAR, TIME, (2,))}, r"velocity has batch_shape \(2,\), expected \(\)"),
        ({"loads": VerticalLoads(CAR, TIME, (4,))}, r"loads has batch_shape \(4,\)"),
        ({"velocity": VelocityFusion(CAR, 0.01)}, "velocity is for sample_time = 0.01 s, the pipeline runs at 0.005 s"),
        ({"corner_observers": (0.01,)}, "corner_observers is for sample_time = 0.01 s"),
    ],
)
def test_settings_that_make_no_sense_are_refused_in_one_line(arguments: dict[str, Any], message: str) -> None:
    if "corner_observers" in arguments:
        arguments = {"corner_observers": SimpleNamespace(sample_time=0.01, step=None)}
    with pytest.raises(EstimatorError, match=message) as caught:
        EstimationPipeline(**{"vehicle": CAR, "sample_time": TIME, **arguments})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wheel_speed": np.zeros(3)}, r"wheel_speed has shape \(3,\), expected \(4,\)"),
        ({"ax": "fast"}, "ax is not an array of numbers"),
        ({"elapsed": np.zeros(2)}, "elapsed has shape"),
    ],
)
def test_signals_of_another_shape_are_refused(change: dict[str, Any], message: str) -> None:
    pipeline = EstimationPipeline(CAR, TIME)
    with pytest.raises(EstimatorError, match=message):
        pipeline.step(VehicleSignals(**{"wheel_speed": np.zeros(4), "ax": 0.0, **change}))
