"""Arithmetic of the unscented filter for a few batch entries: batch axis first, factors from LAPACK."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters.sigma import MOST, SigmaWeights
from estimators.filters.step import all_bounded, bounded, diagonal, refused
from estimators.filters.triangular import upper_factor

UNRESOLVED = (
    "R is lost in the curvature of the measurement: it is smaller than the rounding of its even parts; give every channel a "
    "noise variance that its measurement can have"
)
Corrected = tuple[FloatArray, FloatArray, FloatArray, BoolArray, BoolArray]
Directions = Callable[[FloatArray], FloatArray]
"""Slope of an affine function along directions: (count, b, n) -> (count, b, r)."""


class FewPoints:
    """Mean (b, n) and upper factor U (b, n, n) of P = U'U; values of functions are (1+2k, b, r), see `points`."""

    def __init__(self, weights: SigmaWeights, count: int, size: int) -> None:
        self.weights, self.size = weights, size
        self.mean = np.zeros((count, size))
        self.upper = np.zeros((count, size, size))

    def prepared(self, matrix: FloatArray) -> FloatArray:
        """(b, r, r) from a noise covariance or its factor, of one size for all (r, r) or (b, r, r)."""
        return np.array(np.broadcast_to(matrix, (len(self.mean), *matrix.shape[-2:])))

    def points(self, pairs: int) -> FloatArray:
        """(1+2k, b, n): x, x + tau S_i and x - tau S_i for the first k columns (`pairs`)."""
        out = np.empty((1 + 2 * pairs, *self.mean.shape))
        offset = self.weights.tau * self.upper.swapaxes(0, 1)[:pairs]
        out[0] = self.mean
        np.add(self.mean, offset, out[1 : 1 + pairs])
        np.subtract(self.mean, offset, out[1 + pairs :])
        return out

    def absorb(self, values: FloatArray, slope: Directions | None, noise: FloatArray, root: FloatArray) -> BoolArray:
        """Takes the moments of the values plus noise as its own; returns the entries (b,) that stayed.

        `slope` is asked for the columns that have no pair of points. The noise covariance, as `prepared`, comes with its
        lower factor, which is all that is needed here.
        """
        mean, odd, even, weight = self._parts(values, slope)
        centre = even[:, -1].copy()
        even[:, -1] *= np.sqrt(max(weight, 0.0))
        stack = np.concatenate((odd, even, root.swapaxes(1, 2)), axis=1)
        if all_bounded(stack) and all_bounded(mean):
            self.mean, self.upper = mean, _less(upper_factor(stack), centre, weight)
            return np.zeros(len(mean), dtype=np.bool_)
        good = bounded(stack, 1, 2) & bounded(mean, 1)
        stack[~good] = 1.0
        centre[~good] = 0.0
        upper = _less(upper_factor(stack), centre, weight)
        self.mean = np.where(good[:, None], mean, self.mean)
        self.upper = np.where(good[:, None, None], upper, self.upper)
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

        QR of [[L_R', 0], [even, 0], [odd, U]] = [[L_yy', Kbar'], [0, U+]], K = Kbar L_yy^-1.
        """
        n, m = self.size, values.shape[2]
        expected, odd, even, weight = self._parts(values, slope)
        innovation = measured - expected
        missing: BoolArray | None = None
        if not (all_bounded(innovation) and all_bounded(odd) and all_bounded(even)):
            bad = ~(bounded(odd, 1) & bounded(even, 1))
            missing = bad | ~bounded(innovation)
            odd, even = (np.where(bad[:, None], 0.0, part) for part in (odd, even))
        wide, even = _widened(noise, even, weight)
        total = odd.swapaxes(1, 2) @ odd + wide
        gated, out = refused(innovation, diagonal(total), missing, threshold)
        clean = innovation
        if out is not None:
            wide = np.where(out[:, :, None] | out[:, None], np.eye(m), wide)
            odd, clean = np.where(out[:, None], 0.0, odd), np.where(out, 0.0, innovation)
        if out is not None or weight < 0:
            root, even = _root(wide), even[:, :0]
        split = m + even.shape[1]
        array = np.zeros((len(clean), split + n, m + n))
        array[:, :m, :m] = root.swapaxes(1, 2)
        array[:, m:split, :m] = even
        array[:, split:, :m] = odd
        array[:, split:, m:] = self.upper
        found = upper_factor(array)
        self.upper = found[:, m:, m:]
        scale, cross = found[:, :m, :m], found[:, :m, m:]
        solved = cross / scale if m == 1 else np.asarray(np.linalg.solve(scale, cross), dtype=np.float64)
        gain = solved.swapaxes(1, 2)
        self.mean = self.mean + (gain @ clean[..., None])[..., 0]
        if missing is not None:
            innovation = np.where(missing, np.nan, innovation)
        used = np.ones(innovation.shape, dtype=np.bool_) if out is None else np.logical_not(out)
        return innovation, total, gain, used, gated

    def moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean (b, n) and covariance (b, n, n), copies."""
        return self.mean.copy(), self.upper.swapaxes(1, 2) @ self.upper

    def centre(self) -> FloatArray:
        """Mean (b, n), a view to read from."""
        return self.mean

    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """Mean (b, n) and lower factor (b, n, n): views to read from and write to."""
        self.upper = np.array(self.upper)
        return self.mean, self.upper.swapaxes(1, 2)

    def _parts(self, values: FloatArray, slope: Directions | None) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """Mean (b, r), odd rows b_i / tau (b, n, r), even rows [a_i / tau, c_0] (b, k+1, r), and the weight of c_0."""
        n, tau, (_, b, r) = self.size, self.weights.tau, values.shape
        k = len(values) // 2
        centre, plus, minus = values[0], values[1 : k + 1], values[k + 1 :]
        odd = np.empty((b, n, r))
        odd[:, :k] = ((plus - minus) * (0.5 / tau)).swapaxes(0, 1)
        if slope is not None:
            odd[:, k:] = slope(self.upper.swapaxes(0, 1)[k:]).swapaxes(0, 1)
        pairs = (plus + minus) * 0.5 - centre  # differences from the centre: nothing cancels on a linear function
        shift = np.add.reduce(pairs, 0) / tau**2
        even = np.empty((b, k + 1, r))
        even[:, :k] = ((pairs - shift) / tau).swapaxes(0, 1)
        even[:, k] = -shift
        return centre + shift, odd, even, self.weights.centre_weight(n - k)


def _root(wide: FloatArray) -> FloatArray:
    try:
        return np.asarray(np.linalg.cholesky(wide), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise EstimatorError(UNRESOLVED) from error


def _widened(noise: FloatArray, even: FloatArray, weight: float) -> tuple[FloatArray, FloatArray]:
    """R_e (b, m, m) and the weighted even rows that it contains; `weight` of the last one."""
    if weight >= 0:
        even[:, -1] *= np.sqrt(weight)
        return noise + even.swapaxes(1, 2) @ even, even
    centre, even = even[:, -1], even[:, :-1]
    wide = noise + even.swapaxes(1, 2) @ even
    share = -weight * (centre * np.linalg.solve(wide, centre[..., None])[..., 0]).sum(axis=1)
    taken = weight * np.minimum(1.0, MOST / np.maximum(share, 1e-300))
    return wide + taken[:, None, None] * centre[:, :, None] * centre[:, None], even


def _less(upper: FloatArray, centre: FloatArray, weight: float) -> FloatArray:
    """Factor of U'U - |W0c| c c' where the weight W0c is negative; see `sigma.MOST`."""
    if weight >= 0:
        return upper
    column = np.sqrt(-weight) * centre[..., None]
    try:
        v = np.linalg.solve(upper.swapaxes(1, 2), column)
    except np.linalg.LinAlgError as error:
        raise EstimatorError("the predicted covariance is singular; give Q a variance above zero") from error
    size = (v * v).sum(axis=1, keepdims=True)
    allowed = np.minimum(size, MOST)
    v *= np.sqrt(allowed / np.maximum(size, 1e-300))
    g = 1.0 / (1.0 + np.sqrt(1.0 - allowed))
    return upper_factor(upper - g * v @ (v.swapaxes(1, 2) @ upper))
