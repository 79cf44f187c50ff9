"""State scaling: the solver sees states of size one."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, matrix_balance, solve_continuous_are

from estimators.arrays import FloatArray
from synthesis.models.extract import PolynomialModel
from synthesis.models.numeric import evaluate
from synthesis.models.param import SchedulingParameter

HEAVY = 10.0  # so much more than P or Q weigh gains in the choice of least norm
SWEEPS, BALANCED = 300, 1e-12  # over all states, and the relative change that ends them


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
    transposed. Noise is added where there is too little, in proportion to `output_sizes`; None if no amount of it helps.
    """
    sizes = output_sizes(C * np.linalg.norm(E, axis=1), F)
    C, F = C / sizes[:, None], F / sizes[:, None]
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
            return variance, gain / sizes
    return None


def output_sizes(C: FloatArray, F: FloatArray) -> FloatArray:
    """The noise of every output (ny,); of one without noise what states of size one show in it. One where there is neither."""
    noise, shown = np.linalg.norm(F, axis=1), np.linalg.norm(C, axis=1)
    sizes = np.where(noise > 0.0, noise, shown)
    return np.asarray(np.where(sizes > 0.0, sizes, 1.0))


def correction_sizes(A: FloatArray, C: FloatArray, E: FloatArray, F: FloatArray, scale: FloatArray) -> FloatArray:
    """Sizes (ny,) of outputs: the dual of those of inputs (`synthesis.design.feedback_scale`).

    With them the Kalman filter corrects the states diag(scale) x by `HEAVY`. Without one, or where it leaves an output aside, the
    noise counts.
    """
    found = regular_riccati(A, C, E, F)
    gain = np.zeros(len(C)) if found is None else np.linalg.norm(found[1] * scale[:, None], axis=0)
    return np.asarray(np.where(gain > 0.0, HEAVY / np.where(gain > 0.0, gain, 1.0), output_sizes(C / scale, F)))


def error_scale(A: FloatArray) -> FloatArray:
    """Diagonal balancing of one matrix: rows and columns of the mid-range error matrix get equal norms.

    For the corner models this is sqrt(|c/b|) on the bristle deflection, 150 to 6000.
    """
    _, (scaling, _) = matrix_balance(A, permute=False, separate=True)
    return np.asarray(1.0 / scaling)


def signal_scale(A: FloatArray, E: FloatArray, C: FloatArray) -> FloatArray:
    """Diagonal balancing of x' = A x + E d, z = C x: what comes into every state is as large as what leaves it (Osborne 1960).

    Signals d and z of size one tie the scale to something: it follows the units of the states, where balancing A alone would
    keep those of states that act on each other one way. A state that nothing reaches, or that reaches nothing, is left alone.
    """
    inside = A - np.diag(np.diag(A))
    scale = np.ones(len(A))
    for _ in range(SWEEPS):
        before = scale.copy()
        for i in range(len(A)):
            come = np.hypot(np.linalg.norm(inside[i] / scale), np.linalg.norm(E[i])) * scale[i]
            leave = np.hypot(np.linalg.norm(inside[:, i] * scale), np.linalg.norm(C[:, i])) / scale[i]
            if come > 0.0 and leave > 0.0:
                scale[i] *= np.sqrt(leave / come)
        if np.abs(np.log(scale / before)).max() < BALANCED:
            break
    return scale
