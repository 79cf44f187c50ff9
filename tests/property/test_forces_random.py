"""Whatever comes in, what goes out is finite, and flagged where it should be."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from estimators.arrays import FloatArray
from estimators.faults import Flag
from estimators.forces import (
    AttitudeObserver,
    LateralForceEstimator,
    PidForceObserver,
    UnknownInputForceObserver,
    VerticalLoads,
    WheelForceFilter,
    planar_outputs,
    reconcile,
    vertical_loads,
)
from estimators.signals import FilteredDerivative, TickSpeed
from estimators.vehicle import VehicleParameters

TIME = 0.005
CAR = replace(VehicleParameters.published_suv(), rolling_resistance=0.012)
BAD = st.sampled_from([math.nan, math.inf, -math.inf, 1e150, -1e300])
ANY = st.floats(-500, 500, width=32) | BAD | st.just(0.0)


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, (12, 3, 4), elements=ANY))
def test_wheel_forces_are_finite_whatever_comes_in(signals: FloatArray) -> None:
    speed, torque, load = signals[:, 0], 10 * signals[:, 1], 20 * signals[:, 2]
    slope = FilteredDerivative(TIME, 0.005)
    runners = UnknownInputForceObserver(CAR, TIME), WheelForceFilter(CAR, TIME)
    pid = PidForceObserver(CAR, TIME)
    for k in range(12):
        seen = slope.step(speed[k])
        assert np.isfinite(seen.derivative).all()
        steps = [runner.step(speed[k], torque[k], load[k]) for runner in runners]
        steps.append(pid.step(speed[k], seen.derivative, torque[k], load[k]))
        for step in steps:
            assert np.isfinite(step.force).all()
            assert np.isfinite(step.deviation).all()
            assert (np.abs(step.force) < 1e9).all()
            lost = ~(np.abs(speed[k]) <= 1e100)
            np.testing.assert_array_equal((step.flags & Flag.MISSING_MEASUREMENT) > 0, lost)
            lost = ~(np.abs(torque[k]) <= 1e100) | ~(np.abs(load[k]) <= 1e100)
            np.testing.assert_array_equal((step.flags & Flag.MISSING_INPUT) > 0, lost)
            assert not (step.used & ~(np.abs(torque[k]) <= 1e100)).any()


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, (10, 14), elements=ANY))
def test_lateral_forces_loads_and_attitude_are_finite_whatever_comes_in(signals: FloatArray) -> None:
    lateral = [LateralForceEstimator(CAR, TIME, method=m) for m in ("unscented", "linear")]  # type: ignore[arg-type]
    loads, attitude = VerticalLoads(CAR, TIME), AttitudeObserver(TIME)
    for row in signals:
        found = loads.step(row[0], row[1], row[2], row[3], row[4])
        assert np.isfinite(found.load).all()
        assert (found.load >= 0.0).all()
        for runner in lateral:
            step = runner.step(row[0], row[1], row[5], row[6], 10 * row[7:11], np.abs(10 * row[10:14]))
            assert np.isfinite(step.corner_force).all()
            assert np.isfinite(step.deviation).all()
        seen = attitude.step(*row[:6], yaw_rate=row[6], grade=row[7], bank=row[8])
        assert np.isfinite([seen.roll, seen.pitch]).all()
        assert abs(seen.total_roll) <= math.radians(60.001)


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, (30,), elements=st.integers(0, 4000) | st.just(math.nan)))
def test_tick_speeds_are_finite(counts: FloatArray) -> None:
    counter = TickSpeed(48, TIME, (), longest_window=7)
    for count in counts:
        assert np.isfinite(counter.step(count).speed)


def small(low: float, high: float, shape: tuple[int, ...]) -> Any:
    return arrays(np.float64, shape, elements=st.floats(low, high))


@settings(max_examples=80, deadline=None)
@given(small(-15, 15, (2,)), st.floats(4, 16), small(-0.3, 0.3, (2,)))
def test_loads_sum_to_what_holds_the_car_up(a: FloatArray, up: float, tilt: FloatArray) -> None:
    raw = vertical_loads(CAR, a[0], a[1], up, tilt[0], tilt[1])
    total = CAR.mass * ((up * np.cos(tilt[0]) + a[0] * np.sin(tilt[0])) * np.cos(tilt[1]) + a[1] * np.sin(tilt[1]))
    np.testing.assert_allclose(raw.sum(), total, rtol=1e-9, atol=1e-6)
    found = VerticalLoads(CAR, TIME, dynamic=False).step(a[0], a[1], up, tilt[0], tilt[1])
    np.testing.assert_allclose(found.load.sum(), max(total, 0.0), rtol=1e-9, atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.05, 0.5), st.sampled_from([-1.0, 1.0]), small(-4000, 4000, (8,)))
def test_planar_forces_come_back_from_the_motion_they_make(angle: float, side: float, forces: FloatArray) -> None:
    """Start from the answer: any forces, their accelerations, and the filter finds the axles again."""
    fx, fy, steer = forces[:4], forces[4:], np.array(side * angle)
    y = planar_outputs(CAR, steer, fx, fy)
    runner = LateralForceEstimator(CAR, TIME, method="linear", split_deviation=1e6)
    for _ in range(150):
        found = runner.step(y[0], y[1], y[2], steer, fx)
    np.testing.assert_allclose(found.axle_force, [fy[0] + fy[1], fy[2] + fy[3]], atol=60.0)


@settings(max_examples=60, deadline=None)
@given(small(-5000, 5000, (4,)), small(10, 900, (4,)), st.floats(-2e4, 2e4), st.floats(1, 1e3))
def test_reconciled_forces_never_disagree_more_than_before(
    force: FloatArray, spread: FloatArray, total: float, s: float
) -> None:
    found = reconcile(force, spread, total, s, CAR.static_loads, np.zeros(4, dtype=bool))
    assert abs(found.force.sum() - total) <= abs(force.sum() - total) * (1 + 1e-9) + 1e-9
    assert (found.deviation <= spread * (1 + 1e-12)).all()
