"""The Kalman filter of a speed and of the parameters that disturb it.

The speed, the first state, moves by its own input and by the others, which keep to themselves:

    x_0+ = x_0 + sum_j a_j x_j + u + w_0,      x_i+ = m_i + phi_i (x_i - m_i) + w_i,   Cov w = P0 - Phi P0 Phi.

Parameters change slowly, and forget every `every` samples for all of these at once: between, only the speed moves. Every
parameter is a first-order Gauss-Markov process around its prior mean m_i: however long nothing excites it, its
covariance never grows beyond the prior P0. A correction takes several channels at once, by the
Cholesky factor of their covariance, S = H P H' + R = L L', found row by row together with

    U = L^-1 H P,   z = L^-1 nu,   x+ = x + U' z,   P+ = P - U' U;

a channel that is not used leaves its row of U at zero. States behind the `learned` first ones may be only considered by a
correction: they do not move, and the block of P that is theirs alone stays (Schmidt (1966)).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimators.arithmetic import Number, Signals
from estimators.arrays import FloatArray, IntArray
from estimators.memory import Memory

Columns = tuple[tuple[int, ...], ...]
"""Of each channel, the states that it sees: as many of each."""
Values = Sequence[Sequence[Number]]
"""What it sees of the first state, of the second ...: h by column, each over all channels."""
Shared = Sequence[tuple[int, int, Number]]
"""Channels whose noise is not independent: the later one, the earlier one, their covariance."""


class SpeedFilter(Memory):
    """Mean (n, b) and covariance of b cars, as its upper triangle row by row (n (n + 1)/2, b).

    Args:
        mean: (n,) prior means m.
        spread: (n, n) prior covariance P0; only parameters that forget alike may be correlated.
        rates: (n,) 1/s, how fast the parameters forget in time; the first entry is not used.
        spatial: the one state that forgets along the road instead, and its 1/m.
        learned: how many states every correction moves.
        every: samples after which the parameters forget.
        count: b.
    """

    memory = ("mean", "spread", "waiting", "waited")

    def __init__(
        self,
        mean: FloatArray,
        spread: FloatArray,
        rates: FloatArray,
        spatial: tuple[int, float],
        learned: int,
        every: int,
        count: int,
    ) -> None:
        self.size, self.learned, self.every, self.count = mean.size, learned, every, count
        self.place, self.per_metre = spatial
        self.rates = rates.copy()
        self.rates[0] = self.rates[self.place] = 0.0
        self.prior_mean, self.prior = mean.copy(), spread.copy()
        self.waited: Number = np.array(0)
        self._start()

    def _start(self) -> None:
        n = self.size
        self._upper = rows, columns = np.triu_indices(n)
        packed = np.zeros((n, n), dtype=np.int64)
        packed[rows, columns] = packed[columns, rows] = np.arange(rows.size)
        self._at = packed  # where each entry of P is kept
        self._kept = int(packed[self.learned, self.learned]) if self.learned < n else rows.size
        self._packed = self.prior[rows, columns][:, None]
        self.mean: Number = np.repeat(self.prior_mean[:, None], self.count, axis=1)
        self._places: dict[Columns, list[tuple[IntArray, IntArray]]] = {}  # of the columns that are asked for
        self.spread: Number = np.repeat(self._packed, self.count, axis=1)
        self.waiting: Number = np.zeros((2, self.count))  # s and m since the parameters last forgot

    @property
    def state(self) -> FloatArray:
        """A copy of the mean, (b, n)."""
        out: FloatArray = self.mean.T.copy()
        return out

    @property
    def covariance(self) -> FloatArray:
        """P as (b, n, n)."""
        out: FloatArray = np.moveaxis(self.spread[self._at], 2, 0).copy()
        return out

    def variance(self, place: int, other: int | None = None) -> Number:
        """An entry of P."""
        return self.spread[self._at[place, place if other is None else other]]

    def move(
        self,
        elapsed: Number,
        magnitude: Number,
        columns: tuple[int, ...],
        coupling: tuple[Number, ...],
        shift: Number,
        noise: Number,
    ) -> None:
        """One sample on: `elapsed` s, `magnitude` m/s, `coupling` a_j of the states `columns`, `shift` u, `noise` Var w_0."""
        n, x, P = self.size, self.mean, self.spread
        first, speed = P[:n].copy(), x[0] + shift
        for place, value in zip(columns, coupling, strict=True):
            first += value * P[self._at[place]]
            speed = speed + value * x[place]
        variance = first[0] + noise
        for place, value in zip(columns, coupling, strict=True):
            variance = variance + value * first[place]
        first[0] = variance
        P[:n], self.mean = first, np.concatenate((speed[None], x[1:]))
        self.waiting = self.waiting + np.stack((elapsed, elapsed * magnitude))
        self.waited = self.waited + 1
        if self.waited >= self.every:
            self._forget()
            self.waiting, self.waited = np.zeros((2, self.count)), np.array(0)

    def _forget(self) -> None:
        """The parameters return towards their priors; the speed has none."""
        time, way = self.waiting
        memory = np.exp(-self.rates[:, None] * time)
        memory[self.place] = np.exp(-self.per_metre * way)
        rows, columns = self._upper
        prior = np.where(rows[:, None] > 0, self._packed, 0.0)
        self.spread = memory[rows] * memory[columns] * (self.spread - prior) + prior
        mean = self.prior_mean[:, None]
        self.mean = np.concatenate((self.mean[:1], (mean + memory * (self.mean - mean))[1:]))

    def expect(self, columns: Columns, values: Values) -> Signals:
        """h P h' of each channel; `weigh` takes the channels from here."""
        known = self._places.get(columns)
        if known is None:
            known = self._places[columns] = [(place, self._at[place]) for place in np.array(columns).T]
        shape = len(columns), self.count
        W: Number = 0.0
        S: Number = 0.0
        given = (np.asarray(value) for value in values)
        H = [value if value.shape == shape else np.broadcast_to(value, shape) for value in given]
        for h, (_, rows) in zip(H, known, strict=True):
            W = W + h[:, None] * self.spread[rows]
        for h, (place, _) in zip(H, known, strict=True):
            S = S + h * W[:, place]
        self._W, self._S = W, S  # (m, n, b) P h', (m, m, b) H P H'
        out: Signals = S.diagonal().T
        return out

    def weigh(
        self,
        innovation: Sequence[Number],
        variance: Sequence[Number],
        used: Sequence[Number],
        learning: Number = True,
        shared: Shared = (),
    ) -> None:
        """Corrects with the channels of `expect` that are `used`; `learning`: not only the `learned` first states.

        `shared`: covariances of their noise; that of all channels together must stay positive definite.
        """
        S = self._S
        for later, earlier, covariance in shared:
            S[later, earlier] = S[later, earlier] + covariance
        U: list[Number] = []
        z: list[Number] = []
        factor: list[list[Number]] = []  # L, with the reciprocals of its diagonal
        for k, counts in enumerate(used):
            gap, rest, w = innovation[k], variance[k] + S[k, k], self._W[k]
            row: list[Number] = []
            for i, (u, known) in enumerate(zip(U, z, strict=True)):
                entry = S[k, i]  # of L, from those to the left of it
                for left, above in zip(row, factor[i], strict=False):
                    entry = entry - left * above
                entry = entry * factor[i][i]
                row.append(entry)
                rest, gap, w = rest - entry * entry, gap - entry * known, w - entry * u
            scale = np.where(counts, 1.0 / np.sqrt(rest), 0.0)
            factor.append([*row, scale])
            U.append(w * scale)
            z.append(gap * scale)
        all_U = np.stack(U)
        change = (all_U[:, self._upper[0]] * all_U[:, self._upper[1]]).sum(axis=0)
        moved = (all_U * np.stack(z)[:, None]).sum(axis=0)
        if learning is not True:
            change[self._kept :] *= learning
            moved[self.learned :] *= learning
        self.spread = self.spread - change
        self.mean = self.mean + moved

    def renew(self, where: Number, first: Number, variance: Number) -> None:
        """Back to the priors where the condition `where` holds, with the speed `first` and its variance."""
        self.mean = np.where(where, self.prior_mean[:, None], self.mean)
        self.spread = np.where(where, self._packed, self.spread)
        self.restart(where, first, variance)

    def restart(self, where: Number, first: Number, variance: Number) -> None:
        """The speed `first` with its variance where the condition `where` holds; parameters stay as they are known."""
        self.spread[1 : self.size, where] = 0.0
        self.mean[0] = np.where(where, first, self.mean[0])
        self.spread[0] = np.where(where, variance, self.spread[0])

    def widen(self, where: Number, variance: Number, place: int = 0) -> None:
        """Adds to the variance of a state where the condition `where` holds."""
        at = self._at[place, place]
        self.spread[at] = self.spread[at] + np.where(where, variance, 0.0)
