r"""Mean-square stability of a gain schedule under packet drops while its parameter moves within its rate.

With drops of probability p, independent from sample to sample, and w constant over a sample of length T,

    (1 - p) Phi1(w)' P(w+) Phi1(w) + p Phi0(w)' P(w+) Phi0(w) < P(w),    P > 0,    rate_min T <= w+ - w <= rate_max T

for all w and w+ in the range proves E[e' P(w) e] to decrease along every path of w. P is linear between nodes, so P(w+) lies
in the convex hull of finitely many values, and the inequality is needed for those only. P at the nodes comes from an LMI in
which w is sampled; the proof afterwards covers every w by `analysis.drops.cells`, in floating point with a guard for
rounding, without the solver.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from analysis.checks import probability
from analysis.constant_lmi import constant_problem, matrix_of
from analysis.drops.cells import ROUNDING, Cells, cell_updates, curvature, ends
from analysis.drops.certain import drop_verdict
from analysis.drops.frozen import drop_radius
from analysis.drops.modes import schedule_drop_modes
from analysis.drops.schedule import FrozenDropProbability, frozen_critical_probability
from analysis.errors import AnalysisError
from analysis.markov.coupled_lmi import weighted_sum
from analysis.markov.second_moment import lifted, pack, unpack
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.schedule import GainSchedule
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve

REFINEMENTS = (1, 2)  # segments of P to a segment of the table, tried in turn
SHARE = 4  # cells of the LMI to a segment of P
MOST_CELLS = 2000  # open at once before a proof gives up


@dataclass(frozen=True, repr=False)
class MeanSquareSchedule(Display):
    """Verdict about one drop probability for every admissible motion of the parameter.

    CERTIFIED: the inequality is proved on the whole range by P, `lyapunov` (b, n, n) at `nodes` (b,). REFUTED: the second moment
    does not fall while the parameter rests at `place`. INCONCLUSIVE: neither; `margin` is the smallest eigenvalue found, relative
    to P, at `place`, and `cells` the number of cells of the proof.
    """

    verdict: Verdict
    drop_probability: float
    message: str
    margin: float
    place: float
    nodes: FloatArray = field(default_factory=lambda: np.zeros(0))
    lyapunov: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 0)))
    cells: int = 0


def mean_square_schedule(
    schedule: GainSchedule,
    drop_probability: float,
    frozen: FrozenDropProbability | None = None,
    settings: LmiSettings | None = None,
) -> MeanSquareSchedule:
    """Check one drop probability; `frozen` may be passed in if it is known already.

    Raises AnalysisError for a probability outside [0, 1].

    >>> print(mean_square_schedule(GainSchedule.shipped("longitudinal-speed"), 0.01).verdict)
    certified
    """
    p = float(probability("drop_probability", drop_probability))
    frozen = frozen or frozen_critical_probability(schedule)
    name, unit = schedule.parameter.name, schedule.parameter.unit
    if p >= frozen.smallest:
        modes = schedule_drop_modes(schedule, frozen.place)
        radius = float(drop_radius(modes.dropped, modes.received, p))
        if drop_verdict(modes.dropped, modes.received, p) is Verdict.REFUTED:
            words = f"refuted: second-moment radius {radius:.6g} at {name} = {frozen.place:.6g} {unit}, standing still"
            return MeanSquareSchedule(Verdict.REFUTED, p, words, 1.0 - radius, frozen.place)
    for refinement in REFINEMENTS:
        answer = check_mean_square(schedule, p, *design(schedule, p, refinement, settings))
        if answer.verdict is Verdict.CERTIFIED:
            break
    return answer


def certified_drop_probability(
    schedule: GainSchedule, tolerance: float = 1e-3, settings: LmiSettings | None = None
) -> tuple[MeanSquareSchedule, float]:
    """The largest drop probability found with a certificate, and the upper end of the bracket (frozen, or not certified).

    Raises AnalysisError for a tolerance that is not positive.

    >>> schedule = GainSchedule.shipped("longitudinal-speed")
    >>> found, upper = certified_drop_probability(schedule, tolerance=0.05)
    >>> 0.0 <= found.drop_probability <= upper <= 1.0
    True
    """
    if not tolerance > 0.0:
        raise AnalysisError(f"tolerance = {tolerance} must be positive")
    frozen = frozen_critical_probability(schedule)
    best, low, high = mean_square_schedule(schedule, 0.0, frozen, settings), 0.0, frozen.smallest
    while best.verdict is Verdict.CERTIFIED and high - low > tolerance:
        # The answer usually lies close under the frozen value: try there first.
        middle = max(0.5 * (low + high), high - 4.0 * tolerance) if low == 0.0 else 0.5 * (low + high)
        answer = mean_square_schedule(schedule, middle, frozen, settings)
        if answer.verdict is Verdict.CERTIFIED:
            best, low = answer, middle
        else:
            high = middle
    return best, high


def design(
    schedule: GainSchedule, p: float, refinement: int, settings: LmiSettings | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes (b,), P at the nodes in scaled states (b, n, n), and the scaling S (n, n): P_physical = S' P S."""
    nodes = _refined(schedule.breakpoints, refinement)
    scale = _scale(schedule, p, nodes)
    points = _refined(nodes, SHARE)
    still = Cells(points, points)
    (dropped, received) = ends(cell_updates(schedule, still, scale))[:, 0]
    (here,), after = _weights(nodes, points), _vertices(schedule, nodes, still)
    n = scale.shape[0]
    problem = constant_problem()
    P = [problem.symmetric(f"P{i}", n) for i in range(len(nodes))]
    for i, entry in enumerate(P):
        problem.require(f"P{i} > 0", entry)
        problem.require(f"P{i} < 1", problem.constant(np.eye(n)) - entry, strict=False)
    for i in range(len(points)):
        now = weighted_sum(P, here[i])
        A0, A1 = problem.constant(dropped[i]), problem.constant(received[i])
        for vertex in np.unique(after[i], axis=0):
            future = weighted_sum(P, vertex)
            problem.require(f"point {i}", now - A1.T @ future @ A1 * (1.0 - p) - A0.T @ future @ A0 * p)
    result = solve(problem, settings or LmiSettings(verify=False))
    return nodes, np.stack([matrix_of(result.values[f"P{i}"]) for i in range(len(nodes))]), scale


