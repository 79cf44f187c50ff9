"""Arithmetic of the unscented filter for many batch entries: component axes first, the batch last."""

from __future__ import annotations

import numpy as np

from estimators.faults import BoolArray
from estimators.filters.sigma import MOST, SigmaWeights
from estimators.filters.step import all_bounded, bounded, refused
from estimators.filters.triangular import cholesky, left_divide, lower_factor, right_divide, summed_factor
from estimators.filters.unscented_few import Corrected
from estimators.filters.workspace import Workspace
from estimators.interpolate import FloatArray


class ManyPoints:
    """Mean (n, b) and lower factor S (n, n, b) of P = S S'; values of functions are (1+n+k, b, r), see `points`.

    S is kept in the first rows of a block that has room for what the correction appends to it. Sigma points, columns and
    the inner factor take the same memory one after the other: what does not fit in the cache costs more than arithmetic.
    """

    def __init__(self, weights: SigmaWeights, count: int, size: int) -> None:
        self.weights, self.size = weights, size
        self.mean = np.zeros((size, count))
        self._block = np.zeros((size, size, count))
        self._memory = Workspace()
        self.identity = np.eye(size)[:, :, None]

    @property
    def lower(self) -> FloatArray:
        """S (n, n, b), zero above the diagonal: a view."""
        return self._block[: self.size]

    def prepared(self, matrix: FloatArray) -> FloatArray:
        """(r, r, 1) or (r, r, b) from a noise covariance or its factor, of one size for all (r, r) or (b, r, r)."""
        if matrix.ndim == 2:
            return matrix[:, :, None].copy()
        return np.ascontiguousarray(matrix.transpose(1, 2, 0))

    def points(self, pairs: int) -> FloatArray:
        """(1+n+k, b, n): x, x + tau S_i and x - tau S_i for the first k columns (`pairs`), x + S_i for the others.

        A view of component-first scratch memory: good until the next call.
        """
        n, tau = self.size, self.weights.tau
        out = self._memory("points", (n, 1 + n + pairs, self.mean.shape[1]))
        mean, ahead, lower = self.mean[:, None], out[:, 1 : n + 1], self.lower
        np.multiply(lower[:, :pairs], tau, ahead[:, :pairs])
        np.subtract(mean, ahead[:, :pairs], out[:, n + 1 :])
        np.add(mean, ahead[:, :pairs], ahead[:, :pairs])
        np.add(mean, lower[:, pairs:], ahead[:, pairs:])
        out[:, 0] = self.mean
        return out.transpose(1, 2, 0)

    def absorb(self, values: FloatArray, noise: FloatArray, root: FloatArray) -> BoolArray:
        """Takes the moments of the values plus noise as its own; returns the entries (b,) that stayed.

        The noise covariance, as `prepared`, comes with its lower factor.
        """
        mean, columns, weight = self._parts(values)
        if weight != 0:
            columns[:, -1] *= np.sqrt(abs(weight))
        bad = None if all_bounded(mean) and all_bounded(columns) else ~(bounded(mean, 0) & bounded(columns, 0, 1))
        if bad is not None:
            columns[:, :, bad] = 0.0
        own = self.lower if bad is None else self.lower.copy()
        lower = summed_factor(noise, root, columns[:, :-1] if weight < 0 else columns, own)
        if weight < 0:
            lower = _downdated(lower, columns[:, -1])
        if bad is not None:
            self.mean, lower = np.where(bad, self.mean, mean), np.where(bad, self.lower, lower)
        else:
            self.mean = mean
        if lower is not own or bad is not None:
            self.lower[:] = lower
        return np.zeros(mean.shape[1], dtype=np.bool_) if bad is None else bad

    def correct(
        self, values: FloatArray, measured: FloatArray, noise: FloatArray, root: FloatArray, threshold: float | None
    ) -> Corrected:
        """Innovation (b, m), its covariance (b, m, m), gain (b, n, m), used and gated (b, m).

        Z = L_e^-1 G' with L_e L_e' = R_e; M'M = I + Z'Z with M lower triangular; S+ = S M^-1, K = S+ (Z M^-1)' L_e^-1.
        """
        n, m = self.size, values.shape[2]
        expected, columns, weight = self._parts(values)
        innovation = measured.T - expected
        missing: BoolArray | None = None
        if not (all_bounded(innovation) and all_bounded(columns)):
            bad = ~bounded(columns, 1)
            missing = bad | ~bounded(innovation)
            columns = np.where(bad[:, None], 0.0, columns)
        odd, wide, factor = columns[:, :n], noise, root
        if weight != 0:
            wide = _widened(noise, columns[:, n:-1], columns[:, -1], weight)
        total = np.einsum("ikb,jkb->ijb", odd, odd) + wide
        gated, out = refused(innovation, np.einsum("iib->ib", total), missing, threshold)
        clean = innovation
        if out is not None:
            wide = np.where(out[:, None] | out, np.eye(m)[:, :, None], wide)
            odd, clean = np.where(out[:, None], 0.0, odd), np.where(out, 0.0, innovation)
        if wide is not noise:
            factor = cholesky(wide, "R")
        gain = self._contract(odd, factor)
        self.mean = self.mean + np.einsum("imb,mb->ib", gain, clean)
        if missing is not None:
            innovation = np.where(missing, np.nan, innovation)
        used = np.ones(innovation.shape, dtype=np.bool_) if out is None else np.logical_not(out)
        return innovation.T, total.transpose(2, 0, 1), gain.transpose(2, 0, 1), used.T, gated.T

    def moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean (b, n) and covariance (b, n, n), copies."""
        n = self.size
        covariance = np.empty_like(self.lower)
        for k in range(n):  # row k of S is zero beyond the diagonal
            covariance[k:, k] = np.einsum("jkb,kb->jb", self.lower[k:, : k + 1], self.lower[k, : k + 1])
            covariance[k, k:] = covariance[k:, k]
        return self.mean.T.copy(), covariance.transpose(2, 0, 1)

    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """Mean (b, n) and lower factor (b, n, n): views to read from and write to."""
        return self.mean.T, self.lower.transpose(2, 0, 1)

    def _contract(self, odd: FloatArray, root: FloatArray) -> FloatArray:
        """Replaces S by S+ and returns K (n, m, b)."""
        n, m, count = self.size, odd.shape[0], odd.shape[2]
        if len(self._block) < n + m:
            self._block = np.concatenate((self.lower, np.zeros((m, n, count))))
        rows = self._block[: n + m]
        whitened = left_divide(root, odd, rows[n:])
        # rows in reverse order: lower times upper becomes upper times lower
        reverse = self._memory("reverse", (n, m, count))
        reverse[:] = whitened[:, ::-1].swapaxes(0, 1)
        inner = summed_factor(self.identity, self.identity, reverse, self._memory("points", (n, n, count)))
        right_divide(rows, inner[::-1, ::-1].swapaxes(0, 1), triangular=True)
        small = np.einsum("ikb,mkb->imb", rows[:n], rows[n:])
        return right_divide(small, root) if m > 1 else small / root

    def _parts(self, values: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Mean (r, b), columns [b_i / tau, a_i / tau, c_0] (r, n+k+1, b), and the weight of c_0.

        From values (1+n+k, b, r). Without pairs (k = 0) the columns are b_i / tau alone, and the weight is 0.
        """
        n, tau, (count, b, r) = self.size, self.weights.tau, values.shape
        k = count - 1 - n
        columns = self._memory("points", (r, n + k + (k > 0), b))
        given = (values.copy() if np.may_share_memory(values, columns) else values).transpose(2, 0, 1)
        centre, plus, minus = given[:, 0], given[:, 1 : n + 1], given[:, n + 1 :]
        odd, even = columns[:, :n], columns[:, n : n + k]
        np.subtract(plus[:, k:], centre[:, None], odd[:, k:])
        if k == 0:
            return centre.copy(), columns, 0.0
        np.subtract(plus[:, :k], minus, odd[:, :k])
        np.add(plus[:, :k], minus, even)
        even -= (2.0 * centre)[:, None]  # differences from the centre: nothing cancels on a linear function
        shift = np.add.reduce(even, 1)
        shift *= 1.0 / tau**2  # twice the mean minus the centre
        even -= shift[:, None]
        odd[:, :k] *= 0.5 / tau
        even *= 0.5 / tau
        shift *= 0.5
        np.negative(shift, columns[:, -1])
        shift += centre
        return shift, columns, self.weights.centre_weight(n - k)


