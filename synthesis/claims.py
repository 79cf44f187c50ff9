"""The claims of a deployed table: for each one a Lyapunov function of its own, found by LMI with the table fixed.

The inequalities are those of `synthesis.verify`, which proves them exactly; here they are solved for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from synthesis.deployed_loop import DeployedLoop, segment_gain
from synthesis.errors import ProblemError
from synthesis.hinf_observer import Channel, ObserverDesign, channel_matrices
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.solve import solve
from synthesis.polynomials.matrix import FloatArray, symmetric_block

POINTS_PER_SEGMENT = 5


@dataclass(frozen=True)
class Request:
    """A claim to be solved for; level None means: find the best one (for the kind 'gain')."""

    name: str
    kind: str
    unit: str
    level: float | None
    channel: Channel | None = None
    frozen_decay: float = 0.0
    growth: float = 0.0
    open_growth: float = 0.0


@dataclass(frozen=True)
class Claim:
    """One property that was solved for, with margin and tightest place.

    `P` holds coefficients (degree+1, nx, nx) in the physical parameter and states.
    """

    request: Request
    P: FloatArray
    margin: float
    place: str

    @property
    def name(self) -> str:
        """As in the schedule file."""
        return self.request.name

    @property
    def level(self) -> float:
        """The claimed number."""
        return float(self.request.level or 0.0)


def find_claim(loop: DeployedLoop, design: ObserverDesign, request: Request) -> Claim | None:
    """P for one claim with the largest margin, or None if there is none of this degree."""
    result = solve_request(loop, design, request)
    if result.verdict is not Verdict.CERTIFIED:
        return None
    (parameter,) = loop.model.parameters
    offset, factor = (
        np.array([-parameter.middle / parameter.half_width, 0.0]),
        np.array([1.0 / parameter.half_width, 1.0]),
    )
    physical = result.values["P"].affine(offset, factor).coefficients[:, 0, ..., 0]
    scale = loop.scale()
    return Claim(request, physical * np.outer(scale, scale), result.tightest.value, result.tightest.place)


def solve_request(loop: DeployedLoop, design: ObserverDesign, request: Request) -> LmiResult:
    """Solve for P on all segments; with a level, P < I (or the output weight) normalises and a margin is maximised."""
    scale = loop.scale()
    problem = LmiProblem(loop.model.parameters, maximise_margin=request.level is not None)
    size = len(loop.model.states)
    P = problem.symmetric("P", size, max(design.degree, 1))
    P_dot = problem.time_derivative(P)
    squared = problem.scalar("gamma^2") if request.level is None else None
    if squared is not None:
        problem.minimise("gamma^2")
    elif request.kind != "gain":
        problem.require("P < 1", problem.constant(np.eye(size)) - P, strict=False)
    problem.require("P > 0", P)
    if request.kind in ("sampled", "drops"):
        problem.require("growth of P", P * (2.0 * request.growth) - P_dot)
    scaled = loop.model.polynomial.with_states_scaled(scale)
    plant = {key: problem.known(getattr(scaled, key)) for key in ("A", "C", "E", "F", "denominator")}
    below = plant["denominator"]
    if request.kind == "drops":
        coasting = P @ plant["A"]
        problem.require(
            "growth while coasting", P.scaled_by(below) * (2.0 * request.open_growth) - coasting - coasting.T
        )
    motion, weighted = P_dot.scaled_by(below), P.scaled_by(below)
    for i, window in enumerate(pairwise(loop.breakpoints)):
        gain = segment_gain(problem, loop, i, scale)
        A_e, B_e = plant["A"] - gain @ plant["C"], plant["E"] - gain @ plant["F"]
        product = P @ A_e
        S = product + product.T
        phi = S + motion
        level = float(request.level or 0.0)
        if request.kind == "decay":
            block = -(phi + weighted * (2.0 * level))
        elif request.kind == "fastest pole":
            block = S + weighted * (2.0 * level)
        elif request.kind in ("sampled", "drops"):
            block = -(S + weighted * (2.0 * request.frozen_decay))
        elif request.channel is None:
            raise ProblemError(f"claim '{request.name}' of the kind 'gain' needs a channel")
        else:
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
