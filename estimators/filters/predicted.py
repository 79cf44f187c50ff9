"""A predicted covariance that is not factored before somebody asks for the factor; components first, the batch last."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from estimators.filters.triangular import checked_factor, lower_factor, products
from estimators.filters.workspace import Workspace


class Predicted:
    """P- = Q + C C' of an unscented prediction, `matrix` (n, n, b), with the columns C (n, k, b) it came from.

    A measurement that is affine, with slope H, corrects it without sigma points and without a factor of P-:

        Pyy = H P- H' + R = L L',   W = P- H' L'^-1,   P+ = P- - W W' = S+ S+',   K = W L^-1.

    The difference is as good as the orthogonal form as long as no pivot of S+ is small against its entry of P-. That is
    checked for all entries: `corrected` returns None otherwise, and `factor` is the way to the square-root form.

    Args:
        noise: Q (n, n, 1) or (n, n, b).
        root: its lower factor.
        columns: C; needed as long as P- is, and overwritten by `factor`.
        memory: for what is needed until the next prediction.
    """

    def __init__(self, noise: FloatArray, root: FloatArray, columns: FloatArray, memory: Workspace) -> None:
        n, _, count = columns.shape
        self._root, self._columns, self._memory = root, columns, memory
        self.matrix = memory("predicted", (n, n, count))
        for k, product in enumerate(products(columns)):
            np.add(product, noise[k:, k], self.matrix[k:, k])
        _mirror(self.matrix)

    @property
    def variances(self) -> FloatArray:
        """Diagonal of P- (n, b), a view."""
        return self.matrix.diagonal().T

    def factor(self, out: FloatArray) -> None:
        """S (n, n, b) of P-, into `out`, which is zero above the diagonal."""
        if not checked_factor(self.matrix, self.variances, out):
            out[:] = lower_factor(self._root, self._columns)

    def corrected(self, whitened: FloatArray, out: FloatArray) -> FloatArray | None:
        """P+ (n, n, b) from W' (m, n, b), with its factor in `out`; None: too close to singular for a difference."""
        left = self._memory("corrected", self.matrix.shape)
        for k, product in enumerate(products(whitened.swapaxes(0, 1))):
            np.subtract(self.matrix[k:, k], product, left[k:, k])
        if not checked_factor(left, self.variances, out):
            return None
        _mirror(left)
        return left


def _mirror(matrix: FloatArray) -> None:
    """Writes the lower triangle above the diagonal."""
    for k in range(len(matrix) - 1):
        matrix[k, k + 1 :] = matrix[k + 1 :, k]
