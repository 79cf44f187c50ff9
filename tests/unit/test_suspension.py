"""Suspension compliance, against scipy's matrix exponential and the oscillator's closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.velocity import SuspensionCompliance, SuspensionParameters

STEP = 0.005
PARAMETERS = SuspensionParameters()


def test_published_frequencies() -> None:
    """P3 notes 3: 80.8 rad/s and damping ratio 0.50 along, 123.4 rad/s and 0.33 across."""
    p = PARAMETERS
    for stiffness, damping, frequency, ratio in (
        (p.stiffness_x, p.damping_x, 80.8, 0.50),
        (p.stiffness_y, p.damping_y, 123.4, 0.33),
    ):
        assert np.sqrt(stiffness / p.unsprung_mass) == pytest.approx(frequency, abs=0.05)
        assert damping / 2 / np.sqrt(stiffness * p.unsprung_mass) == pytest.approx(ratio, abs=0.005)


def test_steps_equal_the_matrix_exponential() -> None:
    rng = np.random.default_rng(1)
    model = SuspensionCompliance(PARAMETERS, STEP, (3,))
    state = np.zeros((3, 4, 2, 2))
    for _ in range(20):
        force = 4000 * rng.normal(size=(2, 3, 4))
        step = model.step(*force)
        for axis, k, c in (
            (0, PARAMETERS.stiffness_x, PARAMETERS.damping_x),
            (1, PARAMETERS.stiffness_y, PARAMETERS.damping_y),
        ):
            m = PARAMETERS.unsprung_mass
            block = expm(STEP * np.array([[0, 1, 0], [-k / m, -c / m, 1 / m], [0, 0, 0]]))
            state[:, :, axis] = state[:, :, axis] @ block[:2, :2].T + force[axis][..., None] * block[:2, 2]
        np.testing.assert_allclose(step.displacement, state[..., 0], rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(step.velocity, state[..., 1], rtol=1e-9, atol=1e-13)


def test_a_constant_force_deflects_and_then_rests() -> None:
    model = SuspensionCompliance(PARAMETERS, STEP)
    for _ in range(400):
        step = model.step(np.full(4, 3000.0), np.full(4, -3500.0))
    np.testing.assert_allclose(step.displacement, np.broadcast_to([0.01, -0.005], (4, 2)), rtol=1e-9)
    np.testing.assert_allclose(step.velocity, 0.0, atol=1e-10)


def test_a_missing_force_is_held_and_flagged() -> None:
    model, twin = SuspensionCompliance(PARAMETERS, STEP), SuspensionCompliance(PARAMETERS, STEP)
    force, hole = np.full(4, 1000.0), np.array([1000.0, np.nan, np.inf, 1000.0])
    model.step(force, force)
    twin.step(force, force)
    step, whole = model.step(hole, force), twin.step(force, force)
    np.testing.assert_array_equal(step.velocity, whole.velocity)
    np.testing.assert_array_equal(step.flags, np.array([0, 1, 1, 0]) * int(Flag.MISSING_INPUT))


def test_saved_and_reset() -> None:
    model, other = SuspensionCompliance(PARAMETERS, STEP, (2,)), SuspensionCompliance(PARAMETERS, STEP, (2,))
    force = np.full((2, 4), 1000.0)
    model.step(force, force)
    other.restore(model.save())
    np.testing.assert_array_equal(model.step(force, force).velocity, other.step(force, force).velocity)
    model.reset(np.array([True, False]))
    assert not model.state[0].any()
    assert model.state[1].any()


@pytest.mark.parametrize("bad", [{"stiffness_x": 0.0}, {"damping_y": -1.0}, {"unsprung_mass": float("nan")}])
def test_impossible_parameters_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(EstimatorError, match=next(iter(bad))):
        SuspensionParameters(**bad)


def test_another_shape_is_refused() -> None:
    with pytest.raises(EstimatorError, match="force_x"):
        SuspensionCompliance(PARAMETERS, STEP).step(np.zeros(3), np.zeros(4))
    with pytest.raises(EstimatorError, match="sample_time"):
        SuspensionCompliance(PARAMETERS, 0.0)