def _widened(noise: FloatArray, even: FloatArray, tail: FloatArray, weight: float) -> FloatArray:
    """R_e = R + sum a_i a_i' / tau^2 + W0c c_0 c_0', (m, m, b); see `sigma.MOST` for a negative W0c."""
    wide = noise + np.einsum("ikb,jkb->ijb", even, even)
    if weight >= 0:
        return np.asarray(wide + weight * tail[:, None] * tail)
    whitened = left_divide(cholesky(wide, "R"), tail[:, None])[:, 0]
    share = -weight * np.einsum("mb,mb->b", whitened, whitened)
    return np.asarray(wide + weight * np.minimum(1.0, MOST / np.maximum(share, 1e-300)) * tail[:, None] * tail)


def _downdated(lower: FloatArray, column: FloatArray) -> FloatArray:
    """L (n, n, b) with L L' = S S' - d d'; see `sigma.MOST`.

    With v = S^-1 d: S S' - d d' = S (I - v v') S' and I - v v' = (I - g v v')^2, g = (1 - sqrt(1 - v'v)) / v'v.
    """
    v = left_divide(lower, column[:, None])[:, 0]
    size = np.einsum("ib,ib->b", v, v)
    allowed = np.minimum(size, MOST)
    v *= np.sqrt(allowed / np.maximum(size, 1e-300))
    g = 1.0 / (1.0 + np.sqrt(1.0 - allowed))
    moved = np.einsum("ikb,kb->ib", lower, v)
    return lower_factor(np.zeros_like(lower), lower - g * moved[:, None] * v)
