r"""Where a pencil (1 - x) F + x G of cone-preserving operators is certainly stable, certainly not, or undecided by its data.

The radius of such an operator is an eigenvalue of it, so it passes 1 only where I - (1 - x) F - x G is singular. Cells of x
that are not shown to be regular (`analysis.markov.regular`) are halved. Between those that are left nothing crosses 1, for
any x and any data within the error, so one radius of one member decides a whole region.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from analysis.exact import radius_below_one
from analysis.markov.enclosure import EPS, enclosed
from analysis.markov.regular import EXACT, regular_cells
from estimators.arrays import FloatArray
from estimators.display import Display

Interval: TypeAlias = tuple[float, float]
START, MOST = 16, 256  # cells at first, and at most in one round of halving
FINEST = 2.0**-50  # width of a cell
PLACES = (0.5, 0.25, 0.75, 0.05, 0.95)  # of a region, where its radius is asked for


@dataclass(frozen=True, repr=False)
class Regions(Display):
    """Intervals that fill [0, 1], each in order: radius < 1, radius > 1, and undecided, for all data within their error."""

    stable: tuple[Interval, ...]
    unstable: tuple[Interval, ...]
    undecided: tuple[Interval, ...]


def regions(first: FloatArray, last: FloatArray, first_error: FloatArray, last_error: FloatArray) -> Regions:
    """Regions of x for F = `first`, G = `last` (d, d), whose entries are known to within the errors (d, d)."""
    doubtful = singular_cells(first, last, first_error, last_error)
    cuts = [0.0, *(x for cell in doubtful for x in cell), 1.0]
    found: dict[str, list[Interval]] = {"stable": [], "unstable": [], "undecided": list(doubtful)}
    for low, high in list(pairwise(cuts))[::2]:
        if high > low:
            found[_status(first, last, first_error, last_error, (low, high))].append((low, high))
    return Regions(tuple(found["stable"]), tuple(found["unstable"]), _joined(sorted(found["undecided"])))


def singular_cells(
    first: FloatArray, last: FloatArray, first_error: FloatArray, last_error: FloatArray
) -> tuple[Interval, ...]:
    """Closed intervals of [0, 1] that hold every x at which some member of the family has an eigenvalue 1."""
    edges = np.linspace(0.0, 1.0, START + 1)
    low, high = edges[:-1], edges[1:]
    while len(low):
        open_ = ~regular_cells(first, last, first_error, last_error, low, high)
        low, high = low[open_], high[open_]
        if not len(low) or 2 * len(low) > MOST or high[0] - low[0] <= FINEST:
            break
        middle = 0.5 * (low + high)
        low, high = np.stack([low, middle], 1).reshape(-1), np.stack([middle, high], 1).reshape(-1)
    return _joined([(float(a), float(b)) for a, b in zip(low, high, strict=True)])


def _joined(cells: list[Interval]) -> tuple[Interval, ...]:
    """Neighbours that touch as one interval; cells come in order."""
    out: list[Interval] = []
    for a, b in cells:
        if out and a <= out[-1][1]:
            out[-1] = (out[-1][0], max(b, out[-1][1]))
        else:
            out.append((a, b))
    return tuple(out)


def _status(F: FloatArray, G: FloatArray, F_error: FloatArray, G_error: FloatArray, region: Interval) -> str:
    low, high = region
    for place in PLACES:
        x = low + place * (high - low)
        error = (1.0 - x) * F_error + x * G_error + 4.0 * EPS * (np.abs(F) + np.abs(G))
        found = enclosed((1.0 - x) * F + x * G, error)
        if found.upper < 1.0 or found.lower >= 1.0:
            return "stable" if found.upper < 1.0 else "unstable"
    if len(F) > EXACT:
        return "undecided"
    x = 0.5 * (low + high)
    below = radius_below_one((1.0 - x) * F + x * G)
    return "undecided" if below is None else "stable" if below else "unstable"
