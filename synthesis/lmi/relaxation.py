"""From inequalities on a box to finitely many: sampled points, vertices, Bernstein coefficients, or sums of squares."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.lmi.problem import Inequality, LmiProblem
from synthesis.lmi.settings import LmiSettings
from synthesis.polynomials.bernstein import to_bernstein
from synthesis.polynomials.matrix import MatrixPolynomial, padded

MOST_WORK = 100_000  # of `cheaper`: beyond it a few places that are exchanged cost less (six states, degree 1)


@dataclass(frozen=True)
class SampledInequality:
    """M_g(x) >= margin * I at g places: `values` (g, k, k, 1+N), `places` (g, v) in scaled variables."""

    name: str
    values: FloatArray
    places: FloatArray
    margin: float


@dataclass(frozen=True)
class SosInequality:
    """M(u, x) - margin * I = sum_t w_t(u) (b_t(u) (x) I)' X_t (b_t(u) (x) I) with X_t >= 0, matched at d+1 nodes.

    `values` (d+1, k, k, 1+N) holds M at the Chebyshev nodes, `weights` w_t and `bases` b_t at the same nodes.
    For one variable on [-1, 1] this is exact: w = (1, 1-u^2) for even degree, (1+u, 1-u) for odd (Hol, Scherer).
    """

    name: str
    values: FloatArray
    weights: tuple[FloatArray, ...]
    bases: tuple[FloatArray, ...]
    margin: float


@dataclass(frozen=True)
class RelaxedProblem:
    """What the solvers see."""

    relaxation: str
    sampled: tuple[SampledInequality, ...]
    sos: tuple[SosInequality, ...]
    cost: FloatArray
    weights: FloatArray  # of the squares of the decisions; all zero: the cost is linear


def relax(problem: LmiProblem, settings: LmiSettings) -> RelaxedProblem:
    """Apply the relaxation that the settings name ('auto' picks the cheaper sound one for one parameter)."""
    kind = relaxation_of(problem, settings)
    if kind == "exact":
        if len(problem.parameters) != 1:
            raise ProblemError(
                f"the exact relaxation is for one parameter, this problem has {len(problem.parameters)}; use grid or vertex"
            )
        sos = tuple(
            part for entry in problem.inequalities for part in _sums_of_squares(problem, entry, settings.margin)
        )
        return RelaxedProblem(kind, (), sos, problem.cost, problem.weights)
    if kind == "bernstein":
        sampled = tuple(_coefficients(problem, entry, settings) for entry in problem.inequalities)
    elif kind == "vertex":
        sampled = tuple(part for entry in problem.inequalities for part in _vertices(problem, entry, settings.margin))
    else:
        sampled = tuple(
            _sample(problem, entry, _axes(problem, entry, settings.points), settings.margin)
            for entry in problem.inequalities
        )
    return RelaxedProblem(kind, sampled, (), problem.cost, problem.weights)


def relaxation_of(problem: LmiProblem, settings: LmiSettings) -> str:
    """The relaxation that the settings name, or the one that 'auto' takes."""
    return cheaper(problem, settings) if settings.relaxation == "auto" else settings.relaxation


def cheaper(problem: LmiProblem, settings: LmiSettings) -> str:
    """Grid or exact, by the sum of squared cone dimensions, which tracks the measured solve time of both; else exchange."""
    if len(problem.parameters) != 1:
        return "exchange" if problem.parameters else "grid"
    grid = exact = 0
    for entry in problem.inequalities:
        k, degree = entry.matrix.shape[0], entry.matrix.degrees[0]
        rates = 2 if entry.matrix.degrees[1] else 1
        grid += rates * len(_axes(problem, entry, settings.points)[0]) * (k * (k + 1) // 2) ** 2
        exact += rates * sum((k * (h + 1) * (k * (h + 1) + 1) // 2) ** 2 for h in _orders(degree))
    if min(exact, grid) > MOST_WORK:
        return "exchange"
    return "exact" if exact <= grid else "grid"


def widened(values: FloatArray, decisions: int) -> FloatArray:
    """Pad to all decisions of the problem."""
    return padded(values, (*values.shape[:-1], decisions + 1))


def rate_vertices(matrix: MatrixPolynomial, parameters: int) -> list[tuple[float, ...]]:
    """Vertices of the rates that the matrix depends on; it is affine in them, so the vertices suffice."""
    for i, degree in enumerate(matrix.degrees[parameters:]):
        if degree > 1:
            raise ProblemError(
                f"an inequality has degree {degree} in rate {i}; inequalities must be affine in the rates"
            )
    return list(product(*((-1.0, 1.0) if degree else (0.0,) for degree in matrix.degrees[parameters:])))


def rate_samples(matrix: MatrixPolynomial, parameters: int) -> list[tuple[float, ...]]:
    """Vertices of the rates, and points between them for those in which the matrix is not affine (P one sample later)."""
    degrees = matrix.degrees[parameters:]
    if max(degrees, default=0) <= 1:
        return rate_vertices(matrix, parameters)
    axes = [np.linspace(-1.0, 1.0, 2 if d == 1 else 2 * d + 1) if d else np.zeros(1) for d in degrees]
    return [tuple(float(x) for x in point) for point in product(*axes)]


def _axes(problem: LmiProblem, entry: Inequality, points: int) -> list[FloatArray]:
    """Sample points along each parameter; a smaller box gets its share of them, three at least."""
    share = [max(3, round(points * factor)) if factor < 1.0 else points for factor in entry.factor]
    return [np.linspace(-1.0, 1.0, n) for n in share[: len(problem.parameters)]]


def _sample(problem: LmiProblem, entry: Inequality, axes: list[FloatArray], margin: float) -> SampledInequality:
    """Points of the parameters it depends on, times the vertices of the rates it depends on."""
    count = len(problem.parameters)
    used = [axis if degree else np.zeros(1) for axis, degree in zip(axes, entry.matrix.degrees[:count], strict=True)]
    grid = problem.places_on(used)
    rates = np.array(rate_samples(entry.matrix, count))
    places = np.hstack([np.tile(grid, (len(rates), 1)), np.repeat(rates, len(grid), axis=0)])
    values = widened(entry.matrix.at(places), problem.decisions)
    return SampledInequality(entry.name, values, places, margin if entry.strict else 0.0)


def _coefficients(problem: LmiProblem, entry: Inequality, settings: LmiSettings) -> SampledInequality:
    """The coefficients of M in the tensor Bernstein basis of every cell: all of them positive definite proves M > 0 there.

    Sufficient by construction, and the less conservative the more cells. `places` are where the basis functions peak.
    """
    count, matrix = len(problem.parameters), entry.matrix
    edges = [np.linspace(-1.0, 1.0, settings.cells + 1) if d else np.array([-1.0, 1.0]) for d in matrix.degrees[:count]]
    values, places = [], []
    for low in product(*(range(len(line) - 1) for line in edges)):
        ends = [(line[k], line[k + 1]) for line, k in zip(edges, low, strict=True)] + [(-1.0, 1.0)] * count
        offset, factor = (np.array([(b + sign * a) / 2 for a, b in ends]) for sign in (1.0, -1.0))
        if problem.faces is not None and problem.faces.misses(offset[None], factor[None])[0]:
            continue
        local = matrix.affine(offset, factor).coefficients
        for axis, degree in enumerate(matrix.degrees):
            local = np.moveaxis(np.tensordot(to_bernstein(degree), local, axes=(1, axis)), 0, axis)
        values.append(local.reshape(-1, *local.shape[2 * count :]))
        peaks = [np.linspace(-1.0, 1.0, degree + 1) if degree else np.zeros(1) for degree in matrix.degrees]
        places.append(offset + factor * np.array(list(product(*peaks))).reshape(-1, 2 * count))
    margin = settings.margin if entry.strict else 0.0
    return SampledInequality(entry.name, widened(np.concatenate(values), problem.decisions), np.vstack(places), margin)


def _vertices(problem: LmiProblem, entry: Inequality, margin: float) -> list[SampledInequality]:
    """Vertices of the box, and multi-convexity (P1, after (27)): -d2M/dp_i2 >= 0 wherever M is quadratic in p_i.

    M > 0 is concave along every axis then, so its minimum over the box sits at a vertex (Gahinet, Apkarian, Chilali).
    """
    count = len(problem.parameters)
    if problem.half_spaces:
        raise ProblemError(
            "the vertex relaxation is for boxes, this problem has constraints between parameters; use grid or exchange"
        )
    corners = [np.array([-1.0, 1.0])] * count
    out = [_sample(problem, entry, corners, margin)]
    rate_vertices(entry.matrix, count)  # refuses what its vertices do not decide
    for i in range(count):
        if entry.matrix.degrees[i] > 2:
            raise ProblemError(
                f"'{entry.name}' has degree {entry.matrix.degrees[i]} in {problem.parameters[i].name}; the vertex relaxation "
                "takes at most 2; use a lower degree of P, or grid or exact"
            )
        if entry.matrix.degrees[i] == 2:
            second = replace(entry, name=f"{entry.name}: multi-convexity in {problem.parameters[i].name}", strict=False)
            second = replace(second, matrix=-entry.matrix.derivative(i).derivative(i))
            out.append(_sample(problem, second, corners, 0.0))
    return out


def _orders(degree: int) -> tuple[int, ...]:
    """Basis degrees of the two sums of squares."""
    half = degree // 2
    if degree % 2:
        return half, half
    return (half, half - 1) if half else (half,)


def _sums_of_squares(problem: LmiProblem, entry: Inequality, margin: float) -> list[SosInequality]:
    degree = entry.matrix.degrees[0]
    nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    if degree % 2:
        weights: tuple[FloatArray, ...] = (1.0 + nodes, 1.0 - nodes)
    else:
        weights = (np.ones_like(nodes), 1.0 - nodes**2)
    orders = _orders(degree)
    bases = tuple(np.asarray(np.polynomial.chebyshev.chebvander(nodes, order), np.float64) for order in orders)
    out = []
    for (rate,) in rate_vertices(entry.matrix, 1):
        values = entry.matrix.at(np.stack([nodes, np.full(degree + 1, rate)], axis=1))
        values = widened(values, problem.decisions)
        out.append(SosInequality(entry.name, values, weights[: len(orders)], bases, margin if entry.strict else 0.0))
    return out
