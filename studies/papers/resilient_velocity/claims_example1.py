"""Example 1 and Proposition 1: eigenvalues of the error matrix, of its symmetric part, and the energy bound (16)."""

from __future__ import annotations

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from analysis.norms import stability_margin
from analysis.switching import best_diagonal_transform, similarity_bound, symmetric_growth
from studies.claim import ClaimFunction, Finding, agrees, judged
from studies.papers.resilient_velocity.setting import HIGHEST_SPEED, PRINTED, Setting
from studies.papers.verdicts import derived, erratum

PRINTED_EIGENVALUE, PRINTED_SYMMETRIC, PRINTED_TRANSFORMED = -327.1, 108750.0, -326.8  # 1/s


def symmetric_part(setting: Setting, speed: float, transformed: bool = False) -> float:
    """lambda_max((A_e + A_e')/2) in 1/s at one wheel speed, of T A_e T^-1 if `transformed`."""
    A_e = setting.error("longitudinal", speed)[0]
    return float(symmetric_growth(A_e, setting.transform if transformed else None)[0])


def speeds_between(setting: Setting, low: float, high: float, transformed: bool) -> tuple[float, float] | None:
    """The wheel speeds (rad/s) between which the symmetric part lies between two levels; None if it does nowhere.

    It falls with the wheel speed on the whole range, so one root for each level is enough.
    """
    ends = []
    for level in (high, low):

        def excess(speed: float, level: float = level) -> float:
            return symmetric_part(setting, speed, transformed) - level

        if excess(0.0) <= 0.0 or excess(HIGHEST_SPEED) >= 0.0:
            return None
        ends.append(float(brentq(excess, 0.0, HIGHEST_SPEED, xtol=1e-10)))
    return ends[0], ends[1]


def eigenvalue(setting: Setting = PRINTED) -> Finding:
    """P3-ex1-eig."""
    found = float(stability_margin(setting.error("longitudinal", setting.example_speed)[0])[0])
    return Finding(
        found,
        judged(agrees(found, PRINTED_EIGENVALUE, 0.05)),
        "Largest eigenvalue of the continuous error matrix A - L C of (8) with Table I at "
        f"{setting.example_speed:g} rad/s.",
    )


def symmetric(setting: Setting = PRINTED) -> Finding:
    """P3-ex1-sym."""
    found = symmetric_part(setting, setting.example_speed)
    match = speeds_between(setting, PRINTED_SYMMETRIC - 0.5, PRINTED_SYMMETRIC + 0.5, transformed=False)
    where = None if match is None else 0.5 * (match[0] + match[1])
    rate = None if where is None else float(setting.rolling_rate("longitudinal", where))
    computed = {
        "at_40_rad_per_s": found,
        "relative_difference": found / PRINTED_SYMMETRIC - 1.0,
        "speeds_that_round_to_print_rad_per_s": None if match is None else list(match),
        "kappa_Re_omega_there_per_s": rate,
    }
    reading = (
        f"Table I gives {found:.0f} 1/s at the stated {setting.example_speed:g} rad/s, "
        f"{found / PRINTED_SYMMETRIC - 1:+.1%} from the print. "
        + (
            "No wheel speed gives the print. "
            if where is None
            else f"The print belongs to {where:.2f} rad/s (kappa R_e omega = {rate:.1f} 1/s). "
        )
        + "That the symmetric part is far above zero, so that it proves nothing without a transformation, holds all "
        "the same."
    )
    return Finding(computed, judged(agrees(found, PRINTED_SYMMETRIC, 0.5)), reading)


