"""The symbolic LPV model: written once, used by design, analysis and simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from estimators.display import Display, counted
from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.constraint import ParameterConstraint, scaled_set, still_cutting
from synthesis.models.extract import MATRICES, ExactModel, PolynomialModel, extract
from synthesis.models.from_grid import Fit, from_systems, grid_fields, with_noise
from synthesis.models.from_jacobian import jacobian_fields
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.numeric import NumericModel, evaluate_pieces
from synthesis.models.param import Constant, SchedulingParameter, Signal
from synthesis.models.pieces import ModelPiece, Pieces, pieces_of, whole
from synthesis.models.symbols import plain
from synthesis.models.table import LookupTable, check_table, table_words
from synthesis.polynomials.half_spaces import Faces, HalfSpaces

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False, repr=False)
class LpvModel(Display):
    r"""x' = A(p) x + B(p) u + E(p) d,  y = C(p) x + D(p) u + F(p) d, with p(t) in a box and dp/dt in another.

    `constraints` are linear inequalities between the parameters that cut corners off their box; the matrices are defined on
    all of it. Rate bounds hold as far as the set allows. `tables` are quantities known at breakpoints (`LookupTable`), used by
    their names: the plant is a polynomial on each cell of their grid (`pieces`), with kinks between them.

    Matrices are sympy matrices whose symbols are the names of `parameters`, `constants` and `tables`, polynomial or rational in
    the parameters (with tables, polynomial). A disturbance whose column of E is zero is measurement noise. B, D, E and F
    default to zero.

    Raises ModelError for a stray symbol, a shape that does not fit, a parameter or constant that never appears, a
    dependence that is not rational, a denominator that vanishes inside the range, and repeated names.

    >>> import sympy as sp
    >>> k = sp.Symbol("stiffness")
    >>> model = LpvModel(
    ...     name="oscillator", source="Newton, mass 1 kg", states=(Signal("position", "m"), Signal("velocity", "m/s")),
    ...     outputs=(Signal("measured_position", "m"),),
    ...     parameters=(SchedulingParameter("stiffness", "1/s^2", 1.0, 4.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[0, 1], [-k, 0]]), C=sp.Matrix([[1, 0]]),
    ... )
    >>> model.on([1.0, 4.0]).A[:, 1, 0].tolist()
    [-1.0, -4.0]
    """

    name: str
    source: str
    states: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    parameters: tuple[SchedulingParameter, ...]
    A: sp.Matrix
    C: sp.Matrix
    inputs: tuple[Signal, ...] = ()
    disturbances: tuple[Signal, ...] = ()
    B: sp.Matrix | None = None
    D: sp.Matrix | None = None
    E: sp.Matrix | None = None
    F: sp.Matrix | None = None
    constants: Mapping[str, Constant] = field(default_factory=dict)
    constraints: tuple[ParameterConstraint, ...] = ()
    tables: Mapping[str, LookupTable] = field(default_factory=dict)

    def __post_init__(self) -> None:
        nx, ny, nu, nd = len(self.states), len(self.outputs), len(self.inputs), len(self.disturbances)
        shapes = {"A": (nx, nx), "B": (nx, nu), "C": (ny, nx), "D": (ny, nu), "E": (nx, nd), "F": (ny, nd)}
        self._check_names()
        for key, shape in shapes.items():
            given = getattr(self, key)
            try:
                matrix = plain(sp.zeros(*shape) if given is None else sp.Matrix(given))
            except (TypeError, ValueError) as error:
                raise ModelError(f"model '{self.name}': {key} is not a matrix ({error})") from None
            if matrix.shape != shape:
                raise ModelError(
                    f"model '{self.name}': {key} has the shape {matrix.shape}, but {nx} states, {nu} inputs, {ny} outputs and "
                    f"{nd} disturbances need {shape}"
                )
            object.__setattr__(self, key, matrix)
        self._check_symbols()
        self.half_spaces  # noqa: B018  a set that is empty must not exist
        for key, table in self.tables.items():
            check_table(table, self.parameters, f"model '{self.name}': table '{key}'")
        if self.tables and self.constraints:
            raise ModelError(
                f"model '{self.name}' has tables and constraints between its parameters; one of both is supported: leave the "
                "constraints out, or fit polynomials to the tables"
            )
        for piece in self.pieces:  # a model that is not rational, or divides by zero, must not exist
            piece.polynomial  # noqa: B018

    def summary(self) -> tuple[str, ...]:
        """Signals and parameters with their units; `gainsmith model` shows the rest."""

        def listed(signals: tuple[Signal, ...]) -> str:
            return ", ".join(f"{s.name} [{s.unit}]" for s in signals) or "none"

        tables = table_words(self.tables, self.parameters, len(self.pieces)) if self.tables else ()
        moving = [f"{p.name} {p.minimum:g} to {p.maximum:g} {p.unit}" for p in self.parameters]
        box = ", ".join([*moving, *(c.words for c in self.constraints)])
        return (
            f"LpvModel '{self.name}' ({self.source})",
            f"{counted(len(self.states), 'state')}: {listed(self.states)}",
            f"inputs; outputs: {listed(self.inputs)}; {listed(self.outputs)}",
            f"disturbances: {listed(self.disturbances)}",
            f"{counted(len(moving), 'parameter')}: {'; '.join([box or 'none', *tables])}",
        )

    def _check_names(self) -> None:
        if not self.states or not self.outputs:
            raise ModelError(f"model '{self.name}' needs at least one state and one output")
        names = [s.name for s in (*self.states, *self.inputs, *self.outputs, *self.disturbances)]
        names += [p.name for p in self.parameters] + list(self.constants) + list(self.tables)
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ModelError(f"model '{self.name}' uses the name(s) {', '.join(repeated)} twice; names must be unique")
        if not self.source.strip():
            raise ModelError(f"model '{self.name}' has no source; say where its equations come from")

    def _check_symbols(self) -> None:
        used = {str(symbol) for key in MATRICES for symbol in getattr(self, key).free_symbols}
        known = {p.name for p in self.parameters} | set(self.constants) | set(self.tables)
        used |= {name for key in used & set(self.tables) for name in self.tables[key].over}
        stray = sorted(used - known)
        if stray:
            raise ModelError(
                f"model '{self.name}': symbol(s) {', '.join(stray)} are neither parameter nor constant; "
                "give each a range or a value"
            )
        idle = sorted({p.name for p in self.parameters} - used)
        if idle:
            raise ModelError(f"model '{self.name}': parameter(s) {', '.join(idle)} appear in no matrix; remove them")
        for kind, names in (("constant", self.constants), ("table", self.tables)):
            idle = sorted(set(names) - used)
            if idle:
                raise ModelError(f"model '{self.name}': {kind}(s) {', '.join(idle)} appear in no matrix; remove them")

    @cached_property
    def exact(self) -> ExactModel:
        """Exact polynomials of the matrices in the scaled parameters u in [-1, 1], over a common denominator.

        Raises ModelError for a model with tables, which is another polynomial on every cell: see `pieces`.
        """
        self.refuse_tables("a design or an analysis of one polynomial for the whole range")
        matrices = {key: getattr(self, key) for key in MATRICES}
        return extract(f"model '{self.name}'", matrices, self.parameters, self.constants)

    def __getstate__(self) -> dict[str, object]:
        """Without exact numbers, which cannot be pickled and are worked out again where they are needed."""
        exact = ("exact", "half_spaces", "cells")
        return {key: value for key, value in self.__dict__.items() if key not in exact}

    def refuse_tables(self, what: str) -> None:
        """Raise ModelError where `what` does not know of tables."""
        if self.tables:
            raise ModelError(
                f"model '{self.name}' has the table(s) {', '.join(self.tables)}: {what} does not support a plant by cells; fit a "
                "polynomial to them (LpvModel.from_grid)"
            )

    @cached_property
    def cells(self) -> Pieces:
        """The pieces of the model with the borders between them."""
        if not self.tables:
            return whole(self.parameters, self.exact)
        matrices = {key: getattr(self, key) for key in MATRICES}
        return pieces_of(f"model '{self.name}'", matrices, self.parameters, self.constants, self.tables)

    @property
    def pieces(self) -> tuple[ModelPiece, ...]:
        """The model on every cell of its tables, the last parameter's running fastest; without tables on the whole range."""
        return self.cells.all

    @cached_property
    def half_spaces(self) -> HalfSpaces:
        """The constraints in the scaled parameters u, exact."""
        return scaled_set(self.parameters, self.constraints, f"model '{self.name}'")

    @cached_property
    def polynomial(self) -> PolynomialModel:
        """`exact` as float64 coefficient arrays."""
        self.refuse_tables("a design or an analysis of one polynomial for the whole range")
        return self.pieces[0].polynomial

    def on(self, grid: ArrayLike) -> NumericModel:
        """The model at g parameter values: the only border between sympy and numpy.

        `grid` has shape (g, p), or (g,) for one parameter; the matrices come out read-only as (g, rows, columns).
        Raises ModelError for values outside the range or not finite.
        """
        try:
            points = np.asarray(grid, float)
        except (TypeError, ValueError):
            raise ModelError(f"model '{self.name}': the grid {grid!r} is not an array of numbers") from None
        count = len(self.parameters)
        points = points.reshape(-1, 1) if points.ndim <= 1 and count == 1 else np.atleast_2d(points)
        if points.ndim != 2 or points.shape[-1] != count:
            raise ModelError(f"model '{self.name}': a grid of shape {points.shape} does not fit {count} parameters")
        self._check_range(points)
        return evaluate_pieces([p.polynomial for p in self.pieces], self.cells.borders, self.parameters, points)

    @property
    def centre(self) -> FloatArray:
        """A parameter value (1, p) in the middle: of the ranges, or of the corners of the set where that is no box."""
        count = len(self.parameters)
        scaled = Faces.of(self.half_spaces).corners.mean(axis=0) if self.half_spaces else np.zeros(count)
        return self.physical(scaled.reshape(1, count))

    def physical(self, u: FloatArray) -> FloatArray:
        """Parameter values (g, p) of scaled ones in the ranges; rounding takes none beyond their ends."""
        low, high, middle, half = (
            np.array([getattr(p, key) for p in self.parameters])
            for key in ("minimum", "maximum", "middle", "half_width")
        )
        return np.asarray(np.clip(middle + half * u, low, high)).reshape(len(u), len(self.parameters))

    def scaled(self, points: FloatArray) -> FloatArray:
        """u = (p - middle)/half_width (g, p) of parameter values (g,) or (g, p), also beyond the range."""
        count, grid = len(self.parameters), np.asarray(points, float)
        grid = grid.reshape(-1, count) if count else grid.reshape(len(grid), 0)
        middle, half = (np.array([getattr(p, key) for p in self.parameters]) for key in ("middle", "half_width"))
        return np.asarray((grid - middle) / half)

    def _check_range(self, points: FloatArray) -> None:
        for column, p in zip(points.T, self.parameters, strict=True):
            slack = 1e-12 * (p.maximum - p.minimum)
            bad = np.flatnonzero(~((column >= p.minimum - slack) & (column <= p.maximum + slack)))
            if len(bad):
                raise ModelError(
                    f"{p.name} = {column[bad[0]]:.6g} {p.unit} is outside [{p.minimum:g}, {p.maximum:g}] {p.unit} "
                    f"(grid point {bad[0]}); widen the model's range or stay inside it"
                )

    @classmethod
    def from_grid(
        cls,
        name: str,
        source: str,
        parameters: Sequence[SchedulingParameter],
        points: Mapping[str, ArrayLike] | ArrayLike,
        systems: object = None,
        *,
        A: ArrayLike | None = None,
        B: ArrayLike | None = None,
        C: ArrayLike | None = None,
        D: ArrayLike | None = None,
        E: ArrayLike | None = None,
        F: ArrayLike | None = None,
        states: tuple[Signal, ...] | None = None,
        inputs: tuple[Signal, ...] | None = None,
        outputs: tuple[Signal, ...] | None = None,
        disturbances: tuple[Signal, ...] = (),
        measurement_noise: bool = False,
        degree: int | Sequence[int] | None = None,
        fit: Fit = "polynomial",
        tolerance: float = 0.01,
        sizes: Mapping[str, float] | None = None,
    ) -> LpvModel:
        r"""A model fitted to tables of its matrices, or to `control.StateSpace` systems, at the points of a rectilinear grid.

        `points` maps every parameter to its grid line, with tables (g_1, .., g_p, rows, columns); or lists all points (g, p) in
        any order, with tables (g, rows, columns). A matrix without these axes is the same everywhere. Of `systems` (one for every
        point) the columns of B and D are the inputs, then the disturbances; signals default to their labels, with the unit 1.
        `measurement_noise` adds one disturbance to every output.

        Entries become Chebyshev polynomials (least squares), stored as exact rationals: of `degree`, or of the lowest degree that
        leaves no entry off by more than `tolerance` of its largest value (at most half as many as points, so that points are left
        to tell). `fit` says what the plant is between the points: "polynomial", the fit itself; "piecewise-linear", straight
        lines, so that the residual is bounded over the whole range. With the fit "table" there is none: the plant is multilinear
        between the points, exactly, another polynomial on every cell (`LookupTable`); a point that stands twice is a jump.

        The residual enters the model as a stated uncertainty (`synthesis.models.fitted`): for each row that is off, a disturbance
        `NAME_fit_error` between -1 and 1 with a constant `NAME_fit_error_size`; name these disturbances in the channels of a
        design. `sizes` are the largest magnitudes of the states, inputs and disturbances that the residual multiplies.

        Raises ModelError for points that are no grid, tables that do not fit, a range beyond the grid, a fit beyond the
        tolerance, and an error left without sizes.
        """
        given = {"states": states, "inputs": inputs, "outputs": outputs, "disturbances": disturbances}
        tables: dict[str, Any] = {"A": A, "B": B, "C": C, "D": D, "E": E, "F": F}
        if systems is not None:
            if any(value is not None for value in tables.values()):
                raise ModelError(f"model '{name}': give systems or matrices, not both")
            tables, signals = from_systems(systems, f"model '{name}'", given)
            if isinstance(points, Mapping):  # systems come in a row
                counts = [len(np.atleast_1d(np.asarray(points[p.name]))) for p in parameters if p.name in points]
                if len(tables["A"]) != np.prod(counts):
                    raise ModelError(
                        f"model '{name}': {len(tables['A'])} systems for a grid of {int(np.prod(counts))} points"
                    )
                tables = {key: table.reshape(*counts, *table.shape[1:]) for key, table in tables.items()}
        else:
            if A is None or C is None or states is None or outputs is None:
                raise ModelError(f"model '{name}': give A and C with states and outputs, or systems")
            signals = {key: value or () for key, value in given.items()}
        if measurement_noise:
            tables, signals = with_noise(tables, signals)
        return cls(**grid_fields(name, source, parameters, points, tables, signals, degree, fit, tolerance, sizes))

    @classmethod
    def from_jacobian(
        cls,
        model: NonlinearModel,
        parameters: Sequence[SchedulingParameter],
        trim: Mapping[str, Any],
        *,
        disturbances: Sequence[str] = (),
        drifting: Sequence[str] = (),
        measurement_noise: bool = False,
        degree: int | None = None,
        tolerance: float = 1e-3,
        sizes: Mapping[str, float] | None = None,
    ) -> LpvModel:
        r"""The Jacobian of a nonlinear model along a family of trims, in deviations from them.

        `trim` gives every state and input as a number or as a sympy expression in the scheduling parameters and constants; the
        derivatives of all states must vanish on it, except those named in `drifting`. Inputs named in `disturbances` become such;
        `measurement_noise` adds one to every output. What the moving trim itself adds, d(trim)/dp p', is not part of the model.

        Entries that are rational in the parameters stay symbolic. Others become polynomials in Chebyshev form, of `degree` or of
        the lowest one that is off by at most `tolerance` of the entry's size; the residual is bounded over the whole range in
        ball arithmetic and enters as in `from_grid`, with `sizes` for the deviations that it multiplies.

        Raises ModelError for unknown names, a trim that is no equilibrium (state, place), and a fit beyond the tolerance.
        """
        return cls(
            **jacobian_fields(
                model, parameters, trim, disturbances, drifting, measurement_noise, degree, tolerance, sizes
            )
        )

    def to_control(self, point: ArrayLike = (), disturbances: bool = False) -> Any:
        """The plant at one parameter value (p,) as `control.StateSpace` in continuous time, signals by their names.

        Inputs are `inputs`, and behind them, if asked for, `disturbances` (E and F). Raises ModelError for a value outside the
        range, and for a plant that has no column to show.
        """
        import control  # half a second: paid by those who use it

        at = self.on(np.asarray(point, float).reshape(1, -1))
        signals = (*self.inputs, *(self.disturbances if disturbances else ()))
        if not signals:
            raise ModelError(
                f"model '{self.name}' has no inputs, which control.StateSpace needs; pass disturbances=True"
            )
        B, D = (
            np.concatenate([first[0], second[0]], -1) if disturbances else first[0]
            for first, second in ((at.B, at.E), (at.D, at.F))
        )
        names = ([s.name for s in group] for group in (self.states, signals, self.outputs))
        states, inputs, outputs = names
        return control.StateSpace(
            at.A[0],
            B,
            at.C[0],
            D,
            0,
            states=states,
            inputs=inputs,
            outputs=outputs,
            name=self.name,
            remove_useless_states=False,
        )

    def with_range(self, name: str, minimum: float, maximum: float) -> LpvModel:
        """The same model with another range of one parameter; constraints that then cut nothing off are dropped."""
        if name not in {p.name for p in self.parameters}:
            raise ModelError(unknown("parameter", name, (p.name for p in self.parameters)))
        changed = tuple(replace(p, minimum=minimum, maximum=maximum) if p.name == name else p for p in self.parameters)
        return replace(self, parameters=changed, constraints=still_cutting(changed, self.constraints))
