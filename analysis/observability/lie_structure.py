"""Generic Lie rank, and the directions that no output can ever see."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.lie_rank import LieRank, LieRankTest, ball_rank, exact_model
from analysis.observability.matrix import exact_number
from estimators.display import Display
from synthesis.models.nonlinear import NonlinearModel

Range = tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class StructuralDirections(Display):
    """Constant state directions V (nx, d), exact: `proved` if h_x V = 0 and f_x V = V K for every state and input.

    Then moving the state along V changes no output, however the inputs move, and the hidden part w (d,) obeys w' = K w
    in first order: `dynamics` K (d, d) says whether it dies out by itself (detectability of what is lost).
    """

    basis: sp.ImmutableMatrix
    dynamics: sp.ImmutableMatrix
    state_names: tuple[str, ...]
    proved: bool

    def describe(self) -> tuple[str, ...]:
        """Each direction in words, for example 'force_rl - force_rr'."""
        words = []
        for j in range(self.basis.cols):
            terms = [(self.basis[i, j], name) for i, name in enumerate(self.state_names) if self.basis[i, j] != 0]
            text = " ".join(f"{'-' if v < 0 else '+'} {'' if abs(v) == 1 else f'{abs(v)} '}{name}" for v, name in terms)
            words.append(text.removeprefix("+ "))
        return tuple(words)


@dataclass(frozen=True, eq=False, repr=False)
class GenericRank(Display):
    """The largest rank over random rational points: proved from below for almost every point of the analytic piece.

    `samples` are the single results; `structure` holds what all of them miss. With `structure.proved` the rank is
    exactly nx minus the number of those directions wherever the rank is generic, and can be higher nowhere.
    """

    rank: int
    samples: tuple[LieRank, ...]
    structure: StructuralDirections


def generic_rank(
    model: NonlinearModel,
    ranges: Mapping[str, Range],
    samples: int = 3,
    order: int | None = None,
    moving_inputs: bool = True,
    seed: int = 0,
) -> GenericRank:
    """Lie rank at random rational points of a box over all states and inputs.

    `moving_inputs` draws the derivatives of every input up to the order of the test as well (per second, within its half-width);
    otherwise inputs are held. A range (v, v) fixes a value, and its derivatives at zero. Raises AnalysisError for
    missing or reversed ranges.

    >>> import sympy as sp
    >>> x, y = sp.symbols("x y")
    >>> model = NonlinearModel(
    ...     "pair", "example", (Signal("x", "1"), Signal("y", "1")), (Signal("z", "1"),),
    ...     f=sp.Matrix([y, -x]), h=sp.Matrix([x**2]),
    ... )
    >>> generic_rank(model, {"x": (0.5, 1.0), "y": (0.5, 1.0)}).rank
    2
    """
    test = LieRankTest(model, order)
    for name in (*test.names, *test.input_names):
        if name not in ranges:
            raise AnalysisError(f"model '{model.name}': no range for '{name}'; give one for every state and input")
        if np.size(ranges[name]) != 2 or not all(exact_number(name, end).is_real for end in ranges[name]):
            raise AnalysisError(f"model '{model.name}': the range {ranges[name]} of '{name}' needs two real ends")
        if not ranges[name][0] <= ranges[name][1]:
            raise AnalysisError(f"model '{model.name}': the range {ranges[name]} of '{name}' is reversed")
    if samples < 1:
        raise AnalysisError(f"samples = {samples} must be at least 1")
    random = np.random.default_rng(seed)

    def draw(low: float, high: float) -> sp.Rational:
        share = sp.Rational(int(random.integers(1, 10**6)), 10**6)
        bottom, top = (sp.Rational(str(float(v))) for v in (low, high))
        return bottom + share * (top - bottom)

    found = []
    for _ in range(samples):
        state = {name: draw(*ranges[name]) for name in test.names}
        inputs = {}
        for name in test.input_names:
            half = 0.5 * (ranges[name][1] - ranges[name][0])
            more = [draw(-half, half) for _ in range(test.order)] if moving_inputs and half > 0.0 else []
            inputs[name] = [draw(*ranges[name]), *more]
        found.append(test.at(state, inputs))
    fixed = {name: ranges[name][0] for name in test.input_names if ranges[name][0] == ranges[name][1]}
    return GenericRank(max(r.rank for r in found), tuple(found), _structure(model, found, fixed))


def _structure(model: NonlinearModel, found: list[LieRank], fixed: Mapping[str, float]) -> StructuralDirections:
    """The common null space of all samples, read as small rationals, then proved symbolically."""
    rows = [row for result in found for row in result.rows]
    names = found[0].state_names
    rank, _ = ball_rank(rows)
    # Points that miss more than all of them together have directions of their own: no constant ones explain the rank.
    basis = _rational_null_space(rows, rank) if rank == max(result.rank for result in found) else None
    if basis is None:  # directions that depend on the point, or no small rationals: nothing constant to prove
        basis = sp.zeros(len(names), 0)
        return StructuralDirections(sp.ImmutableMatrix(basis), sp.ImmutableMatrix(sp.zeros(0, 0)), names, False)
    dynamics = _dynamics(model, basis, fixed)
    return StructuralDirections(
        sp.ImmutableMatrix(basis), sp.ImmutableMatrix(dynamics or sp.zeros(0, 0)), names, dynamics is not None
    )


def _rational_null_space(rows: list[list[Any]], rank: int) -> sp.Matrix | None:
    """Reduced basis from the midpoints by rational elimination; None if an entry is no small rational."""
    columns = len(rows[0])
    left: list[list[Fraction]] = []
    for row in rows:
        numbers = [_fraction(entry) for entry in row]
        size = max(abs(v) for v in numbers)
        if size:
            left.append([v / size for v in numbers])
    done: list[tuple[int, list[Fraction]]] = []  # pivot column and its row, cleared in all other pivot columns
    for _ in range(rank):
        used = {column for column, _ in done}
        _, i, j = max((abs(v), i, j) for i, row in enumerate(left) for j, v in enumerate(row) if j not in used)
        chosen = left.pop(i)
        pivot = [_rounded(v / chosen[j]) for v in chosen]
        done = [*((column, _cleared(row, pivot, j)) for column, row in done), (j, pivot)]
        left = [_cleared(row, pivot, j) for row in left]
    free = [j for j in range(columns) if j not in {column for column, _ in done}]
    basis = sp.zeros(columns, len(free))
    for number, j in enumerate(free):
        basis[j, number] = 1
        for column, entries in done:
            small = entries[j].limit_denominator(10**6)
            if abs(small - entries[j]) > Fraction(1, 10**25):
                return None
            basis[column, number] = -sp.Rational(small.numerator, small.denominator)
    return basis


def _cleared(row: list[Fraction], pivot: list[Fraction], j: int) -> list[Fraction]:
    return [_rounded(a - row[j] * b) for a, b in zip(row, pivot, strict=True)]


def _fraction(entry: Any) -> Fraction:
    mantissa, exponent = entry.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def _rounded(value: Fraction) -> Fraction:
    """Keep 320 bits: exact fractions would grow with every step."""
    scale = 1 << 320
    return Fraction(round(value * scale), scale)


def _dynamics(model: NonlinearModel, basis: sp.Matrix, fixed: Mapping[str, float]) -> sp.Matrix | None:
    """K of f_x V = V K if that and h_x V = 0 hold identically, inputs of no width at their value; None otherwise."""
    values = {sp.Symbol(name): sp.Rational(str(float(v))) for name, v in fixed.items()}
    f, h = (g.subs(values) for g in exact_model(model))
    states = list(model.state_symbols)
    if any(sp.simplify(entry) != 0 for entry in h.jacobian(states) * basis):
        return None
    moved = (f.jacobian(states) * basis).applyfunc(sp.simplify)
    # The reduced basis is an identity in its free rows: K can be read off there.
    free = [next(i for i in range(basis.rows) if basis.row(i) == sp.eye(basis.cols).row(j)) for j in range(basis.cols)]
    inside = moved.extract(free, list(range(basis.cols)))
    return inside if all(sp.simplify(entry) == 0 for entry in moved - basis * inside) else None
