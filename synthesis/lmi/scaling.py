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
    A, C, E, F = middle.A[0], middle.C[0], middle.E[0], middle.F[0]
    process, cross = E @ E.T, E @ F.T
    sensor = F @ F.T
    for regular in (0.0, 1e-6, 1e-3, 1.0):
        try:
            floor = regular * (np.trace(sensor) / len(sensor) + (1.0 if not sensor.any() else 0.0))
            variance = solve_continuous_are(
                A.T, C.T, process + regular * np.diag(np.diag(process)), sensor + floor * np.eye(len(sensor)), s=cross
            )
        except (LinAlgError, ValueError):
            continue
        size = np.diag(variance)
        if np.isfinite(size).all() and (size > 0.0).all():
            return np.asarray(1.0 / np.sqrt(size))
    return error_scale(A)


def error_scale(A: FloatArray) -> FloatArray:
    """Diagonal balancing of one matrix: rows and columns of the mid-range error matrix get equal norms.

    For the corner models this is sqrt(|c/b|) on the bristle deflection, 150 to 6000.
    """
    _, (scaling, _) = matrix_balance(A, permute=False, separate=True)
    return np.asarray(1.0 / scaling)
