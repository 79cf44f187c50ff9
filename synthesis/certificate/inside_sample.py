r"""What a parameter that moves inside a sample adds to the error: bounded, because the claims hold it over the sample.

The update freezes p at p_k. With the true x' = A(p(t)) x + B(p(t)) u, u held, the plant ends the sample elsewhere by at most

    |x(T) - (frozen)| <= N |x_k| + N_u |u|,    N = q T^2/2 X |A'| X,    N_u = q T^2/2 X (|A'| T X |B| + |B'|)

entry by entry, summed over the parameters: q the largest rate, |A'| the largest dA/dp, |B| the largest B, and X = e^(T M) with
the comparison matrix M (M_ii = sup A_ii or 0 if that is negative, M_ij = sup |A_ij|), which bounds every transition matrix inside
a sample, over a part of it or all of it: |Phi| <= X. It is the same for all kinds of update: it adds to the error e of an
observer, and to the states x of a feedback loop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flint import arb, arb_mat, fmpq

from synthesis.certificate.claims import quotient
from synthesis.certificate.rounding import round_up
from synthesis.loop.loop import Loop
from synthesis.polynomials.enclosure import Entries, PolynomialMatrix, magnitudes


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
    """The bounds for a loop with a sample time; None if a parameter may jump, or if a bound is not finite."""
    plant, period = loop.plant, loop.sample_time
    if period is None or any(axis.may_jump for axis in plant.axes):
        return None
    A, B = (plant.matrices[key].balls() for key in "AB")
    n = A.shape[0]
    grown = (_comparison(A) * arb(period)).exp()
    moved, driven = arb_mat(n, n), arb_mat(n, B.shape[1])
    for i, axis in enumerate(plant.axes):
        rate = max(abs(axis.rate_low or fmpq(0)), abs(axis.rate_high or fmpq(0))) / axis.half
        half = arb(rate * period * period / 2)
        slope, turn = _largest(A.derivative(i)), _largest(B.derivative(i))
        moved = moved + grown * slope * grown * half
        driven = driven + grown * (slope * grown * _largest(B) * arb(period) + turn) * half
    bounds = InsideSample(_floats(moved), _floats(driven))
    finite = all(x < float("inf") for row in (*bounds.of_states, *bounds.of_inputs) for x in row)
    return bounds if finite else None


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
