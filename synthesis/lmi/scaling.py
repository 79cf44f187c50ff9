"""State scaling: the solver sees states of size one."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, matrix_balance, solve_continuous_are

from estimators.arrays import FloatArray
from synthesis.models.extract import PolynomialModel
from synthesis.models.numeric import evaluate
from synthesis.models.param import SchedulingParameter


def observer_scale(model: PolynomialModel, parameters: tuple[SchedulingParameter, ...]) -> FloatArray:
    """1/sqrt of the error variances of the mid-range Kalman filter driven by the model's own disturbances.

    Rescaling the states of the given model rescales these variances with them, so the scaled problem, and with it the
    answer, does not depend on the units of the states. (With given gains `error_scale` needs no filter.)
    """
    middle = evaluate(model, parameters, np.array([[p.middle for p in parameters]]))
    return riccati_scale(middle.A[0], middle.C[0], middle.E[0], middle.F[0])


def riccati_scale(A: FloatArray, C: FloatArray, E: FloatArray, F: FloatArray) -> FloatArray:
    """1/sqrt of the error variances of the Kalman filter of x' = A x + E d, y = C x + F d."""
    found = regular_riccati(A, C, E, F)
    return error_scale(A) if found is None else np.asarray(1.0 / np.sqrt(np.diag(found[0])))


def regular_riccati(A: FloatArray, C: FloatArray, E: FloatArray, F: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """The stabilising X of A X + X A' + E E' = (X C' + E F') (F F')^-1 (C X + F E'), and the gain (X C' + E F') (F F')^-1.

    Variances and gain of a Kalman filter; with A', B', Cz', Dz' the cost of states under the best feedback, and minus its gain,
    transposed. Noise is added where there is too little; None if no amount of it helps.
    """
    process, cross = E @ E.T, E @ F.T
    sensor = F @ F.T
    for regular in (0.0, 1e-6, 1e-3, 1.0):
        try:
            floor = regular * (np.trace(sensor) / len(sensor) + (1.0 if not sensor.any() else 0.0))
            noise = sensor + floor * np.eye(len(sensor))
            variance = solve_continuous_are(A.T, C.T, process + regular * np.diag(np.diag(process)), noise, s=cross)
            gain = np.linalg.solve(noise, (variance @ C.T + cross).T).T
        except (LinAlgError, ValueError):
            continue
        size = np.diag(variance)
        if np.isfinite(size).all() and (size > 0.0).all():
            return variance, gain
    return None


def error_scale(A: FloatArray) -> FloatArray:
    """Diagonal balancing of one matrix: rows and columns of the mid-range error matrix get equal norms.

    For the corner models this is sqrt(|c/b|) on the bristle deflection, 150 to 6000.
    """
    _, (scaling, _) = matrix_balance(A, permute=False, separate=True)
    return np.asarray(1.0 / scaling)
