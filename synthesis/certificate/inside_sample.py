r"""What a parameter that moves inside a sample adds to the error: bounded, because the claims hold it over the sample.

The update freezes p at p_k. With the true x' = A(p(t)) x + B(p(t)) u, u held, the plant ends the sample elsewhere by at most

    |x(T) - (frozen)| <= N |x_k| + N_u |u|,    N = q T^2/2 X |A'| X,    N_u = q T^2/2 X (|A'| T X |B| + |B'|)

entry by entry, summed over the parameters: q the largest rate, |A'| the largest dA/dp, |B| the largest B, and X = e^(T M) with
the comparison matrix M (M_ii = sup A_ii or 0 if that is negative, M_ij = sup |A_ij|), which bounds every transition matrix inside
a sample, over a part of it or all of it: |Phi| <= X. It is the same for all kinds of update: it adds to the error e of an
observer, and to the states x of a feedback loop. The largest values of a rational plant and of its derivative (N' d - N d') / d^2
are those on parts of the range, where the quotients are enclosed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from flint import arb, arb_mat, fmpq

from synthesis.certificate.claims import quotient
from synthesis.certificate.rounding import round_up
from synthesis.loop.loop import Loop
from synthesis.loop.plant import Plant
from synthesis.polynomials.enclosure import Entries, PolynomialMatrix, magnitudes
from synthesis.polynomials.quotient import quotients

PARTS = {1: 32, 2: 8}  # of every range of a rational plant, by the number of parameters


@dataclass(frozen=True)
class InsideSample:
    """`of_states` (nx, nx) and `of_inputs` (nx, nu): upper bounds N and N_u, in the units of the signals."""

    of_states: tuple[tuple[float, ...], ...]
    of_inputs: tuple[tuple[float, ...], ...]

    def words(self, states: Sequence[str], inputs: Sequence[str], units: Mapping[str, str]) -> list[str]:
        """One line for every state that is moved."""
        lines = []
        for row, more, state in zip(self.of_states, self.of_inputs, states, strict=True):
            parts = [
                f"{round_up(bound, 3):.3g} {quotient(units[state], units[name])} |{name}|"
                for bound, name in zip((*row, *more), (*states, *inputs), strict=True)
                if bound > 0.0
            ]
            lines += [f"{state} by at most {' + '.join(parts)}"] if parts else []
        return lines


def inside_sample(loop: Loop) -> InsideSample | None:
    """The bounds for a loop with a sample time; None if a parameter or the plant may jump, or if a bound is not finite."""
    plant, period = loop.plant, loop.sample_time
    if period is None or any(axis.may_jump for axis in plant.axes) or not plant.is_continuous:
        return None
    parts = _on_parts(plant)
    if parts is None:
        return None
    n, nu = plant.states, plant.shape("B")[1]
    grown = (_over_parts(_comparison, [part["A"] for part in parts]) * arb(period)).exp()
    largest = _over_parts(_largest, [part["B"] for part in parts])
    moved, driven = arb_mat(n, n), arb_mat(n, nu)
    for i, axis in enumerate(plant.axes):
        rate = max(abs(axis.rate_low or fmpq(0)), abs(axis.rate_high or fmpq(0))) / axis.half
        half = arb(rate * period * period / 2)
        slope, turn = (_over_parts(_largest, [part[f"{key}{i}"] for part in parts]) for key in "AB")
        moved = moved + grown * slope * grown * half
        driven = driven + grown * (slope * grown * largest * arb(period) + turn) * half
    bounds = InsideSample(_floats(moved), _floats(driven))
    finite = all(x < float("inf") for row in (*bounds.of_states, *bounds.of_inputs) for x in row)
    return bounds if finite else None


def _on_parts(plant: Plant) -> list[dict[str, PolynomialMatrix]] | None:
    """A, B and their derivatives A0, B0, A1, .. by u_0, u_1, .. on parts that cover the range, balls; None if one is open."""
    count = len(plant.axes)
    if plant.is_polynomial:
        parts = []
        for middle, factor, piece in plant.cells:
            given = {key: piece.matrices[key] for key in "AB"}
            slopes = {f"{key}{i}": m.derivative(i) for key, m in given.items() for i in range(count)}
            parts.append({key: m.affine(middle, factor).balls() for key, m in (given | slopes).items()})
        return parts
    d, given = plant.denominator, {key: plant.matrices[key] for key in "AB"}
    turned = {
        f"{key}{i}": m.derivative(i).scaled_by(d) - m.scaled_by(d.derivative(i))
        for key, m in given.items() for i in range(count)
    }  # fmt: skip
    square, number, found = d @ d, PARTS.get(count, 4), []
    for index in product(range(number), repeat=count):
        offset = [fmpq(2 * k + 1 - number, number) for k in index]

        def local(matrix: PolynomialMatrix, offset: list[fmpq] = offset) -> PolynomialMatrix:
            return matrix.affine(offset, [fmpq(1, number)] * count).balls()

        values = quotients({key: local(m) for key, m in given.items()}, local(d))
        moving = quotients({key: local(m) for key, m in turned.items()}, local(square))
        if values is None or moving is None:
            return None
        found.append(values | moving)
    return found


def _over_parts(bound: Callable[[PolynomialMatrix], Entries], matrices: Sequence[PolynomialMatrix]) -> Entries:
    """The largest of the bounds, entry by entry."""
    total = bound(matrices[0])
    for matrix in matrices[1:]:
        more = bound(matrix)
        for i in range(total.nrows()):
            for j in range(total.ncols()):
                total[i, j] = total[i, j].max(more[i, j])
    return total


def _largest(matrix: PolynomialMatrix) -> Entries:
    """Upper bounds of |M_ij(u)| on [-1, 1]^p."""
    total = arb_mat(*matrix.shape)
    for entries in matrix.terms.values():
        total = total + magnitudes(entries)
    return total


def _comparison(matrix: PolynomialMatrix) -> Entries:
    """Off the diagonal the largest absolute values, on it the largest values, or 0: e^(s M) must not fall with s."""
    found, n = _largest(matrix), matrix.shape[0]
    constant = matrix.terms.get((0,) * matrix.variables, arb_mat(n, n))
    for i in range(n):
        found[i, i] = (found[i, i] - abs(constant[i, i]) + constant[i, i]).max(arb(0))
    return found


def _floats(matrix: Entries) -> tuple[tuple[float, ...], ...]:
    # An upper end is exact to 30 bits; the factor covers its conversion to float64.
    rows = matrix.tolist() if matrix.ncols() else [[] for _ in range(matrix.nrows())]
    return tuple(tuple(float(x.abs_upper()) * (1.0 + 1e-15) for x in row) for row in rows)
