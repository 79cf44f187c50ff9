"""Inputs that reach an observer are finite, in range and flagged: the last good value is held."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from estimators.arrays import AnyArray, BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.filters.step import bounded, broadcast, numbers


class HeldInput:
    """One input per batch entry, with any trailing axes, held where it is missing and clipped where it is impossible.

    Args:
        initial: what is used as long as nothing finite was seen; shape (*batch, ...).
        low, high: range beyond which a value is clipped.
        axes: how many trailing axes belong to the input itself.
    """

    def __init__(self, what: str, initial: FloatArray, low: float, high: float, axes: int = 0) -> None:
        self.what, self.low, self.high, self.axes = what, low, high, axes
        self.initial = initial
        self.value = initial.copy()

    def __call__(self, given: npt.ArrayLike, flags: FlagArray) -> FloatArray:
        """The usable value; raises flags of the entries.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        array = broadcast(given, self.value.shape, self.what)
        if np.minimum.reduce(array, None) >= self.low and np.maximum.reduce(array, None) <= self.high:  # False for NaN
            self.value = array.copy()
            return self.value
        inner = tuple(range(-self.axes, 0))
        good = bounded(array)
        if not good.all():
            raise_flag(flags, np.asarray(~good.all(axis=inner)), Flag.MISSING_INPUT)
        held = np.where(good, array, self.value)
        clipped = np.clip(held, self.low, self.high)
        if not np.array_equal(clipped, held):
            raise_flag(flags, np.asarray((clipped != held).any(axis=inner)), Flag.PARAMETER_OUT_OF_RANGE)
        self.value = clipped
        return clipped

    def forget(self, where: BoolArray) -> None:
        """Starts the entries afresh."""
        self.value[where] = self.initial[where]


def checked_noise(value: npt.ArrayLike | None, default: tuple[float, ...], what: str, zero: bool) -> FloatArray:
    """Variances of the states or channels as a diagonal matrix.

    Raises:
        EstimatorError: another number of them, not finite, negative (or zero, unless allowed).
    """
    variances = numbers(default if value is None else value, what)
    if variances.shape != (len(default),):
        raise EstimatorError(f"{what} has shape {variances.shape}, expected {len(default)} variances")
    good = np.isfinite(variances) & ((variances >= 0) if zero else (variances > 0))
    if not good.all():
        kind = "finite and not negative" if zero else "finite and positive"
        raise EstimatorError(f"{what}[{int(np.argmin(good))}] = {variances[np.argmin(good)]:g} must be {kind}")
    return np.diag(variances)


def check_saved(saved: Mapping[str, AnyArray], own: Mapping[str, AnyArray]) -> None:
    """Compares saved arrays with what is expected.

    Raises:
        EstimatorError: incomplete, of another shape or not finite.
    """
    for key, array in own.items():
        if key not in saved:
            raise EstimatorError(f"saved state lacks '{key}'")
        if np.shape(saved[key]) != array.shape:
            raise EstimatorError(f"saved '{key}' has shape {np.shape(saved[key])}, expected {array.shape}")
        if not np.isfinite(saved[key]).all():
            raise EstimatorError(f"saved '{key}' is not finite")
