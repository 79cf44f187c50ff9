"""The claims of a deployed table: for each one a Lyapunov function of its own, found by LMI with the table fixed.

The inequalities are those of `synthesis.verify`, which proves them exactly; here they are solved for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from synthesis.hinf_observer import Channel, ObserverDesign, channel_matrices
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.scaling import error_scale
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray, MatrixPolynomial, symmetric_block

POINTS_PER_SEGMENT = 5


@dataclass(frozen=True)
class DeployedLoop:
    """A model in closed loop with a gain table (breakpoints, nx, ny), linear between its breakpoints."""

    model: LpvModel
    breakpoints: FloatArray
    table: FloatArray

    def scale(self) -> FloatArray:
        """Diagonal balancing of the mid-range error matrix."""
        middle = 0.5 * (self.breakpoints[0] + self.breakpoints[-1])
        return error_scale(self.error_matrices(np.array([middle]))[0][0])

    def error_matrices(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A_e (g, nx, nx) and B_e (g, nx, nd) on a grid."""
        flat = self.table.reshape(len(self.table), -1)
        gain = np.stack([np.interp(points, self.breakpoints, column) for column in flat.T], axis=1)
        return self.model.on(points).error_dynamics(gain.reshape(len(points), *self.table.shape[1:]))


@dataclass(frozen=True)
class Claim:
    """One proved property; `P` holds coefficients (degree+1, nx, nx) in the physical parameter and states."""

    name: str
    kind: str
    level: float
    unit: str
    P: FloatArray
    channel: Channel | None = None
    frozen_decay: float | None = None
    growth: float | None = None
    margin: float = 0.0
    place: str = ""


@dataclass(frozen=True)
class _Request:
    """A claim to be solved for: level None means: find the best one."""

    name: str
    kind: str
    unit: str
    level: float | None
    channel: Channel | None = None
    frozen_decay: float = 0.0
    growth: float = 0.0


def frozen_gain(loop: DeployedLoop, channel: Channel, points: int = 281) -> float:
    """Largest gain of the channel over constant parameters and a grid of frequencies: a bound from below.

    A constant parameter is one of the admissible trajectories, and every frequency bounds the norm there from below.
    """
    grid = np.linspace(loop.breakpoints[0], loop.breakpoints[-1], points)
    A_e, B_e = loop.error_matrices(grid)
    d, z = channel_matrices(loop.model, channel)
    frequencies = np.concatenate([[0.0], np.geomspace(1e-2, 1e4, 61)])
    resolvent = 1j * frequencies[:, None, None, None] * np.eye(A_e.shape[-1]) - A_e
    response = z @ np.linalg.solve(resolvent, np.broadcast_to(B_e @ d, (len(frequencies), *(B_e @ d).shape)))
    return float(np.linalg.norm(response, 2, axis=(-2, -1)).max())


def claim_levels(loop: DeployedLoop, design: ObserverDesign) -> dict[str, float]:
    """The least L2 gain of every channel that some P of this degree proves for the table."""
    out = {}
    for channel in design.channels:
        result = _solve(loop, design, _Request(channel.name, "gain", "1", None, channel))
        good = result.verdict is Verdict.CERTIFIED and result.objective is not None
        out[channel.name] = float(np.sqrt(result.objective or 0.0)) if good else np.inf
    return out


def prove_claims(
    loop: DeployedLoop, design: ObserverDesign, levels: dict[str, float], settle: float
) -> tuple[Claim, ...] | None:
    """P for every claim with the largest margin; None if one of them cannot be had for this table."""
    requests = [_Request("decay rate", "decay", "1/s", design.decay_rate)] if design.decay_rate else []
    if design.fastest_pole is not None:
        requests.append(_Request("fastest pole", "fastest pole", "1/s", design.fastest_pole))
    for channel in design.channels:
        level = _round_up(levels[channel.name] * (1.0 + settle))
        requests.append(_Request(f"gain {channel.name}", "gain", _gain_unit(loop.model, channel), level, channel))
    claims = []
    for request in requests:
        claim = _claim(loop, design, request)
        if claim is None:
            return None
        claims.append(claim)
    sampled = _sampled_claim(loop, design)
    return None if sampled is None else (*claims, sampled)


def _sampled_claim(loop: DeployedLoop, design: ObserverDesign) -> Claim | None:
    """The runtime's own update: the largest proved alpha - beta among a few splits of the slowest frozen pole."""
    points = np.linspace(loop.breakpoints[0], loop.breakpoints[-1], 2001)
    slowest = -float(np.linalg.eigvals(loop.error_matrices(points)[0]).real.max())
    for share in (0.95, 0.9, 0.8, 0.6, 0.4, 0.2, 0.1):
        for growth in (0.001, 0.05, 0.2, 0.5):
            alpha = _round_down(share * slowest)
            beta = _round_down(growth * alpha)
            if not 0.0 < beta < alpha:
                continue
            level = _round_down(0.999999 * (alpha - beta))
            claim = _claim(loop, design, _Request("sampled decay rate", "sampled", "1/s", level, None, alpha, beta))
            if claim is not None:
                return claim
    return None


