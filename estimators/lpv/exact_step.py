r"""The update of an observer of any size over one sample with u, y and p held, by a Taylor series whose length is proved enough.

    held     xhat+ = xhat + phi(M) T (A xhat + B u + L innovation),   M = T (A - L C)
    sampled  xhat+ = xhat + phi(M) T (A xhat + B u) + K innovation,   M = T A

with phi(M) = int_0^1 e^(Ms) ds and innovation = y - C xhat - D u at the start of the sample. phi(M) v is all that is needed:
with v_k = M v_(k-1)/(k+1) it is the sum of the v_k, in `pieces` equal parts of the sample where M is large. |M| <= nu on the
whole range, in the largest row sum of diag(w) |M| diag(w)^-1 (bounds of |A| and |C| are those of `largest` of their
polynomials, that of |L| is the largest entry of the table). With z = nu/pieces the terms from k = K on sum to less than z^K
/ (K+1)! / (1 - z/(K+2)), whatever the parameters are; K is the least with a sum below 2^-53 of the first term.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import ScheduleError
from estimators.interpolate import Multilinear
from estimators.schedule import GainSchedule
from estimators.schedule.plant import chebyshev
from estimators.schedule.plant_cells import PlantByCells
from estimators.schedule.quotient import PlantQuotient

_ENOUGH = 2.0**-53
_STIFFEST = 2000.0  # of nu: more would take 500 pieces of a sample
_MOST_GROWTH = 50.0  # exponent of growth in one sample; from e^700 on float64 overflows
_LOOKS = 500  # places at most where growth is looked for
_LARGEST_STEP = 1e50  # of the numbers in T A, T L C: their products meet states of up to 1e100 (arguments.LIMIT)
_ROUNDS = 8  # of balancing


def series(nu: float) -> tuple[int, int]:
    """(pieces, terms) of phi(M) v for |M| <= nu: the cheapest that leave less than 2^-53 of v."""
    best = (1, 60)
    for pieces in range(max(1, math.ceil(nu / 4.0)), max(2, math.ceil(4.0 * nu) + 1)):
        z = nu / pieces
        for terms in range(1, 60):
            rest = z**terms / math.factorial(terms + 1) / (1.0 - z / (terms + 2)) if z < terms + 2 else math.inf
            if rest <= _ENOUGH:
                break
        if pieces * (terms + 1) < best[0] * (best[1] + 1) or best == (1, 60):
            best = pieces, terms
    return best


def norm_bound(size: FloatArray) -> float:
    """The largest row sum of diag(w) size diag(w)^-1 for powers of two w that nearly balance it."""
    work = size.copy()
    for _ in range(_ROUNDS):
        for i in range(len(work)):
            row, column = work[i].sum() - work[i, i], work[:, i].sum() - work[i, i]
            if row > 0.0 and column > 0.0:
                step = 2.0 ** round(0.5 * math.log2(column / row))
                work[i] *= step
                work[:, i] /= step
    return float(min(work.sum(axis=1).max(initial=0.0), size.sum(axis=1).max(initial=0.0))) * (1.0 + 1e-12)


class ExactStep:
    """Plant, gains and sample time of a schedule, ready for entries (n, ..)."""

    def __init__(self, schedule: GainSchedule) -> None:
        self.sizes = len(schedule.states), len(schedule.inputs), len(schedule.outputs)
        nx, nu, ny = self.sizes
        period = schedule.sample_time
        stored: dict[str, FloatArray] = {}  # with the cells of the plant in front
        sizes: dict[str, FloatArray] = {}
        count = len(schedule.parameters)
        first = schedule.plant["A"]
        self.cells = first if isinstance(first, PlantByCells) else None
        self.divided = False
        for key, scale in (("A", period), ("B", period), ("C", 1.0), ("D", 1.0)):
            matrix = schedule.plant[key]
            sizes[key] = scale * matrix.largest
            if isinstance(matrix, PlantByCells):
                stored[key] = scale * matrix.pieces
                continue
            if isinstance(matrix, PlantQuotient):
                stored["denominator"], matrix, self.divided = (
                    matrix.denominator.coefficients[None],
                    matrix.numerator,
                    True,
                )
            stored[key] = scale * matrix.coefficients[None]
        self.orders = [max(1, *(part.shape[1 + axis] for part in stored.values())) for axis in range(count)]
        flat, number = [], len(stored["A"])
        shapes = {"A": (nx, nx), "B": (nx, nu), "C": (ny, nx), "D": (ny, nu)}
        for key, shape in (shapes | ({"denominator": (1, 1)} if self.divided else {})).items():
            full = np.zeros((number, *self.orders, *shape))
            full[(slice(None), *(slice(n) for n in stored[key].shape[1 : 1 + count]))] = stored[key]
            flat.append(full.reshape(number, math.prod(self.orders), shape[0] * shape[1]))
        self.coefficients: FloatArray = np.concatenate(flat, axis=2)
        self.ends = np.cumsum([part.shape[2] for part in flat])[:-1]
        if self.cells is None:
            self.middle, self.half = (np.atleast_1d(getattr(first, key)) for key in ("middle", "half"))
            self.coefficients = self.coefficients[0]
        self.sampled = schedule.observer_update == "sampled"
        table = schedule.table if self.sampled else period * schedule.table
        self.gains = Multilinear(schedule.grid, table)
        gain = np.abs(table).max(axis=tuple(range(count)))
        products = float((gain @ np.hstack([sizes["C"], sizes["D"]])).sum())
        if not max(float(sizes["A"].sum() + sizes["B"].sum()), products) <= _LARGEST_STEP:
            raise ScheduleError(
                f"schedule '{schedule.name}': plant, gains and sample time multiply to more than {_LARGEST_STEP:g} in one "
                "sample, where float64 overflows; check their units"
            )
        largest = norm_bound(sizes["A"] + (0.0 if self.sampled else gain @ sizes["C"]))
        self._refuse_growth(schedule)
        if not largest <= _STIFFEST:
            raise ScheduleError(
                f"schedule '{schedule.name}': the fastest error moves {largest:.0f} times faster than a sample; shorten the "
                "sample time or bound the fastest pole"
            )
        self.pieces, self.terms = series(largest)
        self.factors = [1.0 / (k + 1) for k in range(1, self.terms)]

    def _refuse_growth(self, schedule: GainSchedule) -> None:
        """A proved schedule never comes here; a wrong sign or sample time must not end in an overflow."""
        count = len(schedule.grid)
        lines = [np.union1d(line, 0.5 * (line[1:] + line[:-1])) for line in schedule.grid]
        while math.prod(map(len, lines)) > _LOOKS and max(map(len, lines)) > 2:
            lines = [np.union1d(line[::2], line[-1:]) if len(line) > 3 else line[[0, -1]] for line in lines]
        places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, count)
        A, _, C, _ = self.plant(places)
        for matrices in (A,) if self.sampled else (A, A - self.gains(places) @ C):
            growth = np.linalg.eigvals(matrices).real.max(axis=-1)
            if not growth.max() <= _MOST_GROWTH:
                place = places[int(growth.argmax())]
                at = ", ".join(f"{q.name} = {x:g} {q.unit}" for q, x in zip(schedule.parameters, place, strict=True))
                raise ScheduleError(
                    f"schedule '{schedule.name}': the error grows by e^{growth.max():.0f} in one sample at {at}; check the signs "
                    "of the gains and the sample time"
                )

    def plant(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """T A, T B, C and D at parameters (n, p)."""
        nx, nu, ny = self.sizes
        if self.cells is None:
            values = chebyshev((parameters - self.middle) / self.half, self.orders) @ self.coefficients
        else:
            number, t = self.cells.local(parameters)
            values = np.einsum("gk,gkf->gf", chebyshev(t, self.orders), self.coefficients.take(number, 0))
        if self.divided:  # by the last column
            values = values / values[:, -1:]
        A, B, C, D = np.split(values, self.ends, axis=1)[:4]
        n = len(parameters)
        return A.reshape(n, nx, nx), B.reshape(n, nx, nu), C.reshape(n, ny, nx), D.reshape(n, ny, nu)

    def advance(
        self, state: FloatArray, held: FloatArray, measured: FloatArray, parameters: FloatArray, used: BoolArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """States (n, nx) at the end of the sample and innovations (n, ny) at its start; not `used`: moved with L = 0."""
        A, B, C, D = self.plant(parameters)
        gain = self.gains(parameters)
        if used is not None:
            gain = gain * used[:, None, None]
        innovation = measured - _times(C, state) - _times(D, held)
        correction = _times(gain, innovation)
        rate = _times(A, state) + _times(B, held)
        M: Any = A
        if not self.sampled:
            rate = rate + correction
            M = A - gain @ C
        moved = self._moved_one(M[0], rate[0], state[0])[None] if len(state) == 1 else self._moved(M, rate, state)
        return (moved + correction if self.sampled else moved), innovation

    def _moved_one(self, M: FloatArray, rate: FloatArray, state: FloatArray) -> FloatArray:
        """x + phi(M) r of one entry, in equal pieces: over each of them r changes by M times the movement."""
        M, rate = M * (1.0 / self.pieces), rate * (1.0 / self.pieces)
        for piece in range(self.pieces):
            term = change = rate
            for factor in self.factors:
                term = M.dot(term) * factor
                change = change + term
            state = state + change
            if piece + 1 < self.pieces:
                rate = rate + M.dot(change)
        return state

    def _moved(self, M: FloatArray, rate: FloatArray, state: FloatArray) -> FloatArray:
        """The same of many entries, column by column."""
        M, rate = M * (1.0 / self.pieces), rate[..., None] * (1.0 / self.pieces)
        state = state[..., None]
        for piece in range(self.pieces):
            term = change = rate
            for factor in self.factors:
                term = (M @ term) * factor
                change = change + term
            state = state + change
            if piece + 1 < self.pieces:
                rate = rate + M @ change
        return np.asarray(state[..., 0])


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
