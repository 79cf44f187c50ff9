"""An LMI problem: unknown matrices, named inequalities and an objective, over a box of parameters and rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display, counted
from synthesis.errors import ProblemError
from synthesis.lmi.basis import chebyshev_basis
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.half_spaces import Faces, HalfSpaces, faces_of
from synthesis.polynomials.matrix import MatrixPolynomial, constant, variable

MARGIN = "margin"
CURVED = 100.0
SYMMETRY = 1e-12  # relative; products of symmetric expressions differ from their transposes by rounding


@dataclass(frozen=True)
class Inequality:
    """`matrix` > 0 for every parameter and rate of its box, in local variables that run over [-1, 1].

    `offset` and `factor` (v,) lead back from local variables to those of the problem. An inequality that is not `strict`
    only normalises the unknowns: it takes no margin and no part in the verdict. `floor` has been taken off `matrix` for the
    solver; the verdict is about matrix + floor I.
    """

    name: str
    matrix: MatrixPolynomial
    offset: FloatArray
    factor: FloatArray
    strict: bool = True
    floor: float = 0.0


@dataclass(repr=False)
class LmiProblem(Display):
    """Variables and inequalities in scaled coordinates: parameters and rates run over [-1, 1].

    The variables of every polynomial are (u_1..u_p, r_1..r_p) with p_i = middle_i + half_i u_i and
    dp_i/dt = rate_middle_i + rate_half_i r_i.

    With `maximise_margin` every strict inequality becomes M > t I for a common unknown t, which is maximised: the sign
    of t decides, its size tells how far. The problem must then normalise its unknowns. Re-evaluation judges M itself.

    With `least_norm` the decisions with the least sum of squares are sought under M > floor I, those that belong to powers of a
    parameter counted CURVED times: a strictly convex problem, whose one answer moves little when the data or the processor
    change. (Maximal margins and least gammas are attained on flat sets.) Of all answers it takes one that varies little.

    With `half_spaces` every inequality is asked for where these hold, too: the parameters' set is no box. Where the data are
    another polynomial on every cell, `on_cell` says on which the inequalities that follow are required.

    >>> problem = LmiProblem((SchedulingParameter("speed", "m/s", 10.0, 40.0, -5.0, 5.0),))
    >>> P = problem.symmetric("P", 2, degree=1)
    >>> problem.require("P > 0", P)
    >>> len(problem.inequalities)
    1
    """

    parameters: tuple[SchedulingParameter, ...]
    maximise_margin: bool = False
    least_norm: bool = False
    floor: float = 0.0
    decisions: int = 0
    curved: list[bool] = field(default_factory=list)
    unknowns: dict[str, MatrixPolynomial] = field(default_factory=dict)
    inequalities: list[Inequality] = field(default_factory=list)
    objective: str | None = None
    sense: float = 1.0
    half_spaces: HalfSpaces = ()
    cell: tuple[FloatArray, FloatArray] | None = None
    suffix: str = ""  # of the names of what is required on a cell

    def __post_init__(self) -> None:
        if self.maximise_margin:
            self.scalar(MARGIN)
            self.maximise(MARGIN)

    def summary(self) -> tuple[str, ...]:
        """Unknowns and inequalities by name and size, the box, what is optimised."""
        box = [f"{p.name} {p.minimum:g} to {p.maximum:g} {p.unit}" for p in self.parameters]
        aim = "none" if self.objective is None else f"{'minimise' if self.sense > 0.0 else 'maximise'} {self.objective}"
        return (
            f"LmiProblem: {counted(self.decisions, 'decision')}, {counted(len(self.inequalities), 'inequality')}",
            f"unknowns: {', '.join(f'{n} {v.shape}' for n, v in self.unknowns.items()) or 'none'}",
            f"inequalities: {', '.join(f'{i.name} {i.matrix.shape}' for i in self.inequalities) or 'none'}",
            f"parameters: {', '.join(box) or 'none'}",
            f"objective: {'least norm' if self.least_norm else aim}",
        )

    @cached_property
    def faces(self) -> Faces | None:
        """The set of the parameters in floats; None for a box."""
        return faces_of(self.half_spaces)

    def places_on(self, lines: Sequence[FloatArray]) -> FloatArray:
        """The places (g, p) of a rectilinear grid of scaled parameters; where the set is no box, those of it and its border.

        A line of one place, of a parameter that does not matter, then is one from end to end: there may be nothing in its middle.
        """
        if self.faces is None:
            points = list(product(*lines))  # one empty point for an LMI without parameters
            return np.array(points, float).reshape(len(points), len(self.parameters))
        return self.faces.on_lines([line if len(line) > 1 else np.array([-1.0, 1.0]) for line in lines])

    @property
    def variables(self) -> int:
        """Number of polynomial variables: parameters, then rates."""
        return 2 * len(self.parameters)

    def known(self, coefficients: FloatArray) -> MatrixPolynomial:
        """A known matrix from its coefficients (d_1+1, ..., d_p+1, rows, columns) in the physical parameters."""
        count = len(self.parameters)
        array = np.asarray(coefficients, float)
        if not np.isfinite(array).all():
            raise ProblemError("a known matrix has coefficients that are not finite; look for NaN in the model")
        if array.ndim != count + 2:
            raise ProblemError(f"known matrix has {array.ndim} axes; {count} parameters need {count + 2}")
        shaped = array.reshape(*array.shape[:count], *(1,) * count, *array.shape[count:], 1)
        offsets = np.array([p.middle for p in self.parameters] + [0.0] * count)
        factors = np.array([p.half_width for p in self.parameters] + [1.0] * count)
        return MatrixPolynomial(shaped).affine(offsets, factors)

    def scaled(self, coefficients: FloatArray) -> MatrixPolynomial:
        """A known matrix from its coefficients (d_1+1, ..., d_p+1, rows, columns) in the scaled parameters u."""
        count, array = len(self.parameters), np.asarray(coefficients, float)
        return MatrixPolynomial(array.reshape(*array.shape[:count], *(1,) * count, *array.shape[count:], 1))

    def constant(self, matrix: FloatArray) -> MatrixPolynomial:
        """A matrix that depends on no parameter."""
        return constant(np.asarray(matrix, float), self.variables)

    def symmetric(self, name: str, size: int, degree: int | tuple[int, ...] = 0) -> MatrixPolynomial:
        """Unknown symmetric polynomial matrix."""
        rows, columns = np.triu_indices(size)
        entries = np.zeros((len(rows), size, size))
        entries[np.arange(len(rows)), rows, columns] = 1.0
        entries[np.arange(len(rows)), columns, rows] = 1.0
        return self._unknown(name, entries, degree)

    def matrix(self, name: str, rows: int, columns: int, degree: int | tuple[int, ...] = 0) -> MatrixPolynomial:
        """Unknown rectangular polynomial matrix."""
        return self._unknown(name, np.eye(rows * columns).reshape(-1, rows, columns), degree)

    def scalar(self, name: str) -> MatrixPolynomial:
        """Unknown number."""
        return self._unknown(name, np.ones((1, 1, 1)), 0)

    def _unknown(self, name: str, entries: FloatArray, degree: int | tuple[int, ...]) -> MatrixPolynomial:
        if name in self.unknowns:
            raise ProblemError(f"the unknown '{name}' exists already; choose another name")
        count = len(self.parameters)
        given = (degree,) if isinstance(degree, int) else degree
        if min(given, default=0) < 0 or (not isinstance(degree, int) and len(degree) != count):
            raise ProblemError(
                f"degree {degree} of '{name}' must be one number >= 0, or one for each of {count} parameters"
            )
        basis = chebyshev_basis(count, degree)
        functions, (number, rows, columns) = len(basis), entries.shape
        out = np.zeros((*basis.shape[1:], *(1,) * count, rows, columns, 1 + self.decisions + functions * number))
        terms = np.einsum("f...,eij->...ijfe", basis, entries).reshape(*basis.shape[1:], rows, columns, -1)
        out[..., 1 + self.decisions :] = terms.reshape(*basis.shape[1:], *(1,) * count, rows, columns, -1)
        self.decisions += functions * number
        total = basis.reshape(functions, -1)
        self.curved += [bool(np.flatnonzero(row)[-1]) for row in total for _ in range(number)]
        self.unknowns[name] = MatrixPolynomial(out)
        return self.unknowns[name]

    def time_derivative(self, matrix: MatrixPolynomial) -> MatrixPolynomial:
        """dM/dt = sum_i dM/dp_i dp_i/dt, affine in the rates."""
        count = len(self.parameters)
        total = matrix * 0.0
        for i, p in enumerate(self.parameters):
            slope = matrix.derivative(i)
            if not slope.coefficients.any():
                continue
            if p.may_jump:
                raise ProblemError(
                    f"'{p.name}' has unbounded rate [{p.rate_minimum}, {p.rate_maximum}] ({p.unit})/s, so no unknown may "
                    "depend on it; use degree 0 for it or bound its rate"
                )
            rate_middle = 0.5 * (p.rate_minimum + p.rate_maximum)
            rate_half = 0.5 * (p.rate_maximum - p.rate_minimum)
            rate = self.constant(np.array([[rate_middle]]))
            if rate_half > 0.0:  # a constant parameter needs no rate axis
                rate = rate + variable(count + i, self.variables) * rate_half
            total = total + slope.scaled_by(rate) * (1.0 / p.half_width)
        return total

    def require(self, name: str, matrix: MatrixPolynomial, strict: bool = True) -> None:
        """matrix > 0 (pass the negative for < 0) on the whole box, or on the cell that is asked about (`on_cell`)."""
        coefficients = matrix.coefficients
        if matrix.shape[0] != matrix.shape[1]:
            raise ProblemError(f"inequality '{name}' has the shape {matrix.shape}; it must be square and symmetric")
        if not np.isfinite(coefficients).all():
            raise ProblemError(
                f"inequality '{name}' has coefficients that are not finite; look for NaN in its matrices"
            )
        if np.abs(coefficients - np.swapaxes(coefficients, -3, -2)).max() > SYMMETRY * np.abs(coefficients).max():
            raise ProblemError(f"inequality '{name}' is not symmetric; add its transpose")
        matrix = (matrix + matrix.T) * 0.5  # takes off the rounding, so that no triangle is preferred
        if strict:
            matrix = self._with_margin(matrix)
        offset, factor = self.cell or (np.zeros(self.variables), np.ones(self.variables))
        floor = self.floor if strict else 0.0
        self.inequalities.append(Inequality(name + self.suffix, matrix, offset, factor, strict, floor))

    def on_cell(self, number: int = 0, box: tuple[FloatArray, FloatArray] | None = None) -> None:
        """What follows is required on a box of the parameters u = offset + factor t, |t| <= 1, and for all rates, in t (`here`).

        Without a box (offset and factor, (p,) each), or where it is the whole range, all is as it was.
        """
        self.cell, self.suffix = None, ""
        if box is not None and not (box[1] == 1.0).all():
            count = len(self.parameters)
            self.cell = np.concatenate([box[0], np.zeros(count)]), np.concatenate([box[1], np.ones(count)])
            self.suffix = f", cell {number + 1}"

    def here(self, matrix: MatrixPolynomial) -> MatrixPolynomial:
        """A matrix in u in the local variables of the cell that is asked about."""
        return matrix.affine(*self.cell) if self.cell else matrix

    def _with_margin(self, matrix: MatrixPolynomial) -> MatrixPolynomial:
        unit = self.constant(np.eye(matrix.shape[0]))
        if self.floor:
            matrix = matrix - unit * self.floor
        return matrix - unit.scaled_by(self.unknowns[MARGIN]) if self.maximise_margin else matrix

    def require_on(self, name: str, matrix: MatrixPolynomial, offset: FloatArray, factor: FloatArray) -> None:
        """matrix > 0 on a box of the variables, where it may be another one than elsewhere (the cell of a gain table).

        The matrix is given in the local variables t, variable = offset + factor t. Raises ProblemError for a box that is not
        inside [-1, 1] in every variable.
        """
        if not (np.abs(offset) + np.abs(factor) <= 1.0 + 1e-12).all():
            raise ProblemError(f"inequality '{name}': its box reaches beyond the range of the parameters")
        if not np.isfinite(matrix.coefficients).all():
            raise ProblemError(
                f"inequality '{name}' has coefficients that are not finite; look for NaN in its matrices"
            )
        matrix = self._with_margin((matrix + matrix.T) * 0.5)
        places = np.asarray(offset, float), np.asarray(factor, float)
        self.inequalities.append(Inequality(name, matrix, *places, floor=self.floor))

    def minimise(self, name: str) -> None:
        """Minimise the unknown number of this name."""
        self._objective_index(name)
        self.objective, self.sense = name, 1.0

    def maximise(self, name: str) -> None:
        """Maximise the unknown number of this name."""
        self.minimise(name)
        self.sense = -1.0

    def _objective_index(self, name: str) -> int:
        entry = self.unknowns.get(name)
        if entry is None or entry.shape != (1, 1):
            raise ProblemError(f"'{name}' is not an unknown number of this problem and cannot be minimised")
        return int(np.flatnonzero(entry.coefficients.reshape(-1))[0]) - 1

    @property
    def margin_index(self) -> int | None:
        """Which decision is the common margin."""
        return self._objective_index(MARGIN) if self.maximise_margin else None

    def without_margin(self, decisions: FloatArray) -> FloatArray:
        """The same decisions with the common margin taken out of the inequalities."""
        if not self.maximise_margin:
            return decisions
        out = decisions.copy()
        out[self._objective_index(MARGIN)] = 0.0
        return out

    @property
    def cost(self) -> FloatArray:
        """Cost vector of the decisions."""
        q = np.zeros(self.decisions)
        if self.objective is not None:
            q[self._objective_index(self.objective)] = self.sense
        return q

    @property
    def weights(self) -> FloatArray:
        """Weights of the squares of the decisions in the cost."""
        return np.where(self.curved, CURVED, 1.0) * float(self.least_norm)

    def place(self, entry: Inequality, local: FloatArray) -> str:
        """A point of an inequality's box in physical words."""
        point = entry.offset + entry.factor * local
        count, words = len(self.parameters), []
        for i, p in enumerate(self.parameters):
            words.append(f"{p.name} = {p.middle + p.half_width * point[i]:.4g} {p.unit}")
            if not p.may_jump and entry.matrix.degrees[count + i] > 0:
                rate = 0.5 * (p.rate_minimum + p.rate_maximum + (p.rate_maximum - p.rate_minimum) * point[count + i])
                words.append(f"rate = {rate:.4g} ({p.unit})/s")
        return ", ".join(words) or "all parameters"
