"""Four-wheel observer: Jacobians, accuracy on an independent truth, zero steer, standstill, faults."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError, Flag
from estimators.filters import UnscentedKalmanFilter
from estimators.filters.affine import Affine
from estimators.filters.triangular import FEW
from estimators.sideslip import FourWheel, FourWheelModel, FourWheelObserver
from estimators.sideslip.four_wheel_model import AFFINE_FROM
from tests.support.sideslip_truth import CAR, PERIOD, double_track

KINDS = ["extended", "unscented"]


def states(draw: np.random.Generator, count: int) -> np.ndarray:
    scale = [0.4, 8, 0.1, 2000, 2000, 1500, 1500, 2000]
    return draw.normal(size=(count, 8)) * scale + [0, 20, 0, 0, 0, 0, 0, 0]


@pytest.mark.parametrize("resting", [False, True])
def test_jacobians_are_derivatives(resting: bool) -> None:
    draw = np.random.default_rng(1)
    x = states(draw, 100)
    x[:4, 1] = 0.5, -3.0, 60.0, 45.0  # below the floor, in reverse, relaxation limited
    rest = draw.random(100) < 0.2 if resting else None
    loads = np.absolute(draw.normal(3500, 1500, (100, 4)))
    model = FourWheelModel.at(CAR, PERIOD, 0.1 * draw.normal(size=100), loads, 1.0, rest)
    scale = np.array([0.4, 8, 0.1, 2000, 2000, 1500, 1500, 2000])
    for function, jacobian in [
        (model.transition, model.transition_jacobian),
        (model.measurement, model.measurement_jacobian),
    ]:
        steps = 1e-5 * scale
        columns = [(function(x + e) - function(x - e)) / (2 * e.sum()) for e in np.diag(steps)]
        found = jacobian(x)
        rows = scale if found.shape[1] == 8 else np.array([0.4, 8.0, 1.0, 1.0])
        error = (found - np.stack(columns, axis=-1)) * scale / rows[:, None]
        assert np.absolute(error).max() < 2e-6


@pytest.mark.parametrize("at_rest", [False, True])
def test_the_forces_enter_as_the_filter_takes_for_granted(at_rest: bool) -> None:
    """Affine in the last five states with the first three held, and the measurement in all: f(x+d) + f(x-d) = 2 f(x)."""
    draw = np.random.default_rng(3)
    mean, move = states(draw, 30), draw.normal(size=(30, 8)) * [0.1, 1.0, 0.05, 900, 900, 900, 900, 900]
    stands = np.full(30, True) if at_rest else None
    model = FourWheelModel.at(CAR, PERIOD, np.full(30, 0.05), np.tile(CAR.static_loads, (30, 1)), 1.0, stands)
    linear = move * (np.arange(8) >= AFFINE_FROM)
    for function, slope, step in (
        (model.transition, model.transition_slope, linear),
        (model.measurement, model.measurement_slope, move),
    ):
        for sign in (1.0, -1.0):
            there = function(mean) + slope(mean, sign * step[None])[0]
            np.testing.assert_allclose(function(mean + sign * step), there, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(model.transition_of_points(mean), model.transition(mean))
    np.testing.assert_array_equal(model.measurement_of_points(mean), model.measurement(mean))
    if not at_rest:
        bent = model.transition(mean + move) + model.transition(mean - move) - 2 * model.transition(mean)
        assert np.abs(bent).max() > 1.0  # in the first three it is not


@pytest.mark.parametrize("runs", [3, FEW + 2])
def test_points_left_out_change_nothing(runs: int) -> None:
    draw = np.random.default_rng(4)
    root = draw.normal(size=(runs, 8, 8)) * [[0.01], [0.1], [0.01], [90], [90], [90], [90], [90]]
    mean, spread = states(draw, runs), root @ root.swapaxes(1, 2) + np.diag([1e-6, 1e-2, 1e-6, 1, 1, 1, 1, 1])
    model = FourWheelModel.at(CAR, PERIOD, np.full(runs, 0.05), np.tile(CAR.static_loads, (runs, 1)), 1.0)
    full, short = (UnscentedKalmanFilter(mean, spread) for _ in range(2))
    Q, R = np.diag([1e-5, 1e-4, 1e-7, 1e3, 1e3, 1e3, 1e3, 1e3]), np.diag([4e-6, 4e-2, 2.5e-3, 2.5e-3])
    for _ in range(5):
        full.predict(model.transition, Q)
        short.predict(model.transition_of_points, Q, Affine(AFFINE_FROM, model.transition_slope))
        y = model.measurement(full.state) + 0.1 * draw.normal(size=(runs, 4))
        y[0, 1] = np.nan
        a = full.correct(y, model.measurement, R)
        b = short.correct(y, model.measurement_of_points, R, affine=Affine(0, model.measurement_slope))
        for name in ("state", "innovation", "gain", "innovation_covariance"):
            np.testing.assert_allclose(getattr(b, name), getattr(a, name), rtol=1e-7, atol=1e-9, err_msg=name)
        scale = np.sqrt(np.einsum("bii->bi", a.covariance))
        np.testing.assert_allclose(
            b.covariance / scale[:, :, None] / scale[:, None],
            a.covariance / scale[:, :, None] / scale[:, None],
            atol=1e-9,
        )


def test_transition_is_the_printed_model() -> None:
    """(11) term by term, with the angles as printed."""
    x = np.array([0.3, 21.0, 0.04, 900.0, 1500.0, 700.0, 1100.0, 800.0])
    delta, fz = 0.07, np.array([3000.0, 5000.0, 2200.0, 4000.0])
    m, iz, l1, l2, e = CAR.mass, CAR.yaw_inertia, CAR.front_axle_distance, CAR.rear_axle_distance, CAR.track
    r, v, b, f11, f12, f21, f22, fx = x
    sd, cd = np.sin(delta), np.cos(delta)
    from tests.support.sideslip_truth import dugoff

    slips = [
        delta - np.arctan((v * b + l1 * r) / (v - e * r / 2)),
        delta - np.arctan((v * b + l1 * r) / (v + e * r / 2)),
        -np.arctan((v * b - l2 * r) / (v - e * r / 2)),
        -np.arctan((v * b - l2 * r) / (v + e * r / 2)),
    ]
    bars = [
        dugoff(c, a, CAR.friction * f)
        for c, a, f in zip([CAR.front_stiffness] * 2 + [CAR.rear_stiffness] * 2, slips, fz, strict=True)
    ]
    rates = [
        (l1 * (f11 * cd + f12 * cd + fx * sd) - l2 * (f21 + f22) + e / 2 * (f11 * sd - f12 * sd)) / iz,
        (fx * np.cos(b - delta) + (f11 + f12) * np.sin(b - delta) + (f21 + f22) * np.sin(b)) / m,
        (-fx * np.sin(b - delta) + (f11 + f12) * np.cos(b - delta) + (f21 + f22) * np.cos(b)) / (m * v) - r,
        *[v / CAR.front_relaxation * (bars[k] - x[3 + k]) for k in (0, 1)],
        *[v / CAR.rear_relaxation * (bars[k] - x[3 + k]) for k in (2, 3)],
        0.0,
    ]
    model = FourWheelModel.at(CAR, PERIOD, np.array(delta), fz, 1.0)
    np.testing.assert_allclose(model.transition(x), x + PERIOD * np.array(rates), rtol=1e-12)
    expected = [r, v, (-(f11 + f12) * sd + fx * cd) / m, ((f11 + f12) * cd + f21 + f22 + fx * sd) / m]
    np.testing.assert_allclose(model.measurement(x), expected, rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_follows_an_independent_double_track(kind: Any) -> None:
    """Slalom up to 0.6 g with sensor noise: sideslip within 6 % and forces within 8 % of their peaks (mean error)."""
    truth = double_track(lambda t: 0.05 * np.sin(1.8 * t) * min(1.0, t), 20.0, 8.0, drive=150.0)
    assert 5.0 < np.absolute(truth["ay"]).max() < 8.0
    draw = np.random.default_rng(3)
    clean = np.stack([truth[name] for name in ("yaw_rate", "speed", "ax", "ay")], axis=-1)
    runs = 10
    y = clean[:, None] + draw.normal(size=(len(clean), runs, 4)) * [0.002, 0.1, 0.05, 0.05]
    observer = FourWheelObserver(CAR, kind, (runs,))
    observer.reset(state=[0, 20, 0, 0, 0, 0, 0, 0])
    found = [
        observer.step(np.full(runs, d), np.tile(z, (runs, 1)), v)
        for d, z, v in zip(truth["steering"], truth["loads"], y, strict=True)
    ]
    sideslip = np.stack([step.sideslip for step in found])
    error = np.absolute(sideslip - truth["sideslip"][:, None])[100:].mean()
    assert error < 0.06 * np.absolute(truth["sideslip"]).max()
    forces = np.stack([step.forces for step in found])
    errors = np.absolute(forces - truth["forces"][:, None])[100:].mean(axis=(0, 1))
    assert (errors < 0.08 * np.absolute(truth["forces"]).max(axis=0)).all()
    assert found[5].used_friction == pytest.approx(found[5].forces / truth["loads"][5])


@pytest.mark.parametrize("kind", KINDS)
def test_zero_steer_keeps_covariance_bounded_and_forgets_an_offset(kind: Any) -> None:
    observer = FourWheelObserver(CAR, kind)
    observer.reset(state=[0, 20, 0.05, 800, 0, 0, 0, 0])
    sizes = []
    for k in range(2000):
        step = observer.step(0.0, CAR.static_loads, [0.0, 20.0, 0.0, 0.0])
        if k % 500 == 499:
            sizes.append(np.diag(step.filter.covariance))
    np.testing.assert_allclose(sizes[-1], sizes[1], rtol=1e-3)
    assert abs(step.sideslip) < 1e-3 and np.absolute(step.forces).max() < 20
    assert not step.at_rest and not step.flags.any()


@pytest.mark.parametrize("kind", KINDS)
def test_standstill_fades_to_zero_with_bounded_covariance_and_drives_off(kind: Any) -> None:
    observer = FourWheelObserver(CAR, kind)
    observer.reset(state=[0.1, 0.2, 0.3, 500, -500, 100, 0, 0])
    sizes = []
    for k in range(1500):
        step = observer.step(0.3, CAR.static_loads, np.zeros(4))
        if k % 500 == 499:
            sizes.append(np.diag(step.filter.covariance))
    assert step.at_rest and abs(step.sideslip) < 1e-6 and np.absolute(step.forces).max() < 1e-3
    np.testing.assert_allclose(sizes[-1], sizes[0], rtol=1e-2)
    for k in range(600):  # drives off straight
        step = observer.step(0.0, CAR.static_loads, [0.0, 0.02 * k, 2.0, 0.0])
        assert np.isfinite(step.state).all()
    assert not step.at_rest
    assert step.state[1] == pytest.approx(12.0, abs=0.1)
    reverse = FourWheelObserver(CAR, kind)
    for _ in range(50):
        step = reverse.step(0.1, CAR.static_loads, [0.1, -3.0, 0.0, 0.3])
    assert step.at_rest and abs(step.sideslip) < 1e-3


@pytest.mark.parametrize("kind", KINDS)
def test_faults_are_flagged_finite_and_leave_other_entries_alone(kind: Any) -> None:
    observer, calm = FourWheelObserver(CAR, kind, (3,)), FourWheelObserver(CAR, kind, (3,))
    load = np.tile(CAR.static_loads, (3, 1))
    good = np.tile([0.1, 15.0, 0.0, 1.5], (3, 1))
    for _ in range(30):
        for each in (observer, calm):
            each.step(np.full(3, 0.02), load, good)
    bad, angle, lifted = good.copy(), np.full(3, 0.02), load.copy()
    bad[0], angle[0], lifted[0] = [np.nan, np.inf, -np.inf, np.nan], np.nan, [np.nan, -5.0, 0.0, 1e9]
    step, other = observer.step(angle, lifted, bad), calm.step(np.full(3, 0.02), load, good)
    expected = Flag.MISSING_MEASUREMENT | Flag.MISSING_INPUT | Flag.PARAMETER_OUT_OF_RANGE
    assert Flag(int(step.flags[0])) == expected and not step.flags[1:].any()
    assert np.isfinite(step.state).all() and np.isfinite(step.used_friction).all()
    assert not step.filter.used[0].any() and np.isnan(step.filter.innovation[0]).all()
    np.testing.assert_array_equal(step.state[1:], other.state[1:])


@pytest.mark.parametrize("kind", KINDS)
def test_blind_for_long_stays_bounded_and_finds_back(kind: Any) -> None:
    observer = FourWheelObserver(CAR, kind)
    resets = 0
    for _ in range(1500):
        step = observer.step(np.nan, np.full(4, np.nan), np.full(4, np.nan))
        resets += int(step.flags) & Flag.RESET > 0
        assert np.isfinite(step.state).all() and np.diag(step.filter.covariance).max() < 1e9
    assert resets > 0
    for _ in range(200):
        step = observer.step(0.0, CAR.static_loads, [0.0, 25.0, 0.0, 0.0])
    assert step.state[1] == pytest.approx(25.0, abs=0.1)


@pytest.mark.parametrize("kind", KINDS)
def test_batch_save_restore_and_chunks(kind: Any) -> None:
    shape = (2, 601)  # two chunks
    draw = np.random.default_rng(4)
    observer, twin = FourWheelObserver(CAR, kind, shape), FourWheelObserver(CAR, kind, shape)
    single = FourWheelObserver(CAR, kind)
    start = [0, 20, 0, 0, 0, 0, 0, 0]
    for each in (observer, single):
        each.reset(state=start)
    for _ in range(5):
        angle, y = 0.05 * draw.normal(size=shape), draw.normal(size=(*shape, 4)) * 0.1 + [0, 20, 0, 0]
        step = observer.step(angle, np.broadcast_to(CAR.static_loads, (*shape, 4)), y)
        alone = single.step(angle[1, 600], CAR.static_loads, y[1, 600])
    np.testing.assert_allclose(step.state[1, 600], alone.state, rtol=1e-8, atol=1e-8)
    assert step.state.shape == (*shape, 8) and step.filter.gain.shape == (*shape, 8, 4)
    twin.restore(observer.save())
    left, right = (each.step(angle, np.broadcast_to(CAR.static_loads, (*shape, 4)), y) for each in (observer, twin))
    np.testing.assert_array_equal(left.state, right.state)
    np.testing.assert_array_equal(left.filter.covariance, right.filter.covariance)
    with pytest.raises(EstimatorError, match="lacks"):
        twin.restore({})


def test_low_load_and_friction_limit_the_force() -> None:
    slippery = replace(CAR, friction=0.3)
    model = FourWheelModel.at(slippery, PERIOD, np.array(0.5), np.array([4000.0, 0.0, 3000.0, 3000.0]), 1.0)
    x = np.array([0, 30.0, 0, 0, 0, 0, 0, 0])
    for _ in range(200):
        x = np.concatenate((x[:3], model.transition(x)[3:7], x[7:]))
    assert 0.8 * 1200 < x[3] < 1200
    assert abs(x[4]) < 1e-6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "kalman"}, "not known"),
        ({"sample_time": 0.0}, "sample_time"),
        ({"process_noise": [1.0]}, "process_noise"),
        ({"measurement_noise": [1.0, 1.0, 0.0, 1.0]}, r"measurement_noise\[2\]"),
        ({"standstill_speed": -1.0}, "standstill_speed"),
        ({"batch_shape": (0,)}, "no entries"),
    ],
)
def test_constructor_refuses(options: dict[str, Any], message: str) -> None:
    with pytest.raises(EstimatorError, match=message):
        FourWheelObserver(CAR, **options)
    with pytest.raises(EstimatorError, match=r"mass = -1\.0 kg"):
        FourWheel(-1.0, *[1.0] * 9)
    with pytest.raises(EstimatorError, match="measurement has shape"):
        FourWheelObserver(CAR).step(0.0, CAR.static_loads, np.zeros(3))
