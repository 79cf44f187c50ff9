"""Longitudinal force of a wheel: three observers against the closed forms of what they are, and against lost signals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter

from estimators.arrays import FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.filters import KalmanFilter
from estimators.forces import PidForceObserver, UnknownInputForceObserver, WheelForceFilter
from estimators.forces.wheel import WheelForceStep
from estimators.signals import FilteredDerivative, Freshness
from estimators.vehicle import VehicleParameters

TIME = 0.005
CAR = VehicleParameters.published_suv()
ROLLING = replace(CAR, rolling_resistance=0.012, effective_radius=(0.33, 0.34))
Step = Callable[..., WheelForceStep]


def stepper(kind: str, car: VehicleParameters = CAR, shape: tuple[int, ...] = (4,), **options: Any) -> tuple[Any, Step]:
    """The observer, and a step that takes (speed, torque, load) whatever it needs."""
    if kind == "pid":
        pid, slope = PidForceObserver(car, TIME, shape, **options), FilteredDerivative(TIME, 0.0, shape)

        def step(speed: Any, torque: Any, load: Any = None, fresh: Any = None) -> WheelForceStep:
            return pid.step(speed, slope.step(speed).derivative, torque, load, fresh=fresh)

        return pid, step
    make: Any = UnknownInputForceObserver if kind == "uio" else WheelForceFilter
    named = {} if kind == "uio" else {"method": {"ukf": "unscented", "kf": "linear"}[kind]}
    runner = make(car, TIME, shape, **named, **options)
    return runner, runner.step


KINDS = ["uio", "pid", "ukf", "kf"]


def rolled(
    force: FloatArray, torque: FloatArray, car: VehicleParameters, load: FloatArray, start: float = 40.0
) -> FloatArray:
    """Wheel speeds (n, 4) under forces and torques (n, 4) held over each interval; the first torque acts before row 0."""
    push = torque[1:] - car.radius * (force[1:] + car.rolling_resistance * load)
    return start + np.concatenate((np.zeros((1, 4)), np.cumsum(push / car.wheel_inertia * TIME, axis=0)))


def test_unknown_input_observer_is_a_first_order_lag_of_the_force() -> None:
    rng = np.random.default_rng(1)
    force = np.cumsum(rng.normal(0, 60, size=(400, 4)), axis=0)
    load = CAR.static_loads
    torque = force * 0.3 + rng.normal(0, 10, size=(400, 4))
    speed = rolled(force, torque, ROLLING, load)
    lag = 0.02
    _, step = stepper("uio", ROLLING, lag=lag)
    found = np.array([step(speed[k], torque[k], load).force for k in range(400)])
    keep = math.exp(-TIME / lag)
    expected = lfilter([1 - keep], [1, -keep], force[1:], axis=0)
    np.testing.assert_allclose(found[1:], expected, rtol=1e-8, atol=1e-6)


def test_unknown_input_observer_follows_its_differential_equation() -> None:
    """The independent check: what itself, integrated as (1), (2) of P2 with a gain K_p, by matrix exponential."""
    lag, nominal = 0.03, 500.0
    inertia, radius = CAR.wheel_inertia, 0.33
    gain = inertia / lag
    torque, acceleration = 300.0, -25.0
    runner = UnknownInputForceObserver(CAR, TIME, lag=lag, nominal_force=nominal)
    A = np.array([[-gain / inertia, gain / inertia, 1.0], [0.0, 0.0, acceleration], [0.0, 0.0, 0.0]])
    A[0, 2] = (torque - radius * nominal) / inertia
    state = np.array([40.0, 40.0, 1.0])  # what, w, 1
    runner.step(40.0, torque)
    move = expm(A * TIME)
    for _ in range(50):
        state = move @ state
        found = runner.step(state[1], torque)
        np.testing.assert_allclose(found.force, nominal - gain * (state[1] - state[0]) / radius, rtol=1e-9)
        np.testing.assert_allclose(runner.speed_error, state[1] - state[0], rtol=1e-7, atol=1e-9)


def test_pid_observer_is_the_filter_of_the_note() -> None:
    rng = np.random.default_rng(2)
    n, torque = 300, 50.0
    speed = 60.0 + np.cumsum(rng.normal(0, 0.05, size=(n, 4)), axis=0)
    acceleration = np.diff(speed, axis=0, prepend=speed[:1]) / TIME
    m = (torque - CAR.wheel_inertia * acceleration) / 0.33
    runner = PidForceObserver(CAR, TIME)
    found = np.array([runner.step(speed[k], acceleration[k], torque).force for k in range(n)])
    a = 50.6 * TIME
    state = (m[:1] * -(a)).repeat(1, axis=0)  # the filter starts settled at m_0
    expected, _ = lfilter([1 + a, -1], [1, -(1 - a)], m, axis=0, zi=state)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_speed_error_of_the_pid_observer_obeys_its_matrix() -> None:
    """dw/dt that is wrong by a constant b: e_w settles at zero through int e_w, along K of P1 (7)."""
    b, inertia, (eta1, eta2, _) = 2.0, CAR.wheel_inertia, (1.8, 11.4, 50.6)
    runner = PidForceObserver(CAR, TIME)
    K = np.array([[0.0, 1.0], [-eta2 / inertia, -0.33 * eta1 / inertia]])
    move = expm(K * TIME)
    state = np.zeros(2)
    for k in range(300):
        found = runner.step(50.0, b, 0.0)
        if k:
            state[1] -= b * TIME
        measured = -inertia * b / 0.33
        np.testing.assert_allclose(found.force - measured - 50.6 * runner.integral, -eta1 * state[1], atol=1e-9)
        state = move @ state


@pytest.mark.parametrize("slope", [100.0, -3000.0])
def test_a_ramp_is_led_by_the_pid_and_followed_by_the_others(slope: float) -> None:
    n = 400
    force = np.repeat((slope * TIME * np.arange(n))[:, None], 4, axis=1)
    speed = rolled(force, force * 0.33, CAR, CAR.static_loads)  # the wheel turns evenly: torque balances the force
    late = {}
    for kind in KINDS:
        runner, step = stepper(kind)
        for k in range(n):
            found = step(speed[k], force[k] * 0.33).force
        late[kind] = (force[-1] - found) / slope / TIME
    keep = math.exp(-TIME / 0.0025)
    np.testing.assert_allclose(late["uio"], keep / (1 - keep), rtol=1e-6)
    np.testing.assert_allclose(late["pid"], -1.0, rtol=1e-6)
    noise = (CAR.wheel_inertia / (0.33 * TIME)) ** 2 * runner.measurement_variance
    gain = WheelForceFilter.steady_gain(runner.process_variance, noise)
    for kind in ("ukf", "kf"):
        np.testing.assert_allclose(late[kind], (1 - gain) / gain, rtol=1e-6)


@pytest.mark.parametrize("method", ["unscented", "linear"])
def test_wheel_filter_is_a_scalar_kalman_filter(method: Any) -> None:
    rng = np.random.default_rng(3)
    n, shape = 200, (3, 4)
    speed = 30.0 + np.cumsum(rng.normal(0, 0.2, size=(n, *shape)), axis=0)
    torque = rng.normal(0, 300, size=(n, *shape))
    runner = WheelForceFilter(CAR, TIME, shape, bearing_friction=0.05, method=method)
    H = np.array([[-0.33 * TIME / CAR.wheel_inertia]])
    twin = KalmanFilter(np.zeros((*shape, 1)), np.broadcast_to(CAR.static_loads**2, shape)[..., None, None])
    for k in range(n):
        found = runner.step(speed[k], torque[k])
        if k == 0:
            runner.filter.reset(covariance=np.eye(1) * 1e4)
            twin.reset(covariance=np.eye(1) * 1e4)
            continue
        twin.predict(np.eye(1), np.eye(1) * runner.process_variance)
        offset = speed[k - 1] + TIME / CAR.wheel_inertia * (torque[k] - 0.05 * speed[k - 1])
        same = twin.correct(speed[k][..., None], H, np.eye(1) * runner.measurement_variance, offset[..., None])
        np.testing.assert_allclose(found.force, same.state[..., 0], rtol=1e-9, atol=1e-7)
        np.testing.assert_allclose(runner.filter.covariance, same.covariance, rtol=1e-9)
        np.testing.assert_allclose(found.innovation, same.innovation[..., 0], atol=1e-10)
    gain = WheelForceFilter.steady_gain(runner.process_variance, runner.measurement_variance / float(H[0, 0]) ** 2)
    np.testing.assert_allclose(same.gain * H, gain, rtol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rolling_resistance_and_reverse(kind: str, sign: float) -> None:
    """A car rolling freely in either direction: the wheel is slowed by resistance alone, forces fight it."""
    load = np.array([5000.0, 6000.0, 5500.0, 4500.0])
    _, step = stepper(kind, ROLLING)
    resistance = 0.012 * load * sign
    for _ in range(200):
        found = step(np.full(4, sign * 40.0), ROLLING.radius * 100.0 * sign, load)
    np.testing.assert_allclose(found.force, sign * 100.0 - resistance, rtol=1e-6)
    assert found.used.all()
    assert not found.flags.any()


@pytest.mark.parametrize("kind", KINDS)
def test_a_stopped_wheel_is_marked_and_its_force_fades(kind: str) -> None:
    """The brake locks the front left wheel: its torque no longer says what the road does."""
    _, step = stepper(kind)
    speed = np.full(4, 40.0)
    for _ in range(50):
        found = step(speed, -330.0)
    np.testing.assert_allclose(found.force, -1000.0, rtol=1e-5)
    speed[0] = 0.2
    for k in range(40):
        found = step(speed, -3300.0 if k else -330.0)
        assert found.stopped.tolist() == [True, False, False, False]
        assert found.unknown.tolist() == [True, False, False, False]
        assert not found.used[0]
        assert np.isfinite(found.force).all()
        assert np.isnan(found.innovation[0])
    assert found.force[0] == pytest.approx(-1000.0 * math.exp(-40 * TIME / 0.2), rel=1e-4)
    assert found.deviation[0] > 2000.0  # friction can be anything up to the load
    assert (found.deviation[1:] < 500.0).all()
    speed[0] = 40.0
    found = step(speed, -330.0)
    assert found.stopped[0]  # the interval behind the stop still contains it
    for _ in range(60):
        found = step(speed, -330.0)
    assert not found.stopped.any()
    np.testing.assert_allclose(found.force, -1000.0, rtol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_start_from_rest(kind: str) -> None:
    _, step = stepper(kind)
    for _ in range(100):
        found = step(np.zeros(4), 0.0)
        np.testing.assert_array_equal(found.force, 0.0)
        assert found.stopped.all()
    speed = 0.0
    for _ in range(200):  # 1000 N at each corner, spinning up at 10 rad/s^2
        speed += 10.0 * TIME
        found = step(np.full(4, speed), 330.0 + CAR.wheel_inertia * 10.0)
    np.testing.assert_allclose(found.force, 1000.0, rtol=1e-4)
    assert not found.stopped.any()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
def test_lost_signals_are_flagged_held_and_survived(kind: str, bad: float) -> None:
    runner, step = stepper(kind, ROLLING)
    load = CAR.static_loads
    for _ in range(50):
        found = step(np.full(4, 40.0), 330.0, load)
    before = found.force
    speed, torque, weight = np.full(4, 40.0), np.full(4, 330.0), load.copy()
    speed[0] = torque[1] = weight[2] = bad
    for _ in range(400):
        found = step(speed, torque, weight)
        assert np.isfinite(found.force).all()
        assert np.isfinite(found.deviation).all()
    assert Flag(int(found.flags[0])) & Flag.MISSING_MEASUREMENT
    assert found.flags[1:].tolist() == [Flag.MISSING_INPUT, Flag.MISSING_INPUT, 0]
    assert not found.used[1]
    assert found.used[2:].all()
    np.testing.assert_allclose(found.force[2:], before[2:], rtol=1e-9)
    assert abs(found.force[1]) < 1.0  # two seconds without torque: nothing is known
    for _ in range(100):
        found = step(np.full(4, 40.0), 330.0, load)
    np.testing.assert_allclose(found.force, before, rtol=1e-5)
    assert not found.flags.any()
    assert runner.batch_shape == (4,)


@pytest.mark.parametrize("kind", ["uio", "ukf", "kf"])
def test_a_missing_speed_is_bridged_by_the_mean_over_the_gap(kind: str) -> None:
    """The wheel equation holds over a gap too: constant force, any torque, four speeds lost."""
    rng = np.random.default_rng(5)
    n = 120
    force = np.full((n, 4), 700.0)
    torque = rng.normal(200, 40, size=(n, 4))
    speed = rolled(force, torque, CAR, CAR.static_loads)
    _, step = stepper(kind)
    for k in range(n):
        found = step(speed[k] if k not in range(80, 84) else np.full(4, np.nan), torque[k])
        if k >= 40:
            np.testing.assert_allclose(found.force, 700.0, rtol=1e-6)
        assert found.used.all() == (k > 0 and k not in range(80, 84))


def test_a_slow_device_read_fast_does_not_make_the_filter_overconfident() -> None:
    """50 Hz wheel speeds at 200 Hz: with repetitions told apart, the reported deviation is that of a 50 Hz filter."""
    rng = np.random.default_rng(6)
    runs, n, noise = 300, 400, 0.05
    force, speed = np.zeros((runs, 4)), np.full((runs, 4), 200.0)
    told, blind = (WheelForceFilter(CAR, TIME, (runs, 4), force_rate=1000.0) for _ in range(2))
    judge = Freshness((runs, 4), hold=4)
    for k in range(n):
        force = force + rng.normal(0, 1000.0 * math.sqrt(TIME), size=force.shape)
        speed = speed - TIME / CAR.wheel_inertia * 0.33 * force
        if k % 4 == 0:
            reading = speed + noise * rng.normal(size=speed.shape)
        found = told.step(reading, 0.0, fresh=judge.step(reading).fresh)
        wrong = blind.step(reading, 0.0)
    told_nees = (found.force - force) ** 2 / told.filter.covariance[..., 0, 0]
    blind_nees = (wrong.force - force) ** 2 / blind.filter.covariance[..., 0, 0]
    # white noise of the speed is not white in its differences, so the filter is a little better than it says
    assert 0.3 < told_nees.mean() < 1.1
    assert blind_nees.mean() > 4.0
    assert told.filter.covariance.mean() > 2.0 * blind.filter.covariance.mean()


@pytest.mark.parametrize("kind", ["uio", "ukf", "kf"])
def test_batches_equal_single_corners_and_states_can_be_saved(kind: str) -> None:
    rng = np.random.default_rng(7)
    n, shape = 60, (3, 4)
    speed = 5.0 + np.cumsum(rng.normal(0, 1.0, size=(n, *shape)), axis=0)
    speed[rng.random(speed.shape) < 0.1] = np.nan
    torque = rng.normal(0, 300, size=(n, *shape))
    torque[rng.random(torque.shape) < 0.1] = np.nan
    many, step = stepper(kind, ROLLING, shape)
    singles = [stepper(kind, ROLLING) for _ in range(3)]
    other, other_step = stepper(kind, ROLLING, shape)
    for k in range(n):
        if k == 30:
            other.restore(many.save())
            many.reset(np.eye(3, 4, dtype=bool))
            for i, (single, _) in enumerate(singles):
                single.reset(np.arange(4) == i)
            other.reset(np.eye(3, 4, dtype=bool))
        found = step(speed[k], torque[k])
        for i, (_, one) in enumerate(singles):
            alone = one(speed[k, i], torque[k, i])
            for name in ("force", "deviation", "innovation", "used", "stopped", "unknown", "flags"):
                np.testing.assert_allclose(getattr(found, name)[i], getattr(alone, name), rtol=1e-9, atol=1e-9)
        if k >= 30:
            same = other_step(speed[k], torque[k])
            np.testing.assert_array_equal(found.force, same.force)
            np.testing.assert_array_equal(found.flags, same.flags)
            assert bool((found.flags[0, 0] & Flag.RESET) == Flag.RESET) == (k == 30)


def test_pid_saves_and_resets() -> None:
    first, second = PidForceObserver(CAR, TIME), PidForceObserver(CAR, TIME)
    for k in range(20):
        first.step(40.0 + 0.1 * k * k, 30.0 + k, 100.0)
    second.restore(first.save())
    np.testing.assert_array_equal(first.step(81.0, 50.0, 90.0).force, second.step(81.0, 50.0, 90.0).force)
    second.reset()
    found = second.step(81.0, 50.0, 90.0)
    np.testing.assert_allclose(found.force, (90.0 - CAR.wheel_inertia * 50.0) / 0.33)
    assert (found.flags == Flag.RESET).all()


def test_a_lost_acceleration_is_flagged() -> None:
    runner = PidForceObserver(CAR, TIME)
    for k in range(30):
        rate = np.array([0.0, np.nan if k > 10 else 0.0, 0.0, 0.0])
        found = runner.step(40.0, rate, 330.0)
    assert found.flags.tolist() == [0, Flag.MISSING_INPUT, 0, 0]
    assert found.used.tolist() == [True, False, True, True]
    assert 0 < found.force[1] < 990.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_spinning_wheel_on_ice_shows_the_force_of_the_ice(kind: str) -> None:
    """Split friction under full torque: 300 N on the left, 3500 N on the right; the left wheels take off."""
    force = np.array([300.0, 3500.0, 300.0, 3500.0])
    torque = 0.33 * 3500.0
    _, step = stepper(kind)
    speed = np.full(4, 10.0)
    for _ in range(40):
        speed = speed + TIME / CAR.wheel_inertia * (torque - 0.33 * force)
        found = step(speed, torque)
    assert speed[0] > 130.0
    np.testing.assert_allclose(found.force, force, rtol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_coarse_wheel_speeds_cost_no_more_than_their_step(kind: str) -> None:
    """Speeds in steps of q: m is off by at most I q/(R Ts), and none of the observers makes more than 1.6 of it."""
    q = 0.05
    t = TIME * np.arange(600)
    exact_speed = 60.0 + 5.0 * np.sin(3.0 * t)
    (_, exact), (_, coarse) = stepper(kind), stepper(kind)
    off = []
    for w in exact_speed:
        found = exact(np.full(4, w), 300.0).force - coarse(np.full(4, q * np.round(w / q)), 300.0).force
        off.append(np.abs(found).max())
    assert 0.0 < max(off[1:]) <= 1.6 * CAR.wheel_inertia * q / (0.33 * TIME)


def test_bad_settings_are_refused() -> None:
    with pytest.raises(EstimatorError, match=r"eta_3 = 400 1/s times sample_time = 0.005 s is not below 2"):
        PidForceObserver(CAR, TIME, gains=(1.8, 11.4, 400.0))
    with pytest.raises(EstimatorError, match="eta_1 = 0 N s must be finite and above 0"):
        PidForceObserver(CAR, TIME, gains=(0.0, 11.4, 50.6))
    with pytest.raises(EstimatorError, match="must end with the four corners"):
        UnknownInputForceObserver(CAR, TIME, (3,))
    with pytest.raises(EstimatorError, match="lag = -1 s must be finite and at least 0 s"):
        UnknownInputForceObserver(CAR, TIME, lag=-1.0)
    with pytest.raises(EstimatorError, match=r"force_rate = 0 N/sqrt\(s\)"):
        WheelForceFilter(CAR, TIME, force_rate=0.0)
    with pytest.raises(EstimatorError, match="method = 'extended' is not known; use 'unscented' or 'linear'"):
        WheelForceFilter(CAR, TIME, method="extended")  # type: ignore[arg-type]
    with pytest.raises(EstimatorError, match="stopped_below = nan rad/s"):
        WheelForceFilter(CAR, TIME, stopped_below=math.nan)
    with pytest.raises(EstimatorError, match=r"torque has shape \(2,\), expected \(4,\)"):
        WheelForceFilter(CAR, TIME).step(np.zeros(4), np.zeros(2))
