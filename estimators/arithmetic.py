"""One formula for one car, on plain numbers, and for many cars, on arrays: what Python's operators leave open.

A numpy call costs about a microsecond whatever the size of its arrays, and a filter takes hundreds: for a single car
plain numbers are ten times faster. A formula written with + - * / and one of these kits serves both, so there is one.
Every value is a `Number`: a float (or a bool) of one car, or an array of the batch shape; what there is of every wheel or
axle are `Signals`. Conditions combine with & and |; their negation is `no`, because ~True is -2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

from estimators.arguments import entries, number
from estimators.arrays import AnyArray

Number = Any
"""A float, int or bool of one car, or an array of the batch shape."""
Signals = Any
"""Several numbers, such as four wheels: a sequence of those of one car, or an array (k, ...) of k of all cars."""


class Arithmetic:
    """What `OneCar` and `ManyCars` share."""

    exp: Any
    sqrt: Any
    sin: Any
    cos: Any
    tan: Any
    atan: Any
    where: Any  # (condition, value where it holds, value elsewhere)
    maximum: Any
    minimum: Any
    sign: Any
    no: Any  # negation of a condition
    known: Any  # whether a number is finite
    some: Any  # whether a condition holds for any car

    def silent(self) -> AbstractContextManager[Any]:
        """Within it, what is not finite is made without a warning."""
        raise NotImplementedError

    def full(self, value: float | bool) -> Number:
        """The same for every car."""
        raise NotImplementedError

    def own(self, value: npt.ArrayLike) -> Number:
        """A signal of the batch shape as a `Number`."""
        raise NotImplementedError

    def car(self, value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> Number:
        """An argument of the batch shape `shape`, or one number for all cars.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        raise NotImplementedError

    def wheels(self, value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> Signals:
        """An argument (*shape, 4), or one number for all wheels.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        return self.rows(entries(value, (*shape, 4), what), 4)

    def each(self, formula: Callable[..., tuple[Number, ...]], *signals: Signals) -> tuple[Signals, ...]:
        """The results of a formula for each entry of the signals, which are as long as each other."""
        raise NotImplementedError

    def signals(self, values: Sequence[float]) -> Signals:
        """Constants, one an entry."""
        raise NotImplementedError

    def stacked(self, values: Sequence[Number]) -> Signals:
        """Numbers side by side."""
        raise NotImplementedError

    def rows(self, value: AnyArray, width: int) -> Signals:
        """The `width` columns of (..., width)."""
        raise NotImplementedError

    def table(self, groups: Sequence[Signals], shape: tuple[int, ...]) -> AnyArray:
        """The contrary of `rows`: (*shape, width), the groups side by side."""
        raise NotImplementedError

    def replaced(self, where: Number, new: float, value: Any) -> Any:
        """A number or signals with `new` for the cars `where`."""
        raise NotImplementedError


_NOTHING = nullcontext()


def _choose(condition: bool, yes: Any, otherwise: Any) -> Any:
    return yes if condition else otherwise


def _larger(a: float, b: float) -> float:
    return a if a > b else b


def _smaller(a: float, b: float) -> float:
    return a if a < b else b


def _sign(a: float) -> float:
    return 1.0 if a > 0.0 else -1.0 if a < 0.0 else 0.0


def _not(a: bool) -> bool:
    return not a


class OneCar(Arithmetic):
    """Plain numbers; nothing may overflow, for Python raises where numpy gives infinity."""

    exp, sqrt, sin, cos, tan, atan = map(staticmethod, (math.exp, math.sqrt, math.sin, math.cos, math.tan, math.atan))
    where, maximum, minimum = staticmethod(_choose), staticmethod(_larger), staticmethod(_smaller)
    sign, no, known, some = map(staticmethod, (_sign, _not, math.isfinite, bool))

    def silent(self) -> AbstractContextManager[Any]:
        """Plain numbers warn of nothing."""
        return _NOTHING

    def full(self, value: float | bool) -> Number:
        """`value` itself."""
        return value

    def own(self, value: npt.ArrayLike) -> Number:
        """The only entry."""
        return value if type(value) is float else np.asarray(value).item()  # numpy's own floats are slow

    def car(self, value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> Number:
        """A float."""
        return number(value, shape, what)

    def each(self, formula: Callable[..., tuple[Number, ...]], *signals: Signals) -> tuple[Signals, ...]:
        """One after the other."""
        return tuple(zip(*map(formula, *signals), strict=True))

    def signals(self, values: Sequence[float]) -> Signals:
        """A tuple."""
        return tuple(values)

    def stacked(self, values: Sequence[Number]) -> Signals:
        """As they are."""
        return values

    def rows(self, value: AnyArray, width: int) -> Signals:
        """The entries as a list."""
        out: list[Number] = (value if value.ndim == 1 else value.reshape(width)).tolist()
        return out

    def table(self, groups: Sequence[Signals], shape: tuple[int, ...]) -> AnyArray:
        """An array of the entries, behind axes of length one if `shape` has any."""
        array = np.array(list(chain.from_iterable(groups)))
        return array.reshape(*shape, -1) if shape else array

    def replaced(self, where: Number, new: float, value: Any) -> Any:
        """One number, or a list of them."""
        if not isinstance(value, list | tuple):
            return new if where else value
        return [new] * len(value) if where else value


class ManyCars(Arithmetic):
    """Arrays of `shape`."""

    exp, sqrt, sin, cos, tan, atan = np.exp, np.sqrt, np.sin, np.cos, np.tan, np.arctan
    where, maximum, minimum, sign, no = staticmethod(np.where), np.maximum, np.minimum, np.sign, np.logical_not
    known = np.isfinite

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.shape = shape
        cars = len(shape)  # a moved axis by `np.moveaxis` costs more than small arrays do
        self._columns, self._back = (cars, *range(cars)), (*range(1, cars + 1), 0)

    @staticmethod
    def some(condition: Any) -> bool:
        """Whether it holds for any car."""
        return bool(np.count_nonzero(condition))

    def silent(self) -> AbstractContextManager[Any]:
        """Of numpy."""
        return np.errstate(invalid="ignore", over="ignore")

    def full(self, value: float | bool) -> Number:
        """An array."""
        return np.full(self.shape, value)

    def own(self, value: npt.ArrayLike) -> Number:
        """The array."""
        return np.asarray(value)

    def car(self, value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> Number:
        """An array of the kit's own shape."""
        return entries(value, shape, what).reshape(self.shape)

    def each(self, formula: Callable[..., tuple[Number, ...]], *signals: Signals) -> tuple[Signals, ...]:
        """All at once."""
        return formula(*signals)

    def signals(self, values: Sequence[float]) -> Signals:
        """An array (k, 1...)."""
        return np.array(values).reshape(-1, *(1 for _ in self.shape))

    def stacked(self, values: Sequence[Number]) -> Signals:
        """(k, ...)."""
        return np.array(values)

    def rows(self, value: AnyArray, width: int) -> Signals:
        """Contiguous (width, ...)."""
        return np.ascontiguousarray(value.reshape(*self.shape, width).transpose(self._columns))

    def table(self, groups: Sequence[Signals], shape: tuple[int, ...]) -> AnyArray:
        """Groups that are lists are stacked first."""
        arrays = [group if isinstance(group, np.ndarray) else np.array(group) for group in groups]
        return np.concatenate(arrays).transpose(self._back).reshape(*shape, -1)

    def replaced(self, where: Number, new: float, value: Any) -> Any:
        """The cars are the last axis."""
        return np.where(where, new, value)


def arithmetic(shape: tuple[int, ...]) -> Arithmetic:
    """Plain numbers for one car, arrays for more."""
    return OneCar() if math.prod(shape) == 1 else ManyCars(shape)
