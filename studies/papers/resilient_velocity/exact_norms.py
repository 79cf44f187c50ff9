"""The static gain of the error dynamics in exact numbers: where the norm of Fig. 2 crosses 1."""

from __future__ import annotations

import sympy as sp

from studies.papers.resilient_velocity.setting import DISTURBANCES, HIGHEST_SPEED, Setting
from synthesis.models.catalogue.corner import Direction

SPEED = sp.Symbol("wheel_speed", real=True)


def exact(value: float) -> sp.Rational:
    """A printed decimal as a rational number: 0.0016 is 1/625."""
    return sp.Rational(str(value))


def static_gain_matrix(setting: Setting, direction: Direction) -> sp.Matrix:
    """-A_e^-1 B_e (2, 2) of (8), (13) with Table I as exact decimals, rational in the wheel speed."""
    model = setting.models[direction]
    numbers = {sp.Symbol(name): exact(c.value) for name, c in model.constants.items()}
    A, C, E, F = (sp.Matrix(getattr(model, key)).subs(numbers) for key in "ACEF")
    L = sp.Matrix([exact(g) for g in setting.gains[direction]])
    columns = [[s.name for s in model.disturbances].index(name) for name in DISTURBANCES]
    A_e, B_e = A - L * C, (E - L * F)[:, columns]
    return (-A_e.LUsolve(B_e)).applyfunc(sp.cancel).subs(sp.Symbol("wheel_speed"), SPEED)


def norm_crosses_one(setting: Setting, direction: Direction) -> list[float]:
    """Wheel speeds inside 0..140 rad/s at which a singular value of the static gain is exactly 1.

    They are the roots of det(I - S'S), isolated exactly; the numbers are rounded at the end only.
    """
    S = static_gain_matrix(setting, direction)
    condition = sp.together((sp.eye(2) - S.T * S).det())
    polynomial = sp.Poly(sp.numer(sp.cancel(condition)), SPEED)
    return sorted({float(root) for root in sp.real_roots(polynomial) if 0 < root < HIGHEST_SPEED})
