"""The plant in float64 against the stored polynomial in exact rationals, also where powers of p would lose everything."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from estimators import GainSchedule, LpvVelocityObserver
from tests.support.schedule_content import chebyshev, schedule_content

RANGES = {
    "far from zero": (634.65, 635.65),
    "single precision": (float(np.float32(634.65)), float(np.float32(635.65))),
    "single precision, narrow": (float(np.float32(0.1)), float(np.float32(0.1000002))),
    "negative": (-1e6 - 0.1, -1e6),
    "tiny": (1e-12, 3e-12),
    "wide": (0.0, 1e9),
}
# Where the range is narrow for its place, the rounding of its middle is what is left: 2^-53 |middle| / half.
TOLERANCE = {"single precision, narrow": 1e-9, "negative": 1e-8}


def exact(stored: dict[str, Any], low: float, high: float, p: float) -> list[list[Fraction]]:
    """sum of coefficients times T_k(u) in rationals; the range as the decimals that are written, other numbers as they are."""
    first, last = Fraction(repr(low)), Fraction(repr(high))
    u = (Fraction(p) - (first + last) / 2) / ((last - first) / 2)
    values = [Fraction(1), u]
    while len(values) < 17:
        values.append(2 * u * values[-1] - values[-2])
    rows = np.array(stored["coefficients"][0]).shape
    total = [[Fraction(0)] * rows[1] for _ in range(rows[0])]
    for (order,), matrix in zip(stored["orders"], stored["coefficients"], strict=True):
        for i in range(rows[0]):
            for j in range(rows[1]):
                total[i][j] += Fraction(matrix[i][j]) * values[order]
    return total


def places(low: float, high: float) -> np.ndarray:
    """Ends, middle, and as many as a single-precision signal has between."""
    inside = np.linspace(low, high, 101)
    single = inside.astype(np.float32).astype(np.float64)
    return np.unique(np.concatenate([inside, single[(single >= low) & (single <= high)], [low, high]]))


def content_on(low: float, high: float, orders: int, seed: int = 0) -> dict[str, Any]:
    """A corner model whose A and C are random Chebyshev series that do not vanish anywhere."""
    content = schedule_content(breakpoints=(low, low + 0.3 * (high - low), high), gains=(0.0, 0.0))
    content["scheduling"][0]["absolute"] = False
    for key in "BDEF":
        content["plant"][key] = {"orders": [[0]], "coefficients": [content["plant"][key]["coefficients"][0]]}
    draw = np.random.default_rng(seed)
    for key, shape in (("A", (2, 2)), ("C", (1, 2))):
        series = draw.normal(size=(orders, *shape)) / np.arange(1, orders + 1)[:, None, None] ** 2
        series[0] = 3.0
        content["plant"][key] = {"orders": [[k] for k in range(orders)], "coefficients": series.tolist()}
    return content


@pytest.mark.parametrize("orders", [1, 2, 4, 17])
@pytest.mark.parametrize("name", RANGES)
def test_the_runtime_evaluates_the_polynomial_that_is_stored(name: str, orders: int) -> None:
    low, high = RANGES[name]
    content = content_on(low, high, orders)
    schedule = GainSchedule.from_content(content)
    at = places(low, high)
    for key in "AC":
        expected = np.array([exact(content["plant"][key], low, high, p) for p in at]).astype(float)
        assert np.abs(expected).min() > 0.1
        np.testing.assert_allclose(schedule.plant[key].at(at), expected, rtol=TOLERANCE.get(name, 1e-12))


@pytest.mark.parametrize("orders", [2, 3, 4, 17])
@pytest.mark.parametrize("name", ["far from zero", "single precision", "tiny", "wide"])
def test_plain_numbers_and_arrays_evaluate_it_too(name: str, orders: int) -> None:
    """With the estimate at a unit vector and y = u = 0 the innovation is an entry of -C."""
    low, high = RANGES[name]
    content = content_on(low, high, orders)
    schedule = GainSchedule.from_content(content)
    at = places(low, high)
    expected = np.array([exact(content["plant"]["C"], low, high, p) for p in at]).astype(float)[:, 0]
    for column in (0, 1):
        many = LpvVelocityObserver(schedule, at.shape)
        few = [LpvVelocityObserver(schedule, ()) for _ in at]
        for observer in (many, *few):
            observer.reset(state=np.eye(2)[column])
        zero = np.zeros_like(at)
        np.testing.assert_allclose(-many.step(zero, zero, at).innovation, expected[:, column], rtol=1e-12)
        found = [float(one.step(0.0, 0.0, p).innovation) for one, p in zip(few, at, strict=True)]
        np.testing.assert_allclose(-np.array(found), expected[:, column], rtol=1e-12)


def test_powers_would_not_do() -> None:
    """The negative control: the very polynomial in powers of p keeps no digit where its Chebyshev form keeps twelve."""
    low, high = RANGES["far from zero"]
    powers = np.polynomial.polynomial.polyfromroots([634.9, 635.1, 635.3])  # (p - 634.9)(p - 635.1)(p - 635.3)
    cubic = [Fraction(1)]
    for root in ("634.9", "635.1", "635.3"):
        cubic = [a - Fraction(root) * b for a, b in zip([Fraction(0), *cubic], [*cubic, Fraction(0)], strict=True)]
    stored = chebyshev(low, high, *([[c]] for c in cubic))
    assert len(stored["orders"]) == 4
    content = schedule_content(breakpoints=(low, 635.0, high))
    content["plant"]["D"] = stored
    schedule = GainSchedule.from_content(content)
    at = np.array([634.7, 635.0, 635.2, 635.6])
    expected = np.array([float(sum(c * Fraction(p) ** k for k, c in enumerate(cubic))) for p in at])
    found = schedule.plant["D"].at(at)[:, 0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-11)
    assert np.abs(np.polynomial.polynomial.polyval(at, powers) / expected - 1.0).max() > 1e-6
