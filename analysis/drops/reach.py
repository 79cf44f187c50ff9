r"""How near to its first crossing a pencil (1 - x) F + x G is certainly stable, and certainly not, for all data within an error.

On the way up, X with M(c) X = X - I proves radius < 1 for every x in [a, c] at once, if M(x) X < X at a and at c: M is affine
in x, and the cone is convex. Beyond the crossing one point is enough: where no member of the family has the
eigenvalue 1, and one member has a radius above 1, all have (`analysis.markov.regular`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.exact import radius_below_one
from analysis.markov.enclosure import EPS
from analysis.markov.regular import EXACT, regular_cells
from analysis.markov.second_moment import pack, unpack
from estimators.arrays import FloatArray

DIGITS = 50  # halvings of the distance to the crossing


@dataclass(frozen=True)
class Family:
    """(1 - x) first + x last, (d, d) each, to within the errors, on the half-vectorised matrices of `modes` modes with
    `states`.
    """

    first: FloatArray
    last: FloatArray
    first_error: FloatArray
    last_error: FloatArray
    states: int
    modes: int

    def at(self, x: float) -> tuple[FloatArray, FloatArray]:
        """The operator and its entrywise error."""
        size = (1.0 - x) * np.abs(self.first) + x * np.abs(self.last)
        return (1.0 - x) * self.first + x * self.last, (
            1.0 - x
        ) * self.first_error + x * self.last_error + 4.0 * EPS * size


def stable_until(family: Family, start: float, crossing: float) -> float:
    """The largest c below `crossing` for which [start, c] is proved stable, up to a factor 2 of the distance; `start` if
    none is.
    """
    reached = start
    for halving in range(1, DIGITS):
        c = crossing - (crossing - start) * 0.5**halving
        if not start < c < crossing or not _proves(family, reached, c):
            break
        reached = c
    return reached


def unstable_from(family: Family, crossing: float, end: float) -> float:
    """The smallest x above `crossing` at which every member is proved unstable, up to a factor 2; `end` if none is."""
    reached = end
    if len(family.first) > EXACT:
        return reached
    for halving in range(1, DIGITS):
        x = crossing + (end - crossing) * 0.5**halving
        if not crossing < x < end:
            break
        point = np.array([x])
        operator, _ = family.at(x)
        errors = family.first_error, family.last_error
        if (
            not regular_cells(family.first, family.last, *errors, point, point)[0]
            or radius_below_one(operator) is not False
        ):
            break
        reached = x
    return reached


def _proves(family: Family, start: float, c: float) -> bool:
    d = len(family.first)
    one = np.tile(pack(np.eye(family.states)), family.modes)
    middle, _ = family.at(c)
    try:
        x = np.asarray(np.linalg.solve(np.eye(d) - middle, one), float)
    except np.linalg.LinAlgError:
        return False
    if not np.isfinite(x).all():
        return False
    size = np.abs(x)
    if not _smallest(family, x) > 4.0 * family.states * EPS * float(np.linalg.norm(x)):
        return False
    for place in (start, c):
        operator, error = family.at(place)
        slip = error @ size + 2.0 * (d + 2) * EPS * (np.abs(operator) @ size + size)
        if not _smallest(family, np.asarray(x - operator @ x)) > float(np.linalg.norm(slip)) * (1.0 + 1e-9):
            return False
    return True


def _smallest(family: Family, x: FloatArray) -> float:
    """The smallest eigenvalue of all modes' matrices."""
    return float(np.linalg.eigvalsh(unpack(x.reshape(family.modes, -1), family.states)).min())
