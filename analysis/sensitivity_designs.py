"""Where to look: grids, Latin hypercubes and Sobol sequences over named ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from analysis.checks import as_stack
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray

Ranges: TypeAlias = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Design:
    """`samples` (N, d): one row a sample, one column a name; `shape` is that of the grid it came from, or (N,)."""

    kind: str
    names: tuple[str, ...]
    samples: FloatArray
    shape: tuple[int, ...]
    seed: int | None = None

    def columns(self) -> dict[str, FloatArray]:
        """Samples by name, each (N,): what a measure takes."""
        return {name: self.samples[:, i] for i, name in enumerate(self.names)}


def bounds(ranges: Ranges) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names, lower and upper limits (d,). Raises AnalysisError for empty, reversed or infinite ranges."""
    if not ranges:
        raise AnalysisError("no parameter to vary; give at least one name with its range")
    pairs = np.empty((len(ranges), 2))
    for i, (name, pair) in enumerate(ranges.items()):
        array = as_stack(f"range of {name}", pair, ndim=1)
        if array.shape != (2,) or not array[0] < array[1]:
            raise AnalysisError(f"range of {name} is {pair}; give (minimum, maximum) with minimum < maximum")
        pairs[i] = array
    return tuple(ranges), pairs[:, 0], pairs[:, 1]


def around(nominal: Mapping[str, float], relative: float = 0.2) -> dict[str, tuple[float, float]]:
    """Ranges nominal (1 - relative) .. nominal (1 + relative), in ascending order. A nominal of 0 has none."""
    out = {}
    for name, value in nominal.items():
        edges = sorted((value * (1.0 - relative), value * (1.0 + relative)))
        if not (np.isfinite(edges).all() and edges[0] < edges[1]):
            raise AnalysisError(f"{name} = {value} has no relative range of {relative:g}; give its range yourself")
        out[name] = (edges[0], edges[1])
    return out


def grid(levels: Mapping[str, Sequence[float] | FloatArray]) -> Design:
    """Every combination of the given levels."""
    if not levels:
        raise AnalysisError("no parameter to vary; give at least one name with its levels")
    axes = [as_stack(f"levels of {name}", values, ndim=1).ravel() for name, values in levels.items()]
    mesh = np.meshgrid(*axes, indexing="ij")
    return Design("grid", tuple(levels), np.stack([m.ravel() for m in mesh], axis=1), mesh[0].shape)


def latin_hypercube(ranges: Ranges, samples: int, seed: int) -> Design:
    """`samples` points with one in each of as many equal slices of every range (McKay, Beckman, Conover 1979)."""
    names, low, high = bounds(ranges)
    _check_count(samples)
    points = qmc.LatinHypercube(len(names), rng=np.random.default_rng(seed)).random(samples)
    return Design("latin hypercube", names, low + points * (high - low), (samples,), seed)


def sobol(ranges: Ranges, samples: int, seed: int) -> Design:
    """Scrambled Sobol points (Owen 1998); `samples` must be a power of two, on which their balance rests."""
    names, low, high = bounds(ranges)
    power = power_of_two(samples)
    points = qmc.Sobol(len(names), rng=np.random.default_rng(seed)).random_base2(power)
    return Design("sobol", names, low + points * (high - low), (samples,), seed)


def corners(ranges: Ranges, limit: int = 1 << 16) -> Design:
    """All 2^d corners of the box. Raises AnalysisError beyond `limit` of them."""
    names, low, high = bounds(ranges)
    if len(names) >= limit.bit_length():
        raise AnalysisError(f"{len(names)} parameters have more than {limit} corners; vary fewer")
    return grid({name: (low[i], high[i]) for i, name in enumerate(names)})


def power_of_two(samples: int) -> int:
    """The exponent. Raises AnalysisError with the nearest power."""
    _check_count(samples)
    power = int(samples).bit_length() - 1
    if 1 << power != samples:
        raise AnalysisError(
            f"{samples} samples: a Sobol design needs a power of two, {1 << power} or {1 << (power + 1)}"
        )
    return power


def _check_count(samples: ArrayLike) -> None:
    if not isinstance(samples, (int, np.integer)) or samples < 1:
        raise AnalysisError(f"number of samples {samples!r} must be a positive whole number")
