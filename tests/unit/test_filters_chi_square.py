"""The chi-square distribution against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from estimators import EstimatorError
from estimators.filters import average_band, chi_square_probability, chi_square_quantile, nees, nis

FREEDOMS = [0.5, 1, 2, 3, 4, 8, 50, 1000, 8000, 100_000]


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_quantile_and_probability(freedom: float) -> None:
    for p in [1e-8, 1e-3, 0.025, 0.5, 0.95, 0.975, 0.999, 1 - 1e-9]:
        value = chi_square_quantile(p, freedom)
        assert value == pytest.approx(chi2.ppf(p, freedom), rel=1e-7 if p > 0.9999 else 1e-9)
        assert chi_square_probability(value, freedom) == pytest.approx(p, rel=1e-9)
    for value in (1e-3 * freedom, freedom, 3 * freedom):
        assert chi_square_probability(value, freedom) == pytest.approx(chi2.cdf(value, freedom), rel=1e-9, abs=1e-14)
    assert chi_square_probability(-1.0, freedom) == 0.0


def test_two_degrees_are_exponential() -> None:
    assert chi_square_quantile(0.9, 2) == pytest.approx(-2 * np.log(0.1), rel=1e-14)


def test_average_band() -> None:
    low, high = average_band(1000, 8, 0.95)
    assert (low, high) == pytest.approx((chi2.ppf(0.025, 8000) / 1000, chi2.ppf(0.975, 8000) / 1000))


def test_normalised_squares() -> None:
    draw = np.random.default_rng(0)
    root = draw.normal(size=(5, 3, 3))
    S = root @ root.swapaxes(1, 2) + np.eye(3)
    e = draw.normal(size=(5, 3))
    np.testing.assert_allclose(nees(e, S), [v @ np.linalg.inv(M) @ v for v, M in zip(e, S, strict=True)])
    e[2, 1] = np.nan
    value, channels = nis(e, S)
    assert channels.tolist() == [3, 3, 2, 3, 3]
    kept = e[2, ::2]
    assert value[2] == pytest.approx(kept @ np.linalg.inv(S[2][::2, ::2]) @ kept)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: chi_square_quantile(0.0, 1), "inside"),
        (lambda: chi_square_quantile(0.5, -1), "positive"),
        (lambda: average_band(0, 1), "at least 1"),
        (lambda: average_band(1, 1, 2.0), "confidence"),
        (lambda: nees([1.0], [[0.0]]), "singular"),
    ],
)
def test_refusals(call: object, text: str) -> None:
    with pytest.raises(EstimatorError, match=text):
        call()  # type: ignore[operator]
