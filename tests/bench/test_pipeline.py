"""Cost of one step of the pipeline: of one car, and of several in a batch against a loop over them; reported, not asserted."""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np
import pytest

from estimators import GainSchedule
from estimators.forces import AttitudeObserver, LateralForceEstimator, VerticalLoads
from estimators.pipeline import (
    CornerObservers,
    CornerVelocity,
    DifferentiatedPid,
    EstimationPipeline,
    KalmanCorners,
    StiffnessSideslip,
    VehicleSignals,
)
from estimators.sideslip import SingleTrack
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, FusionSettings, SlipWeights, VelocityFusion
from tests.support.schedule_content import schedule_content

CAR, TIME = VehicleParameters.published_suv(), 0.005
SINGLE_TRACK = SingleTrack(2270.0, 4650.0, 1.42, 1.43, 1.8e5, 1.8e5)


def samples(batch: tuple[int, ...], count: int = 64) -> list[VehicleSignals]:
    rng = np.random.default_rng(0)

    def noise(size: float, *tail: int) -> Any:
        return size * rng.normal(size=(*batch, *tail))

    return [
        VehicleSignals(
            60.0 + noise(0.05, 4),
            noise(0.05),
            noise(0.05),
            noise(0.002),
            noise(0.002, 4),
            50.0 + noise(1.0, 4),
            roll_rate=noise(0.002),
            pitch_rate=noise(0.002),
        )
        for _ in range(count)
    ]


COMPOSITIONS = (
    *("default", "unsigned wheels", "attitude", "own fusion", "own loads", "own lateral forces", "own wheel forces"),
    *("default and corner observers", "default and sideslip", "P1", "P2"),
)


def chain(name: str, shape: tuple[int, ...] = ()) -> EstimationPipeline:
    """The default; with one part of the user's; with observers beside it; the chains of two papers, with their own velocities."""
    along, across = (GainSchedule.from_content(schedule_content(n), n) for n in ("longitudinal", "lateral"))
    four, parts = (*shape, 4), dict[str, Any]()
    if name in ("attitude", "P2"):
        parts["attitude"] = AttitudeObserver(TIME, shape)
    if name in ("own wheel forces", "P1"):
        parts["longitudinal_force"] = DifferentiatedPid(CAR, TIME, four)
    if name == "own fusion":
        parts["velocity"] = VelocityFusion(CAR, TIME, shape, FusionSettings(dead_speed=0.4))
    elif name == "own loads":
        parts["loads"] = VerticalLoads(CAR, TIME, shape, dynamic=False)
    elif name == "own lateral forces":
        parts["lateral_force"] = LateralForceEstimator(CAR, TIME, shape, "linear")
    elif name == "default and corner observers":
        parts["corner_observers"] = CornerObservers(CAR, along, across, shape)
    elif name == "default and sideslip":
        parts["sideslip"] = StiffnessSideslip(SINGLE_TRACK, TIME, shape)
    elif name == "P1":
        parts["velocity"] = CornerVelocity(CornerObservers(CAR, along, across, shape, weights=SlipWeights()))
    elif name == "P2":
        corners = KalmanCorners(BristleTire(), TIME, four)
        parts["velocity"] = CornerVelocity(CornerObservers(CAR, corners, across, shape))
    return EstimationPipeline(CAR, TIME, shape, unsigned_wheels=name == "unsigned wheels", **parts)


@pytest.mark.parametrize("name", ["default", "P1", "P2", "default and corner observers"])
def test_one_step_for_four_corners(benchmark: Any, name: str) -> None:
    pipeline = chain(name)
    given = samples(())
    turn = iter(range(10**9))
    step = benchmark(lambda: pipeline.step(given[next(turn) % len(given)]))
    assert np.isfinite(step.vx)


def test_a_thousand_cars(benchmark: Any) -> None:
    pipeline, given = chain("default", (1000,)), samples((1000,), 4)
    turn = iter(range(10**9))
    step = benchmark(lambda: pipeline.step(given[next(turn) % len(given)]))
    assert np.isfinite(step.vx).all()


@pytest.mark.parametrize("name", COMPOSITIONS)
@pytest.mark.parametrize("cars", [2, 3, 4, 8])
def test_several_cars_against_a_loop(benchmark: Any, name: str, cars: int) -> None:
    """Both by turns in one run; `extra_info` has the median of the ratios of processor time: see the changelog."""
    if benchmark.disabled and (name, cars) != ("default", 2):
        pytest.skip("runs when benchmarks are enabled")
    batch, ones = chain(name, (cars,)), [chain(name) for _ in range(cars)]
    together, apart = samples((cars,), 8), samples((), 8)
    ratios: list[float] = []

    def paired() -> None:
        start = time.process_time()
        steps = [batch.step(signals) for signals in together]
        middle = time.process_time()
        for signals in apart:
            for one in ones:
                one.step(signals)
        ratios.append((middle - start) / (time.process_time() - middle))
        assert np.isfinite(steps[-1].vx).all()

    benchmark.pedantic(paired, rounds=40, warmup_rounds=4)
    benchmark.extra_info["of a loop"] = round(statistics.median(ratios[4:] or ratios), 3)
