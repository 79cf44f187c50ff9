r"""A sampled observer whose sample time varies: e+ = (e^(T A) - K C) e with T anywhere in an interval at every sample.

The sample time is one more parameter, which may jump; the gain is that of the table, whatever T is. Scheduling parameters of
the observer keep their rates, over the longest sample. One sample is the unit of time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat

from estimators.arrays import FloatArray
from synthesis.loop.observer import ORDER, ObserverLoop
from synthesis.loop.plant import Axis, Plant
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials.enclosure import PolynomialMatrix, constant, identity, variable, zero
from synthesis.polynomials.exponential import exponential, phi
from synthesis.polynomials.rational import rational

NAME = "sample_time"


@dataclass(frozen=True)
class JitterLoop:
    """The error of an observer with the update `sampled` over a sample of any length from `shortest` to `longest` (s)."""

    observer: ObserverLoop
    shortest: fmpq
    longest: fmpq
    time: Time = "discrete"
    _systems: dict[Any, System | None] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def plant(self) -> Plant:
        """That of the observer with the sample time as its last parameter; rates per sample."""
        axes = tuple(
            replace(
                axis,
                rate_low=None if axis.rate_low is None else axis.rate_low * self.longest,
                rate_high=None if axis.rate_high is None else axis.rate_high * self.longest,
            )
            for axis in self.observer.plant.axes
        )
        sample = Axis(NAME, "s", self.shortest, self.longest, None, None)
        plant = self.observer.plant
        return replace(
            plant, axes=(*axes, sample), half_spaces=tuple(h.among(len(axes) + 1) for h in plant.half_spaces)
        )

    @property
    def states(self) -> int:
        """Those of the observer's error."""
        return self.observer.states

    @property
    def breakpoints(self) -> tuple[tuple[fmpq, ...], ...]:
        """Of the table; the sample time has its ends."""
        return (*self.observer.breakpoints, (self.shortest, self.longest))

    @property
    def sample_time(self) -> fmpq:
        """One sample."""
        return fmpq(1)

    def cells(self) -> Iterator[Region]:
        """Those of the table, all sample times."""
        for cell in self.observer.cells():
            count = cell.parameters
            yield Region(
                (*cell.offset[:count], fmpq(0), *cell.offset[count:], fmpq(0)),
                (*cell.factor[:count], fmpq(1), *cell.factor[count:], fmpq(1)),
            )

    def system(self, region: Region, time: Time) -> System | None:
        """The update on a region; None where the exponential is too large, or a denominator not certainly positive."""
        count = region.parameters
        box = (region.offset[:count], region.factor[:count])
        if box not in self._systems:
            self._systems[box] = self._update(region)
        return self._systems[box]

    def _update(self, region: Region) -> System | None:
        count, inner = region.parameters, region.parameters - 1
        observers = Region((*region.offset[:inner], *(fmpq(0),) * inner), (*region.factor[:inner], *(fmpq(0),) * inner))
        axis = self.plant.axes[-1]
        length = constant(fmpq_mat([[axis.middle + axis.half * region.offset[inner]]]), 2 * count)
        length = (length + variable(inner, 2 * count) * (axis.half * region.factor[inner])).balls()
        plant = self.observer.plant_on(observers, "AC", divided=True)
        if plant is None:
            return None
        A, C, gain = (
            _with_sample_time(matrix, inner) for matrix in (plant["A"], plant["C"], self.observer.gain(observers))
        )
        TA = A.scaled_by(length)
        integral = phi(TA)
        if integral is None:
            return None
        coasting = exponential(TA, integral)
        unit = identity(A.shape[0], 2 * count)
        return System("discrete", (coasting - gain @ C).truncated(ORDER), {}, unit, {}, coasting)


def observer_of(A: FloatArray, C: FloatArray, K: FloatArray) -> ObserverLoop:
    """A constant observer as a loop without parameters; every number is the binary one that it is."""
    (p, n), none = C.shape, zero
    matrices = {"A": A, "C": C}
    exact = {key: _exact(matrix) for key, matrix in matrices.items()}
    exact |= {key: constant(none(shape), 0) for key, shape in
              {"B": (n, 0), "D": (p, 0), "E": (n, 0), "F": (p, 0)}.items()}  # fmt: skip
    table: dict[tuple[int, ...], fmpq_mat] = {(): fmpq_mat(n, p, [rational(float(x)) for x in np.asarray(K).ravel()])}
    return ObserverLoop(Plant((), exact, identity(1, 0)), (), table, "sampled", None, rounded=False)


def _exact(matrix: FloatArray) -> PolynomialMatrix:
    rows, columns = matrix.shape
    return constant(fmpq_mat(rows, columns, [rational(float(x)) for x in matrix.ravel()]), 0)


def _with_sample_time(matrix: PolynomialMatrix, inner: int) -> PolynomialMatrix:
    """From variables (t_1 .. t_p, r_1 .. r_p) to those with a sample time and its rate behind each group."""
    terms = {(*k[:inner], 0, *k[inner:], 0): m for k, m in matrix.terms.items()}
    return PolynomialMatrix(terms, matrix.shape, 2 * inner + 2)
