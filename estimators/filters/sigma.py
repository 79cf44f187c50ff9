"""Where sigma points lie and what they weigh."""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.errors import EstimatorError

MOST = 0.99  # share of the rest of a covariance that a negative centre weight may take away in its direction


class SigmaWeights(NamedTuple):
    """X_0 = x, X_i = x + tau S_i, X_(n+i) = x - tau S_i; tau^2 = N + eta = epsilon^2 N.

    W0m = eta / (N + eta), W0c = W0m + 1 - epsilon^2 + beta, W_i = 1 / (2 (N + eta)): P1 notes 3, corrected.
    """

    tau: float
    centre_mean: float  # W0m
    centre_spread: float  # W0c

    @classmethod
    def scaled(cls, size: int, epsilon: float | None = None, beta: float = 2.0) -> SigmaWeights:
        """For `size` states; epsilon None: sqrt(3 / N), hence tau = sqrt(3).

        Raises:
            EstimatorError: epsilon not positive, beta not finite.
        """
        spread = math.sqrt(3.0 / size) if epsilon is None else epsilon
        if not 1e-6 <= spread <= 1e3:
            raise EstimatorError(f"epsilon = {epsilon!r} must lie in [1e-6, 1e3]; None is sqrt(3 / {size})")
        if not math.isfinite(beta):
            raise EstimatorError(f"beta = {beta!r} must be finite; 2 suits Gaussian densities")
        eta = spread**2 * size - size
        centre = eta / (size + eta)
        return cls(math.sqrt(size + eta), centre, centre + 1 - spread**2 + beta)

    def centre_weight(self, single: int) -> float:
        """W0c where `single` columns have no even part of their own: theirs is c_0, of weight 1/tau^2 each."""
        return self.centre_spread + single / self.tau**2
