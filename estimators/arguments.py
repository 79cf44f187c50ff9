"""Arguments of a step and settings of a constructor: accepted with their shape and unit, or refused in one line."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError

LIMIT = 1e100  # a magnitude beyond it is treated as not finite: no physical quantity, and products would overflow
_FEW, _SMALL = 6, 4096  # entries


def numbers(value: npt.ArrayLike, what: str) -> FloatArray:
    """`value` as float64.

    Raises:
        EstimatorError: not numbers.
    """
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise EstimatorError(f"{what} is not an array of numbers: {error}") from error


def broadcast(value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> FloatArray:
    """`value` broadcast to `shape` (a read-only view).

    Raises:
        EstimatorError: names the shapes that do not fit.
    """
    array = numbers(value, what)
    if array.shape == shape:
        return array
    try:
        return np.broadcast_to(array, shape)
    except ValueError as error:
        raise EstimatorError(f"{what} has shape {array.shape}, expected {shape} or what broadcasts to it") from error


def vectors(value: npt.ArrayLike, shape: tuple[int, ...], size: int, what: str) -> FloatArray:
    """`value` of (*shape, size) as (entries, size); the last axis may be left out where it is one long.

    Raises:
        EstimatorError: not numbers, or another shape.
    """
    array, wanted = numbers(value, what), (*shape, size)
    if array.shape != wanted and not (size == 1 and array.shape == shape):
        raise EstimatorError(f"{what} has shape {array.shape}, expected {wanted}")
    return array.reshape(math.prod(shape), size)


def entries(value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> FloatArray:
    """`value` as float64 of `shape`; one number stands for all entries.

    Raises:
        EstimatorError: not numbers, or another shape.
    """
    array = numbers(value, what)
    if array.shape == shape:
        return array
    if array.ndim == 0:
        return np.broadcast_to(array, shape)
    raise EstimatorError(f"{what} has shape {array.shape}, expected {shape} or one number")


def number(value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> float:
    """`entries` for a shape of one entry, as a plain number.

    Raises:
        EstimatorError: not a number, or another shape.
    """
    return float(value) if isinstance(value, float) else float(entries(value, shape, what).item())


def apart(value: npt.ArrayLike | None, shape: tuple[int, ...], what: str) -> list[Any]:
    """The plain numbers of `entries`, one after the other; None as often, if it is None.

    Raises:
        EstimatorError: not numbers, or another shape.
    """
    if value is None or isinstance(value, float):
        return [value] * math.prod(shape)
    return entries(value, shape, what).ravel().tolist()


def pair(
    first: npt.ArrayLike, second: npt.ArrayLike, shape: tuple[int, ...], what: str = "first", other: str = "second"
) -> FloatArray:
    """Two signals of `shape` side by side on a new last axis."""
    both: FloatArray = np.empty((*shape, 2))
    both[..., 0], both[..., 1] = entries(first, shape, what), entries(second, shape, other)
    return both


def mask(value: npt.ArrayLike | None, shape: tuple[int, ...], what: str) -> BoolArray:
    """A bool mask of `shape`; None: all.

    Raises:
        EstimatorError: another type or shape.
    """
    if value is None:
        return np.ones(shape, dtype=np.bool_)
    array = np.asarray(value)
    if array.dtype != np.bool_ or array.shape != shape:
        raise EstimatorError(f"{what}: {array.dtype} {array.shape}, expected a bool mask of shape {shape}")
    return array


def bounded(value: FloatArray, limit: float = LIMIT) -> BoolArray:
    """Which entries are finite and of a size that means something; comparisons with NaN are false."""
    return np.absolute(value) <= limit


def quiet(value: FloatArray, limit: float = LIMIT) -> bool:
    """Whether all entries are within `limit`: what every step asks first. False for NaN.

    Plain numbers for a handful (their sum: False may also mean that they are large together); one dot product for small
    arrays, unless they are large together; for large ones BLAS would start threads, and extrema are as fast.
    """
    if value.ndim == 0:
        return bool(abs(value.item()) <= limit)
    if value.ndim == 1 and value.size <= _FEW:
        return bool(sum(map(abs, value.tolist())) <= limit)
    if value.size <= _SMALL and np.vdot(value, value) <= limit * limit:
        return True
    return bool(np.minimum.reduce(value, None) >= -limit and np.maximum.reduce(value, None) <= limit)


def diagonal_noise(value: npt.ArrayLike | None, default: tuple[float, ...], what: str, zero: bool) -> FloatArray:
    """Variances of the states or channels as a diagonal matrix; `zero`: whether they may be zero.

    Raises:
        EstimatorError: another number of them, not finite, negative.
    """
    variances = numbers(default if value is None else value, what)
    if variances.shape != (len(default),):
        raise EstimatorError(f"{what} has shape {variances.shape}, expected {len(default)} variances")
    good = np.isfinite(variances) & ((variances >= 0) if zero else (variances > 0))
    if not good.all():
        kind = "finite and not negative" if zero else "finite and positive"
        raise EstimatorError(f"{what}[{int(np.argmin(good))}] = {variances[np.argmin(good)]:g} must be {kind}")
    return np.diag(variances)


def finite(value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> FloatArray:
    """`broadcast` of finite numbers, for the state that a `reset` sets.

    Raises:
        EstimatorError: another shape, or not finite.
    """
    array = broadcast(value, shape, what)
    if not bounded(array).all():
        raise EstimatorError(f"{what} is not finite; reset to finite numbers")
    return array


def any_missing(missing: BoolArray, shape: tuple[int, ...]) -> BoolArray:
    """Which entries of `shape` miss any of their channels, all axes of `missing` beyond `shape`."""
    return np.asarray(missing.reshape(*shape, -1).any(axis=-1), dtype=np.bool_)


def batch(shape: tuple[int, ...], corners: bool = False) -> tuple[int, ...]:
    """The batch shape of an estimator, as a tuple.

    Raises:
        EstimatorError: no entries, or not the four corners on the last axis where they are asked for.
    """
    given = tuple(int(size) for size in shape)
    if math.prod(given) < 1:
        raise EstimatorError(f"batch_shape = {given} holds no entries")
    if corners and (not given or given[-1] != 4):
        raise EstimatorError(f"batch_shape = {given} must end with the four corners fl, fr, rl, rr, such as (4,)")
    return given


def setting(value: float, what: str, unit: str, low: float = 0.0, low_allowed: bool = False) -> float:
    """A finite number above `low` (or at it, if allowed).

    Raises:
        EstimatorError: names the setting, its value and unit, and the bound.
    """
    number = float(value)
    if not math.isfinite(number) or number < low or (number == low and not low_allowed):
        bound = "at least" if low_allowed else "above"
        raise EstimatorError(f"{what} = {number:g} {unit} must be finite and {bound} {low:g} {unit}")
    return number


def positive_fields(settings: Any, what: str) -> None:
    """Every field of a dataclass is a finite number above zero.

    Raises:
        EstimatorError: names all that are not.
    """
    values = {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
    bad = [
        f"{name} = {value!r}"
        for name, value in values.items()
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf
    ]
    if bad:
        raise EstimatorError(f"{what} must be finite and above zero: {', '.join(bad)}")
