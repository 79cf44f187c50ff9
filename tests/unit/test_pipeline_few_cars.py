"""A few cars in one pipeline are as many pipelines of one car: whatever each of them does, saved and reset in the middle."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from estimators import Flag, GainSchedule
from estimators.forces import AttitudeObserver, LoadStep, VerticalLoads
from estimators.pipeline import CornerObservers, CornerVelocity, EstimationPipeline, PipelineStep, VehicleSignals
from estimators.pipeline.car_by_car import FEW, CarByCar
from estimators.vehicle import GRAVITY
from estimators.velocity import FusionSettings, SlipWeights, VelocityFusion
from tests.support.pipeline_truth import CAR, TIME, Truth, noisy, sample, straight, turning
from tests.support.schedule_content import schedule_content

SHAPE = (2, 2)
PLACES = list(product(*map(range, SHAPE)))
N, HALF = 50, 25


def cars() -> list[Truth]:
    """A turn; a start with a dead accelerometer and a lost torque; one at rest; braking with a wheel that fails."""
    drives = turning(N), straight(np.full(N, 2.0), 10.0), straight(np.zeros(N), 0.0), straight(np.full(N, -4.0), 25.0)
    runs = [noisy(drive, seed) for seed, drive in enumerate(drives)]
    runs[1].ax[10:] = runs[1].ax[10]
    runs[1].torque[20:, 1] = np.nan
    runs[2].wheel_speed[:] = 0.0
    runs[3].wheel_speed[15:25, 2] = np.inf
    return runs


def signals(truth: Truth, k: int, place: int | None = None) -> VehicleSignals:
    """With signals that only some cars have an odd value of: the car at `place`, or all of them."""
    up = GRAVITY * (1.0 + 0.01 * np.arange(4.0))
    late = TIME * np.where((np.arange(4) == 3) & (k == 12), 3.0, 1.0)
    gear = np.where((np.arange(4) == 3) & (k > HALF), -1.0, 0.0)  # found to be in reverse
    own = {"az": up, "elapsed": late, "roll_rate": 0.01 * up, "pitch_rate": np.sin(0.1 * k + up), "direction": gear}
    shaped = {name: v.reshape(SHAPE) if place is None else v[place] for name, v in own.items()}
    return sample(truth, k)._replace(grade=0.02, **shaped)


def compare(batch: Any, alone: Any, place: tuple[int, ...], name: str = "") -> int:
    """Every field; how many of them."""
    if alone is None:
        assert batch is None
        return 0
    if isinstance(alone, tuple):
        pairs: Any = zip(alone._fields, batch, alone, strict=True)  # type: ignore[attr-defined]
        return sum(compare(mine, other, place, f"{name}.{field}") for field, mine, other in pairs)
    assert batch.shape == SHAPE + alone.shape, name
    assert batch.dtype == alone.dtype, name
    np.testing.assert_allclose(batch[place], alone, rtol=1e-9, atol=1e-9, err_msg=name)
    return 1


def pipeline(name: str, shape: tuple[int, ...] = ()) -> EstimationPipeline:
    """Default parts, parts of the user that can be divided, and a velocity part that cannot."""
    if name == "default":
        return EstimationPipeline(CAR, TIME, shape)
    along, across = (GainSchedule.from_content(schedule_content(n), n) for n in ("longitudinal", "lateral"))
    corners = CornerObservers(CAR, along, across, shape, weights=SlipWeights())
    attitude = AttitudeObserver(TIME, shape, time_constant=1.0)
    if name == "corners":
        return EstimationPipeline(
            CAR, TIME, shape, attitude=attitude, velocity=CornerVelocity(corners), unsigned_wheels=True
        )
    return EstimationPipeline(
        *(CAR, TIME, shape),
        loads=VerticalLoads(CAR, TIME, shape, roll=(2.0, 0.4)),
        attitude=attitude,
        velocity=VelocityFusion(CAR, TIME, shape, FusionSettings(dead_speed=0.4)),
        corner_observers=corners,
        unsigned_wheels=True,
    )


@pytest.mark.parametrize("name", ["default", "own", "corners"])
def test_each_of_a_few_cars_is_a_pipeline_of_its_own(name: str) -> None:
    runs = cars()
    whole = Truth(*(np.stack(column).reshape(*SHAPE, *column[0].shape) for column in zip(*runs, strict=True)))
    batch, ones = pipeline(name, SHAPE), [pipeline(name) for _ in runs]
    assert isinstance(batch.motion, CarByCar)
    last: list[PipelineStep] = []
    for k in range(N):
        if k == HALF:
            saved = {key: array.copy() for key, array in batch.save().items()}
            batch = pipeline(name, SHAPE)
            batch.restore(saved)
            batch.reset(np.array([[False, True], [False, False]]), vx=12.0)
            ones[1].reset(vx=12.0)
        together = batch.step(signals(whole, k))
        last = [one.step(signals(run, k, i)) for i, (one, run) in enumerate(zip(ones, runs, strict=True))]
        if k % 5 < 2:
            assert all(compare(together, one, place) > 60 for one, place in zip(last, PLACES, strict=True))
        if name != "corners":  # that part has no flag of its own for it
            assert bool(together.flags[0, 1] & Flag.RESET) == (k == HALF)
    if name == "default":
        assert together.velocity.standing.tolist() == [[False, False], [True, False]]
    assert (together.vx[1, 1] < 0.0) == (name != "default")
    for place, one in zip(PLACES, ones, strict=True):
        mine, own = batch.save(), one.save()
        assert mine.keys() == own.keys()
        for key in ones[0].motion.save():
            if name == "corners" and key.startswith("velocity."):  # the cars of its arrays are not in front
                continue
            np.testing.assert_allclose(mine[key][place], own[key], rtol=1e-9, atol=1e-9, err_msg=key)
    with pytest.raises(AssertionError):  # the answers of two cars in each other's place
        compare(together, last[0], PLACES[3])


class Softer(VerticalLoads):
    """Of a user, who has not said how it is divided."""


class Level:
    """Of a user, without a state: nothing but what the pipeline asks for."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.shape = shape

    def like(self, batch_shape: tuple[int, ...]) -> Level:
        return Level(batch_shape)

    def step(self, ax: Any, ay: Any, az: Any = None, pitch: Any = None, roll: Any = None) -> LoadStep:
        four = (*self.shape, 4)
        load = np.broadcast_to(CAR.static_loads, four)
        return LoadStep(load, np.zeros(four, dtype=np.bool_), np.zeros(self.shape, dtype=np.int32))


