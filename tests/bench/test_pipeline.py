"""Cost of one step of the pipeline: the default composition, with corner observers, and a batch; reported, not asserted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators import GainSchedule
from estimators.forces import AttitudeObserver
from estimators.pipeline import (
    CornerObservers,
    CornerVelocity,
    DifferentiatedPid,
    EstimationPipeline,
    KalmanCorners,
    VehicleSignals,
)
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, SlipWeights
from tests.support.schedule_content import schedule_content

CAR, TIME = VehicleParameters.published_suv(), 0.005


def samples(batch: tuple[int, ...], count: int = 64) -> list[VehicleSignals]:
    rng = np.random.default_rng(0)

    def noise(size: float, *tail: int) -> Any:
        return size * rng.normal(size=(*batch, *tail))

    return [
        VehicleSignals(
            60.0 + noise(0.05, 4), noise(0.05), noise(0.05), noise(0.002), noise(0.002, 4), 50.0 + noise(1.0, 4)
        )
        for _ in range(count)
    ]


def chain(name: str) -> EstimationPipeline:
    """The default; the same with corner observers beside it; and the chains of two papers, with their own velocities."""
    along, across = (GainSchedule.from_content(schedule_content(n), n) for n in ("longitudinal", "lateral"))
    if name == "default":
        return EstimationPipeline(CAR, TIME)
    if name == "default and corner observers":
        return EstimationPipeline(CAR, TIME, corner_observers=CornerObservers(CAR, along, across))
    if name == "P1":
        corners = CornerObservers(CAR, along, across, weights=SlipWeights())
        return EstimationPipeline(
            CAR, TIME, longitudinal_force=DifferentiatedPid(CAR, TIME), velocity=CornerVelocity(corners)
        )
    corners = CornerObservers(CAR, KalmanCorners(BristleTire(), TIME), across)
    return EstimationPipeline(CAR, TIME, attitude=AttitudeObserver(TIME), velocity=CornerVelocity(corners))


@pytest.mark.parametrize("name", ["default", "P1", "P2", "default and corner observers"])
def test_one_step_for_four_corners(benchmark: Any, name: str) -> None:
    pipeline = chain(name)
    given = samples(())
    turn = iter(range(10**9))
    step = benchmark(lambda: pipeline.step(given[next(turn) % len(given)]))
    assert np.isfinite(step.vx)


@pytest.mark.parametrize("cars", [2, 3, 4, 8, 1000])
def test_several_cars(benchmark: Any, cars: int) -> None:
    """Never more than the loop below: 0.98, 0.88, 0.84 and 0.5 times as much for two, three, four and eight cars."""
    pipeline = EstimationPipeline(CAR, TIME, (cars,))
    given = samples((cars,), 4)
    turn = iter(range(10**9))
    step = benchmark(lambda: pipeline.step(given[next(turn) % len(given)]))
    assert np.isfinite(step.vx).all()


@pytest.mark.parametrize("cars", [2, 3, 4, 8])
def test_a_loop_over_single_cars(benchmark: Any, cars: int) -> None:
    pipelines = [EstimationPipeline(CAR, TIME) for _ in range(cars)]
    given = samples((), 4)
    turn = iter(range(10**9))

    def loop() -> list[Any]:
        signals = given[next(turn) % len(given)]
        return [pipeline.step(signals) for pipeline in pipelines]

    assert all(np.isfinite(step.vx) for step in benchmark(loop))
