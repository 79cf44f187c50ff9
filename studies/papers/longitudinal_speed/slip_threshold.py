"""P2-29: the adaptive slip threshold, as printed and corrected."""

from __future__ import annotations

import numpy as np
import sympy as sp

from estimators.velocity.high_slip import adaptive_threshold
from studies.claim import Finding
from studies.papers.longitudinal_speed.inputs import topic
from studies.papers.verdicts import erratum
from studies.plots import Axis, Figure, Level, Line, Panel, Words, colours
from studies.study import PartResult, Scope

TOPIC = topic()
LIMITS = sp.Rational(1, 20), sp.Rational(1, 5)  # lambda_l, lambda_u of the example; none are printed
LOWER, UPPER = map(float, LIMITS)
STEEPNESS = 100.0  # beta_e in s^4/m^2, not printed either
VARIANCE, RATE = sp.symbols("sigma_e beta_e", positive=True)
ROOT = sp.sqrt(2 * sp.pi)
PRINTED_WIDTH = (LIMITS[1] - LIMITS[0]) / ROOT  # phi_e
# The reciprocal: the factor before the exponential is lambda_u - lambda_l.
CORRECTED_WIDTH = 1 / (ROOT * (LIMITS[1] - LIMITS[0]))


def threshold(width: sp.Expr) -> sp.Expr:
    """(29) for a given phi_e, in the variance sigma_e and the rate beta_e."""
    return LIMITS[1] - sp.exp(-RATE * VARIANCE / (2 * width**2)) / (width * ROOT)


def limits(width: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """The threshold without excitation and with strong excitation."""
    return sp.simplify(threshold(width).subs(VARIANCE, 0)), sp.limit(threshold(width), VARIANCE, sp.oo)


@TOPIC.claim("P2-29")
def slip_threshold(width: sp.Expr = PRINTED_WIDTH) -> Finding:
    """Both limits of (29) for lambda_l = 0.05, lambda_u = 0.2, and the runtime's own threshold."""
    printed, right = limits(width), limits(CORRECTED_WIDTH)
    (low, high), corrected = map(float, printed), [*map(float, right)]
    runtime = [float(adaptive_threshold(v, LOWER, UPPER, STEEPNESS)) for v in (0.0, 1e9)]
    found = {"printed": [low, high], "corrected": corrected, "runtime": runtime}
    computed = {"lambda_l": LOWER, "lambda_u": UPPER, **found}
    reading = (
        f"With phi_e as printed the threshold is lambda_u - 1/(lambda_u - lambda_l) = {low:.4f} without excitation, for "
        f"lambda_l = {LOWER:g}, lambda_u = {UPPER:g}: every slip would count as high. With its reciprocal it is exactly "
        f"{corrected[0]:g} and rises to {corrected[1]:g}. sigma_e must be a variance and beta_e carry its unit."
        if width == PRINTED_WIDTH
        else f"With this phi_e the threshold runs from {low:.4g} to {high:.4g}."
    )
    runtime_holds = abs(runtime[0] - LOWER) < 1e-12 and abs(runtime[1] - UPPER) < 1e-12
    return Finding(computed, erratum(printed == LIMITS, right == LIMITS and runtime_holds), reading)


@TOPIC.part("high-slip", "Adaptive slip threshold")
def high_slip(scope: Scope) -> PartResult:
    """The threshold (29) over the variance of the acceleration, as printed and corrected."""
    variance, fine = np.linspace(0.0, 1.5, 301), np.linspace(0.0, 5e-3, 301)
    function = sp.lambdify(VARIANCE, threshold(PRINTED_WIDTH).subs(RATE, STEEPNESS), "numpy")
    lower, upper = (Level(y=y, color=colours.GREY, dash="dotted", width=1.0) for y in (LOWER, UPPER))
    names = [Words(1.45, y, name, offset=(0, 3)) for y, name in ((LOWER, "λl"), (UPPER, "λu"))]
    curve = Line(variance, adaptive_threshold(variance, LOWER, UPPER, STEEPNESS), color=colours.BLUE)
    wrong = Line(fine, function(fine), color=colours.RED, dash="dashed")
    x, y = "variance of |a| [m²/s⁴]", "slip threshold [1]"
    corrected = Panel([curve, lower, upper, *names], x, Axis(y, 0.0, 0.25), "φe = 1/(√(2π) (λu − λl))")
    figure = Figure(
        "slip-threshold",
        f"Threshold (29) of the high-slip detector over the variance of the measured acceleration, λl = {LOWER:g}, λu = "
        f"{UPPER:g}, βe = {STEEPNESS:g} s⁴/m² (the paper prints no values). Corrected it rises from λl to λu; as printed it "
        "starts at −6.47, so that any slip counts as high.",
        "Left: a curve from 0.05 to 0.2. Right: a curve that starts at minus 6.5.",
        [corrected, Panel([wrong, lower], x, y, "φe as printed (finer axis)")], (7.2, 3.2),
    )  # fmt: skip
    return PartResult(TOPIC.found(), figures=[figure])
