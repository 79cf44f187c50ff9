r"""Static gains for measurements that arrive at random, from an LMI, from Riccati equations and from a nonlinear Perron problem.

Where a gain comes from is no evidence: its radius is. See `analysis.drops.intermittent` for the equations.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import solve_discrete_are

from analysis.checks import as_stack, probability, square
from analysis.constant_lmi import constant_problem, matrix_of
from analysis.errors import AnalysisError
from analysis.markov.enclosure import EPS
from analysis.markov.regular import radius_verdicts
from analysis.markov.second_moment import lifted, spectral_radius
from analysis.markov.system import LIFTED
from analysis.mode_objects import with_output
from estimators.arrays import FloatArray
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.polynomials.matrix import symmetric_block

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

SWEEPS = 20_000  # of the nonlinear power iteration
GUARD = 1e-12  # relative, for the rounding of eigenvalues


def static_gain_radius(A: ArrayLike, C: ArrayLike | None, gain: ArrayLike, arrival: ArrayLike) -> FloatArray:
    """Radius of a S(A - K C) + (1 - a) S(A) for A (..., n, n), C (..., k, n), K (..., n, k) and a (...).

    Raises AnalysisError for arrays that do not fit or rates outside [0, 1].

    >>> float(static_gain_radius([[1.25]], [[1.0]], [[1.25]], 0.5))  # half of the samples leave 1.25^2
    0.78125
    """
    plant, output = checked_plant(A, C, ndim=None)
    K, a = as_stack("gain", gain), probability("arrival", arrival)[..., None, None]
    if K.shape[-2:] != (plant.shape[-1], output.shape[-2]):
        raise AnalysisError(f"gain has the shape {K.shape}; it must be (..., {plant.shape[-1]}, {output.shape[-2]})")
    return spectral_radius(a * lifted(plant - K @ output) + (1.0 - a) * lifted(plant))


def static_gain_certain(A: FloatArray, C: FloatArray, gain: FloatArray, arrival: float) -> bool:
    """Whether the radius of `static_gain_radius` is below 1 for every A, C and K whose entries round to these."""
    a, loop = arrival, A - gain @ C
    operator = a * lifted(loop) + (1.0 - a) * lifted(A)
    size = a * lifted(np.abs(A) + np.abs(gain) @ np.abs(C)) + (1.0 - a) * lifted(np.abs(A))
    return radius_verdicts(operator, (LIFTED + 4.0 * len(A) * EPS) * size) is Verdict.CERTIFIED


def checked_plant(A: ArrayLike, C: ArrayLike | None, ndim: int | None = 2) -> tuple[FloatArray, FloatArray]:
    """A and C of arrays, or of a discrete-time object with both in the place of A; `ndim` 2 refuses stacks."""
    A, C = with_output(A, C, discrete=True)
    plant, output = square("A", A), as_stack("C", C)
    if plant.shape[-1] != output.shape[-1]:
        raise AnalysisError(f"A has the shape {plant.shape} and C {output.shape}; C needs {plant.shape[-1]} columns")
    if ndim is not None and (plant.ndim != ndim or output.ndim != ndim):
        raise AnalysisError(f"A {plant.shape} and C {output.shape} are stacks; this takes one system at a time")
    return plant, output


def lmi_gain(A: FloatArray, C: FloatArray, arrival: float, settings: LmiSettings | None = None) -> FloatArray | None:
    """K from the LMI at its largest margin, or None if the solver returns no numbers; evidence of nothing by itself."""
    n, k = A.shape[0], C.shape[0]
    scale = _output_scale(A, C)
    F, G = A * (scale[:, None] / scale), C / scale
    problem = constant_problem()
    Y, Z = problem.symmetric("Y", n), problem.matrix("Z", n, k)
    with_, without = Y @ problem.constant(F) + Z @ problem.constant(G), Y @ problem.constant(F)
    rows = [[Y, with_ * arrival**0.5, without * (1.0 - arrival) ** 0.5], [None, Y, None], [None, None, Y]]
    problem.require("Psi > 0", symmetric_block(rows))
    problem.require("Y < 1", problem.constant(np.eye(n)) - Y, strict=False)
    result = solve(problem, settings or LmiSettings(verify=False))
    values, products = matrix_of(result.values["Y"]), matrix_of(result.values["Z"])
    if not (np.isfinite(values).all() and np.isfinite(products).all()) or np.linalg.cond(values) > 1e12:
        return None
    return np.asarray(-np.linalg.solve(values, products) / scale[:, None])


def _output_scale(A: FloatArray, C: FloatArray) -> FloatArray:
    """State scaling (n,) by what each state adds to the outputs of n steps: the units of the states drop out."""
    size = max(float(spectral_radius(A)), np.finfo(float).tiny)
    rows, seen = C, np.zeros(A.shape[0])
    for _ in range(A.shape[0]):
        seen += (rows**2).sum(axis=0)
        rows = rows @ A / size
    visible = seen > 0.0
    return np.sqrt(np.where(visible, seen, seen[visible].mean() if visible.any() else 1.0))


def limit_gain(A: FloatArray, C: FloatArray, arrival: float) -> tuple[FloatArray, float]:
    """The K = K'/a of least radius among Kalman gains K' for process noise from large to next to none, in balanced states."""
    scale = _output_scale(A, C)
    F, G, n = A * (scale[:, None] / scale), C / scale, A.shape[0]
    best = np.zeros((n, C.shape[0]))
    least = float(static_gain_radius(A, C, best, arrival))
    for exponent in range(2, -25, -1) if arrival > 0.0 else ():
        try:
            X = solve_discrete_are(F.T, G.T, 10.0**exponent * np.eye(n), np.eye(C.shape[0]))
        except (np.linalg.LinAlgError, ValueError):
            continue  # noise too small for this precision: the larger ones stand
        gain = F @ X @ G.T @ np.linalg.inv(G @ X @ G.T + np.eye(C.shape[0])) / scale[:, None] / arrival
        radius = float(static_gain_radius(A, C, gain, arrival)) if np.isfinite(gain).all() else np.inf
        if radius < least:
            best, least = gain, radius
    return best, least


def _optimal_gain(A: FloatArray, C: FloatArray, X: FloatArray) -> FloatArray:
    innovation = C @ X @ C.T
    return np.asarray(A @ X @ C.T @ np.linalg.pinv(innovation, rcond=1e-13, hermitian=True))


def _step(A: FloatArray, C: FloatArray, arrival: float, X: FloatArray) -> FloatArray:
    loop = A - _optimal_gain(A, C, X) @ C
    out = arrival * loop @ X @ loop.T + (1.0 - arrival) * A @ X @ A.T
    return np.asarray(0.5 * (out + out.T))


def perron(A: FloatArray, C: FloatArray, arrival: float) -> tuple[FloatArray, FloatArray]:
    """A direction X of Phi_a (trace 1) and the gain that is optimal for it, by power iteration until they decide."""
    n = A.shape[0]
    X = np.eye(n) / n
    for sweep in range(SWEEPS):
        if (sweep & (sweep + 1)) == 0:  # at powers of two, so that looking costs little
            gain = _optimal_gain(A, C, X)
            if float(static_gain_radius(A, C, gain, arrival)) < 1.0 or refutes(A, C, arrival, X):
                return X, gain
        following = _step(A, C, arrival, X)
        size = float(np.trace(following))
        if size <= 0.0:
            break
        # The average with the last direction damps eigenvalues of the same modulus (complex pairs, opposite signs).
        following = 0.5 * (following / size + X)
        change = float(np.abs(following - X).max())
        X = following
        if change <= 1e-15:
            break
    return X, _optimal_gain(A, C, X)


def refutes(A: FloatArray, C: FloatArray, arrival: float, X: FloatArray) -> bool:
    """Whether X shows that no gain is stable: Phi_a(X) >= X >= 0 up to rounding, X != 0."""
    low = float(np.linalg.eigvalsh(X)[0])
    slack = float(np.linalg.eigvalsh(_step(A, C, arrival, X) - X)[0])
    return low >= -GUARD * float(np.trace(X)) and slack >= -GUARD * float(np.trace(X))