def _claim(loop: DeployedLoop, design: ObserverDesign, request: _Request) -> Claim | None:
    result = _solve(loop, design, request)
    if result.verdict is not Verdict.CERTIFIED:
        return None
    (parameter,) = loop.model.parameters
    offset, factor = (
        np.array([-parameter.middle / parameter.half_width, 0.0]),
        np.array([1.0 / parameter.half_width, 1.0]),
    )
    physical = result.values["P"].affine(offset, factor).coefficients[:, 0, ..., 0]
    scale = loop.scale()
    tightest = result.tightest
    return Claim(
        request.name, request.kind, float(request.level or 0.0), request.unit, physical * np.outer(scale, scale),
        request.channel, request.frozen_decay or None, request.growth or None, tightest.value, tightest.place,
    )  # fmt: skip


def _solve(loop: DeployedLoop, design: ObserverDesign, request: _Request) -> LmiResult:
    """Solve for P on all segments; with a level, P < I (or the output weight) normalises and a margin is maximised."""
    scale = loop.scale()
    problem = LmiProblem(loop.model.parameters, maximise_margin=request.level is not None)
    size = len(loop.model.states)
    P = problem.symmetric("P", size, max(design.degree, 1))
    squared = problem.scalar("gamma^2") if request.level is None else None
    if squared is not None:
        problem.minimise("gamma^2")
    elif request.kind != "gain":
        problem.require("P < 1", problem.constant(np.eye(size)) - P, strict=False)
    problem.require("P > 0", P)
    if request.kind == "sampled":
        problem.require("growth of P", P * (2.0 * request.growth) - problem.time_derivative(P))
    scaled = loop.model.polynomial.with_states_scaled(scale)
    plant = {key: problem.known(getattr(scaled, key)) for key in ("A", "C", "E", "F", "denominator")}
    below = plant["denominator"]
    for i, window in enumerate(zip(loop.breakpoints, loop.breakpoints[1:], strict=False)):
        gain = segment_gain(problem, loop, i, scale)
        A_e, B_e = plant["A"] - gain @ plant["C"], plant["E"] - gain @ plant["F"]
        product = P @ A_e
        S = product + product.T
        phi = S + problem.time_derivative(P).scaled_by(below)
        weighted = P.scaled_by(below)
        level = float(request.level or 0.0)
        if request.kind == "decay":
            block = -(phi + weighted * (2.0 * level))
        elif request.kind == "fastest pole":
            block = S + weighted * (2.0 * level)
        elif request.kind == "sampled":
            block = -(S + weighted * (2.0 * request.frozen_decay))
        else:
            assert request.channel is not None
            d, z = channel_matrices(loop.model, request.channel)
            force = (P @ B_e) @ problem.constant(d)
            inputs = problem.constant(np.eye(d.shape[1]))
            bound = inputs.scaled_by(squared) if squared is not None else inputs * level**2
            corner = phi + problem.constant(z.T @ z / np.outer(scale, scale)).scaled_by(below)
            block = -symmetric_block([[corner, force], [None, -bound.scaled_by(below)]])
        problem.require(f"{request.name}, segment {i}", block, window)
    # A few points a segment are enough: whatever comes out is re-evaluated on the continuum, and proved exactly later.
    points = POINTS_PER_SEGMENT * (len(loop.breakpoints) - 1)
    return solve(problem, replace(design.settings, relaxation="grid", points=points))


def segment_gain(problem: LmiProblem, loop: DeployedLoop, segment: int, scale: FloatArray) -> MatrixPolynomial:
    """The linear gain between two breakpoints, in the scaled states."""
    low, high = loop.breakpoints[segment : segment + 2]
    first, second = (scale[:, None] * gain for gain in loop.table[segment : segment + 2])
    slope = (second - first) / (high - low)
    return problem.known(np.stack([first - slope * low, slope]))


def _gain_unit(model: LpvModel, channel: Channel) -> str:
    """Unit of the gain when all its disturbances and all its errors share one unit each, else '1' (mixed)."""
    above = {s.unit for s in model.states if s.name in channel.errors}
    below = {d.unit for d in model.disturbances if d.name in channel.disturbances}
    if above == below or len(above) > 1 or len(below) > 1:
        return "1"
    (top,), (bottom,) = above, below
    return top if bottom == "1" else f"({top})/({bottom})"


def _round_up(value: float, digits: int = 4) -> float:
    """Up to so many significant digits, so that a printed bound is a bound."""
    step = 10.0 ** (np.floor(np.log10(value)) - digits + 1)
    return float(f"{np.ceil(value / step) * step:.{digits}g}")


def _round_down(value: float, digits: int = 4) -> float:
    if not value > 0.0:
        return 0.0
    step = 10.0 ** (np.floor(np.log10(value)) - digits + 1)
    return float(f"{np.floor(value / step) * step:.{digits}g}")
