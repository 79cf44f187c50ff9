"""Small problems with known answers, built from the parts of the engine: used by several tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp
from flint import fmpq, fmpq_poly

from estimators.arrays import FloatArray
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult
from synthesis.lmi.scaling import error_scale, observer_scale
from synthesis.models.catalogue.corner import Direction, corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.models.parameter_set import Published, load_parameter_set
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block
from synthesis.polynomials.rational import first_failure, rational


def parameter(name: str = "p", low: float = -1.0, high: float = 1.0, rate: float = 1.0) -> SchedulingParameter:
    """A dimensionless parameter with symmetric rates; rate 0: constant, inf: it may jump."""
    return SchedulingParameter(name, "1", low, high, -rate, rate)


def small_model(A: Any, C: Any, parameters: Sequence[SchedulingParameter] = (), **more: Any) -> LpvModel:
    """A model with dimensionless signals x1.., y1.., and disturbances d1.. if E is given."""
    A, C = sp.Matrix(A), sp.Matrix(C)
    disturbances = sp.Matrix(more["E"]).shape[1] if "E" in more else 0
    inputs = sp.Matrix(more["B"]).shape[1] if "B" in more else 0
    filled: dict[str, Any] = {
        "name": "small",
        "source": "made for a test",
        "states": tuple(Signal(f"x{i + 1}", "1") for i in range(A.shape[0])),
        "outputs": tuple(Signal(f"y{i + 1}", "1") for i in range(C.shape[0])),
        "inputs": tuple(Signal(f"u{i + 1}", "1") for i in range(inputs)),
        "disturbances": tuple(Signal(f"d{i + 1}", "1") for i in range(disturbances)),
        "parameters": tuple(parameters) or (parameter(),),
        "A": A,
        "C": C,
    }
    return LpvModel(**(filled | more))


def corner(name: str, direction: Direction, maximum: float = 180.0) -> tuple[LpvModel, Published]:
    """A corner model of the papers with what its source prints."""
    values = load_parameter_set(name)
    published = values.tire[direction].published
    assert published is not None
    return corner_velocity_model(values, direction, maximum), published


def lyapunov_problem(
    parameters: Sequence[SchedulingParameter], A: FloatArray, degree: int | tuple[int, ...] = 0
) -> LmiProblem:
    """P > 0, A'P + P A + dP/dt < 0, normalised by P < 1, margin maximised; A as coefficients (d_1+1, .., n, n)."""
    problem = LmiProblem(tuple(parameters), maximise_margin=True)
    known = problem.known(A)
    P = problem.symmetric("P", known.shape[0], degree)
    product = P @ known
    problem.require("P > 0", P)
    problem.require("P < 1", problem.constant(np.eye(known.shape[0])) - P, strict=False)
    problem.require("dV/dt < 0", -(product + product.T + problem.time_derivative(P)))
    return problem


def gain_inequality(
    problem: LmiProblem, A: FloatArray, B: FloatArray, C: FloatArray, degree: int | tuple[int, ...]
) -> tuple[MatrixPolynomial, MatrixPolynomial]:
    """P and the bounded real block of x' = A x + B d, z = C x, both to be positive; minimises `gamma`."""
    known = [problem.known(matrix) for matrix in (A, B, C)]
    P = problem.symmetric("P", known[0].shape[0], degree)
    gamma = problem.scalar("gamma")
    problem.minimise("gamma")
    product = P @ known[0]
    corner_block = product + product.T + problem.time_derivative(P)
    inputs = problem.constant(np.eye(known[1].shape[1])).scaled_by(gamma)
    outputs = problem.constant(np.eye(known[2].shape[0])).scaled_by(gamma)
    return P, -symmetric_block(
        [[corner_block, P @ known[1], known[2].T], [None, -inputs, None], [None, None, -outputs]]
    )


def gain_problem(
    parameters: Sequence[SchedulingParameter],
    A: FloatArray,
    B: FloatArray,
    C: FloatArray,
    degree: int | tuple[int, ...],
) -> LmiProblem:
    """The least L2 gain that some P of this degree proves."""
    problem = LmiProblem(tuple(parameters))
    P, block = gain_inequality(problem, A, B, C, degree)
    problem.require("P > 0", P)
    problem.require("gain", block)
    return problem


SLACK = 1e-5  # relative: the most that `solve` loosens an optimum so that a proof is found


def within(value: float | None, optimum: float, digits: float = 1e-9) -> bool:
    """A certified bound is never below the optimum (known to `digits`), and above it by the loosening at most.

    What lies between these two hangs on the last digits of a solver; that it lies between them does not.
    """
    assert value is not None
    size = max(abs(optimum), 1e-3)
    return optimum - digits <= value <= optimum + digits + 2.0 * SLACK * size


