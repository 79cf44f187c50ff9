r"""What the system certainly does along one periodic path: the map over a period enclosed in balls, and what follows from it.

Ratio: for the input that a search found, the periodic answer is solved for in balls. The ratio of the energies over one period
is a lower bound of the L2 gain (Cantoni, Sandberg 2009; Peni, Seiler 2016): the input, repeated often enough and then ended,
comes as near to it as one likes. (Along a path that is not stable the gain is infinite, and any number is a lower bound.)
Growth: a monodromy matrix with an eigenvalue that is certainly not inside the circle of radius e^(-aT) decays no faster than a.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, fmpq

from analysis.lpv.lifted import intervals
from analysis.lpv.proved_step import Interval, Line, adjoint
from analysis.lpv.question import Question
from analysis.lpv.trajectory import Path, check_admissible
from estimators.arrays import ComplexArray
from synthesis.polynomials.rational import rational
from synthesis.polynomials.stable import is_schur

MOST_STEPS = 20_000


@dataclass(frozen=True)
class ProvedPath:
    """The intervals of a path, each in balls; `frequency` of the carrier e^(jwt), `parts` intervals for every piece."""

    question: Question
    path: Path
    frequency: float
    parts: int

    @cached_property
    def intervals(self) -> list[Interval] | None:
        """One after another; None where they cannot be enclosed. Raises AnalysisError for a path that is not admissible."""
        check_admissible(self.path, self.question.axes, self.question.loop.plant.half_spaces)
        if self.question.discrete:
            return [line.sample() for line in self._lines(1, fmpq(1))]
        start, change = intervals(self.path, self.parts)
        A, B, *_ = self.question.frozen(np.concatenate([start, start + change]))
        size = float(np.abs(A).sum(axis=-1).max()) + abs(self.frequency)
        length = float(self.path.durations.max()) / self.parts
        steps = max(1, int(np.ceil(2.0 * size * length)))
        if steps * len(start) > MOST_STEPS:
            return None
        # Inputs in a unit that makes B no larger than A: they stand still, so that only the norm of M feels their size.
        largest = float(np.abs(B).sum(axis=-1).max(initial=0.0))
        unit = fmpq(2) ** int(np.floor(np.log2(max(size, 1.0 / length) / largest))) if largest > 0.0 else fmpq(1)
        found: list[Interval] = []
        for number, line in enumerate(self._lines(steps, unit)):
            one = line.step()
            if one is None:
                return None
            found[number // steps :] = [one if number % steps == 0 else found[-1].then(one)]
        return [one.with_inputs_times(unit, self._states) for one in found]

    @property
    def _states(self) -> int:
        return self.question.loop.plant.states

    @cached_property
    def lengths(self) -> list[fmpq]:
        """Of the intervals, exact."""
        if self.question.discrete:
            return [fmpq(1)] * round(self.path.period)
        return [rational(float(x)) / self.parts for x in self.path.durations for _ in range(self.parts)]

    @cached_property
    def starts(self) -> list[list[fmpq]]:
        """u at the beginning of every interval, exact."""
        return [line.start for line in self._lines(1, fmpq(1))]

    def _lines(self, steps: int, unit: fmpq) -> Iterator[Line]:
        """Every step of every interval of every piece, exact; in discrete time every sample."""
        for first, last, duration in zip(self.path.start, self.path.end, self.path.durations, strict=True):
            a, b = ([rational(float(x)) for x in side] for side in (first, last))
            count = round(duration) if self.question.discrete else self.parts * steps
            change = [(y - x) / count for x, y in zip(a, b, strict=True)]
            h = rational(float(duration)) / count
            for k in range(count):
                start = [x + c * k for x, c in zip(a, change, strict=True)]
                yield Line(self.question, start, change, h, self.frequency, unit)

    def ratio(self, v: ComplexArray) -> float:
        """A float that is certainly not above the ratio for the input v (N, m); 0.0 where nothing can be said."""
        if self.intervals is None:
            return 0.0
        n = self._states
        inputs = [acb_mat([[acb(float(x.real), float(x.imag))] for x in row]) for row in v]
        steps = [_split(one.step, n) for one in self.intervals]
        whole, forced = _identity(n), acb_mat(n, 1)
        for (F, G), given in zip(steps, inputs, strict=True):
            whole, forced = F * whole, F * forced + G * given
        try:
            state = (_identity(n) - whole).solve(forced)
        except ZeroDivisionError:
            return 0.0
        energy, spent = arb(0), arb(0)
        for one, (F, G), given, length in zip(self.intervals, steps, inputs, self.lengths, strict=True):
            both = acb_mat([*state.tolist(), *given.tolist()])
            energy = energy + (adjoint(both) * one.energy * both)[0, 0].real
            spent = spent + (adjoint(given) * given)[0, 0].real * length
            state = F * state + G * given
        return floor_of((energy / spent).sqrt()) if spent > 0 and energy > 0 else 0.0

    def decays_no_faster(self, rate: float) -> bool:
        """Whether the monodromy matrix certainly has an eigenvalue of absolute value e^(-rate T) or more."""
        if self.intervals is None:
            return False
        F = arb_mat(_identity(self._states).real)
        for one in self.intervals:
            F = arb_mat(_split(one.step, self._states)[0].real) * F
        period = sum(self.lengths, fmpq(0))
        return is_schur(F * arb(rational(rate) * period).exp()) is False


def floor_of(number: Any) -> float:
    """A float that is certainly not above a ball; 0.0 if that is not positive."""
    if not number > 0:
        return 0.0
    low = float(number.mid()) * (1.0 - 1e-15) - float(number.rad()) * (1.0 + 1e-15)
    return max(0.0, low) if np.isfinite(low) else 0.0


def _split(step: Any, n: int) -> tuple[Any, Any]:
    rows = step.tolist()[:n]
    return acb_mat([row[:n] for row in rows]), acb_mat([row[n:] for row in rows])


def _identity(n: int) -> Any:
    return acb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
