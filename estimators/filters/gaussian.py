"""What all filters share: an estimate with its covariance, checked, reset, saved and restored."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from estimators.arguments import LIMIT, broadcast, mask, numbers
from estimators.arrays import AnyArray, BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.memory import Memory, Saved


class GaussianFilter(Memory):
    """Mean (..., n) and covariance (..., n, n) of a state; every batch entry has its own.

    Args:
        state: (..., n) initial mean.
        covariance: (..., n, n) initial covariance, symmetric positive definite; the batch axes of both broadcast.

    Raises:
        EstimatorError: shapes that do not fit, not finite, not symmetric, not positive definite; names the entry.
    """

    def __init__(self, state: npt.ArrayLike, covariance: npt.ArrayLike) -> None:
        mean, spread = numbers(state, "state"), numbers(covariance, "covariance")
        if mean.ndim < 1 or spread.ndim < 2 or spread.shape[-2:] != (mean.shape[-1],) * 2 or mean.shape[-1] < 1:
            raise EstimatorError(
                f"state {mean.shape} and covariance {spread.shape} do not fit; expected (..., n) and (..., n, n)"
            )
        self.size = mean.shape[-1]
        try:
            self.batch_shape: tuple[int, ...] = np.broadcast_shapes(mean.shape[:-1], spread.shape[:-2])
        except ValueError as error:
            raise EstimatorError(f"batch axes of state {mean.shape} and covariance {spread.shape} differ") from error
        self._initial = self._checked(mean, spread)

    @property
    def state(self) -> FloatArray:
        """A copy of the mean, shape (..., n)."""
        return self._read()[0]

    @property
    def covariance(self) -> FloatArray:
        """A copy of the covariance, shape (..., n, n)."""
        return self._read()[1]

    def reset(
        self,
        where: npt.ArrayLike | None = None,
        state: npt.ArrayLike | None = None,
        covariance: npt.ArrayLike | None = None,
    ) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to the given or else the initial values.

        Raises:
            EstimatorError: a mask of another shape, or values that the constructor would refuse.
        """
        chosen = mask(where, self.batch_shape, "where")
        mean = self._initial[0] if state is None else numbers(state, "state")
        spread = self._initial[1] if covariance is None else numbers(covariance, "covariance")
        if state is not None or covariance is not None:
            mean, spread = self._checked(mean, spread)
        self._write(chosen, mean, spread)

    def save(self) -> Saved:
        """Everything needed to continue later, as plain arrays."""
        return {key: array.copy() for key, array in self._memory().items()}

    def _take(self, saved: Mapping[str, AnyArray]) -> None:
        for key, own in self._memory().items():
            own[...] = saved[key]

    def _checked(self, mean: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
        mean = broadcast(mean, (*self.batch_shape, self.size), "state")
        spread = broadcast(spread, (*self.batch_shape, self.size, self.size), "covariance")
        if not (np.absolute(mean) <= LIMIT).all():
            raise EstimatorError("state is not finite; start from finite numbers")
        if not (np.absolute(spread) <= LIMIT).all():
            raise EstimatorError("covariance is not finite; start from finite numbers")
        flipped = np.swapaxes(spread, -1, -2)
        scale = np.sqrt(np.einsum("...i,...j->...ij", *[np.absolute(np.einsum("...ii->...i", spread))] * 2))
        if (np.absolute(spread - flipped) > 1e-9 * scale + 1e-300).any():
            raise EstimatorError("covariance is not symmetric; symmetrise it: (P + P') / 2")
        lowest = np.linalg.eigvalsh(spread / np.where(scale > 0, scale, 1.0))[..., 0]
        if not (lowest > 0).all():
            entry = np.unravel_index(int(np.argmin(lowest)), lowest.shape)
            place = f" at entry {tuple(int(axis) for axis in entry)}" if self.batch_shape else ""
            raise EstimatorError(
                f"covariance is not positive definite{place}: lowest eigenvalue of the correlation {lowest.min():.3g}; "
                "give every state a variance above zero"
            )
        return mean.copy(), ((spread + flipped) / 2).copy()

    def _read(self) -> tuple[FloatArray, FloatArray]:
        raise NotImplementedError

    def _write(self, where: BoolArray, mean: FloatArray, spread: FloatArray) -> None:
        raise NotImplementedError

    def _memory(self) -> dict[str, FloatArray]:
        raise NotImplementedError
