"""A region that the border of the parameters' set cuts, in ball arithmetic: M - g N > 0 (`synthesis.polynomials.multiplier`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flint import fmpq_mat

from synthesis.certificate.unknowns import floats
from synthesis.loop.system import Region
from synthesis.polynomials.definite import sign_on_box
from synthesis.polynomials.enclosure import PolynomialMatrix, constant, variable
from synthesis.polynomials.half_spaces import HalfSpaces
from synthesis.polynomials.multiplier import borders, root
from synthesis.polynomials.rational import rational


def positive_inside(
    named: Sequence[tuple[str, PolynomialMatrix]], region: Region, half_spaces: HalfSpaces, order: int
) -> bool:
    """Whether all matrices are certainly positive definite on that part of the region which is in the set, for all rates."""
    cut, start, slopes = borders(half_spaces, [region.offset], [region.factor])
    if not cut[0]:
        return False
    count, variables = region.parameters, len(region.offset)
    g = constant(fmpq_mat([[rational(float(start[0]))]]), variables)
    for i, slope in enumerate(slopes[0]):
        g = g - variable(i, variables) * rational(float(slope))
    length = float(slopes[0] @ slopes[0])
    place = np.zeros((1, variables))
    place[0, :count] = np.clip(slopes[0] * (start[0] / length), -1.0, 1.0)
    for _, matrix in named:
        short = matrix.truncated(order)
        if sign_on_box(short).positive:
            continue
        M = floats(short)
        G = -sum(M.derivative(i).at(place)[0, ..., 0] * (slope / length) for i, slope in enumerate(slopes[0]))
        V = root(M.at(place)[0, ..., 0], np.asarray(G))
        exact = fmpq_mat([[rational(float(x)) for x in row] for row in V])
        N = constant(exact * exact.transpose(), variables)
        if not sign_on_box(short - N.scaled_by(g).balls()).positive:
            return False
    return True
