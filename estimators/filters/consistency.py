"""Whether a filter's covariance tells the truth: NEES, NIS and their chi-square bands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from estimators.arrays import FloatArray, IntArray
from estimators.errors import EstimatorError
from estimators.filters.chi_square import chi_square_quantile
from estimators.filters.step import numbers


def nees(error: npt.ArrayLike, covariance: npt.ArrayLike) -> FloatArray:
    """Normalised estimation error squared e' P^-1 e, chi-square with n degrees of freedom; (..., n), (..., n, n) to (...).

    Source: Bar-Shalom, Li, Kirubarajan (2001), (5.4.2-3).

    Raises:
        EstimatorError: P singular.
    """
    return _normalised(numbers(error, "error"), numbers(covariance, "covariance"))


def nis(innovation: npt.ArrayLike, innovation_covariance: npt.ArrayLike) -> tuple[FloatArray, IntArray]:
    """Normalised innovation squared nu' S^-1 nu over the channels present, and how many these are; (..., m) to (...).

    Source: Bar-Shalom, Li, Kirubarajan (2001), (5.4.2-5).

    Raises:
        EstimatorError: S singular.
    """
    nu, total = numbers(innovation, "innovation"), numbers(innovation_covariance, "innovation covariance")
    present = np.isfinite(nu)
    both = present[..., :, None] & present[..., None, :]
    clean = np.where(both, total, np.eye(nu.shape[-1]))
    return _normalised(np.where(present, nu, 0.0), clean), present.sum(axis=-1)


def average_band(runs: int, freedom: float, confidence: float = 0.95) -> tuple[float, float]:
    """Interval that holds the average of `runs` independent chi-square values with that probability.

    Raises:
        EstimatorError: numbers that mean nothing.
    """
    if runs < 1:
        raise EstimatorError(f"runs = {runs} must be at least 1")
    if not 0 < confidence < 1:
        raise EstimatorError(f"confidence = {confidence!r} must lie inside (0, 1)")
    tail = (1 - confidence) / 2
    return (
        chi_square_quantile(tail, runs * freedom) / runs,
        chi_square_quantile(1 - tail, runs * freedom) / runs,
    )


@dataclass(frozen=True, eq=False)
class Consistency:
    """Averages over runs against their band, step by step."""

    average: FloatArray  # (steps,) over the runs
    band: tuple[float, float]  # that holds one average with the confidence
    confidence: float
    inside: float  # share of the steps inside the band
    least_inside: float  # share below which the verdict is negative
    consistent: bool

    def __str__(self) -> str:
        verdict = "consistent" if self.consistent else "not consistent"
        return (
            f"{verdict}: {self.inside:.1%} of {self.average.size} averages inside [{self.band[0]:.4g}, {self.band[1]:.4g}] "
            f"(at least {self.least_inside:.1%} asked), mean {self.average.mean():.4g}"
        )


def consistency(
    values: npt.ArrayLike, freedom: float, confidence: float = 0.95, least_inside: float | None = None
) -> Consistency:
    """Tests NEES or NIS values (runs, steps) of independent runs.

    Averages of neighbouring steps are correlated, so the share of steps inside scatters more than a binomial count;
    by default `least_inside` is the confidence less 5 standard deviations of a count over a tenth of the steps.

    Raises:
        EstimatorError: values not finite or not (runs, steps).

    >>> import numpy as np
    >>> values = np.random.default_rng(1).chisquare(2, (50, 20))  # NEES of two states, 50 runs of 20 steps
    >>> bool(consistency(values, freedom=2).consistent)
    True
    """
    table = numbers(values, "values")
    if table.ndim != 2 or not table.size:
        raise EstimatorError(f"values has shape {table.shape}, expected (runs, steps)")
    if not np.isfinite(table).all():
        raise EstimatorError("values are not finite; leave out the steps without a measurement")
    runs, steps = table.shape
    band = average_band(runs, freedom, confidence)
    average: FloatArray = table.mean(axis=0)
    inside = float(((average >= band[0]) & (average <= band[1])).mean())
    if least_inside is None:
        independent = max(1.0, steps / 10)
        least_inside = max(0.0, confidence - 5 * math.sqrt(confidence * (1 - confidence) / independent))
    return Consistency(average, band, confidence, inside, least_inside, inside >= least_inside)


def _normalised(vector: FloatArray, matrix: FloatArray) -> FloatArray:
    try:
        solved = np.linalg.solve(matrix, vector[..., None])[..., 0]
    except np.linalg.LinAlgError as error:
        raise EstimatorError("covariance is singular; the normalised square is not defined") from error
    return np.asarray((vector * solved).sum(axis=-1), dtype=np.float64)