def test_a_part_without_a_state_is_divided_and_changes_nothing() -> None:
    few, one = (EstimationPipeline(CAR, TIME, shape, loads=Level(shape)) for shape in ((2,), ()))
    assert isinstance(few.motion, CarByCar)
    for _ in range(5):
        together = few.step(VehicleSignals(np.full((2, 4), 60.0), ax=0.1, torque=np.full((2, 4), 50.0)))
        alone = one.step(VehicleSignals(np.full(4, 60.0), ax=0.1, torque=np.full(4, 50.0)))
    np.testing.assert_allclose(together.vx, alone.vx, rtol=1e-12)
    np.testing.assert_array_equal(together.force_z, np.tile(CAR.static_loads, (2, 1)))


def test_more_cars_and_parts_that_cannot_be_divided_run_on_arrays() -> None:
    begun = AttitudeObserver(TIME, (2,))
    begun.step(0.1, 0.0, 0.0, 0.0)
    many = [
        EstimationPipeline(CAR, TIME, (FEW + 1,)),
        EstimationPipeline(CAR, TIME, (2,), loads=Softer(CAR, TIME, (2,))),
        EstimationPipeline(CAR, TIME, (2,), attitude=begun),
    ]
    assert not any(isinstance(pipeline.motion, CarByCar) for pipeline in many)


def test_a_velocity_part_that_has_begun_goes_on() -> None:
    """It steps both cars at once, with the gravity that each of them says."""
    starts = np.array([12.0, 13.0])
    whole, *ones = [VelocityFusion(CAR, TIME, shape) for shape in ((2,), (), ())]
    whole.reset(vx=starts)
    for one, start in zip(ones, starts, strict=True):
        one.reset(vx=start)
    few = EstimationPipeline(CAR, TIME, (2,), attitude=AttitudeObserver(TIME, (2,)), velocity=whole)
    alone = [EstimationPipeline(CAR, TIME, attitude=AttitudeObserver(TIME), velocity=one) for one in ones]
    assert isinstance(few.motion, CarByCar)
    assert few.motion.velocity is whole
    blind, rates = np.full(4, np.nan), np.array([-0.5, 0.2])
    for _ in range(10):
        together = few.step(VehicleSignals(np.tile(blind, (2, 1)), ax=0.1, pitch_rate=rates, roll_rate=0.0))
        last = [
            one.step(VehicleSignals(blind, 0.1, pitch_rate=p, roll_rate=0.0))
            for one, p in zip(alone, rates, strict=True)
        ]
    np.testing.assert_allclose(together.vx, [one.vx for one in last], rtol=1e-12)
    np.testing.assert_allclose(together.vx, starts, atol=0.05)
    assert abs(np.diff(together.vx - starts)[0]) > 1e-4
