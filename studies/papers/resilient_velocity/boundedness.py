"""Example 1 and Proposition 1: eigenvalues of the error matrix, of its symmetric part, and the energy bound (16)."""

from __future__ import annotations

import numpy as np
import sympy as sp

from analysis.norms.hinf import stability_margin
from analysis.switching.similarity import best_diagonal_transform, similarity_bound, symmetric_growth
from studies.claim import Finding, agrees, reproduced
from studies.papers.resilient_velocity.inputs import PACKAGE, PRINTED, SPEEDS, Setting, crossing
from studies.papers.topic import Topic
from studies.papers.verdicts import derived, erratum
from studies.study import PartResult, Scope

TOPIC = Topic(PACKAGE)
HALF_DIGIT = 0.05  # 1/s; the symmetric part is printed without decimals: 0.5


def symmetric_part(setting: Setting, speed: float, transformed: bool = False) -> float:
    """lambda_max((A_e + A_e')/2) in 1/s at one wheel speed, of T A_e T^-1 if `transformed`."""
    A_e = setting.error("longitudinal", speed)[0]
    return float(symmetric_growth(A_e, setting.transform if transformed else None)[0])


def speeds_of_print(setting: Setting, name: str, half_digit: float, transformed: bool = False) -> list[float] | None:
    """The wheel speeds (rad/s) between which the symmetric part rounds to what claim `name` prints; None if it does nowhere.

    It falls with the wheel speed on the whole range, so one root for each end is enough.
    """
    ends = [
        crossing(lambda w: symmetric_part(setting, w, transformed), TOPIC.printed(name) + side)
        for side in (half_digit, -half_digit)
    ]
    found = [end for end in ends if end is not None]
    return found if len(found) == 2 else None


@TOPIC.claim("P3-ex1-eig")
def eigenvalue(setting: Setting = PRINTED) -> Finding:
    """lambda_max(A_e) at the speed of the example."""
    found = float(stability_margin(setting.error("longitudinal", setting.example_speed)[0])[0])
    return Finding(
        found,
        reproduced(agrees(found, TOPIC.printed("P3-ex1-eig"), HALF_DIGIT)),
        f"Largest eigenvalue of the continuous error matrix A - L C of (8) with Table I at {setting.example_speed:g} rad/s.",
    )


@TOPIC.claim("P3-ex1-sym")
def symmetric(setting: Setting = PRINTED) -> Finding:
    """Its symmetric part, and the wheel speed to which the print belongs."""
    found, published = symmetric_part(setting, setting.example_speed), TOPIC.printed("P3-ex1-sym")
    match = speeds_of_print(setting, "P3-ex1-sym", 0.5)
    where = None if match is None else 0.5 * sum(match)
    rate = None if where is None else float(setting.rolling_rate("longitudinal", where))
    computed = {
        "at_40_rad_per_s": found, "relative_difference": found / published - 1.0,
        "speeds_that_round_to_print_rad_per_s": match, "kappa_Re_omega_there_per_s": rate,
    }  # fmt: skip
    reading = (
        f"Table I gives {found:.0f} 1/s at the stated {setting.example_speed:g} rad/s, "
        f"{found / published - 1:+.1%} from the print. "
        + ("No wheel speed gives the print. " if where is None else
           f"The print belongs to {where:.2f} rad/s (kappa R_e omega = {rate:.1f} 1/s). ")
        + "That the symmetric part is far above zero, so that it proves nothing without a transformation, holds all the same."
    )  # fmt: skip
    return Finding(computed, reproduced(agrees(found, published, 0.5)), reading)


