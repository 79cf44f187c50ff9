"""The H-infinity problem of P1 (30)-(32) as it stands: what its optimum is, and what it leaves open."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
import sympy as sp

from studies.papers.corner_estimation.inputs import DESIGN_SPEED, corner_model
from synthesis.errors import ProblemError
from synthesis.hinf_observer import Channel, ObserverDesign, ObserverGains, observer_problem, to_gamma
from synthesis.lmi.result import LmiResult
from synthesis.lmi.scaling import observer_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.catalogue.corner import Direction
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray

Sign = Literal["printed", "corrected"]
POINTS = 140  # wheel speeds in [0, 140] rad/s, P1 section 6.2
DEGREES = (0, 1, 2, 3)  # of P and chi; the paper's f is not printed
STATES = ("bristle_deflection", "relative_velocity")
DISTURBANCES = ("friction", "acceleration_error")


@dataclass(frozen=True)
class Optimum:
    """The least gamma of (30) for one degree, with the gains that the solver happened to return, (g, 2) at `omega`."""

    degree: int
    gamma: float
    result: LmiResult
    omega: FloatArray
    gains: FloatArray


def signed_model(direction: Direction, sign: Sign) -> LpvModel:
    """The corner model; `printed` turns sigma1 of the friction column round, so that the error sees I + L [sigma1 0]."""
    model = corner_model(direction, DESIGN_SPEED)
    if sign == "corrected":
        return model
    F = sp.Matrix(model.F)
    F[0, 0] = -F[0, 0]
    return replace(model, F=F)


def literal_design(degree: int, errors: tuple[str, ...] = STATES, points: int = POINTS) -> ObserverDesign:
    """(30)-(32) and nothing else: one channel from all disturbances to the errors C_e, minimised."""
    return ObserverDesign(
        (Channel(DISTURBANCES, errors),), degree, settings=LmiSettings(relaxation="grid", points=points)
    )


@cache
def least_gamma(
    direction: Direction, degree: int, sign: Sign = "corrected", errors: tuple[str, ...] = STATES, points: int = POINTS
) -> Optimum:
    """Minimise gamma over P and chi of this degree. Raises ProblemError if the solver finds nothing."""
    model, design = signed_model(direction, sign), literal_design(degree, errors, points)
    scale = observer_scale(model.polynomial, model.parameters)
    found = solve(observer_problem(model, design, scale), design.settings)
    if found.objective is None or not found.margins:
        raise ProblemError(f"model '{model.name}', degree {degree}: {found.message}")
    gamma = to_gamma(model, design, scale, found.objective)
    omega = np.linspace(0.0, DESIGN_SPEED, 71)
    gains = ObserverGains(design, model, None, gamma, found, found, scale).gain(omega)[..., 0]
    return Optimum(degree, gamma, found, omega, gains)


def optima(direction: Direction, points: int = POINTS) -> tuple[Optimum, ...]:
    """The least gamma for every degree, correct sign, C_e = I."""
    return tuple(least_gamma(direction, degree, "corrected", STATES, points) for degree in DEGREES)


def velocity_floor(direction: Direction, sign: Sign, omega: FloatArray) -> FloatArray:
    r"""|static gain| from friction to the velocity error, the same for every L with L2 != 0, at wheel speeds (g,).

    The second row of the error at rest says C e = -sigma1 d (correct sign) or + sigma1 d (printed one), the first
    e_v = a e_z - d. Hence sigma0/(sigma0 + sigma2 a), and |(2 sigma1 + sigma2) a/(sigma0 + sigma2 a) - 1| as printed.
    """
    values = {name: constant.value for name, constant in corner_model(direction, DESIGN_SPEED).constants.items()}
    a = values["kappa"] * values["effective_radius"] * np.abs(omega)
    below = values["sigma0"] + values["sigma2"] * a
    if sign == "corrected":
        return np.asarray(values["sigma0"] / below)
    return np.asarray(np.abs((2.0 * values["sigma1"] + values["sigma2"]) * a / below - 1.0))
