"""P1-loads: do the load formulas balance the car, and where do their signs contradict the rest of the paper?"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from analysis.loads import Loads, vertical_loads
from studies.claim import Finding, reproduced
from studies.papers.corner_estimation.inputs import PACKAGE, PRINTED_GRAVITY, parameters
from studies.papers.topic import Topic
from studies.plots import DASHES, ZERO, Figure, Line, Panel
from studies.plots.colours import CURVES
from studies.study import PartResult, Scope, Table
from synthesis.models.parameter_set import ParameterSet

TOPIC = Topic(PACKAGE)
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
    roll = [
        (right - left) * size[track] / 2.0 - axle / PRINTED_GRAVITY * height * ay
        for axle, left, right, track in (
            (found.front, found.front_left, found.front_right, "front_track"),
            (found.rear, found.rear_left, found.rear_right, "rear_track"),
        )
    ]
    left: dict[str, ArrayLike] = {"vertical_N": vertical, "pitch_Nm": pitch, "roll_Nm": roll}
    return {name: float(np.abs(residual).max()) for name, residual in left.items()}


def sign_conflict(vehicle: ParameterSet) -> dict[str, float]:
    """A car at rest on a bank of 3 degrees: (11) says that it reads a_y = +g sin(phi); (16) must give zero, in m/s^2."""
    across = {side: float(PRINTED_GRAVITY * np.sin(BANK) * np.cos(angle) + PRINTED_GRAVITY * np.cos(BANK) * np.sin(angle))
              for side, angle in (("printed", BANK), ("angles_reversed", -BANK))}  # fmt: skip
    height, roll_center = (vehicle.vehicle[name].value for name in ("cg_height", "roll_center_height"))
    return {**across, "lever_printed_m": roll_center, "lever_of_the_lateral_shift_m": height - roll_center}


@TOPIC.claim("P1-loads")
def load_formulas(assumed: ParameterSet | None = None) -> Finding:
    """Static loads, transfer per unit of acceleration, balances of the level car, and the sign of (14), (16)."""
    car = parameters() if assumed is None else assumed
    rest, driving, turning = (vertical_loads(car, *a, gravity=PRINTED_GRAVITY) for a in MOTIONS)
    residual, conflict = residuals(car, parameters()), sign_conflict(car)
    computed = {
        "static_N": {"front": float(rest.front), "rear": float(rest.rear), **_corners(rest)},
        "per_unit_a_x_N": {"front": float(driving.front - rest.front), "rear": float(driving.rear - rest.rear)},
        "per_unit_a_y_N": {name: value - _corners(rest)[name] for name, value in _corners(turning).items()},
        "largest_residual": residual, "at_rest_on_3_deg_bank": conflict,
    }  # fmt: skip
    worst = max(residual.values())
    reading = (
        f"Level car: static axle loads {float(rest.front):.1f} and {float(rest.rear):.1f} N, "
        f"{float(driving.rear - rest.rear):.2f} N moved per m/s^2 of a_x, "
        f"{computed['per_unit_a_y_N']['front_right']:.2f} and {computed['per_unit_a_y_N']['rear_right']:.2f} N per "
        f"side and m/s^2 of a_y; forces and moments balance to {worst:.1e}. With body angles (14), (16) "
        f"contradict (11): at rest on a bank of 3 degrees they give {conflict['printed']:.2f} instead of "
        f"{abs(conflict['angles_reversed']):.0f} m/s^2 across. (17) takes h_rc as lever of the lateral shift, where "
        f"the roll arm is {conflict['lever_of_the_lateral_shift_m']:.2f} m."
    )
    return Finding(computed, reproduced(worst <= TOLERANCE), reading)


def _corners(loads: Loads) -> dict[str, float]:
    """Corner loads by name, N, of one motion."""
    return {name: float(getattr(loads, name)) for name in WHEELS}


@TOPIC.part("loads", "Vertical loads")
def loads(scope: Scope) -> PartResult:
    """Static loads of the corners and their transfer per unit of acceleration."""
    claims = TOPIC.found()
    static, along, across = (
        claims[0].finding.computed[key] for key in ("static_N", "per_unit_a_x_N", "per_unit_a_y_N")
    )
    rows = [
        [name.replace("_", " "), static[name], along[name.partition("_")[0]] / 2.0, across[name]] for name in WHEELS
    ]
    columns = ["corner", "static load [N]", "per m/s^2 of a_x [N]", "per m/s^2 of a_y [N]"]
    caption = "Corner loads of the level car of Table I by (15), (17), g = 9.81 m/s^2."
    return PartResult(claims, [Table("vertical-loads", caption, columns, rows)], [load_figure()])


def load_figure() -> Figure:
    """Corner loads over lateral and longitudinal acceleration."""
    acceleration = np.linspace(-9.0, 9.0, 73)
    zero = np.zeros_like(acceleration)
    panels = []
    for motion, axis, title in (((acceleration, zero), "ₓ", "longitudinal"), ((zero, acceleration), "ᵧ", "lateral")):
        found = vertical_loads(parameters(), *motion, gravity=PRINTED_GRAVITY)
        lines = [
            Line(acceleration, getattr(found, name) / 1e3, name.replace("_", " "), colour, dash)
            for name, colour, dash in zip(WHEELS, CURVES, DASHES, strict=False)
        ]
        panels.append(Panel([ZERO, *lines], f"a{axis} [m/s²]", "vertical load [kN]", f"{title} acceleration"))
    return Figure(
        "vertical-loads",
        "Vertical load of each corner over one acceleration at a time, level car of Table I, no body angles. Left "
        "lines lie on right ones for longitudinal acceleration. Below zero the formulas no longer apply: the wheel "
        "has lifted. P1 (15), (17).",
        "Loads change linearly: 518 newtons per axle and metre per second squared longitudinally, 457 and 471 per "
        "side laterally.",
        panels,
        legend="below",
        share_y="all",
    )
