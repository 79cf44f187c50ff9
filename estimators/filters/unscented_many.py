"""Arithmetic of the unscented filter for many batch entries: component axes first, the batch last."""

from __future__ import annotations

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.filters.predicted import Predicted
from estimators.filters.sigma import MOST, SigmaWeights
from estimators.filters.step import all_bounded, bounded, refused
from estimators.filters.triangular import (
    checked_factor,
    cholesky,
    left_divide,
    lower_factor,
    right_divide,
    summed_factor,
)
from estimators.filters.unscented_few import UNRESOLVED, Corrected, Directions
from estimators.filters.workspace import Workspace


class ManyPoints:
    """Mean (n, b) and lower factor S (n, n, b) of P = S S'; values of functions are (1+2k, b, r), see `points`.

    Sigma points, columns and the inner factor take the same memory one after the other: what does not fit in the cache
    costs more than arithmetic. A prediction is not factored before S is asked for, see `Predicted`.
    """

    def __init__(self, weights: SigmaWeights, count: int, size: int) -> None:
        self.weights, self.size = weights, size
        self.mean = np.zeros((size, count))
        self._lower = np.zeros((size, size, count))
        self._memory = Workspace()
        self._predicted: Predicted | None = None  # what S is to be a factor of, unless None
        self._covariance: FloatArray | None = None  # (n, n, b), where the last correction had to form it
        self.identity = np.eye(size)[:, :, None]

    @property
    def lower(self) -> FloatArray:
        """S (n, n, b), zero above the diagonal: a view."""
        if self._predicted is not None:
            self._predicted.factor(self._lower)
            self._predicted = None
        return self._lower

    def prepared(self, matrix: FloatArray) -> FloatArray:
        """(r, r, 1) or (r, r, b) from a noise covariance or its factor, of one size for all (r, r) or (b, r, r)."""
        if matrix.ndim == 2:
            return matrix[:, :, None].copy()
        return np.ascontiguousarray(matrix.transpose(1, 2, 0))

    def points(self, pairs: int) -> FloatArray:
        """(1+2k, b, n): x, x + tau S_i and x - tau S_i for the first k columns (`pairs`).

        A view of component-first scratch memory: good until the next call.
        """
        mean = self.mean[:, None]
        if not pairs:  # a prediction may still need its columns, which are in that memory
            return mean.transpose(1, 2, 0)
        lower, out = self.lower, self._memory("points", (self.size, 1 + 2 * pairs, self.mean.shape[1]))
        ahead = out[:, 1 : 1 + pairs]
        np.multiply(lower[:, :pairs], self.weights.tau, ahead)
        np.subtract(mean, ahead, out[:, 1 + pairs :])
        np.add(mean, ahead, ahead)
        out[:, 0] = self.mean
        return out.transpose(1, 2, 0)

    def absorb(self, values: FloatArray, slope: Directions | None, noise: FloatArray, root: FloatArray) -> BoolArray:
        """Takes the moments of the values plus noise as its own; returns the entries (b,) that stayed.

        `slope` is asked for the columns that have no pair of points. The noise covariance, as `prepared`, comes with
        its lower factor.
        """
        mean, columns, weight = self._parts(values, slope)
        if weight != 0:
            columns[:, -1] *= np.sqrt(abs(weight))
        self._covariance = None
        if weight >= 0:
            predicted = Predicted(noise, root, columns, self._memory)
            if all_bounded(mean) and all_bounded(predicted.variances):
                self.mean, self._predicted = mean, predicted
                return np.zeros(mean.shape[1], dtype=np.bool_)
        good = bounded(mean, 0) & bounded(columns, 0, 1)
        columns[:, :, ~good] = 0.0
        lower = summed_factor(noise, root, columns[:, :-1] if weight < 0 else columns)
        if weight < 0:
            lower = _downdated(lower, columns[:, -1])
        self.mean = np.where(good, mean, self.mean)
        self.lower[:] = np.where(good, lower, self.lower)
        return np.logical_not(good)

    def correct(
        self,
        values: FloatArray,
        slope: Directions | None,
        measured: FloatArray,
        noise: FloatArray,
        root: FloatArray,
        threshold: float | None,
    ) -> Corrected:
        """Innovation (b, m), its covariance (b, m, m), gain (b, n, m), used and gated (b, m).

        Pyy = G' G + R_e = L L', W = S G L'^-1, K = W L^-1; Z = L_e^-1 G' with L_e L_e' = R_e, M'M = I + Z'Z with M lower
        triangular, S+ = S M^-1.
        A function that is affine everywhere, right after a prediction, takes the way of `Predicted`.
        """
        if self._predicted is not None and slope is not None and len(values) == 1:
            return self._correct_affine(self._predicted, values[0].T, slope, measured, noise, root, threshold)
        expected, columns, weight = self._parts(values, slope)
        innovation = measured.T - expected
        missing: BoolArray | None = None
        if not (all_bounded(innovation) and all_bounded(columns)):
            bad = ~bounded(columns, 1)
            missing = bad | ~bounded(innovation)
            columns = np.where(bad[:, None], 0.0, columns)
        odd, wide = columns[:, : self.size], noise
        factor: FloatArray | None = root
        if weight != 0:
            wide = _widened(noise, columns[:, self.size : -1], columns[:, -1], weight)
            factor = None
        total = np.einsum("ikb,jkb->ijb", odd, odd) + wide
        gated, out = refused(innovation, np.einsum("iib->ib", total), missing, threshold)
        gain = self._contract(odd, wide, factor, out)
        return self._moved(gain, innovation, total, missing, out, gated)

    def _correct_affine(
        self,
        predicted: Predicted,
        expected: FloatArray,
        slope: Directions,
        measured: FloatArray,
        noise: FloatArray,
        root: FloatArray,
        threshold: float | None,
    ) -> Corrected:
        cross = self._memory("cross", (len(expected), *self.mean.shape))
        cross[:] = slope(predicted.matrix.transpose(1, 2, 0)).transpose(2, 0, 1)
        total = slope(cross.transpose(0, 2, 1)).transpose(0, 2, 1) + noise
        innovation = measured.T - expected
        missing: BoolArray | None = None
        if not (all_bounded(innovation) and all_bounded(np.einsum("iib->ib", total))):
            bad = ~(bounded(cross, 1) & bounded(np.einsum("iib->ib", total)))
            missing = bad | ~bounded(innovation)
            total = np.where(bad[:, None] | bad, noise, total)
        gated, out = refused(innovation, np.einsum("iib->ib", total), missing, threshold)
        gain = self._subtract(predicted, cross, total, out)
        if gain is None:
            odd = slope(self.lower.transpose(1, 2, 0)).transpose(2, 0, 1)
            gain = self._contract(odd, noise, root, out)
        return self._moved(gain, innovation, total, missing, out, gated)

    def _moved(
        self,
        gain: FloatArray,
        innovation: FloatArray,
        total: FloatArray,
        missing: BoolArray | None,
        out: BoolArray | None,
        gated: BoolArray,
    ) -> Corrected:
        """Adds K times the innovation to the mean, and reports with the batch in front."""
        clean = innovation if out is None else np.where(out, 0.0, innovation)
        self.mean = self.mean + np.einsum("imb,mb->ib", gain, clean)
        if missing is not None:
            innovation = np.where(missing, np.nan, innovation)
        used = np.ones(innovation.shape, dtype=np.bool_) if out is None else np.logical_not(out)
        return innovation.T, total.transpose(2, 0, 1), gain.transpose(2, 0, 1), used.T, gated.T

    def moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean (b, n) and covariance (b, n, n), copies."""
        if self._covariance is not None:
            return self.mean.copy().T, self._covariance.copy().transpose(2, 0, 1)
        n = self.size
        covariance = np.empty_like(self.lower)
        for k in range(n):  # row k of S is zero beyond the diagonal
            covariance[k:, k] = np.einsum("jkb,kb->jb", self.lower[k:, : k + 1], self.lower[k, : k + 1])
            covariance[k, k:] = covariance[k:, k]
        return self.mean.copy().T, covariance.transpose(2, 0, 1)

    def centre(self) -> FloatArray:
        """Mean (b, n), a view to read from."""
        return self.mean.T

    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """Mean (b, n) and lower factor (b, n, n): views to read from and write to."""
        self._covariance = None
        return self.mean.T, self.lower.transpose(2, 0, 1)

    def _subtract(
        self, predicted: Predicted, cross: FloatArray, total: FloatArray, out: BoolArray | None
    ) -> FloatArray | None:
        """Makes the factor that of `predicted.corrected` and returns K (n, m, b); None: nothing is changed."""
        if out is not None:
            total, cross = _alone(total, out), np.where(out[:, None], 0.0, cross)
        root = np.zeros(total.shape)
        if not checked_factor(total, np.einsum("iib->ib", total), root):
            return None
        whitened = left_divide(root, cross)
        covariance = predicted.corrected(whitened, self._lower)
        if covariance is None:
            return None
        self._predicted, self._covariance = None, covariance
        return right_divide(whitened.swapaxes(0, 1), root)

    def _contract(
        self, odd: FloatArray, wide: FloatArray, root: FloatArray | None, out: BoolArray | None
    ) -> FloatArray:
        """Replaces S by S+ and returns K (n, m, b), from R_e and, where it is known, its lower factor."""
        if out is not None:
            wide, root, odd = _alone(wide, out), None, np.where(out[:, None], 0.0, odd)
        if root is None:
            root = cholesky(wide, UNRESOLVED)
        n, m, count = self.size, odd.shape[0], odd.shape[2]
        lower, self._covariance = self.lower, None
        total = summed_factor(wide, root, odd.copy())
        weighted = left_divide(total, np.einsum("mkb,jkb->mjb", odd, lower)).swapaxes(0, 1)
        whitened = left_divide(root, odd)
        # rows in reverse order: lower times upper becomes upper times lower
        reverse = self._memory("reverse", (n, m, count))
        reverse[:] = whitened[:, ::-1].swapaxes(0, 1)
        inner = summed_factor(self.identity, self.identity, reverse, self._memory("points", (n, n, count)))
        right_divide(lower, inner[::-1, ::-1].swapaxes(0, 1), triangular=True)
        return right_divide(weighted, total)

    def _parts(self, values: FloatArray, slope: Directions | None) -> tuple[FloatArray, FloatArray, float]:
        """Mean (r, b), columns [b_i / tau, a_i / tau, c_0] (r, n+k+1, b), and the weight of c_0.

        From values (1+2k, b, r). Without pairs (k = 0) the columns are b_i / tau alone, and the weight is 0.
        """
        n, tau, (count, b, r) = self.size, self.weights.tau, values.shape
        k = count // 2
        columns = self._memory("points", (r, n + k + (k > 0), b))
        given = (values.copy() if np.may_share_memory(values, columns) else values).transpose(2, 0, 1)
        centre, plus, minus = given[:, 0], given[:, 1 : k + 1], given[:, k + 1 :]
        if slope is not None:
            columns[:, k:n] = slope(self.lower[:, k:].transpose(1, 2, 0)).transpose(2, 0, 1)
        if k == 0:
            return centre.copy(), columns, 0.0
        odd, even = columns[:, :k], columns[:, n : n + k]
        np.subtract(plus, minus, odd)
        np.add(plus, minus, even)
        even -= (2.0 * centre)[:, None]  # differences from the centre: nothing cancels on a linear function
        shift = np.add.reduce(even, 1)
        shift *= 1.0 / tau**2  # twice the mean minus the centre
        even -= shift[:, None]
        odd *= 0.5 / tau
        even *= 0.5 / tau
        shift *= 0.5
        np.negative(shift, columns[:, -1])
        shift += centre
        return shift, columns, self.weights.centre_weight(n - k)


def _alone(matrix: FloatArray, out: BoolArray) -> FloatArray:
    """The matrix (m, m, b) with channels `out` (m, b) replaced by ones that know nothing of the others."""
    return np.where(out[:, None] | out, np.eye(len(out))[:, :, None], matrix)


def _widened(noise: FloatArray, even: FloatArray, tail: FloatArray, weight: float) -> FloatArray:
    """R_e = R + sum a_i a_i' / tau^2 + W0c c_0 c_0', (m, m, b); see `sigma.MOST` for a negative W0c."""
    wide = noise + np.einsum("ikb,jkb->ijb", even, even)
    if weight >= 0:
        return np.asarray(wide + weight * tail[:, None] * tail)
    whitened = left_divide(cholesky(wide, UNRESOLVED), tail[:, None])[:, 0]
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
