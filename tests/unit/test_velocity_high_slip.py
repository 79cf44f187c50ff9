"""The adaptive slip limit and the wheel-acceleration criterion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.velocity import HighSlipDetector, HighSlipSettings, adaptive_threshold

SETTINGS = HighSlipSettings()


def test_the_limits_are_reached_at_rest_and_under_excitation() -> None:
    assert adaptive_threshold(0.0, 0.05, 0.15, 100.0) == pytest.approx(0.05)
    assert adaptive_threshold(1e3, 0.05, 0.15, 100.0) == pytest.approx(0.15)
    rising = adaptive_threshold(np.linspace(0, 2, 50), 0.05, 0.15, 100.0)
    assert (np.diff(rising) > 0).all()


def test_the_corrected_formula_is_the_printed_one_with_the_other_width() -> None:
    """(29) with phi = 1/(sqrt(2 pi)(u - l)); as printed the limit would start at -9.85 for 0.05 and 0.15."""
    lower, upper, rate, variance = 0.05, 0.15, 100.0, 0.3

    def printed(width: float, sigma: float) -> float:
        return upper - math.exp(-rate * sigma / (2 * width**2)) / (width * math.sqrt(2 * math.pi))

    corrected = 1.0 / (math.sqrt(2 * math.pi) * (upper - lower))
    assert adaptive_threshold(variance, lower, upper, rate) == pytest.approx(printed(corrected, variance))
    assert printed((upper - lower) / math.sqrt(2 * math.pi), 0.0) == pytest.approx(-9.85)


def test_the_variance_is_that_of_the_last_samples() -> None:
    rng = np.random.default_rng(0)
    detector = HighSlipDetector(SETTINGS, (3,))
    a = rng.normal(size=(100, 2, 3))
    for k, (ax, ay) in enumerate(a):
        step = detector.step(ax, ay, np.zeros((3, 4)), np.zeros((3, 4)))
        recent = np.hypot(*np.moveaxis(a[max(0, k - SETTINGS.window + 1) : k + 1], 1, 0))
        np.testing.assert_allclose(step.variance, recent.var(axis=0), rtol=1e-10, atol=1e-14)


def test_both_criteria() -> None:
    detector = HighSlipDetector(SETTINGS)
    step = detector.step(0.0, 0.0, [0.04, -0.06, 0.0, np.nan], [0.0, 0.0, -150.0, np.nan])
    np.testing.assert_array_equal(step.by_slip, [False, True, False, False])
    np.testing.assert_array_equal(step.by_acceleration, [False, False, True, False])
    np.testing.assert_array_equal(step.high, [False, True, True, False])


def test_excitation_raises_the_limit() -> None:
    detector = HighSlipDetector(SETTINGS)
    for k in range(SETTINGS.window):
        step = detector.step(3.0 * (k % 2), 0.0, np.full(4, 0.1), np.zeros(4))
    assert not step.high.any()
    detector.reset()
    assert detector.step(0.0, 0.0, np.full(4, 0.1), np.zeros(4)).high.all()


def test_a_missing_acceleration_repeats_the_last_one() -> None:
    detector, twin = HighSlipDetector(SETTINGS), HighSlipDetector(SETTINGS)
    for ax, seen in ((1.0, 1.0), (np.nan, 1.0), (2.0, 2.0)):
        a, b = (d.step(v, 0.0, np.zeros(4), np.zeros(4)) for d, v in ((detector, ax), (twin, seen)))
    assert a.variance == b.variance
    assert np.isfinite(HighSlipDetector(SETTINGS).step(np.nan, np.nan, np.zeros(4), np.zeros(4)).threshold)


def test_saved_and_restored() -> None:
    one, two = HighSlipDetector(SETTINGS), HighSlipDetector(SETTINGS)
    for k in range(7):
        one.step(float(k), 0.0, np.zeros(4), np.zeros(4))
    two.restore(one.save())
    step = [d.step(3.0, 1.0, np.zeros(4), np.zeros(4)).variance for d in (one, two)]
    assert step[0] == step[1]


@pytest.mark.parametrize(
    "bad", [{"lower": 0.2}, {"lower": 0.0}, {"rate": 0.0}, {"window": 1}, {"wheel_acceleration": -1.0}]
)
def test_bad_settings_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(EstimatorError):
        HighSlipSettings(**bad)  # type: ignore[arg-type]


def test_another_shape_is_refused() -> None:
    with pytest.raises(EstimatorError, match="slip"):
        HighSlipDetector(SETTINGS).step(0.0, 0.0, np.zeros(3), np.zeros(4))
