r"""The steady Kalman gains that pass through the printed ones: a design that (30) does not state but its figures fit.

Noise intensities: friction q_z, acceleration error q_a, force noise 1; friction enters the output as well, so process
and measurement noise are correlated. Spectral factorisation of the frozen filter, a = kappa R_e |omega|:

    L2 = sqrt(q_a/(1 + sigma1^2 q_z)) at every wheel speed,
    (1 + sigma1^2 q_z)(p1^2 - 2 p0) = q_z sigma0^2 + q_a (sigma1 + sigma2)^2 + a^2

with p1 = a + L1 (sigma0 - sigma1 a) + L2 (sigma1 + sigma2), p0 = L2 (sigma0 + sigma2 a). Two gains at one wheel speed
therefore determine both intensities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_are

from studies.papers.corner_estimation.inputs import DESIGN_SPEED, corner_model
from synthesis.errors import ProblemError
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray


@dataclass(frozen=True)
class Intensities:
    """Of friction and of the acceleration error, relative to that of the force noise (white, two-sided)."""

    friction: float
    acceleration: float


def fitted(direction: Direction, gains: tuple[float, ...], omega: float) -> Intensities:
    """The intensities whose steady filter has these gains at this wheel speed. Raises ProblemError if none does."""
    values = {name: constant.value for name, constant in corner_model(direction).constants.items()}
    s0, s1, s2 = (values[f"sigma{i}"] for i in range(3))
    a = values["kappa"] * values["effective_radius"] * omega
    L1, L2 = gains
    p1 = a + L1 * (s0 - s1 * a) + L2 * (s1 + s2)
    p0 = L2 * (s0 + s2 * a)
    rest = p1 * p1 - 2.0 * p0 - (L2 * (s1 + s2)) ** 2
    friction = (rest - a * a) / (s0 * s0 - s1 * s1 * rest)
    if not friction > 0.0:
        raise ProblemError(f"no steady filter of the {direction} model has the gains {list(gains)} at {omega:g} rad/s")
    return Intensities(friction, L2 * L2 * (1.0 + s1 * s1 * friction))


def schedule(direction: Direction, noise: Intensities, omega: FloatArray) -> FloatArray:
    """Steady gains (g, 2) of the frozen filters at wheel speeds (g,), by the algebraic Riccati equation."""
    model = corner_model(direction, DESIGN_SPEED).on(omega)
    weights = np.diag([noise.friction, noise.acceleration, 1.0])
    out = np.empty((len(omega), 2))
    for k, (A, C, E, F) in enumerate(zip(model.A, model.C, model.E, model.F, strict=True)):
        sensor, cross = F @ weights @ F.T, E @ weights @ F.T
        P = solve_continuous_are(A.T, C.T, E @ weights @ E.T, sensor, s=cross)
        out[k] = ((P @ C.T + cross) / sensor)[:, 0]
    return out
