"""P1-loads: do the load formulas balance the car, and where do their signs contradict the rest of the paper?"""

from __future__ import annotations

import numpy as np

from analysis.loads import vertical_loads
from studies.claim import Finding, reproduced
from studies.papers.corner_estimation.inputs import PRINTED_GRAVITY, parameters, topic
from studies.plots import DASHES, ZERO, Figure, Line, Panel, colours
from studies.study import PartResult, Scope, Table
from synthesis.models.parameter_set import ParameterSet

TOPIC = topic()
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
TOLERANCE = 1e-4  # N
MOTIONS = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))  # at rest, driving, turning: a_x and a_y in m/s^2
BANK = np.deg2rad(3.0)  # a roll angle of everyday cornering


def residuals(assumed: ParameterSet, true: ParameterSet) -> dict[str, float]:
    """Newton's laws for the level car `true` against (15), (17) with the constants `assumed`: largest over many motions.

    Forces up and moments about the axes through the road:
    F_zf + F_zr = m a_z,  L_f F_zf - L_r F_zr = -m h a_x,  (F_R - F_L) T_i/2 = m_i h a_y with m_i = F_zi / g.
    """
    size = {name: entry.value for name, entry in true.vehicle.items()}
    accelerations = np.linspace(-8, 8, 9), np.linspace(-8, 8, 9), [8.0, PRINTED_GRAVITY, 11.0]
    ax, ay, az = (g.ravel() for g in np.meshgrid(*accelerations))
    found = vertical_loads(assumed, ax, ay, az, gravity=PRINTED_GRAVITY)
    mass, height = size["mass"], size["cg_height"]
    vertical = found.front + found.rear - mass * az
    pitch = size["front_axle_distance"] * found.front - size["rear_axle_distance"] * found.rear + mass * height * ax
    roll = []
    for axle in ("front", "rear"):
        whole, left, right = (getattr(found, axle + side) for side in ("", "_left", "_right"))
        moment = whole / PRINTED_GRAVITY * height * ay
        roll.append(np.abs((right - left) * size[f"{axle}_track"] / 2.0 - moment).max())
    largest = {"vertical_N": np.abs(vertical).max(), "pitch_Nm": np.abs(pitch).max(), "roll_Nm": max(roll)}
    return {name: float(value) for name, value in largest.items()}


def sign_conflict(vehicle: ParameterSet) -> dict[str, float]:
    """A car at rest on a bank of 3 degrees: (11) says that it reads a_y = +g sin(phi); (16) must give zero, in m/s^2."""
    y, z = PRINTED_GRAVITY * np.sin(BANK), PRINTED_GRAVITY * np.cos(BANK)
    angles = {"printed": BANK, "angles_reversed": -BANK}
    across = {side: float(y * np.cos(angle) + z * np.sin(angle)) for side, angle in angles.items()}
    height, roll_center = (vehicle.vehicle[name].value for name in ("cg_height", "roll_center_height"))
    return {**across, "lever_printed_m": roll_center, "lever_of_the_lateral_shift_m": height - roll_center}


@TOPIC.claim("P1-loads")
def load_formulas(assumed: ParameterSet | None = None) -> Finding:
    """Static loads, transfer per unit of acceleration, balances of the level car, and the sign of (14), (16)."""
    car = parameters() if assumed is None else assumed
    rest, driving, turning = (vertical_loads(car, *a, gravity=PRINTED_GRAVITY) for a in MOTIONS)
    residual, conflict = residuals(car, parameters()), sign_conflict(car)
    static = {name: float(getattr(rest, name)) for name in ("front", "rear", *WHEELS)}
    along = {name: float(getattr(driving, name) - getattr(rest, name)) for name in ("front", "rear")}
    across = {name: float(getattr(turning, name)) - static[name] for name in WHEELS}
    computed = {"static_N": static, "per_unit_a_x_N": along, "per_unit_a_y_N": across, "largest_residual": residual,
                "at_rest_on_3_deg_bank": conflict}  # fmt: skip
    worst = max(residual.values())
    reading = (
        f"Level car: static axle loads {float(rest.front):.1f} and {float(rest.rear):.1f} N, "
        f"{float(driving.rear - rest.rear):.2f} N moved per m/s^2 of a_x, {computed['per_unit_a_y_N']['front_right']:.2f} "
        f"and {computed['per_unit_a_y_N']['rear_right']:.2f} N per side and m/s^2 of a_y; forces and moments balance to "
        f"{worst:.1e}. With body angles (14), (16) contradict (11): at rest on a bank of 3 degrees they give "
        f"{conflict['printed']:.2f} instead of {abs(conflict['angles_reversed']):.0f} m/s^2 across. (17) takes h_rc as "
        f"lever of the lateral shift, where the roll arm is {conflict['lever_of_the_lateral_shift_m']:.2f} m."
    )
    return Finding(computed, reproduced(worst <= TOLERANCE), reading)


@TOPIC.part("loads", "Vertical loads")
def loads(scope: Scope) -> PartResult:
    """Static loads of the corners and their transfer per unit of acceleration."""
    claims = TOPIC.found()
    static, along, across = list(claims[0].finding.computed.values())[:3]
    wheels = {name: name.partition("_") for name in WHEELS}
    rows = [[f"{axle} {side}", static[n], along[axle] / 2.0, across[n]] for n, (axle, _, side) in wheels.items()]
    columns = ["corner", "static load [N]", "per m/s^2 of a_x [N]", "per m/s^2 of a_y [N]"]
    caption = "Corner loads of the level car of Table I by (15), (17), g = 9.81 m/s^2."
    acceleration, panels = np.linspace(-9.0, 9.0, 73), []
    for (ax, ay), axis, title in zip(MOTIONS[1:], "ₓᵧ", ("longitudinal", "lateral"), strict=True):
        found = vertical_loads(parameters(), ax * acceleration, ay * acceleration, gravity=PRINTED_GRAVITY)
        lines = [
            Line(acceleration, getattr(found, name) / 1e3, name.replace("_", " "), colour, dash)
            for name, colour, dash in zip(WHEELS, colours.CURVES, DASHES, strict=False)
        ]
        panels.append(Panel([ZERO, *lines], f"a{axis} [m/s²]", "vertical load [kN]", f"{title} acceleration"))
    figure = Figure(
        "vertical-loads",
        "Vertical load of each corner over one acceleration at a time, level car of Table I, no body angles. Left "
        "lines lie on right ones for longitudinal acceleration. Below zero the formulas no longer apply: the wheel "
        "has lifted. P1 (15), (17).",
        "Loads change linearly: 518 newtons per axle and metre per second squared longitudinally, 457 and 471 per "
        "side laterally.",
        panels, legend="below", share_y="all",
    )  # fmt: skip
    return PartResult(claims, [Table("vertical-loads", caption, columns, rows)], [figure])
