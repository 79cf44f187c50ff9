"""Lie-derivative observability rank of nonlinear models at points, in ball arithmetic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import sympy as sp
from flint import arb, arb_mat, arb_series

from analysis.errors import AnalysisError
from analysis.exact import total
from analysis.observability.exact_expression import exact, in_cases
from analysis.observability.lie_series import Evaluator, ball, series_arithmetic
from analysis.observability.matrix import exact_number
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.models.nonlinear import NonlinearModel

Number: TypeAlias = float | int | str | Any  # or an exact sympy number
BITS = 320


@dataclass(frozen=True, eq=False, repr=False)
class LieRank(Display):
    r"""Rank of d/dx [h; L_f h; ...; L_f^k h] at one point, inputs and their derivatives given.

    `by_order[k]` is the rank with derivatives up to k. Each is proved from below (pivots of an elimination in ball
    arithmetic that exclude zero); what is left over is at most `residual` times the largest entry. `unseen`
    (nx, nx - rank) is an orthonormal basis of the directions the outputs do not change along, to first order.
    """

    by_order: tuple[int, ...]
    state_names: tuple[str, ...]
    unseen: FloatArray
    residual: float
    rows: Any

    @property
    def rank(self) -> int:
        """With all derivatives."""
        return self.by_order[-1]

    @property
    def deficiency(self) -> int:
        """Number of directions that are not seen."""
        return len(self.state_names) - self.rank


class LieRankTest(Display):
    """The symbolic work (Jacobians, shared subexpressions) done once for many points of one model.

    `order` Lie derivatives, 2 nx - 1 if None: nx - 1 reach the generic rank, but at a special point (a state at zero) more may
    be needed, and no order is enough for every model.

    >>> import sympy as sp
    >>> x, y = sp.symbols("x y")
    >>> model = NonlinearModel(
    ...     "pair", "example", (Signal("x", "1"), Signal("y", "1")), (Signal("z", "1"),),
    ...     f=sp.Matrix([y, -x]), h=sp.Matrix([x**2]),
    ... )
    >>> LieRankTest(model).at({"x": 1.0, "y": 0.5}).by_order
    (1, 2, 2, 2)
    """

    def __init__(self, model: NonlinearModel, order: int | None = None) -> None:
        self.model = model
        self.order = 2 * len(model.states) - 1 if order is None else order
        if self.order < 0:
            raise AnalysisError(f"order = {self.order} must be at least 0 (number of Lie derivatives)")
        self.names = tuple(s.name for s in model.states)
        self.input_names = tuple(s.name for s in model.inputs)

    @cached_property
    def _jacobians(self) -> tuple[Evaluator, Evaluator]:
        f, h = exact_model(self.model)
        states = self.model.state_symbols
        gradients = [e.diff(s) for g in (f, h) for e in g for s in states]
        return Evaluator(list(f)), Evaluator(gradients)

    def at(self, state: Mapping[str, Number], inputs: Mapping[str, Number | Sequence[Number]] | None = None) -> LieRank:
        """The rank at a state; an input is a value (held) or a sequence [u, u', u'', ...] of it and its derivatives.

        Numbers are taken as exact rationals (floats as their shortest decimal). Raises AnalysisError for names that are
        missing or unknown, and where the model is singular.
        """
        x0 = self._numbers("state", state, self.names)
        given = inputs or {}
        jets = {name: value if isinstance(value, Sequence) and not isinstance(value, str) else [value]
                for name, value in given.items()}  # fmt: skip
        self._numbers("input", {name: jet[0] for name, jet in jets.items() if len(jet)}, self.input_names)
        with series_arithmetic(self.order + 1, BITS):
            bound = {
                name: arb_series(
                    [ball(_rational(name, v)) / arb(int(sp.factorial(k))) for k, v in enumerate(jet)][: self.order + 1]
                )
                for name, jet in jets.items()
            }
            return self._rank(self._gradients(x0, bound))

    def _numbers(self, kind: str, given: Mapping[str, Number], names: tuple[str, ...]) -> list[sp.Rational]:
        for name in given:
            if name not in names:
                raise AnalysisError(f"model '{self.model.name}': {unknown(kind, name, names)}")
        missing = [name for name in names if name not in given]
        if missing:
            raise AnalysisError(f"model '{self.model.name}': no value for {kind} {', '.join(missing)}; give all")
        return [_rational(name, given[name]) for name in names]

    def _gradients(self, x0: list[sp.Rational], inputs: dict[str, Any]) -> Any:
        """Rows d(L_f^k h)/dx / k!, k = 0..order, as one arb_mat: y = h(x(t)) expanded in t, differentiated by x(0).

        x by Picard iteration (each gains one order), then Phi' = f_x Phi coefficient by coefficient.
        """
        n, ny, order = len(self.names), len(self.model.outputs), self.order
        field, gradient = self._jacobians
        start = [arb_series([ball(v)]) for v in x0]
        path = start
        for _ in range(order):
            slopes = field({**inputs, **dict(zip(self.names, path, strict=True))})
            path = [begin + slope.integral() for begin, slope in zip(start, slopes, strict=True)]
        entries = gradient({**inputs, **dict(zip(self.names, path, strict=True))})
        F = [_coefficient(entries[: n * n], n, n, k) for k in range(order + 1)]
        H = [_coefficient(entries[n * n :], ny, n, k) for k in range(order + 1)]
        phi = [arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])]
        for k in range(order):
            phi.append(total([F[j] * phi[k - j] for j in range(k + 1)]) / arb(k + 1))
        blocks = [total([H[j] * phi[k - j] for j in range(k + 1)]) for k in range(order + 1)]
        return [[block[i, j] for j in range(n)] for block in blocks for i in range(ny)]

    def _rank(self, rows: list[list[Any]]) -> LieRank:
        ny = len(self.model.outputs)
        by_order = []
        for k in range(self.order + 1):
            rank, residual = ball_rank(rows[: (k + 1) * ny])
            by_order.append(rank)
        return LieRank(tuple(by_order), self.names, _null_space(rows, by_order[-1]), residual, rows)


def exact_model(model: NonlinearModel) -> tuple[sp.ImmutableMatrix, sp.ImmutableMatrix]:
    """f and h with constants inserted, decimals as fractions and kinks (abs, max) as cases."""
    f, h = (in_cases(exact(f"model '{model.name}'", side)) for side in model.with_constants_inserted())
    return f, h


def ball_rank(rows: list[list[Any]]) -> tuple[int, float]:
    """(rank, residual): as many pivots as exclude zero, found by complete pivoting, and the relative size of the rest.

    Columns are divided by their largest entry first, so that the residual means the same for every unit.
    """
    columns = list(zip(*rows, strict=True))
    sizes = [max((entry.abs_upper() for entry in column), default=arb(0)) for column in columns]
    left = [[e / s if s > 0 else e for e, s in zip(row, sizes, strict=True)] for row in rows]
    rank = 0
    while left and left[0]:
        best, i, j = max(
            ((entry.abs_lower(), i, j) for i, row in enumerate(left) for j, entry in enumerate(row)),
            key=lambda found: float(found[0]),
        )
        if not best > 0:
            break
        rank += 1
        pivot = left[i]
        left = [
            [row[c] - row[j] / pivot[j] * pivot[c] for c in range(len(row)) if c != j]
            for r, row in enumerate(left)
            if r != i
        ]
    residual = max((float(entry.abs_upper()) for row in left for entry in row), default=0.0)
    return rank, residual


def _null_space(rows: list[list[Any]], rank: int) -> FloatArray:
    """Orthonormal basis from the midpoints; each row scaled to unit length first, orders differ by many decades."""
    from scipy.linalg import qr

    middle = np.array([[float(entry.mid()) for entry in row] for row in rows])
    size = np.linalg.norm(middle, axis=1, keepdims=True)
    scaled = middle / np.where(size > 0.0, size, 1.0)
    columns = np.linalg.norm(scaled, axis=0)
    columns = np.where(columns > 0.0, columns, 1.0)
    _, _, right = np.linalg.svd(scaled / columns)
    basis = right[rank:].T / columns[:, None]
    if not basis.shape[1]:
        return basis
    # rows of very different size keep their digits if the largest come first and columns are exchanged (Cox, Higham 1998)
    order = np.argsort(-np.abs(basis).max(axis=1))
    orthonormal = np.empty_like(basis)
    orthonormal[order] = qr(basis[order], mode="economic", pivoting=True)[0]
    return orthonormal


def _coefficient(entries: list[Any], rows: int, columns: int, k: int) -> Any:
    return arb_mat(rows, columns, [e[k] if k < e.length() else arb(0) for e in entries])


def _rational(name: str, value: Number) -> sp.Rational:
    number = exact_number(name, value)
    if not number.is_Rational:
        raise AnalysisError(f"{name} = {number} is irrational; give a rational number")
    return number
