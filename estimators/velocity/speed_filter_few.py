"""`speed_filter` for a single car: numbers where few are involved, matrices where a correction moves all of P.

L is of the size of the channels, four at most: its inverse is found with plain numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from estimators.arrays import FloatArray, IntArray
from estimators.velocity.speed_filter import Columns, Shared, SpeedFilter, Values

_Row = list[float]  # a step of one car: 8.8 times faster than `SpeedFilter`


class SpeedFilterFew(SpeedFilter):
    """`mean` is a list of numbers, `spread` the covariance (n, n)."""

    def _start(self) -> None:
        self._means = self.prior_mean.tolist()
        self.mean: _Row = self._means.copy()
        self.spread: FloatArray = self.prior.copy()
        self.waiting, self.waited = [0.0, 0.0], 0
        self._rows: dict[tuple[int, ...], FloatArray] = {}  # of the transition matrix, the first: 1 and the coupling
        self._floor = self.prior.copy()
        self._floor[0] = self._floor[:, 0] = 0.0
        self._sensitivities: dict[int, tuple[FloatArray, IntArray, Columns]] = {}

    @property
    def state(self) -> FloatArray:
        """A copy of the mean, (1, n)."""
        return np.array([self.mean])

    @property
    def covariance(self) -> FloatArray:
        """P as (1, n, n)."""
        return self.spread[None].copy()

    def variance(self, place: int, other: int | None = None) -> float:
        """An entry of P."""
        return self.spread.item(place, place if other is None else other)

    def move(
        self,
        elapsed: float,
        magnitude: float,
        columns: tuple[int, ...],
        coupling: tuple[float, ...],
        shift: float,
        noise: float,
    ) -> None:
        """One sample on, as `SpeedFilter.move`."""
        x, P, row = self.mean, self.spread, self._rows.get(columns)
        if row is None:
            row = self._rows[columns] = np.zeros(self.size)
            row[0] = 1.0
        speed = x[0] + shift
        for place, value in zip(columns, coupling, strict=True):
            row[place] = value
            speed += value * x[place]
        first = row.dot(P)
        first[0] = row.dot(first) + noise
        P[0] = P[:, 0] = first
        self.mean = [speed, *x[1:]]
        time, way = self.waiting
        self.waiting = [time + elapsed, way + elapsed * magnitude]
        self.waited += 1
        if self.waited >= self.every:
            self._forget()
            self.waiting, self.waited = [0.0, 0.0], 0

    def _forget(self) -> None:
        time, way = self.waiting
        memory = np.exp(-self.rates * time)
        memory[self.place] = math.exp(-self.per_metre * way)
        self.spread = np.multiply.outer(memory, memory) * (self.spread - self._floor) + self._floor
        mean = self.prior_mean + memory * (self.mean - self.prior_mean)
        self.mean[1:] = mean[1:].tolist()

    def expect(self, columns: Columns, values: Values) -> _Row:
        """h P h' of each channel, as `SpeedFilter.expect`."""
        known = self._sensitivities.get(id(columns))  # kept below, so no other object gets its number
        if known is None:
            places = [k * self.size + row[j] for j in range(len(columns[0])) for k, row in enumerate(columns)]
            known = np.zeros((len(columns), self.size)), np.array(places), columns
            self._sensitivities[id(columns)] = known
        H, where, _ = known
        H.put(where, [value for over in values for value in over])
        self._W = H.dot(self.spread)
        self._S = self._W.dot(H.T).tolist()
        return [self._S[k][k] for k in range(len(columns))]

    def weigh(
        self,
        innovation: Sequence[float],
        variance: Sequence[float],
        used: Sequence[bool],
        learning: bool = True,
        shared: Shared = (),
    ) -> None:
        """Corrects with the channels of `expect` that are `used`, as `SpeedFilter.weigh`."""
        S, W, noise = self._S, self._W, variance
        for later, earlier, covariance in shared:
            S[later][earlier] += covariance
        if not all(used):
            rows = [k for k, counts in enumerate(used) if counts]
            if not rows:
                return
            S, W = [[S[k][j] for j in rows] for k in rows], W[rows]
            noise, innovation = [variance[k] for k in rows], [innovation[k] for k in rows]
        inverse = np.array(_inverse_factor(S, noise))
        U = inverse.dot(W)
        change, moved = U.T.dot(U), inverse.dot(innovation).dot(U).tolist()
        if not learning:
            change[self.learned :, self.learned :] = 0.0
            moved[self.learned :] = [0.0] * (self.size - self.learned)
        self.spread -= change
        self.mean = [a + b for a, b in zip(self.mean, moved, strict=True)]

    def renew(self, where: bool, first: float, variance: float) -> None:
        """Back to the priors, if `where`, with the speed `first` and its variance."""
        if where:
            self.mean, self.spread = [first, *self._means[1:]], self._floor.copy()
            self.spread[0, 0] = variance

    def restart(self, where: bool, first: float, variance: float) -> None:
        """The speed `first` with its variance, if `where`; parameters stay as they are known."""
        if where:
            self.mean = [first, *self.mean[1:]]
            self.spread[0] = self.spread[:, 0] = 0.0
            self.spread[0, 0] = variance

    def widen(self, where: bool, variance: float, place: int = 0) -> None:
        """Adds to the variance of a state, if `where`."""
        if where:
            self.spread[place, place] += variance


def _inverse_factor(S: list[_Row], noise: Sequence[float]) -> list[_Row]:
    """L^-1 with L L' = S + diag(noise), for up to four channels: each row from those above."""
    count, root = len(S), math.sqrt
    a = 1.0 / root(S[0][0] + noise[0])
    if count == 1:
        return [[a]]
    p = S[1][0] * a
    b = 1.0 / root(S[1][1] + noise[1] - p * p)
    ba = -p * a * b
    if count == 2:
        return [[a, 0.0], [ba, b]]
    s, t, own, *_ = S[2]
    p, q = s * a, s * ba + t * b
    c = 1.0 / root(own + noise[2] - p * p - q * q)
    ca, cb = -(p * a + q * ba) * c, -q * b * c
    if count == 3:
        return [[a, 0.0, 0.0], [ba, b, 0.0], [ca, cb, c]]
    s, t, u, own = S[3]
    p, q, r = s * a, s * ba + t * b, s * ca + t * cb + u * c
    d = 1.0 / root(own + noise[3] - p * p - q * q - r * r)
    last = [-(p * a + q * ba + r * ca) * d, -(q * b + r * cb) * d, -r * c * d, d]
    return [[a, 0.0, 0.0, 0.0], [ba, b, 0.0, 0.0], [ca, cb, c, 0.0], last]


def speed_filter(
    mean: FloatArray,
    spread: FloatArray,
    rates: FloatArray,
    spatial: tuple[int, float],
    learned: int,
    every: int,
    count: int,
) -> SpeedFilter:
    """The filter that is faster for `count` cars."""
    kind = SpeedFilterFew if count == 1 else SpeedFilter
    return kind(mean, spread, rates, spatial, learned, every, count)
