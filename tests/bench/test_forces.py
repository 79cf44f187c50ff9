"""Cost of one sample of one car: each force, load and attitude estimator, their chain, and the corner observers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from estimators import GainSchedule, LpvVelocityObserver
from estimators.forces import (
    AttitudeObserver,
    LateralForceEstimator,
    UnknownInputForceObserver,
    VerticalLoads,
    WheelForceFilter,
    reconcile,
)
from estimators.pipeline import CornerObservers, DifferentiatedPid
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, LtvKalmanObserver, SlipWeights, SwitchedVelocityObserver
from tests.support.schedule_content import schedule_content

CAR, TIME, COUNT = VehicleParameters.published_suv(), 0.005, 64
DRAW = np.random.default_rng(0)
SPEED, TORQUE = 60.0 + 0.05 * DRAW.normal(size=(COUNT, 4)), 50.0 + DRAW.normal(size=(COUNT, 4))
FORCE, LOAD = 100.0 + DRAW.normal(size=(COUNT, 4)), CAR.static_loads + 10.0 * DRAW.normal(size=(COUNT, 4))
BODY, STEER = 0.05 * DRAW.normal(size=(COUNT, 4)), 0.002 * DRAW.normal(size=COUNT)  # a_x, a_y, r, dr/dt
Step = Callable[[int], Any]


def wheel_forces(kind: str) -> Any:
    makers: dict[str, Callable[[], Any]] = {
        "unknown input": lambda: UnknownInputForceObserver(CAR, TIME),
        "pid": lambda: DifferentiatedPid(CAR, TIME),
        "unscented": lambda: WheelForceFilter(CAR, TIME),
        "linear": lambda: WheelForceFilter(CAR, TIME, method="linear"),
    }
    return makers[kind]()


def schedule(direction: str = "longitudinal") -> GainSchedule:
    return GainSchedule.from_content(schedule_content(direction), direction)


def part(name: str) -> Step:
    kind = name.partition(": ")[2]
    loads, attitude = VerticalLoads(CAR, TIME), AttitudeObserver(TIME)
    if name == "loads":
        return lambda k: loads.step(BODY[k, 0], BODY[k, 1], None, BODY[k, 2], BODY[k, 3])
    if name == "attitude":
        return lambda k: attitude.step(*BODY[k, 2:], *BODY[k, :2], *BODY[k, :2], BODY[k, 2])
    if name.startswith("wheel forces"):
        wheels = wheel_forces(kind)
        return lambda k: wheels.step(SPEED[k], TORQUE[k], LOAD[k])
    method: Any = kind
    lateral = LateralForceEstimator(CAR, TIME, method=method)
    return lambda k: lateral.step(BODY[k, 0], BODY[k, 1], BODY[k, 3], STEER[k], FORCE[k], LOAD[k])


def chain(kind: str) -> Step:
    """Attitude, loads, wheel forces made to agree with m a_x, lateral forces: as the pipeline runs them."""
    loads, attitude, wheels = VerticalLoads(CAR, TIME), AttitudeObserver(TIME), wheel_forces(kind)
    lateral = LateralForceEstimator(CAR, TIME, method="linear")

    def step(k: int) -> Any:
        ax, ay, turn, swing = BODY[k]
        tilt = attitude.step(turn, turn, ax, ay, ax, ay, turn)
        up = loads.step(ax, ay, None, tilt.pitch, tilt.roll).load
        found = wheels.step(SPEED[k], TORQUE[k], up)
        agreed = reconcile(found.force, found.deviation, CAR.mass * ax, 300.0, up, found.unknown)
        return lateral.step(ax, ay, swing, STEER[k], agreed.force, up)

    return step


def first_paper(kind: str) -> Step:
    """Every estimator of P1 for one sample: forces of three directions, corner observers, the centre of gravity."""
    method: Any = kind
    loads, wheels, lateral = (
        VerticalLoads(CAR, TIME),
        wheel_forces("pid"),
        LateralForceEstimator(CAR, TIME, method=method),
    )
    corners = CornerObservers(CAR, schedule(), schedule("lateral"), weights=SlipWeights())

    def step(k: int) -> Any:
        ax, ay, turn, swing = BODY[k]
        up = loads.step(ax, ay).load
        force = wheels.step(SPEED[k], TORQUE[k], up).force
        side = lateral.step(ax, ay, swing, STEER[k], force, up).corner_force
        return corners.step(SPEED[k], (STEER[k], STEER[k], 0.0, 0.0), ax, ay, turn, force / up, side / up)

    return step


def corner(name: str) -> Step:
    use, push = FORCE / LOAD, 1e-3 * FORCE
    if name.startswith("scheduled"):
        observer = LpvVelocityObserver(schedule())
        if "missing" in name:
            use[:, 2] = np.nan
        return lambda k: observer.step(push[k], use[k], SPEED[k])
    if name == "switched":
        switched = SwitchedVelocityObserver(schedule())
        return lambda k: switched.step(push[k], use[k], SPEED[k], 0.01)
    states: Any = 2 if "two" in name else 3
    kalman = LtvKalmanObserver(BristleTire(), TIME, states=states)
    return lambda k: kalman.step(push[k], use[k], SPEED[k], 0.1 * push[k])


def measured(benchmark: Any, step: Step) -> Any:
    turn = iter(range(10**9))
    return benchmark(lambda: step(next(turn) % COUNT))


PARTS = [
    *("loads", "attitude", "lateral forces: linear", "lateral forces: unscented"),
    *(f"wheel forces: {kind}" for kind in ("unknown input", "pid", "linear", "unscented")),
]


@pytest.mark.parametrize("name", PARTS)
def test_part(benchmark: Any, name: str) -> None:
    assert not np.any(measured(benchmark, part(name)).flags)


@pytest.mark.parametrize("kind", ["unknown input", "pid", "linear"])
def test_chain(benchmark: Any, kind: str) -> None:
    assert np.isfinite(measured(benchmark, chain(kind)).axle_force).all()


@pytest.mark.parametrize("kind", ["linear", "unscented"])
def test_estimators_of_the_first_paper(benchmark: Any, kind: str) -> None:
    found = measured(benchmark, first_paper(kind))
    assert np.isfinite(found.vx) and np.isfinite(found.vy) and found.used.all()


@pytest.mark.parametrize(
    "name", ["scheduled", "scheduled, one measurement missing", "switched", "two-state Kalman", "three-state Kalman"]
)
def test_four_corners(benchmark: Any, name: str) -> None:
    assert np.isfinite(measured(benchmark, corner(name)).estimate).all()
