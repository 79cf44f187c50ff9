"""The time-varying observability matrix, symbolic: what the outputs and their derivatives say of the state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import combinations

import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.exact_expression import exact
from estimators.display import Display
from estimators.errors import unknown
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter

MOST_MINORS = 5000


def rate_symbol(name: str, order: int = 1) -> sp.Symbol:
    """The symbol of a time derivative: wheel_speed_rate, wheel_speed_rate2, ..."""
    return sp.Symbol(f"{name}_rate{'' if order == 1 else order}")


@dataclass(frozen=True, eq=False, repr=False)
class ObservabilityMatrix(Display):
    r"""O_n = [xi_1; ...; xi_n], xi_1 = C, xi_{i+1} = xi_i A + d(xi_i)/dt (P1 (12); P2 (24); P3 (9)), (n ny, nx).

    `frozen` says that the parameters were held, so that d/dt was dropped: such a rank is not observability. `values` are
    exact rationals of the constants; `parameters` carries the ranges for the search of rank loss.
    """

    matrix: sp.ImmutableMatrix
    state_names: tuple[str, ...]
    frozen: bool
    values: Mapping[sp.Symbol, sp.Rational] = field(default_factory=dict)
    parameters: tuple[SchedulingParameter, ...] = ()
    name: str = "matrices"

    @cached_property
    def numeric(self) -> sp.ImmutableMatrix:
        """The matrix with the constants inserted as exact rationals; parameters and rates stay symbols."""
        return sp.ImmutableMatrix(self.matrix.subs(dict(self.values)))

    @property
    def free_symbols(self) -> tuple[sp.Symbol, ...]:
        """Parameters and time derivatives that appear, by name."""
        return tuple(sorted(self.numeric.free_symbols, key=str))

    def minors(self, values: Mapping[str, object] | None = None, symbolic: bool = False) -> tuple[sp.Expr, ...]:
        """All maximal minors that are not identically zero, factored; one determinant for a square matrix.

        `values` fixes parameters or rates beforehand; `symbolic` keeps the constants as symbols. All zero: the rank is
        lost for every value. Raises AnalysisError above 5000 minors.
        """
        matrix = (self.matrix if symbolic else self.numeric).subs(self._known(values or {}))
        rows, columns = matrix.shape
        if rows < columns:
            return ()
        if sp.binomial(rows, columns) > MOST_MINORS:
            raise AnalysisError(
                f"{self.name}: {sp.binomial(rows, columns)} maximal minors of a {rows} x {columns} matrix; "
                f"ask for fewer derivatives (at most {MOST_MINORS} minors)"
            )
        found = []
        for chosen in combinations(range(rows), columns):
            minor = sp.factor(
                sp.trigsimp(sp.expand(matrix.extract(list(chosen), list(range(columns))).det("berkowitz")))
            )
            if minor != 0:
                found.append(minor)
        return tuple(found)

    def rank_at(self, values: Mapping[str, object]) -> int:
        """Exact rank with every parameter and rate given (integers, rationals, decimal strings or sympy numbers)."""
        matrix = self.numeric.subs(self._known(values))
        left = sorted(map(str, matrix.free_symbols))
        if left:
            raise AnalysisError(f"{self.name}: no value for {', '.join(left)}; give all parameters and rates")
        return int(matrix.rank(simplify=True))

    def hidden_at(self, values: Mapping[str, object]) -> tuple[sp.Matrix, ...]:
        """Basis of the directions that the rows do not see at a point (exact null space)."""
        self.rank_at(values)  # all symbols given?
        return tuple(self.numeric.subs(self._known(values)).nullspace(simplify=True))

    def describe(self) -> str:
        """One sentence for a report; a frozen matrix says that it is no statement on observability."""
        rows, columns = self.matrix.shape
        if self.frozen:
            return f"{self.name}: frozen parameters, {rows} x {columns}; a frozen rank is not observability"
        return f"{self.name}: time-varying observability matrix, {rows} x {columns}"

    def _known(self, values: Mapping[str, object]) -> dict[sp.Symbol, sp.Expr]:
        """Names to exact numbers: a float means its shortest decimal."""
        names = {str(s) for s in self.matrix.free_symbols} | {p.name for p in self.parameters}
        for name in values:
            if name not in names and name.split("_rate")[0] not in names:
                raise AnalysisError(f"{self.name}: {unknown('parameter or rate', name, names)}")
        return {sp.Symbol(name): exact_number(name, value) for name, value in values.items()}


def exact_number(name: str, value: object) -> sp.Expr:
    """An exact sympy number; floats are read as their shortest decimal. Raises AnalysisError otherwise."""
    if isinstance(value, sp.Expr):
        if value.is_number and value.is_finite:
            return value
        raise AnalysisError(f"{name} = {value} is not a finite number; give one")
    try:
        # Fraction reads decimals and quotients only: nothing that is text is evaluated as code.
        number = Fraction(str(value))
    except (ValueError, ZeroDivisionError):
        raise AnalysisError(f"{name} = {value!r} is not a finite number; give one") from None
    return sp.Rational(number.numerator, number.denominator)


def observability_matrix(
    model: LpvModel, blocks: int | None = None, motion: Mapping[str, str] | None = None
) -> ObservabilityMatrix:
    """The time-varying matrix of a model with n = `blocks` rows of blocks (default: the number of states).

    The time derivative of a parameter p is the symbol `p_rate` (then `p_rate2`, ...), or the parameter that `motion`
    names for it: {"wheel_speed": "wheel_acceleration"}. Raises AnalysisError for unknown names and blocks < 1.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> observability_matrix(model).matrix.shape
    (2, 2)
    """
    model.refuse_tables("a matrix of formulas in the parameters")
    names = [p.name for p in model.parameters]
    for key, value in (motion or {}).items():
        for name in (key, value):
            if name not in names:
                raise AnalysisError(f"model '{model.name}': {unknown('parameter', name, names)}")
    rows = blocks or len(model.states)
    out = observability_of(model.A, model.C, _steps(names, rows, motion or {}), rows, [s.name for s in model.states])
    return _of_model(model, out, frozen=False)


def controllability_matrix(model: LpvModel, blocks: int | None = None) -> ObservabilityMatrix:
    r"""The time-varying controllability matrix [psi_1, psi_2, ..]', psi_1 = B, psi_{i+1} = A psi_i - d(psi_i)/dt, by its dual.

    It is the observability matrix of x' = -A' x, y = B' x (Silverman & Meadows 1967), so its rows are those of the transpose up
    to sign, and where it loses rank some direction of the state cannot be reached. Raises AnalysisError without inputs.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> controllability_matrix(model).matrix.shape
    (2, 2)
    """
    model.refuse_tables("a matrix of formulas in the parameters")
    if not model.inputs:
        raise AnalysisError(f"model '{model.name}' has no inputs: nothing of it can be controlled")
    rows = blocks or len(model.states)
    steps = _steps([p.name for p in model.parameters], rows, {})
    out = observability_of(-model.A.T, model.B.T, steps, rows, [s.name for s in model.states])  # type: ignore[union-attr]
    return _of_model(model, out, frozen=False)


def _steps(names: list[str], rows: int, motion: Mapping[str, str]) -> dict[sp.Symbol, sp.Expr]:
    """What the time derivative of every symbol is."""
    steps: dict[sp.Symbol, sp.Expr] = {}
    for name in names:
        previous = sp.Symbol(name)
        if name in motion:
            steps[previous] = sp.Symbol(motion[name])
            continue
        for order in range(1, rows + 1):
            steps[previous] = rate_symbol(name, order)
            previous = rate_symbol(name, order)
    return steps


def frozen_observability_matrix(model: LpvModel, blocks: int | None = None) -> ObservabilityMatrix:
    """[C; C A; ...] with the parameters held: a frozen rank, NOT observability while the parameters move.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> frozen_observability_matrix(model).frozen
    True
    """
    model.refuse_tables("a matrix of formulas in the parameters")
    out = observability_of(model.A, model.C, {}, blocks or len(model.states), [s.name for s in model.states])
    return _of_model(model, out, frozen=True)


def observability_of(
    A: sp.Matrix,
    C: sp.Matrix,
    motion: Mapping[sp.Symbol, sp.Expr],
    blocks: int,
    state_names: list[str] | None = None,
) -> ObservabilityMatrix:
    r"""The matrix of any symbolic pair A (nx, nx), C (ny, nx); `motion` maps a symbol to its time derivative.

    With an empty `motion` the result is marked frozen. Raises AnalysisError for shapes that do not fit and blocks < 1.

    >>> import sympy as sp
    >>> c = sp.Symbol("c")
    >>> observability_of(sp.Matrix([[0, 1], [0, 0]]), sp.Matrix([[c, 0]]), {}, blocks=2).matrix
    Matrix([
    [c, 0],
    [0, c]])
    """
    A, C = exact("A", A), exact("C", C)
    motion = (
        dict(zip(*(exact("motion", list(side)) for side in (motion.keys(), motion.values())), strict=True))
        if motion
        else {}
    )
    if A.rows != A.cols or C.cols != A.rows or not A.rows or not C.rows:
        raise AnalysisError(f"A has the shape {A.shape} and C {C.shape}; A must be (nx, nx) and C (ny, nx)")
    if blocks < 1:
        raise AnalysisError(f"blocks = {blocks} must be at least 1; the number of states is the usual choice")
    names = tuple(state_names or [f"x{i + 1}" for i in range(A.rows)])
    row, rows = C, [C]
    for _ in range(blocks - 1):
        moved = sum((row.diff(symbol) * rate for symbol, rate in motion.items()), sp.zeros(*row.shape))
        row = (row * A + moved).applyfunc(sp.expand)
        rows.append(row)
    return ObservabilityMatrix(sp.ImmutableMatrix(sp.Matrix.vstack(*rows)), names, frozen=not motion)


def _of_model(model: LpvModel, out: ObservabilityMatrix, frozen: bool) -> ObservabilityMatrix:
    values = {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in model.constants.items()}
    return ObservabilityMatrix(out.matrix, out.state_names, frozen, values, model.parameters, f"model '{model.name}'")