def check_mean_square(
    schedule: GainSchedule, p: float, nodes: FloatArray, P: FloatArray, scale: FloatArray
) -> MeanSquareSchedule:
    """Prove the inequality on every cell of the range for these P (b, n, n), halving the cells that need it.

    `scale` S sets the coordinates in which P is given, P_physical = S' P S.
    """
    name, unit = schedule.parameter.name, schedule.parameter.unit
    lyapunov = scale.T @ P @ scale
    smallest = float(np.linalg.eigvalsh(P)[..., 0].min())
    edges = np.union1d(nodes, schedule.breakpoints)
    waiting, count, margin, place = Cells(edges[:-1], edges[1:]), 0, smallest, float(nodes[0])
    verdict = Verdict.CERTIFIED if smallest > ROUNDING else Verdict.INCONCLUSIVE
    while verdict is Verdict.CERTIFIED:
        value, bound = _cell_margins(schedule, p, nodes, P, scale, waiting)
        exact = _cell_margins(schedule, p, nodes, P, scale, Cells(waiting.low, waiting.low))[0]
        worst = int(exact.argmin())
        if exact[worst] < margin:
            margin, place = float(exact[worst]), float(waiting.low[worst])
        open_ = ~(value - bound > ROUNDING)
        count += int((~open_).sum())
        if not open_.any():
            break
        if margin <= ROUNDING or 2 * int(open_.sum()) > MOST_CELLS:
            verdict = Verdict.INCONCLUSIVE
        waiting = waiting.halved(open_)
    where = f"{name} = {place:.6g} {unit}"
    words = f"{verdict}: drop probability {p:.6g}, margin {margin:.2e} at {where}, {count} cells"
    return MeanSquareSchedule(verdict, p, words, margin, place, nodes, lyapunov, count)


