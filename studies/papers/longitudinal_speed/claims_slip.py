"""P2-29: the adaptive slip threshold, as printed and corrected."""

from __future__ import annotations

import sympy as sp

from estimators.velocity.high_slip import adaptive_threshold
from studies.claim import ClaimFunction, Finding
from studies.papers.verdicts import erratum

LOWER, UPPER = sp.Rational(1, 20), sp.Rational(1, 5)  # lambda_l, lambda_u of the example; none are printed
VARIANCE, RATE = sp.symbols("sigma_e beta_e", positive=True)


def printed_width(low: sp.Expr, high: sp.Expr) -> sp.Expr:
    """phi_e as printed."""
    return (high - low) / sp.sqrt(2 * sp.pi)


def corrected_width(low: sp.Expr, high: sp.Expr) -> sp.Expr:
    """phi_e as the reciprocal, so that the factor before the exponential is lambda_u - lambda_l."""
    return 1 / (sp.sqrt(2 * sp.pi) * (high - low))


def threshold(width: sp.Expr, high: sp.Expr) -> sp.Expr:
    """(29) for a given phi_e, in the variance sigma_e and the rate beta_e."""
    return high - sp.exp(-RATE * VARIANCE / (2 * width**2)) / (width * sp.sqrt(2 * sp.pi))


def limits(width: sp.Expr, high: sp.Expr = UPPER) -> tuple[sp.Expr, sp.Expr]:
    """The threshold without excitation and with strong excitation."""
    expression = threshold(width, high)
    return sp.simplify(expression.subs(VARIANCE, 0)), sp.limit(expression, VARIANCE, sp.oo)


def slip_threshold(printed: sp.Expr | None = None) -> Finding:
    """Both limits of (29) for lambda_l = 0.05, lambda_u = 0.2, and the runtime's own threshold."""
    width = printed_width(LOWER, UPPER) if printed is None else printed
    low, high = limits(width)
    right = limits(corrected_width(LOWER, UPPER))
    runtime = [float(adaptive_threshold(v, float(LOWER), float(UPPER), 100.0)) for v in (0.0, 1e9)]
    computed = {
        "lambda_l": float(LOWER), "lambda_u": float(UPPER),
        "printed": [float(low), float(high)], "corrected": [float(right[0]), float(right[1])], "runtime": runtime,
    }  # fmt: skip
    reading = (
        f"With phi_e as printed the threshold is lambda_u - 1/(lambda_u - lambda_l) = {float(low):.4f} without "
        f"excitation, for lambda_l = {float(LOWER):g}, lambda_u = {float(UPPER):g}: every slip would count as high. "
        f"With its reciprocal it is exactly {float(right[0]):g} and rises to {float(right[1]):g}. sigma_e must be a "
        "variance and beta_e carry its unit."
        if printed is None
        else f"With this phi_e the threshold runs from {float(low):.4g} to {float(high):.4g}."
    )
    holds = (low, high) == (LOWER, UPPER)
    runtime_holds = abs(runtime[0] - float(LOWER)) < 1e-12 and abs(runtime[1] - float(UPPER)) < 1e-12
    return Finding(computed, erratum(holds, right == (LOWER, UPPER) and runtime_holds), reading)


CLAIMS: dict[str, ClaimFunction] = {"P2-29": slip_threshold}
