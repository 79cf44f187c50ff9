"""Are polynomials positive on a whole box? Bernstein coefficients in balls, and boxes that are halved until it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq

from synthesis.polynomials.definite import sign_on_box
from synthesis.polynomials.enclosure import PolynomialMatrix

MOST_BOXES = 4000


@dataclass(frozen=True)
class Decision:
    """`positive` everywhere; or a point where one certainly is not; or neither, and `open_at` is in a box that stayed open."""

    positive: bool
    fails_at: tuple[fmpq, ...] | None = None
    open_at: tuple[fmpq, ...] | None = None


def all_positive(
    polynomials: Sequence[PolynomialMatrix], offset: Sequence[fmpq], factor: Sequence[fmpq], most: int = MOST_BOXES
) -> Decision:
    """Every 1 x 1 polynomial on the box offset + factor [-1, 1]^v; the box whose polynomial is least sure is cut along its longest side."""
    waiting: list[tuple[tuple[fmpq, ...], tuple[fmpq, ...], tuple[PolynomialMatrix, ...]]] = [
        (tuple(offset), tuple(factor), tuple(polynomials))
    ]
    done = 0
    while waiting:
        centre, half, rest = waiting.pop()
        done += 1
        left = []
        for polynomial in rest:
            sign = sign_on_box(polynomial.affine(centre, half).balls())
            if sign.fails_at is not None:
                return Decision(False, tuple(c + h * t for c, h, t in zip(centre, half, sign.fails_at, strict=True)))
            if not sign.positive:
                left.append(polynomial)
        if not left:
            continue
        if done > most:
            return Decision(False, None, centre)
        axis = max(range(len(half)), key=lambda i: half[i] / factor[i] if factor[i] else fmpq(-1))
        for direction in (1, -1):
            moved = (*centre[:axis], centre[axis] + direction * half[axis] / 2, *centre[axis + 1 :])
            waiting.append((moved, (*half[:axis], half[axis] / 2, *half[axis + 1 :]), tuple(left)))
    return Decision(True)
