"""How the units of the bristle deflection decide whether a solver finds a Lyapunov matrix of (28)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.papers.corner_estimation.inputs import STATED_SPEED, corner_model, printed_gains
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray
from synthesis.stability import physical

UNSCALED = np.ones(2)


def natural_scale(name: str, direction: Direction) -> float:
    """g = sqrt|c/b| of A_e = [[a, b], [c, d]] at mid-range: z multiplied by g balances the two couplings, 1/s."""
    A_e = (
        corner_model(direction, STATED_SPEED, name).on([STATED_SPEED / 2]).error_dynamics(_gain(name, direction))[0][0]
    )
    return float(np.sqrt(abs(A_e[1, 0] / A_e[0, 1])))


def best_margin(name: str, direction: Direction, scale: float, condition: float) -> float:
    """Largest t with A_e'P + P A_e < -t I for a constant P, I <= P <= condition I, in the states (scale z, v_r).

    Affine in the wheel speed, so both ends of the range decide; t < 0: no such P proves stability.
    """
    problem = _problem(name, direction, np.array([scale, 1.0]), degree=0, margin=True)
    P = problem.unknowns["P"]
    problem.require("P >= I", P - problem.constant(np.eye(2)), strict=False)
    problem.require("P <= condition I", problem.constant(condition * np.eye(2)) - P, strict=False)
    found = solve(problem, LmiSettings(relaxation="vertex"))
    return float("nan") if found.objective is None else found.objective


@dataclass(frozen=True)
class VertexSolve:
    """An affine P that satisfies (28) at both ends of range and rate, without multi-convexity and without scaling.

    `growth` (g,) is the largest growth rate of V in 1/s at the wheel speeds `omega` (g,): above zero the certificate is
    false, whatever the solver said.
    """

    status: str
    verdict: Verdict
    omega: FloatArray
    growth: FloatArray


def vertices_only(name: str, direction: Direction, points: int = 361) -> VertexSolve:
    """Ask a solver for (28) at the four vertices of (omega, rate) alone, then look between them."""
    problem = _problem(name, direction, UNSCALED, degree=1, margin=False)
    problem.require("P > 0", problem.unknowns["P"])
    found: LmiResult = solve(problem, LmiSettings(relaxation="grid", points=2))
    model = corner_model(direction, STATED_SPEED, name)
    constant, slope = physical(model, found, "P")
    omega = np.linspace(0.0, STATED_SPEED, points)
    P = constant + omega[:, None, None] * slope
    A_e = model.on(omega).error_dynamics(_gain(name, direction))[0]
    total = P @ A_e + np.swapaxes(P @ A_e, 1, 2)
    relative = [
        np.linalg.eigvals(np.linalg.solve(P, total + rate * slope)).real.max(axis=1) for rate in (-800.0, 800.0)
    ]
    return VertexSolve(found.report.status, found.verdict, omega, np.maximum(*relative))


def _problem(name: str, direction: Direction, scale: FloatArray, degree: int, margin: bool) -> LmiProblem:
    """V' < 0 for the printed gains, with the unknown P of this degree."""
    model = corner_model(direction, STATED_SPEED, name)
    problem = LmiProblem(model.parameters, maximise_margin=margin)
    scaled = model.polynomial.with_states_scaled(scale)
    A, C = problem.scaled(scaled.A), problem.scaled(scaled.C)
    P = problem.symmetric("P", 2, degree)
    product = P @ (A - problem.constant(scale[:, None] * _gain(name, direction)) @ C)
    problem.require("dV/dt < 0", -(product + product.T + problem.time_derivative(P)))
    return problem


def _gain(name: str, direction: Direction) -> FloatArray:
    return np.array(printed_gains(direction, name))[:, None]
