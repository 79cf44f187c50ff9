"""Block matrices of polynomials, in balls (`enclosure`) or on many boxes at once (`boxes`): exact, nothing is rounded."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np
from flint import arb_mat

from synthesis.polynomials.boxes import Boxes
from synthesis.polynomials.enclosure import PolynomialMatrix, Powers


def stacked(rows: Sequence[Sequence[Any]], heights: Sequence[int], widths: Sequence[int]) -> Any:
    """[[M11, M12, ..], [M21, ..], ..] from blocks of one ring, heights[i] x widths[j] each; None is zero."""
    down, across = ([0, *accumulate(sizes)] for sizes in (heights, widths))
    placed = [
        (block, down[i], across[j])
        for i, row in enumerate(rows)
        for j, block in enumerate(row)
        if block is not None and 0 not in block.shape
    ]
    shape = down[-1], across[-1]
    like = next(block for row in rows for block in row if block is not None)
    return _boxes(placed, shape, like) if isinstance(like, Boxes) else _balls(placed, shape, like.variables)


def rows(matrix: Any, start: int, stop: int) -> Any:
    """Some rows of a matrix of either ring."""
    if isinstance(matrix, Boxes):
        return Boxes(matrix.middle[:, :, start:stop], matrix.radius[:, start:stop], matrix.variables, matrix.highest)
    width = matrix.shape[1]
    terms = {
        powers: arb_mat(stop - start, width, [entries[i, j] for i in range(start, stop) for j in range(width)])
        for powers, entries in matrix.terms.items()
    }
    return PolynomialMatrix(terms, (stop - start, width), matrix.variables)


Placed = list[tuple[Any, int, int]]


def _boxes(placed: Placed, shape: tuple[int, int], like: Boxes) -> Boxes:
    count = max([len(like.middle), *(len(block.middle) for block, _, _ in placed)])
    middle = np.zeros((count, like.middle.shape[1], *shape))
    radius = np.zeros((count, *shape))
    for block, i, j in placed:
        height, width = block.shape
        middle[:, :, i : i + height, j : j + width] = block.middle
        radius[:, i : i + height, j : j + width] = block.radius
    return Boxes(middle, radius, like.variables, like.highest)


def _balls(placed: Placed, shape: tuple[int, int], variables: int) -> PolynomialMatrix:
    terms: dict[Powers, Any] = {}
    for block, i, j in placed:
        height, width = block.shape
        for powers, entries in block.terms.items():
            whole = terms.setdefault(powers, arb_mat(*shape))
            for a in range(height):
                for b in range(width):
                    whole[i + a, j + b] = entries[a, b]
    return PolynomialMatrix(terms, shape, variables)
