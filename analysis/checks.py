"""Input checks for stacks of matrices: what an analysis may take for granted afterwards."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.errors import AnalysisError
from estimators.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def as_stack(name: str, array: ArrayLike, ndim: int = 2) -> FloatArray:
    """The array as finite float64 with at least `ndim` axes, the last two of them a non-empty matrix.

    Complex numbers, text, ragged lists, masked entries, NaN and infinities raise AnalysisError with the first bad place.
    """
    try:
        given = np.asarray(array)
        if _masked(array):
            raise AnalysisError(f"{name} has masked entries; fill or remove them before the analysis")
        if np.iscomplexobj(given):
            raise AnalysisError(f"{name} is complex; give real matrices (stack real and imaginary parts)")
        out: Any = np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        if isinstance(error, AnalysisError):
            raise
        raise AnalysisError(f"{name} is not an array of numbers ({error}); give nested lists of equal length") from None
    if out.ndim < ndim:
        raise AnalysisError(f"{name} has the shape {out.shape}; it needs at least {ndim} axes (..., rows, columns)")
    require_finite(name, out)
    return np.asarray(out)


def _masked(array: object) -> bool:
    """Whether a masked entry hides in an array, or in an array of a list: numpy drops masks without a word."""
    if isinstance(array, list | tuple):
        return any(_masked(part) for part in array)
    return bool(np.ma.is_masked(array))


def require_finite(name: str, array: FloatArray) -> None:
    """Raise AnalysisError with the place and the number of values that are not finite."""
    bad = ~np.isfinite(array)
    if bad.any():
        place = tuple(int(i) for i in np.argwhere(bad)[0])
        raise AnalysisError(
            f"{name}[{', '.join(map(str, place))}] = {array[place]} ({int(bad.sum())} of {array.size} values are not finite); "
            "remove or replace them before the analysis"
        )


def square(name: str, array: ArrayLike, ndim: int = 2) -> FloatArray:
    """A finite stack of square matrices (..., n, n) with n >= 1."""
    out = as_stack(name, array, ndim)
    if out.shape[-1] != out.shape[-2] or not out.shape[-1]:
        raise AnalysisError(f"{name} has the shape {out.shape}; it must be square (..., n, n) with n >= 1")
    return out


def symmetric(name: str, array: ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """A finite stack of symmetric matrices, returned exactly symmetric."""
    out = square(name, array)
    skew = np.abs(out - np.swapaxes(out, -1, -2)).max(initial=0.0)
    if skew > tolerance * max(1.0, np.abs(out).max(initial=0.0)):
        raise AnalysisError(
            f"{name} is not symmetric (largest difference {skew:.3g}); give (M + M') / 2 if that is meant"
        )
    return np.asarray(0.5 * (out + np.swapaxes(out, -1, -2)))


def positive_semidefinite(name: str, array: ArrayLike, tolerance: float = 1e-12) -> FloatArray:
    """A finite stack of symmetric matrices without negative eigenvalue."""
    out = symmetric(name, array)
    eigenvalues = np.linalg.eigvalsh(out)
    low = float(eigenvalues.min(initial=0.0))
    if low < -tolerance * max(1.0, float(np.abs(eigenvalues).max(initial=0.0))):
        raise AnalysisError(
            f"{name} has the eigenvalue {low:.3g}; a covariance or weight must be positive semidefinite"
        )
    return out


def positive_definite(name: str, array: ArrayLike, tolerance: float = 1e-13) -> FloatArray:
    """A finite stack of symmetric positive definite matrices: a singular one is refused."""
    out = symmetric(name, array)
    eigenvalues = np.linalg.eigvalsh(out)
    low, high = float(eigenvalues.min(initial=np.inf)), float(np.abs(eigenvalues).max(initial=0.0))
    if not low > tolerance * high:
        raise AnalysisError(
            f"{name} is singular or indefinite (smallest eigenvalue {low:.3g}, largest {high:.3g}); "
            "it must be positive definite"
        )
    return out


def leading(arrays: Mapping[str, FloatArray], axes: int = 2) -> tuple[int, ...]:
    """The common leading batch shape of stacks, after broadcasting. Raises AnalysisError with all shapes."""
    try:
        return np.broadcast_shapes(*(array.shape[: array.ndim - axes] for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise AnalysisError(f"leading batch axes do not broadcast: {shapes}; make them equal or 1") from None


def same_size(first: str, a: FloatArray, second: str, b: FloatArray) -> None:
    """Require the last two axes of two stacks to agree."""
    if a.shape[-2:] != b.shape[-2:]:
        raise AnalysisError(
            f"{first} has the shape {a.shape} and {second} {b.shape}; their matrices must have one size"
        )


def probability(name: str, array: ArrayLike) -> FloatArray:
    """Finite numbers in [0, 1], any shape."""
    out = as_stack(name, array, ndim=0)
    if out.size and (out.min() < 0.0 or out.max() > 1.0):
        worst = out.min() if out.min() < 0.0 else out.max()
        raise AnalysisError(f"{name} = {worst:g} is outside [0, 1]; probabilities lie between 0 and 1")
    return out


def whole(name: str, value: float, least: int = 0) -> int:
    """A whole number that is not below `least`."""
    number = as_stack(name, value, ndim=0)
    if number.ndim or number != np.round(number) or number < least:
        raise AnalysisError(f"{name} = {value} must be a whole number of at least {least}")
    return int(number)


def positive(name: str, value: float) -> float:
    """A finite number above zero."""
    given = as_stack(name, value, ndim=0)
    if given.ndim:
        raise AnalysisError(f"{name} has the shape {given.shape}; give one number")
    number = float(given)
    if not number > 0.0:
        raise AnalysisError(f"{name} = {number:g} must be positive")
    return number
