"""Where the inequalities of a search are looked at, and the one that only normalises its unknowns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from synthesis.lmi.exchange import Family, corners
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import rate_samples
from synthesis.polynomials.matrix import MatrixPolynomial


@dataclass
class Asked:
    """A claim that is searched as an LMI problem: its unknown P and the inequalities at the places where they are looked at."""

    problem: LmiProblem
    P: MatrixPolynomial
    families: list[Family]

    def add(self, inequality: str, place: FloatArray) -> bool:
        """Solve for this place, too; False if that changes nothing."""
        return sum(family.add(place) for family in self.families if family.name == inequality) > 0


def rate_places(grid: FloatArray, later: MatrixPolynomial, count: int) -> FloatArray:
    """Every place of the grid with every vertex of the rates (and more, where P one sample later is not affine in them)."""
    found = rate_samples(later, count)
    moving = np.array(found).reshape(len(found), count)
    return np.hstack([np.repeat(grid, len(moving), axis=0), np.tile(moving, (len(grid), 1))])


def below_one(P: MatrixPolynomial, places: FloatArray, count: int) -> Family:
    """P < 1, which normalises the unknowns and takes no part in the verdict."""
    still = np.unique(np.hstack([places[:, :count], np.zeros_like(places[:, count:])]), axis=0)
    unit = np.eye(P.shape[0])

    def rows(chosen: FloatArray) -> FloatArray:
        values = -P.at(chosen)
        values[..., 0] += unit
        return values

    def known(decisions: FloatArray, chosen: FloatArray) -> FloatArray:
        return np.asarray(unit - P.substitute(decisions).at(chosen)[..., 0])

    return Family("P < 1", still, rows, known, corners(still, count), strict=False)