def transformed(setting: Setting = PRINTED) -> Finding:
    """P3-ex1-T."""
    found = symmetric_part(setting, setting.example_speed, transformed=True)
    match = speeds_between(setting, PRINTED_TRANSFORMED - 0.05, PRINTED_TRANSFORMED + 0.05, transformed=True)
    other = speeds_between(setting, PRINTED_SYMMETRIC - 0.5, PRINTED_SYMMETRIC + 0.5, transformed=False)
    at_other = None if other is None else symmetric_part(setting, 0.5 * (other[0] + other[1]), transformed=True)
    computed = {
        "at_40_rad_per_s": found,
        "at_the_speed_that_gives_108750": at_other,
        "speeds_that_round_to_print_rad_per_s": None if match is None else list(match),
    }
    reading = (
        f"T A_e T^-1 with T = diag({setting.similarity:g}, 1) gives {found:.2f} 1/s at {setting.example_speed:g} "
        "rad/s; "
        + (
            "no wheel speed rounds to the print"
            if match is None
            else f"{match[0]:.2f} to {match[1]:.2f} rad/s round to it"
        )
        + (
            "."
            if at_other is None
            else f", and the speed that fits 108750 gives {at_other:.3f}, which meets it by truncation only."
        )
        + " The point of the example, that T turns a useless bound into a sharp one, holds."
    )
    return Finding(computed, judged(agrees(found, PRINTED_TRANSFORMED, 0.05)), reading)


def best_transform(setting: Setting = PRINTED) -> Finding:
    """P3-ex1-Topt."""
    A_e = setting.error("longitudinal", setting.example_speed)[0]
    found = best_diagonal_transform(A_e)
    b, c = float(A_e[0, 0, 1]), float(A_e[0, 1, 0])
    gamma, growth = float(found.gamma[0]), float(found.growth[0])
    exact = float(stability_margin(A_e)[0])
    holds = b * c > 0.0 and agrees(gamma, float(np.sqrt(c / b)), 1e-9 * gamma) and agrees(growth, exact, 1e-6)
    return Finding(
        {"gamma_star": gamma, "lmax_sym": growth},
        derived(holds),
        "The off-diagonal entries b, c of A_e have one sign, so gamma = sqrt(c/b) makes T A_e T^-1 symmetric and "
        "its largest eigenvalue that of A_e itself: no diagonal T can do better, and none is needed beyond it.",
    )


def young(setting: Setting = PRINTED) -> Finding:
    """P3-prop1-young: the quadratic forms in |e| and |B rho| that (16) needs to be positive semidefinite, exactly."""
    eps = sp.Symbol("epsilon", positive=True)
    half = sp.Rational(1, 2)

    def form(e: sp.Expr, b: sp.Expr) -> sp.Matrix:
        """right - left of e'B rho <= e |e|^2 + b |B rho|^2 in (|e|, |B rho|)."""
        return sp.Matrix([[e, -half], [-half, b]])

    printed, corrected = form(eps / 4, 1 / (4 * eps)), form(eps / 2, 1 / (2 * eps))
    equality = sp.Matrix([1, eps])  # B rho = eps e
    left = eps
    right = {
        name: sp.simplify(left + (equality.T * M * equality)[0])
        for name, M in (("printed", printed), ("corrected", corrected))
    }
    printed_holds = bool(sp.simplify(printed.det()) >= 0)
    corrected_holds = bool(sp.simplify(corrected.det()) == 0) and bool(sp.simplify(corrected.trace()).is_positive)
    A_e, B_e = setting.error("longitudinal", np.arange(HIGHEST_SPEED + 1))
    bound = similarity_bound(A_e, B_e, setting.transform, disturbance=1.0)
    computed = {
        "left_over_epsilon": 1.0,
        "printed_right_over_epsilon": float(right["printed"] / eps),
        "corrected_right_over_epsilon": float(right["corrected"] / eps),
        "determinant_printed": float(sp.simplify(printed.det())),
        "determinant_corrected": float(sp.simplify(corrected.det())),
        "eta1_per_s": bound.eta1,
    }
    return Finding(
        computed,
        erratum(printed_holds, corrected_holds and bound.bounded),
        "With B rho = epsilon e the left side of the printed step is epsilon |e|^2 and the right side half of it. "
        "Young's inequality needs |B rho|^2/(2 epsilon) + epsilon |e|^2/2; then eta_1 = 2 lambda_max + epsilon "
        "stays negative over 0..140 rad/s, and boundedness survives.",
    )


CLAIMS: dict[str, ClaimFunction] = {
    "P3-ex1-eig": eigenvalue,
    "P3-ex1-sym": symmetric,
    "P3-ex1-T": transformed,
    "P3-ex1-Topt": best_transform,
    "P3-prop1-young": young,
}
