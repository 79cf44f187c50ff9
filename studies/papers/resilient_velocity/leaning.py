"""A car that stands still and leans, in exact statics: what the wheels carry, what (26), (27) say, and what they should say.

The body rolls by r about a line at the height h_rc of the roll centre, left side up (r > 0 in the frame x forward, y left, z up);
the mass m_i of an axle then stands (h - h_rc) sin r to the right of the middle. Its accelerometers read g sin r along y and
g cos r along z.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

ROLL, PITCH, GRAVITY, AXLE_MASS, HEIGHT, ROLL_HEIGHT, TRACK = sp.symbols("r p g m_i h h_rc T", positive=True)


@dataclass(frozen=True)
class LoadFormula:
    """(27) with the sign of the normal acceleration in the levelling of a_y, a_n, and the arm of the sideways shift."""

    levelling: int  # +1: a_y cos r + a_n sin r as printed; -1: what levels the body
    arm: sp.Expr

    def across(self, lateral: sp.Expr, normal: sp.Expr) -> sp.Expr:
        """a_phi_y for readings of the inertial unit."""
        return lateral * sp.cos(ROLL) + self.levelling * normal * sp.sin(ROLL)

    def upright(self, lateral: sp.Expr, normal: sp.Expr) -> sp.Expr:
        """a_phi_n."""
        return normal * sp.cos(ROLL) - self.levelling * lateral * sp.sin(ROLL)

    def wheels(self, lateral: sp.Expr, normal: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """F_z of the left and the right wheel of an axle."""
        y, n = self.across(lateral, normal), self.upright(lateral, normal)
        shift = self.arm * sp.sin(ROLL)
        left = AXLE_MASS / TRACK * (n * (TRACK / 2 - shift) - y * HEIGHT)
        right = AXLE_MASS / TRACK * (n * (TRACK / 2 + shift) + y * HEIGHT)
        return left, right


AS_PRINTED = LoadFormula(1, ROLL_HEIGHT)
CORRECTED = LoadFormula(-1, HEIGHT - ROLL_HEIGHT)
AT_REST = (GRAVITY * sp.sin(ROLL), GRAVITY * sp.cos(ROLL))


def true_wheels() -> tuple[sp.Expr, sp.Expr]:
    """Loads from the balance of forces and of moments about the middle of the track."""
    left, right = sp.symbols("F_L F_R")
    offset = (HEIGHT - ROLL_HEIGHT) * sp.sin(ROLL)  # of the weight, to the right
    solved = sp.solve(
        [left + right - AXLE_MASS * GRAVITY, (right - left) * TRACK / 2 - AXLE_MASS * GRAVITY * offset], [left, right]
    )
    return solved[left], solved[right]


def reduced(expression: sp.Expr, angle: sp.Symbol = ROLL) -> sp.Expr:
    """A polynomial in sine and cosine with every square of the cosine replaced: zero if and only if it vanishes identically."""
    sine, cosine = sp.symbols("s c")
    polynomial = sp.expand(expression.subs({sp.sin(angle): sine, sp.cos(angle): cosine}))
    rest = sp.rem(polynomial, cosine**2 + sine**2 - 1, cosine)
    return sp.expand(rest).subs({sine: sp.sin(angle), cosine: sp.cos(angle)})


def residual(formula: LoadFormula) -> tuple[sp.Expr, ...]:
    """What the formula is off by at rest: (lateral acceleration, left load, right load); zeros if it is right."""
    wheels = zip(formula.wheels(*AT_REST), true_wheels(), strict=True)
    return tuple(reduced(e) for e in (formula.across(*AT_REST), *(found - true for found, true in wheels)))


def axle_sum(formula: LoadFormula) -> sp.Expr:
    """F_L + F_R - m_i a_phi_n for any readings: zero if the axle load is conserved."""
    lateral, normal = sp.symbols("a_y a_n")
    return reduced(sum(formula.wheels(lateral, normal)) - AXLE_MASS * formula.upright(lateral, normal))


def pitched_car() -> sp.Expr:
    """a_theta_x of (26) at rest on a level road, nose down by p: readings -g sin p and g cos p; zero if (26) levels the body."""
    along, normal = -GRAVITY * sp.sin(PITCH), GRAVITY * sp.cos(PITCH)
    return reduced(along * sp.cos(PITCH) + normal * sp.sin(PITCH), PITCH)
