"""The Dugoff tire against its printed formula and its limits."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.sideslip import dugoff_force, dugoff_slope, used_friction
from estimators.sideslip.dugoff import LEAST_KNEE
from tests.support.sideslip_truth import dugoff

C, LIMIT = 32_500.0, 4000.0
KNEE = LIMIT / (2 * C)


@pytest.mark.parametrize("slip", [-1.2, -0.3, -0.0616, -0.01, 0.0, 1e-9, 0.02, 0.0615, 0.0616, 0.1, 0.7, 1.5])
def test_equals_the_printed_formula(slip: float) -> None:
    found = dugoff_force(C, np.array(np.tan(slip)), KNEE)
    assert found == pytest.approx(dugoff(C, slip, LIMIT), rel=1e-12, abs=1e-9)


def test_limits() -> None:
    assert dugoff_force(C, np.array(1e-7), KNEE) == pytest.approx(C * 1e-7)
    assert dugoff_force(C, np.array(1e9), KNEE) == pytest.approx(LIMIT)  # mu F_z
    assert dugoff_force(C, np.array(KNEE), KNEE) == pytest.approx(LIMIT / 2)
    t = np.linspace(-3, 3, 4001)
    force = dugoff_force(C, t, KNEE)
    assert (np.diff(force) > 0).all() and (np.absolute(force) < LIMIT).all()
    np.testing.assert_allclose(force, -force[::-1], atol=1e-9)
    assert (np.sign(force) == np.sign(t)).all()  # positive slip pushes to the left


def test_slope_is_the_derivative_and_continuous_at_the_knee() -> None:
    t = np.linspace(-0.5, 0.5, 201)
    numeric = (dugoff_force(C, t + 1e-7, KNEE) - dugoff_force(C, t - 1e-7, KNEE)) / 2e-7
    np.testing.assert_allclose(dugoff_slope(C, t, KNEE), numeric, rtol=1e-5, atol=1e-3)
    below, above = (dugoff_slope(C, np.array(KNEE * factor), KNEE) for factor in (1 - 1e-9, 1 + 1e-9))
    assert below == pytest.approx(above, rel=1e-8)


def test_lifted_wheel_gives_nothing() -> None:
    t = np.array([-1.0, 0.0, 1e-3])
    np.testing.assert_allclose(dugoff_force(C, t, LEAST_KNEE), 0.0, atol=1e-9)
    assert np.isfinite(dugoff_slope(C, t, LEAST_KNEE)).all()
    np.testing.assert_array_equal(used_friction(np.array([100.0, 100.0]), np.array([0.0, 1000.0])), [0.0, 0.1])
