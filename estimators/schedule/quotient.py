"""A rational plant in float64: polynomials of the scaled parameters over a common positive one, evaluated as they were proved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, NoReturn

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import ScheduleError
from estimators.schedule.plant import PlantPolynomial, PlantPolynomials, chebyshev

_MOST_PARTS = 50_000  # of the range, before the denominator counts as zero somewhere
_MOST_NUMBERS = 100_000_000  # of all terms
_CHUNK = 1_000_000  # numbers at once
_KEPT = 0.8  # of its value in the middle of a part a denominator keeps on all of it


class PlantQuotient(NamedTuple):
    """M(p) = numerator(p) / denominator(p); `largest` (rows, columns) bounds |M| entry by entry on the whole range."""

    numerator: PlantPolynomial | PlantPolynomials
    denominator: PlantPolynomial | PlantPolynomials
    largest: FloatArray

    def at(self, parameter: FloatArray) -> FloatArray:
        """M(p), leading axes as those of a polynomial."""
        return np.asarray(self.numerator.at(parameter) / self.denominator.at(parameter))

    @property
    def middle(self) -> float | FloatArray:
        """Middle of the ranges."""
        return self.numerator.middle

    @property
    def half(self) -> float | FloatArray:
        """Half the width of the ranges."""
        return self.numerator.half

    @property
    def coefficients(self) -> NoReturn:
        """There are none.

        Raises:
            ScheduleError: always.
        """
        raise ScheduleError(
            "the plant of the schedule is divided by a polynomial of its parameters, what uses it here takes polynomials; "
            "take LpvObserver"
        )


def quotients(
    numerators: Mapping[str, PlantPolynomial | PlantPolynomials],
    denominator: PlantPolynomial | PlantPolynomials,
    names: Sequence[str],
    where: str,
) -> dict[str, PlantQuotient]:
    """Every matrix over the denominator; `names` of the parameters and `where` are for the message of a refusal.

    Raises:
        ScheduleError: the denominator is not positive on the whole range; names a place.
    """
    centres, halves, lower = _parts(denominator, names, where)
    found = {}
    for key, numerator in numerators.items():
        flat, sizes = _flat(numerator)
        values = np.abs(_values(centres, flat, sizes)) + halves @ _steepest(flat, sizes)
        # A bound for sizes alone: what is rounded here is far below its slack.
        bound = np.minimum((values / lower[:, None]).max(axis=0, initial=0.0), numerator.largest.ravel() / lower.min())
        bound *= 1.0 + 1e-9
        found[key] = PlantQuotient(numerator, denominator, bound.reshape(numerator.coefficients.shape[-2:]))
    return found


def _parts(
    denominator: PlantPolynomial | PlantPolynomials, names: Sequence[str], where: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Boxes of u that cover the range: centres and half widths (g, parameters), lower bounds (g,) of the denominator.

    |dT_k/du| <= k^2 bounds its slopes; a box on which it may fall far below its value in the middle is cut in two.
    """
    flat, sizes = _flat(denominator)
    slopes, count = _steepest(flat, sizes)[:, 0], len(sizes)
    rounding = 1e-13 * float(np.abs(flat).sum())
    centres, halves = np.zeros((1, count)), np.ones((1, count))
    done: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    total, most = 0, min(_MOST_PARTS, _MOST_NUMBERS // len(flat))
    while len(centres):
        values = _values(centres, flat, sizes)[:, 0] - rounding
        lower = values - halves @ slopes
        total += len(centres)
        if not (values > 0.0).all() or total > most:
            worst = np.asarray(denominator.middle) + np.asarray(denominator.half) * centres[int(np.argmin(values))]
            at = ", ".join(f"{name} = {x:g}" for name, x in zip(names, np.atleast_1d(worst), strict=True))
            raise ScheduleError(f"{where}: plant.denominator: is not clearly positive on the whole range, near {at}")
        good = lower >= _KEPT * values
        done.append((centres[good], halves[good], lower[good]))
        centres, halves = centres[~good], halves[~good]
        axis = np.argmax(halves * slopes, axis=1)[:, None] == np.arange(count)
        halves = np.where(axis, 0.5 * halves, halves)
        step = np.where(axis, halves, 0.0)
        centres, halves = np.concatenate([centres - step, centres + step]), np.concatenate([halves, halves])
    whole = [np.concatenate(parts) for parts in zip(*done, strict=True)]
    return whole[0], whole[1], whole[2]


def _flat(polynomial: PlantPolynomial | PlantPolynomials) -> tuple[FloatArray, tuple[int, ...]]:
    """Coefficients (products of Chebyshev polynomials, entries), and the number of orders of every parameter."""
    sizes = tuple(max(1, size) for size in polynomial.coefficients.shape[:-2])
    rows, columns = polynomial.coefficients.shape[-2:]
    full = np.zeros((*sizes, rows, columns))
    full[tuple(slice(size) for size in polynomial.coefficients.shape[:-2])] = polynomial.coefficients
    return full.reshape(-1, rows * columns), sizes


def _values(points: FloatArray, flat: FloatArray, sizes: tuple[int, ...]) -> FloatArray:
    """At u (g, parameters): (g, entries)."""
    step = max(1, _CHUNK // len(flat))
    return np.concatenate([chebyshev(points[k : k + step], sizes) @ flat for k in range(0, len(points), step)])


def _steepest(flat: FloatArray, sizes: tuple[int, ...]) -> FloatArray:
    """Bounds of the slopes along every u: (parameters, entries)."""
    orders = np.indices(sizes).reshape(len(sizes), -1)
    return np.asarray((orders**2).astype(float) @ np.abs(flat))
