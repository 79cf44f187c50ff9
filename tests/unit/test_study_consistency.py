"""Normalised errors of the whole pipeline: they stay in the band on a few manoeuvres, and a third of sigma is found out."""

from __future__ import annotations

import numpy as np
import pytest

from studies.beyond.consistency.runs import (
    ALIGNMENT,
    Consistency,
    Errors,
    errors,
    turned,
    with_own_alignment,
    with_own_radii,
)
from studies.beyond.consistency.study import BAND, STUDY, picture
from studies.trials.estimation import TEST_CAR
from studies.truth import Truth, draw, load_manoeuvre, simulate_manoeuvres

NAMES = ("p1-acceleration-left-turn-wet-dry", "p1-lane-change-dry")
SEEDS = range(12)


@pytest.fixture(scope="module")
def truth() -> Truth:
    short = [load_manoeuvre(name).model_copy(update={"duration": 4.0}) for name in NAMES]
    return simulate_manoeuvres(short)


@pytest.fixture(scope="module")
def driven(truth: Truth) -> list[Errors]:
    return sorted(errors(truth, SEEDS), key=lambda one: one.manoeuvre)


@pytest.fixture(scope="module")
def found(driven: list[Errors]) -> list[Consistency]:
    return [one.tested() for one in driven]


def test_the_stated_deviations_are_true_on_what_tires_hold(found: list[Consistency]) -> None:
    assert [one.manoeuvre for one in found] == list(NAMES)
    assert BAND[0] < np.mean([one.nees[2] for one in found]) < BAND[1]
    assert all(one.within(BAND)[2] and max(one.beyond) < 0.05 for one in found)


def test_a_third_of_sigma_leaves_the_band(driven: list[Errors]) -> None:
    """The negative control: the same estimates, stated three times as sure."""
    sure = [one.tested(shrink=3.0) for one in driven]
    assert np.mean([one.nees[2] for one in sure]) > BAND[1]
    assert not any(one.within(BAND)[2] for one in sure)


def test_tilt_is_no_surer_than_it_may_be_and_a_third_of_sigma_is_found_out(driven: list[Errors]) -> None:
    """The negative control: roll and pitch stated three times as sure, on the car whose turn and braking tilt it most."""
    for shrink, sure in ((1.0, False), (3.0, True)):
        tilts = [one.tested(shrink).nees[3:] for one in driven]
        assert (max(max(pair) for pair in tilts) > BAND[1]) is sure


@pytest.mark.parametrize(("manoeuvre", "seconds"), [("p1-brake-in-turn-snow", 5.0), ("p2-launch-ice", 6.0)])
def test_errors_that_last_a_manoeuvre_are_in_the_deviation_of_the_lateral_velocity(
    manoeuvre: str, seconds: float
) -> None:
    """Axles that differ on snow (NEES 10 if that is not looked at), and levelling by speeds that err (4.5 if it is constant)."""
    truth = simulate_manoeuvres([load_manoeuvre(manoeuvre).model_copy(update={"duration": seconds})])
    (found,) = errors(truth, range(4))
    assert BAND[0] < found.tested().nees[1] < BAND[1]


def test_radii_of_a_seed_are_its_own_and_as_wide_as_the_fusion_assumes(truth: Truth) -> None:
    drawn = draw(truth.until(0.1), TEST_CAR, range(400))
    ratio = drawn.signals["wheel_speed"][:, 1, 0] / with_own_radii(drawn).signals["wheel_speed"][:, 1, 0] - 1.0
    common, single = ratio.mean(axis=1), ratio - ratio.mean(axis=1, keepdims=True)
    assert common.std() == pytest.approx(np.hypot(0.015, 0.005 / 2.0), rel=0.1)
    assert single.std() == pytest.approx(0.005 * np.sqrt(0.75), rel=0.1)


def test_a_seed_has_a_thrust_angle_and_front_wheels_of_its_own(truth: Truth) -> None:
    drawn = draw(truth.until(0.1), TEST_CAR, range(400))
    askew, thrust = with_own_alignment(drawn)
    assert thrust.std() == pytest.approx(ALIGNMENT, rel=0.1)
    front = thrust[:, None] - (askew.signals["steer"] - drawn.signals["steer"])[:, 1, 0, :2]
    assert front.std(axis=0) == pytest.approx(ALIGNMENT, rel=0.1)
    np.testing.assert_array_equal(askew.signals["steer"][..., 2:], drawn.signals["steer"][..., 2:])
    for x, y in (("ax", "ay"), ("roll_rate", "pitch_rate")):
        old, new = (one.signals[x] + 1j * one.signals[y] for one in (drawn, askew))
        np.testing.assert_allclose(new, old * np.exp(1j * thrust[:, None, None]), atol=1e-12)
    # along the rear wheels, which stand to the left: forward, and to the left
    assert turned(np.array(20.0), np.array(0.0), 0.01) == pytest.approx((20.0, 0.2), abs=0.002)
    np.testing.assert_array_equal(askew.signals["yaw_rate"], drawn.signals["yaw_rate"])


def test_the_study_draws_what_it_found(found: list[Consistency]) -> None:
    assert {part.name.rsplit("-", 1)[0] for part in STUDY.parts} == {"lugre", "magic-formula"}
    figure = picture("consistency", "caption", found)
    assert figure.alternative and len(figure.rows[0]) == 1