@TOPIC.claim("P3-ex1-T")
def transformed(setting: Setting = PRINTED) -> Finding:
    """The symmetric part of T A_e T^-1, here and at the wheel speed that fits the print of the plain one."""
    found = symmetric_part(setting, setting.example_speed, transformed=True)
    match = speeds_of_print(setting, "P3-ex1-T", HALF_DIGIT, transformed=True)
    other = speeds_of_print(setting, "P3-ex1-sym", 0.5)
    at_other = None if other is None else symmetric_part(setting, 0.5 * sum(other), transformed=True)
    computed = {
        "at_40_rad_per_s": found, "at_the_speed_that_gives_108750": at_other,
        "speeds_that_round_to_print_rad_per_s": match,
    }  # fmt: skip
    reading = (
        f"T A_e T^-1 with T = diag({setting.similarity:g}, 1) gives {found:.2f} 1/s at {setting.example_speed:g} rad/s; "
        + ("no wheel speed rounds to the print" if match is None else
           f"{match[0]:.2f} to {match[1]:.2f} rad/s round to it")
        + ("." if at_other is None else
           f", and the speed that fits 108750 gives {at_other:.3f}, which meets it by truncation only.")
        + " The point of the example, that T turns a useless bound into a sharp one, holds."
    )  # fmt: skip
    return Finding(computed, reproduced(agrees(found, TOPIC.printed("P3-ex1-T"), HALF_DIGIT)), reading)


@TOPIC.claim("P3-ex1-Topt")
def best_transform(setting: Setting = PRINTED) -> Finding:
    """gamma = sqrt(c/b) for the off-diagonal entries b, c of A_e."""
    A_e = setting.error("longitudinal", setting.example_speed)[0]
    found, exact = best_diagonal_transform(A_e), float(stability_margin(A_e)[0])
    b, c = float(A_e[0, 0, 1]), float(A_e[0, 1, 0])
    gamma, growth = float(found.gamma[0]), float(found.growth[0])
    holds = b * c > 0.0 and agrees(gamma, float(np.sqrt(c / b)), 1e-9 * gamma) and agrees(growth, exact, 1e-6)
    return Finding(
        {"gamma_star": gamma, "lmax_sym": growth},
        derived(holds),
        "The off-diagonal entries b, c of A_e have one sign, so gamma = sqrt(c/b) makes T A_e T^-1 symmetric and "
        "its largest eigenvalue that of A_e itself: no diagonal T can do better, and none is needed beyond it.",
    )


@TOPIC.claim("P3-prop1-young")
def young(setting: Setting = PRINTED) -> Finding:
    """The quadratic forms in |e| and |B rho| that (16) needs to be positive semidefinite, exactly (P3 notes 4).

    right - left of e'B rho <= p |e|^2 + q |B rho|^2 is the form [[p, -1/2], [-1/2, q]]; B rho = epsilon e makes it tight.
    """
    eps, half = sp.Symbol("epsilon", positive=True), sp.Rational(1, 2)
    tight = sp.Matrix([1, eps])
    forms = [sp.Matrix([[eps / k, -half], [-half, 1 / (k * eps)]]) for k in (4, 2)]  # printed, corrected
    printed, corrected = (sp.simplify(form.det()) for form in forms)
    sides = [float(sp.simplify((eps + (tight.T * form * tight)[0]) / eps)) for form in forms]
    bound = similarity_bound(*setting.error("longitudinal", SPEEDS), setting.transform, disturbance=1.0)
    corrected_holds = corrected == 0 and sp.simplify(forms[1].trace()).is_positive and bound.bounded
    computed = {
        "left_over_epsilon": 1.0, "printed_right_over_epsilon": sides[0], "corrected_right_over_epsilon": sides[1],
        "determinant_printed": float(printed), "determinant_corrected": float(corrected), "eta1_per_s": bound.eta1,
    }  # fmt: skip
    return Finding(
        computed,
        erratum(bool(printed >= 0), bool(corrected_holds)),
        "With B rho = epsilon e the left side of the printed step is epsilon |e|^2 and the right side half of it. "
        "Young's inequality needs |B rho|^2/(2 epsilon) + epsilon |e|^2/2; then eta_1 = 2 lambda_max + epsilon "
        "stays negative over 0..140 rad/s, and boundedness survives.",
    )


@TOPIC.part("example-1", "Example 1 and the boundedness proof", 0.6)
def example_1(_: Scope) -> PartResult:
    """Example 1 and Proposition 1."""
    return PartResult(TOPIC.found())