def held(problem: LmiProblem, name: str, level: float) -> LmiProblem:
    """The problem with the unknown that it minimises held at `level` or above.

    At an optimum every proof is on the edge, and a processor that rounds differently may miss it; at a level above the
    optimum the other inequalities have room.
    """
    problem.require(f"{name} > {level:g}", problem.unknowns[name] - problem.constant(np.array([[level]])))
    return problem


def capped(problem: LmiProblem, name: str, level: float) -> LmiProblem:
    """The problem with the unknown that it minimises below `level`."""
    problem.require(f"{name} < {level:g}", problem.constant(np.array([[level]])) - problem.unknowns[name])
    return problem


def reference_problem(model: LpvModel, degree: int, given: float, noise: float = 0.5) -> LmiProblem:
    """The reference problem with the first state of the model as given multiplied by `given`.

    e' = (A - L C) e + (E - L F) W d, z = e in the original units, W = diag(1, 1, noise); minimises gamma^2.
    """
    units = np.array([given, 1.0])
    poly = model.polynomial.with_states_scaled(units)
    scale = observer_scale(poly, model.parameters)
    balanced = poly.with_states_scaled(scale)
    problem = LmiProblem(model.parameters)
    A, C, E, F = (problem.scaled(getattr(balanced, key)) for key in "ACEF")
    weights = problem.constant(np.diag([1.0, 1.0, noise]))
    P, X = problem.symmetric("P", 2, degree), problem.matrix("X", 2, 1, degree)
    squared = problem.scalar("gamma^2")
    problem.minimise("gamma^2")
    closed = P @ A - X @ C
    output = problem.constant(np.diag(1.0 / (units * scale) ** 2))
    top = closed + closed.T + problem.time_derivative(P) + output
    inputs = problem.constant(np.eye(3)).scaled_by(squared)
    problem.require("P > 0", P)
    problem.require("gain", -symmetric_block([[top, (P @ E - X @ F) @ weights], [None, -inputs]]))
    return problem


def exactly_positive(matrix: MatrixPolynomial) -> bool:
    """M(u, r) > 0 on [-1, 1]^2 in exact arithmetic, for one parameter u and r affine: both vertices of r.

    The upper triangle is read twice: in floating point the lower one may differ from it by the last bit.
    """
    line = fmpq_poly([-1, 2])
    for rate in (-1, 1) if matrix.degrees[1] else (0,):
        entries = [
            [
                sum(
                    (
                        fmpq_poly([rational(c) * fmpq(rate) ** j])(line) * line**i
                        for (i, j), c in np.ndenumerate(matrix.coefficients[:, :, min(a, b), max(a, b), 0])
                    ),
                    fmpq_poly([0]),
                )
                for b in range(matrix.shape[1])
            ]
            for a in range(matrix.shape[0])
        ]
        if first_failure(entries, depth=40) is not None:
            return False
    return True


def confirmed(problem: LmiProblem, result: LmiResult) -> bool:
    """Every strict inequality at the decisions of the result, with the common margin taken out, proved exactly."""
    decisions = problem.without_margin(result.decisions)
    return all(exactly_positive(entry.matrix.substitute(decisions)) for entry in problem.inequalities if entry.strict)


def condition_problem(A: FloatArray, scale: FloatArray, degree: int) -> LmiProblem:
    """Least t with 1 < P < t and dV/dt < 0 in the states diag(scale) x."""
    model, _ = corner("corner-estimation", "longitudinal")
    problem = LmiProblem(model.parameters)
    known = problem.scaled(A * scale[:, None] / scale)
    P = problem.symmetric("P", 2, degree)
    t = problem.scalar("t")
    problem.minimise("t")
    product = P @ known
    problem.require("P > 1", P - problem.constant(np.eye(2)))
    problem.require("P < t", problem.constant(np.eye(2)).scaled_by(t) - P)
    problem.require("dV/dt < 0", -(product + product.T + problem.time_derivative(P)))
    return problem


def closed_loop(direction: str) -> tuple[FloatArray, FloatArray]:
    """Coefficients of A_e with the printed gains, and its balancing."""
    model, published = corner("corner-estimation", direction)  # type: ignore[arg-type]
    gain = np.array(published.gains)[:, None]
    A = model.polynomial.A - gain @ model.polynomial.C
    return A, error_scale(model.on([90.0]).error_dynamics(gain)[0][0])
