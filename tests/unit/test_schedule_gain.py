"""Gains and plant at given parameters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators import EstimatorError, GainSchedule, RangeError, ScheduleError
from estimators.interpolate import PiecewiseLinear
from estimators.schedule import Signal, sealed
from synthesis.certificate.content import subject_of
from tests.support.schedule_content import PUBLISHED, schedule_content, with_matrix

GAINS = [(0.9, 210.0), (0.8, 183.1), (0.7, 100.0), (0.5, 60.0)]
SCHEDULE = GainSchedule.from_content(schedule_content(gains=GAINS))


@given(
    gaps=st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=8),
    parts=st.lists(st.floats(0, 1), min_size=1, max_size=20),
    seed=st.integers(0, 2**31),
)
def test_interpolation_agrees_with_numpy(gaps: list[float], parts: list[float], seed: int) -> None:
    breakpoints = np.concatenate([[-1.0], -1.0 + np.cumsum(gaps)])
    values = np.random.default_rng(seed).normal(size=(len(breakpoints), 3))
    at = np.concatenate([breakpoints, breakpoints[0] + np.array(parts) * (breakpoints[-1] - breakpoints[0])])
    at = np.clip(at, breakpoints[0], breakpoints[-1])
    piecewise = PiecewiseLinear(breakpoints, values)
    expected = [np.interp(at, breakpoints, column) for column in values.T]
    np.testing.assert_allclose(piecewise(at), expected, rtol=1e-11, atol=1e-11)
    np.testing.assert_array_equal(piecewise(breakpoints), values.T)
    for one, column in zip(at, piecewise(at).T, strict=True):
        np.testing.assert_allclose(piecewise.at(float(one)), column, rtol=1e-11, atol=1e-11)


def test_breakpoints_that_nearly_coincide_are_searched() -> None:
    breakpoints = np.array([0.0, 1e-7, 50.0, 140.0])
    piecewise = PiecewiseLinear(breakpoints, np.arange(4.0)[:, None])
    assert piecewise.searched
    at = np.linspace(0, 140, 1001)
    np.testing.assert_allclose(piecewise(at)[0], np.interp(at, breakpoints, np.arange(4.0)), rtol=1e-12)


def test_stored_gains_are_returned_as_stored_whatever_the_shape() -> None:
    np.testing.assert_array_equal(SCHEDULE.gain(SCHEDULE.breakpoints), SCHEDULE.table)
    at = np.array([[15.0, -15.0, 140.0], [0.0, 80.0, -140.0]])
    gain = SCHEDULE.gain(at)
    assert gain.shape == (2, 3, 2, 1)
    np.testing.assert_allclose(gain[0, :, 0, 0], [0.85, 0.85, 0.5], rtol=1e-15)
    np.testing.assert_array_equal(gain[0, 0], SCHEDULE.gain(15.0))
    assert SCHEDULE.gain(15.0).shape == (2, 1)


def test_the_plant_is_the_published_model() -> None:
    sigma0, sigma1, sigma2, kappa = PUBLISHED["longitudinal"]["constants"]
    a = kappa * 0.33 * 40
    plant = SCHEDULE.plant_at([-40.0, 40.0])
    np.testing.assert_allclose(plant.A, [[[-a, 1], [0, 0]]] * 2)
    np.testing.assert_allclose(plant.C, [[[sigma0 - sigma1 * a, sigma1 + sigma2]]] * 2)
    assert plant.B.tolist() == [[[0], [1]]] * 2
    assert plant.D.shape == (2, 1, 1)
    assert SCHEDULE.states[1] == Signal("relative_velocity", "m/s")
    assert [signal.name for signal in SCHEDULE.disturbances] == ["friction", "acceleration_error", "force_noise"]


@pytest.mark.parametrize("direction", PUBLISHED)
def test_the_published_fixed_gains_are_stable_over_the_whole_range(direction: str) -> None:
    schedule = GainSchedule.from_content(schedule_content(direction))
    speeds = np.linspace(0, 140, 141)
    plant = schedule.plant_at(speeds)
    assert np.linalg.eigvals(plant.A - schedule.gain(speeds) @ plant.C).real.max() < 0


@pytest.mark.parametrize(
    ("parameter", "message"),
    [
        (212.0, r"wheel_speed = 212 rad/s is outside the certified range \[0, 140\] rad/s$"),
        ([3, 7, -212.5], r"wheel_speed = -212.5 rad/s is outside .* \(sample 2\)$"),
        ([[3, 7], [7, np.nan]], r"wheel_speed = nan rad/s .* \(sample \(1, 1\)\)$"),
        (np.inf, "wheel_speed = inf rad/s"),
    ],
)
def test_parameters_outside_the_range_are_refused(parameter: object, message: str) -> None:
    with pytest.raises(RangeError, match=message):
        SCHEDULE.gain(parameter)  # type: ignore[arg-type]
    with pytest.raises(RangeError, match=message):
        SCHEDULE.plant_at(parameter)  # type: ignore[arg-type]


def test_what_is_no_number_is_refused() -> None:
    with pytest.raises(EstimatorError, match="wheel_speed is not an array of numbers"):
        SCHEDULE.gain(["fast"])  # type: ignore[list-item]


def test_a_signed_parameter_keeps_its_sign() -> None:
    content = schedule_content(breakpoints=(-10.0, 0.0, 10.0), gains=[(1.0, 2.0), (2.0, 3.0), (5.0, 4.0)])
    content["scheduling"][0]["absolute"] = False
    with_matrix(content, "A", [[0, 1], [0, 0]], [[0, 0], [0, 0]], [[-0.1, 0], [0, 0]])
    schedule = GainSchedule.from_content(content)
    assert schedule.gain(-5.0)[0, 0] == 1.5
    np.testing.assert_allclose(schedule.plant_at(-3.0).A, [[-0.9, 1], [0, 0]])


def test_arrays_are_read_only() -> None:
    for array in (SCHEDULE.table, SCHEDULE.breakpoints, SCHEDULE.plant["A"].coefficients):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_unknown_shipped_schedule_lists_what_there_is() -> None:
    with pytest.raises(ScheduleError, match="no shipped schedule 'no-such'; there are: "):
        GainSchedule.shipped("no-such")


def test_content_in_memory_is_checked_against_its_digests() -> None:
    content = sealed(schedule_content())
    assert GainSchedule.from_content(content).sha256 == content["sha256"]
    assert GainSchedule.from_content(schedule_content()).sha256 == content["sha256"]
    content["gain"]["table"][0][0][0] = 0.7
    with pytest.raises(ScheduleError, match=r"my content: gain: .*edited"):
        GainSchedule.from_content(content, "my content")


@pytest.mark.parametrize("direction", PUBLISHED)
def test_the_content_of_these_tests_is_one_plant_in_formulas_and_numbers(direction: str) -> None:
    """Rebuilt by the verifier from formulas and constants; also after a matrix was exchanged."""
    content = schedule_content(direction)
    assert subject_of(content, "here").tied
    with_matrix(content, "C", [[600.0, 0.76]], [[0, 0]], [[0, 1e-6]])
    content["model"]["source"] = "format 1, constants and units not tied to the plant: none"  # for the idle constants
    assert not subject_of(content, "here").tied
    content["plant"]["C"]["coefficients"][2][0][1] *= 1.0 + 1e-12
    with pytest.raises(ScheduleError, match=r"here: plant\.C: entry \[0\]\[1\] of order \[2\]"):
        subject_of(content, "here")
