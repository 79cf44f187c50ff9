r"""One short step of a system whose parameters move along a line, enclosed in balls.

A step of length h obeys Psi' = h M(s) Psi on s in [0, 1], M = [[A - jw, B], [0, 0]] a polynomial in s (over a denominator: a
Taylor polynomial of A/d with a bounded rest). A Taylor polynomial of Psi leaves the residual R(s) in that equation, of terms
s^k with k >= K only; the error is below e^(h |M|) |R| in the largest row sum, everywhere on the step, and is put on the
constant term as a ball.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat

from analysis.exact import total
from analysis.lpv.question import Question
from synthesis.polynomials.enclosure import PolynomialMatrix, row_sum

TERMS = 24  # of the Taylor series of a step
BELOW = 16  # of that of 1/d


@dataclass(frozen=True)
class Interval:
    """xi+ = F xi + G v and the energy [xi; v]* Q [xi; v]: `step` [F G; 0 I] and `energy` Q, matrices of balls."""

    step: Any
    energy: Any

    def then(self, later: Interval) -> Interval:
        """Both after each other, the input standing still."""
        return Interval(later.step * self.step, self.energy + adjoint(self.step) * later.energy * self.step)

    def with_inputs_times(self, unit: fmpq, states: int) -> Interval:
        """For the input v of which unit^-1 v was the one before."""
        width = self.step.ncols()

        def scaling(factor: fmpq) -> Any:
            return _diagonal([fmpq(1)] * states + [factor] * (width - states))

        back = scaling(1 / unit)
        return Interval(scaling(unit) * self.step * back, back * self.energy * back)


@dataclass(frozen=True)
class Line:
    """A step with u = start + change s; `unit` makes B small, `frequency` is that of the carrier."""

    question: Question
    start: list[fmpq]
    change: list[fmpq]
    h: fmpq
    frequency: float
    unit: fmpq

    def sample(self) -> Interval:
        """One sample in discrete time: no step at all."""
        below = self.question.exact["denominator"].at(self.start)[0, 0]
        A, B, C, D = (self.question.exact[key].at(self.start) * (1 / below) for key in "ABCD")
        turn = (acb(0, -1) * arb(self.frequency)).exp()
        shown = _beside(acb_mat(C), acb_mat(D))
        return Interval(_stacked(acb_mat(A) * turn, acb_mat(B) * turn, 1), adjoint(shown) * shown)

    def step(self) -> Interval | None:
        """The step; None where the denominator is not bounded away from zero."""
        over = self._over()
        if over is None:
            return None
        below, rest = over
        raw = {key: self._along(key) for key in "ABCD"}
        n, m = self.question.exact["B"].shape
        flow, shown = self._parts({key: _times(matrices, below) for key, matrices in raw.items()})
        flow[0] = flow[0] + _diagonal([acb(0, -self.frequency) * self.h] * n + [acb(0)] * m)
        loose, unseen = (
            (rest * sum(size(matrix) for matrix in part) for part in self._parts(raw)) if rest else (0.0, 0.0)
        )
        order = len(flow)
        terms = [_diagonal([1] * (n + m))]
        for k in range(TERMS):
            terms.append(total([flow[i] * terms[k - i] for i in range(min(order, k + 1))]) * fmpq(1, k + 1))
        left_over = sum(
            size(total([flow[i] * terms[k - i] for i in range(k - TERMS, min(order, k + 1))]))
            for k in range(TERMS, TERMS + order)
        ) + loose * sum(size(term) for term in terms)
        error = (arb(sum(size(term) for term in flow) + loose).exp() * arb(left_over)).abs_upper()
        terms[0] = terms[0] + acb_mat([[_ball(error)] * (n + m)] * n + [[acb(0)] * (n + m)] * m)
        shown[0] = shown[0] + acb_mat([[_ball(unseen)] * (n + m)] * shown[0].nrows())
        out: list[Any] = [shown[0] * 0] * (len(terms) + len(shown) - 1)
        for i, seen in enumerate(shown):
            for k, term in enumerate(terms):
                out[i + k] = out[i + k] + seen * term
        # Weights of the integral are positive, so a ball that holds a function everywhere holds its mean.
        energy = total(
            [adjoint(a) * total([b * fmpq(1, i + k + 1) for k, b in enumerate(out)]) for i, a in enumerate(out)]
        )
        return Interval(total(terms), energy * self.h)

    def _along(self, key: str) -> list[Any]:
        """Coefficients of the powers of s of a matrix on the line."""
        matrix: PolynomialMatrix = self.question.exact[key]
        out: dict[int, Any] = {}
        for powers, entries in matrix.affine(self.start, self.change).terms.items():
            out[sum(powers)] = out[sum(powers)] + entries if sum(powers) in out else entries
        zero = fmpq_mat(*matrix.shape, [fmpq(0)] * (matrix.shape[0] * matrix.shape[1]))
        return [out.get(k, zero) for k in range(max(out, default=0) + 1)]

    def _over(self) -> tuple[list[fmpq], float] | None:
        """A polynomial q(s) for 1/d(s), and a bound of |1/d - q| on [0, 1]."""
        d = [matrix[0, 0] for matrix in self._along("denominator")]
        least = abs(d[0]) - sum((abs(x) for x in d[1:]), fmpq(0))
        if not least > 0:
            return None
        if len(d) == 1:
            return [1 / d[0]], 0.0
        q: list[fmpq] = []
        for k in range(BELOW):
            known = sum((d[i] * q[k - i] for i in range(1, min(k, len(d) - 1) + 1)), fmpq(0))
            q.append((fmpq(int(k == 0)) - known) / d[0])
        rest = sum(
            abs(sum((d[i] * q[k - i] for i in range(k - BELOW + 1, len(d))), fmpq(0)))
            for k in range(BELOW, BELOW + len(d) - 1)
        )  # of 1 - d q
        return q, upper(arb(rest / least))

    def _parts(self, along: dict[str, list[Any]]) -> tuple[list[Any], list[Any]]:
        """h [A B; 0 0] and [C D] by powers of s, inputs in their unit."""
        (n, m), p = self.question.exact["B"].shape, self.question.exact["C"].shape[0]
        flow = [
            _stacked(acb_mat(_at(along["A"], k, (n, n))), acb_mat(_at(along["B"], k, (n, m)) * self.unit), 0) * self.h
            for k in range(max(len(along["A"]), len(along["B"])))
        ]
        shown = [
            _beside(acb_mat(_at(along["C"], k, (p, n))), acb_mat(_at(along["D"], k, (p, m)) * self.unit))
            for k in range(max(len(along["C"]), len(along["D"])))
        ]
        return flow, shown


def adjoint(matrix: Any) -> Any:
    """The conjugate transpose."""
    return matrix.conjugate().transpose()


def size(matrix: Any) -> float:
    """An upper bound of the largest row sum of absolute values."""
    return row_sum(arb_mat([[x.abs_upper() for x in row] for row in matrix.tolist()]))


def upper(number: Any) -> float:
    """A float that is not below a ball."""
    return float(number.abs_upper()) * (1.0 + 1e-15)


def _ball(radius: Any) -> Any:
    return acb(arb(0, radius), arb(0, radius))


def _times(matrices: list[Any], series: list[fmpq]) -> list[Any]:
    if len(series) == 1:
        return [matrix * series[0] for matrix in matrices]
    out = [matrices[0] * 0] * (len(matrices) + len(series) - 1)
    for i, matrix in enumerate(matrices):
        for k, factor in enumerate(series):
            out[i + k] = out[i + k] + matrix * factor
    return out


def _at(terms: list[Any], k: int, shape: tuple[int, int]) -> Any:
    return terms[k] if k < len(terms) else fmpq_mat(*shape, [fmpq(0)] * (shape[0] * shape[1]))


def _stacked(A: Any, B: Any, below: int) -> Any:
    """[A B; 0 I], or with 0 in the place of I."""
    n, m = A.nrows(), B.ncols()
    rows = _beside(A, B).tolist()
    return acb_mat([*rows, *([acb(below * int(j == n + i)) for j in range(n + m)] for i in range(m))])


def _beside(C: Any, D: Any) -> Any:
    return acb_mat([c + d for c, d in zip(C.tolist(), D.tolist(), strict=True)])


def _diagonal(entries: list[Any]) -> Any:
    n = len(entries)
    return acb_mat(n, n, [entries[i] if i == j else 0 for i, j in product(range(n), repeat=2)])
