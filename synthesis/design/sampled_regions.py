r"""Regions of the poles z of an update for designs in discrete time, each a disc (Peaucelle et al. 2000, with a slack matrix).

A disc |z - w| < R of a complex w is asked for with its mirror image: with N = G A - w G over the slack G of the design

    [R P, N*; N, R (G + G* - P)] > 0        every frozen pole within both; w = q + j v is written as [q, -v; v, q]

each with a P of its own, which owes nothing to the rates. With T the sample time, of poles s = ln(z)/T

    disc about q          |z - q| < r, as it stands
    vertical strip (a, b) exp(-b T) < |z| < exp(-a T) exactly. What is outside the inner circle is not
                          convex, so the design keeps to a disc of `WIDE` times the width 1 - exp(-b T), right of exp(-b T)
    horizontal strip w    |arg z| < w T < pi/2 exactly; the design keeps to two discs of radius `WIDE`/sin(w T) that have the
                          sides as tangents in zero: of angles up to 5 % less at |z| = 1

The claims of the deployed table are about the exact regions (`synthesis.certificate.poles`). What is no region here: the image
of a disc about s = 0 and of a damping sector, whose border is a logarithmic spiral.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from synthesis.design.pole_regions import PoleRegions
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block

WIDE = 10.0  # radius of a disc that stands for a half plane, over the size of what it is to hold

Discs = dict[str, tuple[complex, float]]
Over = Callable[[MatrixPolynomial], MatrixPolynomial]


def sampled_discs(regions: PoleRegions, period: float, reserve: float = 0.0) -> Discs:
    """Centre (with the imaginary part that its mirror image has, too) and radius of every disc, tighter by `reserve`.

    Raises ProblemError for regions of continuous time that are none here, and a horizontal strip that is too wide for samples.
    """
    regions.refuse_for("discrete")
    found: Discs = {}
    if regions.sampled_disc is not None:
        found["disc of z"] = complex(regions.sampled_disc[0]), regions.sampled_disc[1] / (1.0 + reserve)
    if regions.vertical_strip is not None:
        near, far = regions.vertical_strip
        inner = float(np.exp(-far * period / (1.0 + reserve)))
        found["vertical strip, slow side"] = 0j, float(np.exp(-near * (1.0 + reserve) * period))
        found["vertical strip, fast side"] = complex(inner + WIDE * (1.0 - inner)), WIDE * (1.0 - inner)
    if regions.horizontal_strip is not None:
        angle = regions.horizontal_strip * period
        if not angle < 0.5 * np.pi:
            raise ProblemError(
                f"regions: horizontal_strip {regions.horizontal_strip:g} rad/s is too wide for samples of {period:g} s; give "
                f"less than pi/2 over the sample time, {0.5 * np.pi / period:.6g} rad/s, or leave it out"
            )
        angle /= 1.0 + reserve
        radius = WIDE / float(np.sin(angle))
        found["horizontal strip"] = radius * complex(np.exp(1j * (angle - 0.5 * np.pi))), radius
    return found


def require_discs(
    problem: LmiProblem, discs: Discs, degree: int, closed: MatrixPolynomial, slack: MatrixPolynomial, over: Over
) -> None:
    """All poles of A in all of them, from `closed` = A G (or its transpose) and `slack` = G (or G'), of one size.

    `over` multiplies by what `closed` is over.
    """
    sums = slack + slack.T
    for name, (centre, radius) in discs.items():
        P = problem.symmetric(f"P of {name}{problem.suffix}", slack.shape[0], degree)
        moved = (closed - over(slack) * centre.real) * (1.0 / radius)
        across = over(slack) * (centre.imag / radius)
        before, after = over(P), over(sums - P)
        if not centre.imag:
            problem.require(name, symmetric_block([[before, moved], [None, after]]))
            continue
        rows: list[list[MatrixPolynomial | None]] = [
            [before, None, moved, across],
            [None, before, -across, moved],
            [None, None, after, None],
            [None, None, None, after],
        ]
        problem.require(name, symmetric_block(rows))
