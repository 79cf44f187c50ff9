"""Corner velocities to the centre of gravity and back; axle weights."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators.errors import EstimatorError
from estimators.vehicle import VehicleParameters
from estimators.velocity import CornerVectors, SlipWeights, corner_velocity, to_centre, to_corners

CAR = VehicleParameters.published_suv()


@given(st.floats(-30, 30), st.floats(-5, 5), st.floats(-2, 2), st.floats(0, 1), st.floats(0, 1))
def test_a_rigid_body_maps_back_whatever_the_weights(vx: float, vy: float, r: float, wx: float, wy: float) -> None:
    found = to_centre(CAR, corner_velocity(CAR, vx, vy, r), r, wx, wy)
    assert found.vx == pytest.approx(vx, abs=1e-12)
    assert found.vy == pytest.approx(vy, abs=1e-12)


@pytest.mark.parametrize("lost", [[0], [3], [0, 1], [2, 3], [0, 3]])
def test_unknown_wheels_are_left_out(lost: list[int]) -> None:
    corner = corner_velocity(CAR, 10.0, 0.5, 0.3)
    corner.x[lost] = corner.y[lost] = np.nan
    found = to_centre(CAR, corner, 0.3, 0.7, 0.2)
    assert (found.vx, found.vy) == (pytest.approx(10.0), pytest.approx(0.5))


def test_no_wheel_no_velocity() -> None:
    nothing = np.full(4, np.nan)
    assert np.isnan(to_centre(CAR, CornerVectors(nothing, nothing), 0.0).vx)


def test_fixed_weights_are_the_published_means() -> None:
    """P2: eta = 0.5 each; P3: one axle."""
    x, y = np.array([10.0, 12.0, 20.0, 22.0]), np.zeros(4)
    assert to_centre(CAR, CornerVectors(x, y), 0.0).vx == pytest.approx(0.5 * 11 + 0.5 * 21)
    assert to_centre(CAR, CornerVectors(x, y), 0.0, front_weight_x=0.0).vx == pytest.approx(21)
    axle = to_centre(CAR, CornerVectors(x, y), 0.4).axle_vy
    np.testing.assert_allclose(axle, [-0.4 * 1.42, 0.4 * 1.43])  # -r L_f and +r L_r, P1 (42)


def test_the_axle_that_slips_less_counts_more() -> None:
    weights = SlipWeights(lower=0.1, upper=0.9, sharpness=50.0)
    spinning = np.array([0.5, 0.5, 0.01, 0.01])
    assert weights.front(np.zeros(4)) == pytest.approx(0.5)
    assert weights.front(spinning) < 0.15
    assert weights.front(np.roll(spinning, 2)) + weights.front(spinning) == pytest.approx(1.0)
    assert weights.front([np.nan, 0.0, 0.0, 0.0]) == pytest.approx(0.5)


@given(st.lists(st.floats(-5, 5), min_size=4, max_size=4))
def test_weights_keep_their_bounds_and_ignore_signs(slip: list[float]) -> None:
    weights = SlipWeights()
    assert weights.lower <= weights.front(slip) <= weights.upper
    assert weights.front(slip) == pytest.approx(weights.front(np.negative(slip)))


def test_the_closed_form_of_the_weight() -> None:
    """P1 (34): W_s + (W_ub - W_lb)/pi atan(rho (difference of slips))."""
    slip = np.array([0.03, 0.05, -0.01, 0.02])
    expected = 0.5 + 0.8 / np.pi * np.arctan(40.0 * (0.03 - 0.08))
    assert SlipWeights(0.1, 0.9, 40.0).front(slip) == pytest.approx(expected)


def test_back_to_corners_a_rolling_car_has_no_slip() -> None:
    steer = np.array([0.1, 0.1, 0.0, 0.0])
    corner = to_corners(CAR, 10.0, 0.2, 0.3, steer, np.zeros(4))
    rolling = to_corners(CAR, 10.0, 0.2, 0.3, steer, corner.along / CAR.radius)
    np.testing.assert_allclose(rolling.ratio, 0.0, atol=1e-12)
    braked = to_corners(CAR, 10.0, 0.2, 0.3, steer, 0.9 * corner.along / CAR.radius)
    np.testing.assert_allclose(braked.ratio, -0.1, atol=1e-12)
    assert rolling.angle[2] == pytest.approx(np.arctan((0.2 - 0.3 * 1.43) / (10.0 + 0.0 - 0.3 * 1.56 / 2)), abs=1e-12)


@pytest.mark.parametrize("bad", [{"lower": 0.6, "upper": 0.4}, {"upper": 0.8}, {"sharpness": 0.0}])
def test_weights_that_mean_nothing_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(EstimatorError, match=r"lower|sharpness"):
        SlipWeights(**bad)


def test_a_share_above_one_is_refused() -> None:
    with pytest.raises(EstimatorError, match="front_weight_x"):
        to_centre(CAR, corner_velocity(CAR, 1.0, 0.0, 0.0), 0.0, 1.5)
