"""P2-29: the adaptive slip threshold, as printed and corrected."""

from __future__ import annotations

import numpy as np
import sympy as sp

from estimators.velocity.high_slip import adaptive_threshold
from studies.claim import Finding
from studies.papers.longitudinal_speed.inputs import topic
from studies.papers.verdicts import erratum
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Words, colours
from studies.study import PartResult, Scope

TOPIC = topic()
LOWER, UPPER = sp.Rational(1, 20), sp.Rational(1, 5)  # lambda_l, lambda_u of the example; none are printed
VARIANCE, RATE = sp.symbols("sigma_e beta_e", positive=True)
ROOT = sp.sqrt(2 * sp.pi)
PRINTED_WIDTH = (UPPER - LOWER) / ROOT  # phi_e
# The reciprocal: the factor before the exponential is lambda_u - lambda_l.
CORRECTED_WIDTH = 1 / (ROOT * (UPPER - LOWER))


def threshold(width: sp.Expr) -> sp.Expr:
    """(29) for a given phi_e, in the variance sigma_e and the rate beta_e."""
    return UPPER - sp.exp(-RATE * VARIANCE / (2 * width**2)) / (width * ROOT)


def limits(width: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """The threshold without excitation and with strong excitation."""
    return sp.simplify(threshold(width).subs(VARIANCE, 0)), sp.limit(threshold(width), VARIANCE, sp.oo)


@TOPIC.claim("P2-29")
def slip_threshold(printed: sp.Expr | None = None) -> Finding:
    """Both limits of (29) for lambda_l = 0.05, lambda_u = 0.2, and the runtime's own threshold."""
    width = PRINTED_WIDTH if printed is None else printed
    low, high = limits(width)
    right = limits(CORRECTED_WIDTH)
    runtime = [float(adaptive_threshold(v, float(LOWER), float(UPPER), 100.0)) for v in (0.0, 1e9)]
    computed = {
        "lambda_l": float(LOWER), "lambda_u": float(UPPER),
        "printed": [float(low), float(high)], "corrected": [float(right[0]), float(right[1])], "runtime": runtime,
    }  # fmt: skip
    reading = (
        f"With phi_e as printed the threshold is lambda_u - 1/(lambda_u - lambda_l) = {float(low):.4f} without excitation, "
        f"for lambda_l = {float(LOWER):g}, lambda_u = {float(UPPER):g}: every slip would count as high. With its reciprocal "
        f"it is exactly {float(right[0]):g} and rises to {float(right[1]):g}. sigma_e must be a variance and beta_e carry its "
        "unit."
        if printed is None
        else f"With this phi_e the threshold runs from {float(low):.4g} to {float(high):.4g}."
    )
    holds = (low, high) == (LOWER, UPPER)
    runtime_holds = abs(runtime[0] - float(LOWER)) < 1e-12 and abs(runtime[1] - float(UPPER)) < 1e-12
    return Finding(computed, erratum(holds, right == (LOWER, UPPER) and runtime_holds), reading)


@TOPIC.part("high-slip", "Adaptive slip threshold")
def high_slip(scope: Scope) -> PartResult:
    """The adaptive slip threshold."""
    return PartResult(TOPIC.found(), figures=[threshold_figure()])


def threshold_figure() -> Figure:
    """(29) over the variance of the acceleration, as printed and corrected."""
    rate, low, high = 100.0, float(LOWER), float(UPPER)
    variance, fine = np.linspace(0.0, 1.5, 301), np.linspace(0.0, 5e-3, 301)
    function = sp.lambdify(VARIANCE, threshold(PRINTED_WIDTH).subs(RATE, rate), "numpy")
    lower, upper = (Level(y=y, color=colours.GREY, dash="dotted", width=1.0) for y in (low, high))
    names = [Words(1.45, y, name, offset=(0, 3)) for y, name in ((low, "λl"), (high, "λu"))]
    left: list[Mark] = [
        Line(variance, adaptive_threshold(variance, low, high, rate), color=colours.BLUE),
        lower,
        upper,
        *names,
    ]
    right: list[Mark] = [Line(fine, function(fine), color=colours.RED, dash="dashed"), lower]
    x, y = "variance of |a| [m²/s⁴]", "slip threshold [1]"
    panels = [
        Panel(left, x, Axis(y, 0.0, 0.25), "φe = 1/(√(2π) (λu − λl))"),
        Panel(right, x, y, "φe as printed (finer axis)"),
    ]
    return Figure(
        "slip-threshold",
        f"Threshold (29) of the high-slip detector over the variance of the measured acceleration, λl = {low:g}, λu = "
        f"{high:g}, βe = {rate:g} s⁴/m² (the paper prints no values). Corrected it rises from λl to λu; as printed it starts "
        "at −6.47, so that any slip counts as high.",
        "Left: a curve from 0.05 to 0.2. Right: a curve that starts at minus 6.5.",
        panels, (7.2, 3.2),
    )  # fmt: skip
