"""Arithmetic of the unscented filter for many batch entries: component axes first, the batch last."""

from __future__ import annotations

import numpy as np

from estimators.faults import BoolArray
from estimators.filters.sigma import MOST, SigmaWeights
from estimators.filters.step import all_bounded, bounded, refused
from estimators.filters.triangular import cholesky, left_divide, lower_factor, right_divide, summed_factor
from estimators.filters.unscented_few import Corrected
from estimators.interpolate import FloatArray


class ManyPoints:
    """Mean (n, b) and lower factor S (n, n, b) of P = S S'; values of functions are (2n+1, b, r)."""

    def __init__(self, weights: SigmaWeights, count: int, size: int) -> None:
        self.weights, self.size = weights, size
        self.mean = np.zeros((size, count))
        self.lower = np.zeros((size, size, count))
        self._sigma = np.empty((size, 2 * size + 1, count))  # scratch that stays in the cache
        self._columns = np.empty((size, 2 * size + 1, count))
        self.identity = np.zeros((size, size, count))
        self.identity[np.arange(size), np.arange(size)] = 1.0

    def prepared(self, matrix: FloatArray) -> FloatArray:
        """(r, r, 1) or (r, r, b) from a noise covariance or its factor, of one size for all (r, r) or (b, r, r)."""
        if matrix.ndim == 2:
            return matrix[:, :, None].copy()
        return np.ascontiguousarray(matrix.transpose(1, 2, 0))

    def points(self) -> FloatArray:
        """(2n+1, b, n), a view of component-first scratch memory: good until the next call."""
        n, out = self.size, self._sigma
        offset = self.weights.tau * self.lower
        mean = self.mean[:, None]
        out[:, 0] = self.mean
        np.add(mean, offset, out[:, 1 : n + 1])
        np.subtract(mean, offset, out[:, n + 1 :])
        return out.transpose(1, 2, 0)

    def absorb(self, values: FloatArray, noise: FloatArray, root: FloatArray) -> BoolArray:
        """Takes the moments of the values plus noise as its own; returns the entries (b,) that stayed.

        The noise covariance, as `prepared`, comes with its lower factor.
        """
        n, weight = self.size, self.weights.centre_spread
        mean, columns = _parts(self.weights, values, self._columns)
        columns *= 0.5 / self.weights.tau
        columns[:, 2 * n] *= np.sqrt(abs(weight))
        bad = None if all_bounded(mean) and all_bounded(columns) else ~(bounded(mean, 0) & bounded(columns, 0, 1))
        if bad is not None:
            columns[:, :, bad] = 0.0
        lower = summed_factor(noise, root, columns[:, : 2 * n + (weight >= 0)])
        if weight < 0:
            lower = _downdated(lower, columns[:, 2 * n])
        if bad is None:
            self.mean, self.lower = mean, lower
            return np.zeros(mean.shape[1], dtype=np.bool_)
        self.mean, self.lower = np.where(bad, self.mean, mean), np.where(bad, self.lower, lower)
        return bad

    def correct(
        self, values: FloatArray, measured: FloatArray, noise: FloatArray, root: FloatArray, threshold: float | None
    ) -> Corrected:
        """Innovation (b, m), its covariance (b, m, m), gain (b, n, m), used and gated (b, m).

        Z = L_e^-1 G' with L_e L_e' = R_e; M'M = I + Z'Z with M lower triangular; S+ = S M^-1, K = S+ (Z M^-1)' L_e^-1.
        """
        n, m = self.size, values.shape[2]
        expected, columns = _parts(self.weights, values, np.empty((m, 2 * n + 1, len(measured))))
        columns *= 0.5 / self.weights.tau
        innovation = measured.T - expected
        missing: BoolArray | None = None
        if not (all_bounded(innovation) and all_bounded(columns)):
            bad = ~bounded(columns, 1)
            missing = bad | ~bounded(innovation)
            columns = np.where(bad[:, None], 0.0, columns)
        odd = columns[:, :n]
        wide = self._widened(noise, columns[:, n:])
        total = np.einsum("ikb,jkb->ijb", odd, odd) + wide
        gated, out = refused(innovation, np.einsum("iib->ib", total), missing, threshold)
        clean = innovation
        if out is not None:
            wide = np.where(out[:, None] | out, np.eye(m)[:, :, None], wide)
            odd, clean = np.where(out[:, None], 0.0, odd), np.where(out, 0.0, innovation)
        gain = self._contract(odd, cholesky(wide, "R"))
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
        n, m = self.size, odd.shape[0]
        whitened = left_divide(root, odd)  # (m, n, b)
        # rows in reverse order: lower times upper becomes upper times lower
        reverse = summed_factor(self.identity, self.identity, np.ascontiguousarray(whitened[:, ::-1].swapaxes(0, 1)))
        inner = reverse[::-1, ::-1].swapaxes(0, 1)
        divided = right_divide(np.concatenate((self.lower, whitened)), inner, triangular=True)
        self.lower = divided[:n]
        small = np.einsum("ikb,mkb->imb", self.lower, divided[n:])
        return right_divide(small, root) if m > 1 else small / root

    def _widened(self, noise: FloatArray, even: FloatArray) -> FloatArray:
        """R_e = R + sum a_i a_i' / tau^2 + W0c c_0 c_0', (m, m, b); see `sigma.MOST` for a negative W0c."""
        weight, n = self.weights.centre_spread, self.size
        tail = even[:, n]
        wide = noise + np.einsum("ikb,jkb->ijb", even[:, :n], even[:, :n])
        if weight >= 0:
            return np.asarray(wide + weight * tail[:, None] * tail)
        whitened = left_divide(cholesky(wide, "R"), tail[:, None])[:, 0]
        share = -weight * np.einsum("mb,mb->b", whitened, whitened)
        return np.asarray(wide + weight * np.minimum(1.0, MOST / np.maximum(share, 1e-300)) * tail[:, None] * tail)


def _parts(weights: SigmaWeights, values: FloatArray, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (r, b), and into `columns` [b_i, a_i, c_0] 2 tau (r, 2n+1, b) of values (2n+1, b, r), b_i and a_i over tau."""
    given = values.transpose(2, 0, 1)
    n = given.shape[1] // 2
    centre, plus, minus = given[:, 0], given[:, 1 : n + 1], given[:, n + 1 :]
    odd, even = columns[:, :n], columns[:, n : 2 * n]
    np.subtract(plus, minus, odd)
    np.add(plus, minus, even)
    even -= (2.0 * centre)[:, None]  # differences from the centre: nothing cancels on a linear function
    shift = even.sum(axis=1)
    shift *= 1.0 / weights.tau**2  # twice the mean minus the centre
    even -= shift[:, None]
    np.multiply(shift, -weights.tau, columns[:, 2 * n])
    shift *= 0.5
    shift += centre
    return shift, columns


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
