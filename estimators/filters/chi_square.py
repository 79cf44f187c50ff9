"""Chi-square distribution from the regularised incomplete gamma function: distribution function and quantile."""

from __future__ import annotations

import math

from estimators.errors import EstimatorError

_TERMS = 100_000


def chi_square_probability(value: float, freedom: float) -> float:
    """P(chi2_k <= v) = P(k/2, v/2), the lower regularised incomplete gamma function.

    Series for v < k + 2, Lentz's continued fraction of the complement otherwise.
    Source: Abramowitz, Stegun (1964), 6.5.29, 6.5.31, 26.4.19.

    Raises:
        EstimatorError: degrees of freedom that are not positive.
    """
    if not 0 < freedom < math.inf:
        raise EstimatorError(f"degrees of freedom = {freedom!r} must be positive and finite")
    if not value > 0:
        return 0.0
    a, x = freedom / 2, value / 2
    return _series(a, x) if x < a + 1 else 1.0 - _fraction(a, x)


def chi_square_quantile(probability: float, freedom: float) -> float:
    """The v with P(chi2_k <= v) = p: Wilson-Hilferty start (A&S 26.4.17), then safeguarded Newton steps.

    Raises:
        EstimatorError: a probability outside (0, 1), or degrees of freedom that are not positive.
    """
    if not 0.0 < probability < 1.0:
        raise EstimatorError(f"probability = {probability!r} must lie inside (0, 1)")
    low, high = 0.0, max(freedom, 1.0)
    while chi_square_probability(high, freedom) < probability:
        low, high = high, 2 * high
    spread = 2.0 / (9.0 * freedom)
    value = freedom * (1 - spread + _normal_quantile(probability) * math.sqrt(spread)) ** 3
    for _ in range(200):
        if not low < value < high:
            value = (low + high) / 2
        error = chi_square_probability(value, freedom) - probability
        low, high = (value, high) if error < 0 else (low, value)
        a = freedom / 2
        density = math.exp((a - 1) * math.log(value / 2) - value / 2 - math.lgamma(a)) / 2
        step = error / density if density > 0 else math.inf
        if abs(step) <= 1e-15 * value or high - low <= 1e-15 * high:
            break
        value -= step
    return value


def _series(a: float, x: float) -> float:
    """x^a e^-x / Gamma(a+1) (1 + x/(a+1) + x^2/((a+1)(a+2)) + ...)."""
    term = total = 1.0
    for k in range(1, _TERMS):
        term *= x / (a + k)
        total += term
        if term < 1e-17 * total:
            break
    return total * math.exp(a * math.log(x) - x - math.lgamma(a + 1))


def _fraction(a: float, x: float) -> float:
    """The complement 1 - P(a, x) by the modified Lentz algorithm."""
    b = x + 1 - a
    c, d = 1e300, 1 / b
    total = d
    for k in range(1, _TERMS):
        numerator = -k * (k - a)
        b += 2
        d = 1 / (numerator * d + b)
        c = b + numerator / c
        total *= c * d
        if abs(c * d - 1) < 1e-16:
            break
    return total * math.exp(a * math.log(x) - x - math.lgamma(a))


def _normal_quantile(probability: float) -> float:
    """Good to 4.5e-4 (A&S 26.2.23): only a starting value."""
    tail = min(probability, 1 - probability)
    t = math.sqrt(-2 * math.log(tail))
    z = t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308)))
    return z if probability > 0.5 else -z
