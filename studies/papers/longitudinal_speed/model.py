"""P2-19M, P2-kappa, P2-Re: the model as it is written down, the patch constant, and the radius."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy as sp
from pint import UnitRegistry

from studies.claim import Finding, reproduced
from studies.papers.longitudinal_speed.inputs import parameters, speed_model, topic
from studies.papers.verdicts import erratum

TOPIC = topic()


@TOPIC.claim("P2-19M")
def descriptor_form(M: tuple[tuple[int, ...], ...] = ((1, 0, 0), (0, 1, 0), (0, -1, 1))) -> Finding:
    """M^-1 times (19) against the model, and its third row against d/dt of the first."""
    model = speed_model()
    inverse = sp.Matrix(M).inv()
    B, A = inverse * sp.Matrix([0, 1, 0]), inverse * model.A
    t = sp.Symbol("t")
    z, v, speed = (sp.Function(name)(t) for name in ("z", "v", "w"))
    rate = sp.Symbol("kappa") * sp.Symbol("effective_radius")
    third = (A * sp.Matrix([z, v, z.diff(t)]) + B * v.diff(t))[2]
    third = third.subs({"wheel_speed": speed, "wheel_acceleration": speed.diff(t)})
    mismatch = sp.simplify((v - rate * speed * z).diff(t) - third)
    computed = {"B": [*map(int, B)], "third_row_of_A": [*map(str, A.row(2))],
                "third_row_minus_derivative_of_the_first": str(mismatch)}  # fmt: skip
    same = sp.Matrix(model.A) == A and sp.Matrix(model.B) == B
    reading = (
        f"M^-1 gives B = {computed['B']}' and {'leaves' if same else 'does not leave'} A as it is; the third row is z'' = V_r' "
        f"- kappa R_e w' z - kappa R_e w z', which differs from d/dt of the bristle equation by {mismatch} (friction left out)."
    )
    return Finding(computed, reproduced(mismatch == 0 and same), reading)


@TOPIC.claim("P2-kappa")
def patch_constant(printed: str = "7/6 L") -> Finding:
    """Unit of kappa as the bristle equation needs it, and the patch length that kappa = 8 1/m means in each form."""
    unit: Any = UnitRegistry()
    patch = unit.Quantity(1.0, "m")
    others = patch * unit.Quantity(1.0, "rad/s") * patch  # R_e, omega, z
    forms = {"7/6 L": 7.0 / 6.0 * patch, "7/(6 L)": 7.0 / 6.0 / patch}
    fits = {name: bool((value * others).is_compatible_with("m/s")) for name, value in forms.items()}
    kappa = Fraction(str(parameters().tire["longitudinal"].kappa.value))
    lengths = {"7/6 L": kappa * Fraction(6, 7), "7/(6 L)": Fraction(7, 6) / kappa}
    right = lengths["7/(6 L)"]
    metres = {name: float(length) for name, length in lengths.items()}
    computed = {"kappa_1_m": float(kappa), "unit_fits": fits, "patch_length_m": metres}
    reading = (
        f"kappa R_e |omega| z must be a velocity, so kappa is in 1/m: 7/(6 L) fits and gives a patch of L = {right} m = "
        f"{float(right):.4f} m for kappa = {float(kappa):g} 1/m; 7/6 L has the unit of a length and would mean "
        f"{metres['7/6 L']:.2f} m."
    )
    plausible = 0.05 < right < 0.3  # m, contact patches of car tires
    return Finding(computed, erratum(fits[printed], fits["7/(6 L)"] and plausible), reading)


@TOPIC.claim("P2-Re")
def effective_radius(printed: dict[str, float] | None = None) -> Finding:
    """Both printed radii, and the one of the sister paper's Table I."""
    values = TOPIC.printed("P2-Re") if printed is None else printed
    sister = parameters("corner-estimation").vehicle["effective_radius"].value
    share = values["text"] / values["table"] - 1.0
    computed = {**values, "table_of_P1": sister, "difference_percent": 100.0 * share}
    reading = (
        f"Table I has {values['table']:g} m, the text {values['text']:g} m: {100 * share:.1f} % apart, and as much in every "
        f"wheel speed times radius. Table I of P1, the same car, has {sister:g} m. Here the tire constants of section IV go "
        "with the text's radius."
    )
    return Finding(computed, erratum(values["table"] == values["text"], values["table"] == sister), reading)


TOPIC.show("model", "Model, patch constant and radius")
