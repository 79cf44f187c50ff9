"""Lateral axle forces: the filter against its linear twin, against forces that are known, and with wheels straight."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.forces import LateralForceEstimator, planar_outputs
from estimators.forces.planar import planar_model
from estimators.vehicle import VehicleParameters

TIME = 0.005
CAR = VehicleParameters.published_suv()
LOAD = CAR.static_loads


def motion(steer: Any, force_x: Any, force_y: Any) -> tuple[Any, ...]:
    out = planar_outputs(CAR, np.asarray(steer, float), np.asarray(force_x, float), np.asarray(force_y, float))
    return out[..., 0], out[..., 1], out[..., 2]


def test_model_is_newton_and_euler_on_the_four_contact_points() -> None:
    """The independent check: sums of force vectors and of moments x F_y - y F_x about the centre of gravity."""
    rng = np.random.default_rng(1)
    steer, fx, fy = rng.normal(0, 0.3, 50), rng.normal(0, 3e3, (50, 4)), rng.normal(0, 3e3, (50, 4))
    angle = np.stack((steer, steer, 0 * steer, 0 * steer), axis=-1)
    along = fx * np.cos(angle) - fy * np.sin(angle)
    across = fx * np.sin(angle) + fy * np.cos(angle)
    moment = CAR.corner_x * across - CAR.corner_y * along
    ax, ay, turn = motion(steer, fx, fy)
    np.testing.assert_allclose(ax, along.sum(-1) / CAR.mass)
    np.testing.assert_allclose(ay, across.sum(-1) / CAR.mass)
    np.testing.assert_allclose(turn, moment.sum(-1) / CAR.yaw_inertia)


def test_rank_is_lost_with_the_wheels_straight_alone() -> None:
    for angle in (0.0, 1e-3, 0.1, -0.4):
        C = planar_model(CAR, np.array(angle), np.zeros(4)).C
        expected = CAR.front_track * math.sin(angle) ** 2 / (2 * CAR.mass**2 * CAR.yaw_inertia)
        assert np.linalg.det(C) == pytest.approx(expected, abs=1e-25)
        assert np.linalg.matrix_rank(C / np.abs(C).max(axis=0, initial=1e-12), tol=1e-9) == (2 if angle == 0 else 3)


@pytest.mark.parametrize("shape", [(), (5,), (2, 3)])
def test_unscented_equals_linear(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(2)
    first, second = (LateralForceEstimator(CAR, TIME, shape, m) for m in ("unscented", "linear"))  # type: ignore[arg-type]
    for k in range(150):
        steer = 0.1 * np.sin(0.1 * k) * rng.random(shape)
        signals = [rng.normal(0, 3, shape) for _ in range(3)]
        signals[k % 3] = np.where(rng.random(shape) < 0.2, np.nan, signals[k % 3])
        forces = rng.normal(0, 2000, (*shape, 4)), LOAD * rng.uniform(0.3, 1.7, (*shape, 4))
        a, b = (runner.step(*signals, steer, *forces) for runner in (first, second))
        for name in a._fields:
            scale = 1e-6 if "force" in name or name == "deviation" else 1e-9
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-8, atol=scale)


def test_known_forces_are_found_with_the_wheels_turned() -> None:
    """No noise: the filter converges to the forces that made the motion, the front split included."""
    fy, fx = np.array([1200.0, 2900.0, 1500.0, 2500.0]), np.array([300.0, -200.0, 500.0, 400.0])
    load = np.array([3000.0, 8000.0, 3500.0, 7500.0])
    signals = motion(0.2, fx, fy)
    runner = LateralForceEstimator(CAR, TIME, split_deviation=1e5)
    for _ in range(600):
        found = runner.step(*signals, 0.2, fx, load)
    np.testing.assert_allclose(found.axle_force, [4100.0, 4000.0], rtol=1e-3)
    np.testing.assert_allclose(found.corner_force[:2], fy[:2], rtol=1e-2)
    np.testing.assert_allclose(found.corner_force[2:], 4000.0 * load[2:] / 11000.0, rtol=1e-3)
    assert found.used.all()
    assert not found.flags.any()


@pytest.mark.parametrize("steer", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("noise", [(0.012, 0.012, 0.012), (0.3, 0.1, 0.3), (5.0, 5.0, 5.0)])
def test_the_front_difference_stays_within_the_stated_bound(steer: float, noise: tuple[float, float, float]) -> None:
    """A scalar filter of dF_yf - rho F_yf with the split alone is the bound: what else is measured can but help."""
    load = np.array([500.0, 9500.0, 4000.0, 6000.0])
    rho, runner = 0.9, LateralForceEstimator(CAR, TIME, split_deviation=1000.0, measurement_deviation=noise)
    walk = 130.0**2 * (1.0 + rho**2)
    bound = math.sqrt(walk / 2 + math.sqrt(walk**2 / 4 + walk * 1000.0**2))
    for k in range(1200):
        found = runner.step(0.0, 0.0, 0.0, steer, np.zeros(4), load)
        if k > 600:
            assert found.deviation[2] <= bound + rho * found.deviation[0]


def test_wheels_straight_the_covariance_stays_bounded_and_the_front_splits_by_load() -> None:
    fy = np.array([1000.0, 3000.0, 1500.0, 2500.0])
    load = np.array([2500.0, 7500.0, 4000.0, 6000.0])
    signals = motion(0.0, np.zeros(4), fy)
    runner = LateralForceEstimator(CAR, TIME, split_deviation=1000.0)
    bound = 130.0**2 / 2 + math.sqrt(130.0**4 / 4 + 130.0**2 * 1000.0**2)
    for k in range(4000):  # twenty seconds straight on
        found = runner.step(*signals, 0.0, np.zeros(4), load)
        if k > 400:
            assert found.deviation[2] ** 2 < 1.01 * bound
    np.testing.assert_allclose(found.axle_force, [4000.0, 4000.0], rtol=1e-6)
    np.testing.assert_allclose(found.corner_force, [1000.0, 3000.0, 1600.0, 2400.0], rtol=1e-4)
    assert found.deviation[:2].max() < 130.0


def test_without_measurements_forces_fade_and_covariances_do_not_run_away() -> None:
    runner = LateralForceEstimator(CAR, TIME, fade_time=0.5)
    signals = motion(0.05, np.zeros(4), np.full(4, 2000.0))
    for _ in range(200):
        runner.step(*signals, 0.05, np.zeros(4))
    before = runner.filter.state
    for _ in range(400):
        found = runner.step(0.0, np.nan, np.nan, np.nan, np.nan, np.full(4, np.inf))
        assert Flag(int(found.flags)) == Flag.MISSING_MEASUREMENT | Flag.MISSING_INPUT
        assert found.used.tolist() == [True, False, False]
        assert np.isfinite(found.corner_force).all()
        axles = LOAD.reshape(2, 2).sum(-1)
        assert (found.deviation[:2] < 1.001 * axles).all()
    assert np.abs(found.axle_force).max() < 0.05 * 1000 * np.abs(before).max()


def test_batches_save_reset_and_refusals() -> None:
    rng = np.random.default_rng(4)
    many, other = LateralForceEstimator(CAR, TIME, (3,)), LateralForceEstimator(CAR, TIME, (3,))
    singles = [LateralForceEstimator(CAR, TIME) for _ in range(3)]
    for k in range(40):
        y, steer, fx = rng.normal(0, 3, (3, 3)), rng.normal(0, 0.1, 3), rng.normal(0, 1e3, (3, 4))
        if k == 20:
            other.restore(many.save())
            for runner in (many, other):
                runner.reset([True, False, False])
            singles[0].reset()
        found = many.step(*y, steer, fx)
        alone = [one.step(*y[:, i], steer[i], fx[i]) for i, one in enumerate(singles)]
        np.testing.assert_allclose(found.corner_force, [one.corner_force for one in alone], rtol=1e-8, atol=1e-6)
        if k >= 20:
            np.testing.assert_array_equal(found.corner_force, other.step(*y, steer, fx).corner_force)
            assert found.flags.tolist() == [Flag.RESET if k == 20 else 0, 0, 0]
    with pytest.raises(EstimatorError, match="method = 'extended' is not known; use 'unscented' or 'linear'"):
        LateralForceEstimator(CAR, TIME, method="extended")  # type: ignore[arg-type]
    with pytest.raises(EstimatorError, match="split_deviation = 0 N must be finite and above 0 N"):
        LateralForceEstimator(CAR, TIME, split_deviation=0.0)
    with pytest.raises(EstimatorError, match=r"steer has shape \(2,\), expected \(3,\) or one number"):
        many.step(0.0, 0.0, 0.0, np.zeros(2), np.zeros((3, 4)))
    with pytest.raises(EstimatorError, match="saved state lacks 'renewed'"):
        many.restore({})
