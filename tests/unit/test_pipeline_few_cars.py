"""A few cars in one pipeline are as many pipelines of one car: whatever each of them does, saved and reset in the middle."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from estimators import Flag
from estimators.pipeline import EstimationPipeline, PipelineStep, VehicleSignals
from estimators.pipeline.car_by_car import FEW, CarByCar
from estimators.vehicle import GRAVITY
from tests.support.pipeline_truth import CAR, TIME, Truth, noisy, sample, straight, turning

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
    if place is not None:
        return sample(truth, k)._replace(az=up[place], elapsed=late[place])
    return sample(truth, k)._replace(az=up.reshape(SHAPE), elapsed=late.reshape(SHAPE))


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


def test_each_of_a_few_cars_is_a_pipeline_of_its_own() -> None:
    runs = cars()
    whole = Truth(*(np.stack(column).reshape(*SHAPE, *column[0].shape) for column in zip(*runs, strict=True)))
    batch, ones = EstimationPipeline(CAR, TIME, SHAPE), [EstimationPipeline(CAR, TIME) for _ in runs]
    assert isinstance(batch.motion, CarByCar)
    last: list[PipelineStep] = []
    for k in range(N):
        if k == HALF:
            saved = {name: array.copy() for name, array in batch.save().items()}
            batch = EstimationPipeline(CAR, TIME, SHAPE)
            batch.restore(saved)
            batch.reset(np.array([[False, True], [False, False]]), vx=12.0)
            ones[1].reset(vx=12.0)
        together = batch.step(signals(whole, k))
        last = [one.step(signals(run, k, i)) for i, (one, run) in enumerate(zip(ones, runs, strict=True))]
        if k % 5 < 2:
            assert all(compare(together, one, place) > 60 for one, place in zip(last, PLACES, strict=True))
        assert bool(together.flags[0, 1] & Flag.RESET) == (k == HALF)
    assert together.velocity.standing.tolist() == [[False, False], [True, False]]
    for place, one in zip(PLACES, ones, strict=True):
        mine, own = batch.save(), one.save()
        assert mine.keys() == own.keys()
        for name in batch.motion.save():
            np.testing.assert_allclose(mine[name][place], own[name], rtol=1e-9, atol=1e-9, err_msg=name)
    with pytest.raises(AssertionError):  # the answers of two cars in each other's place
        compare(together, last[0], PLACES[3])


def test_more_cars_and_other_parts_run_on_arrays() -> None:
    many = EstimationPipeline(CAR, TIME, (FEW + 1,)), EstimationPipeline(CAR, TIME, (2,), unsigned_wheels=True)
    assert not any(isinstance(pipeline.motion, CarByCar) for pipeline in many)