def _cell_margins(
    schedule: GainSchedule, p: float, nodes: FloatArray, P: FloatArray, scale: FloatArray, cells: Cells
) -> tuple[FloatArray, FloatArray]:
    """Smallest eigenvalue at the ends of each cell over all vertices of the next parameter, and the allowance inside it (c,)."""
    updates = cell_updates(schedule, cells, scale)
    phi = ends(updates)
    here = np.einsum("ecb,bij->ecij", _weights(nodes, cells.low, cells.high), P)
    future = np.einsum("cvb,bij->vcij", _vertices(schedule, nodes, cells), P)
    turned = np.swapaxes(phi, -1, -2)[:, :, None] @ future @ phi[:, :, None]
    slack = here[:, None] - p * turned[0] - (1.0 - p) * turned[1]
    value = np.linalg.eigvalsh(slack)[..., 0].min(axis=(0, 1))
    bend = curvature(updates)
    largest = np.linalg.eigvalsh(future)[..., -1].max(axis=0)
    return value, largest * (p * bend[0] + (1.0 - p) * bend[1])


def _scale(schedule: GainSchedule, p: float, nodes: FloatArray) -> FloatArray:
    """S with P near I in S x: the square root of the mean of frozen Lyapunov matrices, each of determinant 1."""
    modes = schedule_drop_modes(schedule, nodes)
    operator = p * lifted(modes.dropped) + (1.0 - p) * lifted(modes.received)
    radius = np.abs(np.linalg.eigvals(operator)).max(axis=-1)[:, None, None]
    # Discounting by the root of the radius keeps the equation solvable and its answer away from the boundary of the cone.
    n = modes.dropped.shape[-1]
    matrix = np.eye(operator.shape[-1]) - np.swapaxes(operator, -1, -2) / np.sqrt(np.maximum(radius, 1e-6))
    weight = np.eye(n)
    for _ in range(
        3
    ):  # the source Q should have the shape of the answer: start balanced, then use the answer's diagonal
        P = unpack(np.linalg.solve(matrix, pack(weight)[:, None])[..., 0], n)
        P = P / np.maximum(np.linalg.det(P), np.finfo(float).tiny)[:, None, None] ** (1.0 / n)
        weight = np.diag(np.diag(P.mean(axis=0)))
    values, vectors = np.linalg.eigh(P.mean(axis=0))
    return np.asarray((vectors * np.sqrt(np.maximum(values, 1e-12 * values[-1]))) @ vectors.T)


def _refined(points: FloatArray, parts: int) -> FloatArray:
    steps = np.arange(parts) / parts
    inner = points[:-1, None] + np.diff(points)[:, None] * steps
    return np.append(inner.reshape(-1), points[-1])


def _weights(nodes: FloatArray, *places: FloatArray) -> FloatArray:
    """Weights (k, c, b) with P(w) = sum of weights times nodes, for k arrays of c places."""
    at = np.stack(places)
    index = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    share = (at - nodes[index]) / (nodes[index + 1] - nodes[index])
    out = np.zeros((*at.shape, len(nodes)))
    np.put_along_axis(out, index[..., None], 1.0 - share[..., None], axis=-1)
    np.put_along_axis(out, index[..., None] + 1, share[..., None], axis=-1)
    return out


def _vertices(schedule: GainSchedule, nodes: FloatArray, cells: Cells) -> FloatArray:
    """Weights (c, v, b) of the values whose convex hull holds P(w+) for every w in the cell."""
    q, T = schedule.parameter, schedule.sample_time
    low = np.maximum(cells.low + q.rate_min * T, q.min)
    high = np.minimum(cells.high + q.rate_max * T, q.max)
    outer = np.moveaxis(_weights(nodes, low, high), 0, 1)
    inside = (nodes > low[:, None]) & (nodes < high[:, None])
    most = int(inside.sum(axis=1).max(initial=0))
    # Cells with fewer nodes inside repeat their lower end.
    rank = np.where(inside, np.arange(len(nodes)), len(nodes))
    chosen = np.sort(rank, axis=1)[:, :most]
    unit = np.vstack([np.eye(len(nodes)), np.zeros(len(nodes))])[chosen]
    unit = np.where((chosen < len(nodes))[..., None], unit, outer[:, :1])
    return np.concatenate([outer, unit], axis=1)
