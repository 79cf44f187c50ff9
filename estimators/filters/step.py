"""What a correction returns, and what it does with the measurement vector before it is used."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from estimators.arguments import LIMIT, broadcast, numbers
from estimators.arguments import quiet as all_bounded  # `quiet` is the decorator here
from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters.chi_square import chi_square_quantile

__all__ = [
    "LIMIT",
    "FilterStep",
    "all_bounded",
    "bounded",
    "broadcast",
    "diagonal",
    "fits",
    "gate_threshold",
    "numbers",
]
__all__ += ["quiet", "refused"]


class FilterStep(NamedTuple):
    """Estimate after a correction with what a log needs; `...` are the batch axes, n states, m channels."""

    state: FloatArray  # (..., n)
    covariance: FloatArray  # (..., n, n)
    innovation: FloatArray  # (..., m) y - yhat; NaN where the channel is missing
    innovation_covariance: FloatArray  # (..., m, m) of all channels, as predicted before any was left out
    gain: FloatArray  # (..., n, m); zero columns for channels that were not used
    used: BoolArray  # (..., m) whether the channel corrected the estimate
    gated: BoolArray  # (..., m) present, but refused by the gate


# Values that are not finite are found by comparison and handled; numpy need not warn of them as well.
quiet = np.errstate(invalid="ignore", over="ignore", divide="ignore")


@lru_cache(maxsize=64)
def gate_threshold(gate: float | None) -> float | None:
    """Largest squared normalised innovation of a channel: the chi-square quantile of one degree of freedom.

    Raises:
        EstimatorError: a gate that is not a probability inside (0, 1).
    """
    if gate is None:
        return None
    if not 0.0 < gate < 1.0:
        raise EstimatorError(f"gate = {gate!r} must be a probability inside (0, 1), such as 0.999, or None")
    return chi_square_quantile(gate, 1)


def fits(shape: tuple[int, ...], batch: tuple[int, ...]) -> bool:
    """Whether leading axes broadcast to those of the batch without adding to them."""
    return len(shape) <= len(batch) and all(
        own in (1, full) for own, full in zip(reversed(shape), reversed(batch), strict=False)
    )


def bounded(array: FloatArray, *axes: int) -> BoolArray:
    """Whether finite and of a representable size: entry by entry, or all of those along the axes."""
    return np.asarray((np.absolute(array) <= LIMIT).all(axis=axes), dtype=np.bool_)


def diagonal(matrix: FloatArray) -> FloatArray:
    """(..., m) of (..., m, m), a view."""
    return matrix.diagonal(0, -2, -1)


def refused(
    innovation: FloatArray, variance: FloatArray, missing: BoolArray | None, threshold: float | None
) -> tuple[BoolArray, BoolArray | None]:
    """The gated channels, and all that are left out (None: no channel at all); variance is that of the innovation."""
    gated: BoolArray = np.zeros(innovation.shape, dtype=np.bool_)
    if threshold is None:
        return gated, missing
    gated = innovation * innovation > threshold * variance
    if missing is not None:
        gated &= ~missing
        return gated, missing | gated
    return gated, gated if gated.any() else None
