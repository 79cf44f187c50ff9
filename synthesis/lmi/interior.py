r"""A primal-dual interior-point method for few matrix inequalities with many unknowns.

    minimise  c'x + x'diag(d)x / 2   subject to   S_j = F_j0 + sum_i x_i F_ji >= 0
    dual      Y_j >= 0,  <F_ji, Y_j> summed over j = c_i + d_i x_i

with the scaling of Nesterov and Todd and Mehrotra's predictor (as in Vandenberghe, The CVXOPT linear and quadratic cone
program solvers, 2010): R_j with R^-1 S R^-T = R'Y R = diag(lambda), and all directions from one matrix, the Gram matrix of
the R^-1 F_ji R^-T. That is one product of dense matrices for each step, where a solver for sparse cones factors the triangles
of all blocks: five to ten times as long with sixteen states. What it says of itself is no more believed than any other
solver's word.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from estimators.arrays import FloatArray
from synthesis.lmi.blocks import Blocks
from synthesis.lmi.clarabel_backend import RawAnswer

REGULAR = (1e-14, 1e-12, 1e-10, 1e-8)  # shares of the diagonal that keep the system definite where a direction is free
STEP = 0.98  # of the way to the boundary
LOST = 1e-3  # steps shorter than this lead nowhere
INSIDE = 10.0  # eigenvalues of S to start with from a given centre are at least so many times its mean complementarity
LIFTED = 1e-2  # relative accuracy with which the least lift of an infeasible problem is sought


@dataclass
class Iterate:
    """A point (x, S, Y), S and Y positive definite."""

    x: FloatArray
    S: list[FloatArray]
    Y: list[FloatArray]

    @property
    def gap(self) -> float:
        """<S, Y>."""
        return float(sum(np.vdot(s, y) for s, y in zip(self.S, self.Y, strict=True)))


@dataclass(frozen=True)
class Found:
    """What a run ended with."""

    point: Iterate
    status: str
    iterations: int
    centre: tuple[FloatArray, float] | None = None


def solve_with_interior(
    given: Sequence[FloatArray],
    cost: FloatArray,
    weights: FloatArray,
    tolerance: float,
    limit: int = 100,
    margins: Sequence[float] = (),
    beyond: float = np.inf,
    centre: tuple[FloatArray, float] | None = None,
) -> RawAnswer:
    """Solve; `given` holds arrays (g, k, k, 1+N) with their margins taken off. Bounds and evidence are those without margins.

    A cost that is certainly above `beyond` is as good as another; `centre` is that of an answer with fewer inequalities.
    """
    began = perf_counter()
    blocks = Blocks(given, margins)
    found = _run(blocks, cost, weights, tolerance, limit, beyond, centre)
    excluded, iterations = 0.0, found.iterations
    if found.status != "Solved" and centre is not None:
        found = _run(blocks, cost, weights, tolerance, limit, beyond)
        iterations += found.iterations
    if found.status == "Stalled" and not _strict(blocks, found.point.x):
        excluded, more = _lift(given, margins, limit)
        iterations += more
    bound = -np.inf
    if not weights.any() and not excluded:
        rest = cost - blocks.adjoint(found.point.Y)
        bound = -blocks.without_margins(found.point.Y) - float(
            10.0 * np.abs(rest) @ np.maximum(np.abs(found.point.x), 1e-3)
        )
    status = "PrimalInfeasible" if excluded else found.status
    seconds = perf_counter() - began
    return RawAnswer(
        "interior", found.point.x, status, excluded > 0.0, excluded, iterations, seconds, bound, found.centre
    )


def _strict(blocks: Blocks, x: FloatArray) -> bool:
    return all(
        bool((np.linalg.eigvalsh(fixed + part) > 0.0).all())
        for fixed, part in zip(blocks.fixed, blocks.linear(x), strict=True)
    )


def _lift(given: Sequence[FloatArray], margins: Sequence[float], limit: int) -> tuple[float, int]:
    """The 1-norm below which no decisions satisfy the inequalities, and the steps that it took to find out.

    The least s with F(x) + s I >= 0 is sought. Its multipliers have <F_i, Y> near zero, so that a feasible x would give
    0 <= <F(x), Y> = <F_0, Y> + r'x, and |x|_1 >= -<F_0, Y> / |r|_inf: all rounding is in r (Farkas, re-evaluated).
    """
    count = given[0].shape[-1] - 1
    lifted = [
        np.concatenate([b, np.broadcast_to(np.eye(b.shape[1])[..., None], (*b.shape[:3], 1))], axis=-1) for b in given
    ]
    least = max(1.0, *(float(np.abs(block[..., 0]).max()) for block in given))
    floor = np.zeros((1, 1, 1, count + 2))
    floor[..., 0], floor[..., -1] = least, 1.0  # s > -least: else the problem may have no end
    cost = np.zeros(count + 1)
    cost[-1] = 1.0
    found = _run(Blocks([*lifted, floor]), cost, np.zeros(count + 1), LIFTED, limit)
    taken = [*(margins or (0.0,) * len(given)), 0.0]
    blocks = Blocks([*given, np.zeros((1, 1, 1, count + 1))], taken)  # the floor of s takes no part
    Y = found.point.Y
    gap, rest = -blocks.without_margins(Y), float(np.abs(blocks.adjoint(Y)).max())
    return (gap / max(rest, np.finfo(float).tiny) if gap > 0.0 else 0.0), found.iterations


def _run(
    blocks: Blocks,
    cost: FloatArray,
    weights: FloatArray,
    tolerance: float,
    limit: int,
    beyond: float = np.inf,
    centre: tuple[FloatArray, float] | None = None,
) -> Found:
    if weights.any():
        centre = None  # of a strictly convex cost it is no better start than any
    point = _start(blocks, cost, weights) if centre is None else _centred(blocks, *centre)
    if point is None:
        n = len(cost)
        return Found(Iterate(np.zeros(n), blocks.fixed, blocks.fixed), "Stalled", 0)
    size = max(1.0, float(np.sqrt(sum(np.vdot(fixed, fixed) for fixed in blocks.fixed))))
    best, best_gap = point, np.inf
    near: Found | None = None
    for iteration in range(limit):
        slope = weights * point.x + cost
        dual_rest = slope - blocks.adjoint(point.Y)
        primal_rest = [
            s - fixed - part for s, fixed, part in zip(point.S, blocks.fixed, blocks.linear(point.x), strict=True)
        ]
        gap, value = point.gap, float(cost @ point.x) + 0.5 * float(weights @ point.x**2)
        if centre is None or gap > abs(value):
            centre = point.x, gap / blocks.order
        primal = max(float(np.abs(part).max()) for part in primal_rest) / size
        dual = float(np.abs(dual_rest).max(initial=0.0)) / max(1.0, float(np.abs(slope).max(initial=0.0)))
        if primal < 1e-8 and dual < 1e-6 and gap < best_gap:
            best, best_gap = point, gap
            if gap <= tolerance * max(abs(value), 1e-7):
                return Found(point, "Solved", iteration, centre)
        # Where multipliers are large, rounding leaves more of the dual equations; what that can cost is what counts.
        lost = gap + float(np.abs(dual_rest) @ np.maximum(np.abs(point.x), 1e-3))
        if primal < 1e-8 and lost <= tolerance * max(abs(value), 1e-7):
            near = Found(point, "Solved", iteration, centre)
        if primal < 1e-8 and value - lost > beyond:
            return Found(point, "Solved", iteration, centre)
        moved = _step(blocks, point, weights, dual_rest, primal_rest)
        if moved is None:
            break
        point = moved
    if near is not None and not best_gap <= tolerance * max(abs(float(cost @ best.x)), 1e-7):
        return near
    almost = np.isfinite(best_gap) and best_gap <= 1e-3 * max(abs(float(cost @ best.x)), 1e-7)
    return Found(best if np.isfinite(best_gap) else point, "AlmostSolved" if almost else "Stalled", limit, centre)


def _start(blocks: Blocks, cost: FloatArray, weights: FloatArray) -> Iterate | None:
    """Least squares for S and Y, both then lifted inside."""
    turned = blocks.turned([np.broadcast_to(np.eye(f.shape[1]), f.shape) for f in blocks.fixed])
    normal = _Normal(blocks.gram(turned) + np.diag(weights))
    if normal.factor is None:
        return None
    x = normal.solve(-blocks.against(turned, blocks.fixed) - cost)
    S = [fixed + part for fixed, part in zip(blocks.fixed, blocks.linear(x), strict=True)]
    Y = blocks.linear(normal.solve(cost + weights * x))
    return Iterate(x, _lifted(S), _lifted(Y))


def _centred(blocks: Blocks, x: FloatArray, mean: float) -> Iterate:
    """S and Y with S Y = `mean` I, S as the inequalities are at x where that is inside."""
    S, Y = [], []
    for fixed, part in zip(blocks.fixed, blocks.linear(x), strict=True):
        values, vectors = np.linalg.eigh(fixed + part)
        values = np.maximum(values, INSIDE * mean)[:, None]
        S.append((vectors * values) @ np.swapaxes(vectors, -1, -2))
        Y.append((vectors * (mean / values)) @ np.swapaxes(vectors, -1, -2))
    return Iterate(x, S, Y)


def _lifted(matrices: list[FloatArray]) -> list[FloatArray]:
    least = min(float(np.linalg.eigvalsh(part).min()) for part in matrices)
    size = max(float(np.abs(part).max()) for part in matrices)
    lift = 0.0 if least > 1e-3 * size else 1.0 * max(1.0, size) - least
    return [part + lift * np.eye(part.shape[-1]) for part in matrices]


class _Normal:
    """A positive semidefinite matrix factored in its diagonal scaling; solutions are refined once."""

    def __init__(self, matrix: FloatArray) -> None:
        diagonal = np.diag(matrix)
        self.scale = 1.0 / np.sqrt(np.maximum(diagonal, np.finfo(float).eps * max(float(diagonal.max()), 1e-300)))
        self.scaled = matrix * np.outer(self.scale, self.scale)
        self.factor: Any = None
        for share in REGULAR:
            try:
                self.factor = cho_factor(self.scaled + share * np.eye(len(matrix)), lower=True, check_finite=False)
            except LinAlgError:
                continue
            break

    def solve(self, right: FloatArray) -> FloatArray:
        wanted = self.scale * right
        found = cho_solve(self.factor, wanted, check_finite=False)
        found = found + cho_solve(self.factor, wanted - self.scaled @ found, check_finite=False)
        return np.asarray(self.scale * found)


def _step(
    blocks: Blocks, point: Iterate, weights: FloatArray, dual_rest: FloatArray, primal_rest: list[FloatArray]
) -> Iterate | None:
    """Predictor, corrector, and as far as both cones allow; None where rounding allows no step any more."""
    try:
        left, values = zip(*(_scaling(s, y) for s, y in zip(point.S, point.Y, strict=True)), strict=True)
    except np.linalg.LinAlgError:
        return None
    turned = blocks.turned(left)
    system = blocks.gram(turned)
    system[np.diag_indices_from(system)] += weights
    normal = _Normal(system)
    if normal.factor is None:
        return None
    rest = [a @ part @ np.swapaxes(a, -1, -2) for a, part in zip(left, primal_rest, strict=True)]
    mean = point.gap / blocks.order

    def direction(
        right: list[FloatArray],
    ) -> tuple[FloatArray, list[FloatArray], list[FloatArray], list[FloatArray]]:
        asked = [q + part for q, part in zip(right, rest, strict=True)]
        x = normal.solve(blocks.against(turned, asked) - dual_rest)
        moved = blocks.linear(x)
        change = [a @ part @ np.swapaxes(a, -1, -2) for a, part in zip(left, moved, strict=True)]
        return (
            x,
            moved,
            [c - r for c, r in zip(change, rest, strict=True)],
            [q - c for q, c in zip(asked, change, strict=True)],
        )

    eye = [np.eye(v.shape[-1]) for v in values]
    _, _, dS, dY = direction([-v[..., None] * e for v, e in zip(values, eye, strict=True)])
    reach = min(1.0, _reach(values, dS), _reach(values, dY))
    centring = (1.0 - reach) ** 3
    right = []
    for v, e, s, y in zip(values, eye, dS, dY, strict=True):
        product = s @ y
        wanted = (centring * mean - v[..., None] ** 2) * e - 0.5 * (product + np.swapaxes(product, -1, -2))
        right.append(2.0 * wanted / (v[:, :, None] + v[:, None, :]))
    x, moved, dS, dY = direction(right)
    reach = min(1.0, STEP * _reach(values, dS), STEP * _reach(values, dY))
    if not (np.isfinite(x).all() and reach > LOST):
        return None
    S = [old + reach * (part - r) for old, part, r in zip(point.S, moved, primal_rest, strict=True)]
    back = [np.swapaxes(a, -1, -2) @ y @ a for a, y in zip(left, dY, strict=True)]
    Y = [old + reach * 0.5 * (y + np.swapaxes(y, -1, -2)) for old, y in zip(point.Y, back, strict=True)]
    return Iterate(point.x + reach * x, S, Y)


def _scaling(S: FloatArray, Y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """R^-1 and lambda."""
    first, second = np.linalg.cholesky(S), np.linalg.cholesky(Y)
    U, values, _ = np.linalg.svd(np.swapaxes(second, -1, -2) @ first)
    left = np.swapaxes(U, -1, -2) @ np.swapaxes(second, -1, -2) / np.sqrt(values)[..., None]
    return left, values


def _reach(values: Sequence[FloatArray], change: Sequence[FloatArray]) -> float:
    """How far diag(lambda) + a change stays positive definite."""
    least = min(
        float(np.linalg.eigvalsh(c / np.sqrt(v[:, :, None] * v[:, None, :])).min())
        for v, c in zip(values, change, strict=True)
    )
    return 1e6 if least >= -1e-6 else -1.0 / least
