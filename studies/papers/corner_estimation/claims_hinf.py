"""P1-30-sign and P1-hinf-gamma: the sign in (30), and the gamma that its optimum has."""

from __future__ import annotations

import numpy as np
import sympy as sp

from studies.claim import ClaimFunction, Finding
from studies.papers.corner_estimation.hinf import DEGREES, POINTS, STATES, Sign, least_gamma, optima, velocity_floor
from studies.papers.corner_estimation.inputs import DESIGN_SPEED, DIRECTIONS, corner_model
from studies.papers.verdicts import derived, erratum
from synthesis.lmi.result import Verdict

SIGN_TOLERANCE = 1e-3  # of gamma
GAMMA_TOLERANCE = 2e-5  # from the infimum


def disturbance_matrix_error(sign: int) -> sp.Matrix:
    """I + sign L [sigma1 0] minus the disturbance matrix E - L F that follows from (22)-(24), symbolic."""
    model = corner_model("longitudinal")
    L = sp.Matrix(sp.symbols("L1 L2"))
    derived_matrix = (model.E - L * model.F)[:, :2]
    return sp.Matrix(sp.expand(sp.eye(2) + sign * L * sp.Matrix([[sp.Symbol("sigma1"), 0]]) - derived_matrix))


def sign_of_the_disturbance(printed_sign: int = 1) -> Finding:
    """(25) against the matrix in (30), and what the wrong sign does to gamma."""
    wrong, right = disturbance_matrix_error(printed_sign), disturbance_matrix_error(-1)
    signs: tuple[Sign, ...] = ("printed", "corrected")
    gamma = {s: {d: least_gamma(d, 1, s, STATES, POINTS).gamma for d in DIRECTIONS} for s in signs}
    omega = np.linspace(0.0, DESIGN_SPEED, POINTS)
    floor = {s: {d: float(velocity_floor(d, s, omega).max()) for d in DIRECTIONS} for s in signs}
    attained = all(abs(gamma[s][d] - floor[s][d]) <= SIGN_TOLERANCE for s in signs for d in DIRECTIONS)
    computed = {
        "printed_minus_derived": [str(entry) for entry in wrong],
        "corrected_minus_derived": [str(entry) for entry in right],
        "gamma": gamma,
        "static_floor": floor,
    }
    shown = ", ".join(f"{d} {gamma['printed'][d]:.4f} against {gamma['corrected'][d]:.4f}" for d in DIRECTIONS)
    reading = (
        "By (25) the disturbance enters the error through I - L [sigma1 0], so block (1,2) of (30) is P - chi "
        f"[sigma1 0]. Least gamma with the printed and with the corrected sign: {shown}. The printed one is the "
        "static gain (2 sigma1 + sigma2) a/(sigma0 + sigma2 a) - 1, where that exceeds one, of a loop that is not "
        "the observer's."
    )
    return Finding(computed, erratum(wrong.is_zero_matrix, bool(right.is_zero_matrix and attained)), reading)


def least_gamma_by_degree(points: int = POINTS, tolerance: float = GAMMA_TOLERANCE) -> Finding:
    """gamma for f = 0..3 and both directions, against the static gain that no observer can lower."""
    found = {d: optima(d, points) for d in DIRECTIONS}
    floor = {d: float(velocity_floor(d, "corrected", np.array([0.0]))[0]) for d in DIRECTIONS}
    gamma = {d: [o.gamma for o in found[d]] for d in DIRECTIONS}
    largest = {d: [float(np.abs(o.gains[:, 1]).max()) for o in found[d]] for d in DIRECTIONS}
    distance = max(abs(g - floor[d]) for d in DIRECTIONS for g in gamma[d])
    proved = all(o.result.verdict is Verdict.CERTIFIED for d in DIRECTIONS for o in found[d])
    computed = {
        "degrees": list(DEGREES),
        "gamma": gamma,
        "exact_infimum": floor,
        "largest_distance": distance,
        "proved_on_the_whole_range": proved,
        "largest_L2_returned": largest,
    }
    low, high = (pick(value for row in largest.values() for value in row) for pick in (min, max))
    reading = (
        "At standstill of the error friction cannot be told from slip velocity: their static gain is "
        "sigma0/(sigma0 + sigma2 a) for every L, 1 at rest, so gamma has the infimum 1. All degrees come within "
        f"{distance:.1e} of it; the degree buys nothing, and the gains returned on the way there are as large as "
        f"the solver's tolerance lets them be (L2 up to {low:.2g} to {high:.2g} m/s^2)."
    )
    return Finding(computed, derived(distance <= tolerance and proved), reading)


CLAIMS: dict[str, ClaimFunction] = {"P1-30-sign": sign_of_the_disturbance, "P1-hinf-gamma": least_gamma_by_degree}
