"""P1-loads: do the load formulas balance the car, and where do their signs contradict the rest of the paper?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.loads import Loads, vertical_loads
from studies.claim import ClaimFunction, Finding, judged
from studies.papers.corner_estimation.inputs import PRINTED_GRAVITY, parameters
from synthesis.models.parameter_set import ParameterSet

TOLERANCE = 1e-4  # N
BANK = np.deg2rad(3.0)  # a roll angle of everyday cornering


@dataclass(frozen=True)
class Balance:
    """Largest residual over many motions of a car without pitch and roll: N, N*m, N*m."""

    vertical: float
    pitch: float
    roll: float

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.vertical, self.pitch, self.roll)


def balance(assumed: ParameterSet, true: ParameterSet) -> Balance:
    """Newton's laws for the level car `true` against (15), (17) with the constants `assumed`.

    Forces up and moments about the axes through the road:
    F_zf + F_zr = m a_z,  L_f F_zf - L_r F_zr = -m h a_x,  (F_R - F_L) T_i/2 = m_i h a_y with m_i = F_zi / g.
    """
    size = {name: entry.value for name, entry in true.vehicle.items()}
    ax, ay, az = (
        g.ravel() for g in np.meshgrid(np.linspace(-8, 8, 9), np.linspace(-8, 8, 9), [8.0, PRINTED_GRAVITY, 11.0])
    )
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
    return Balance(*(float(np.abs(residual).max()) for residual in (vertical, pitch, roll)))


def sign_conflict(vehicle: ParameterSet) -> dict[str, float]:
    """A car at rest on a bank of 3 degrees: (11) says that it reads a_y = +g sin(phi); (16) must give zero, in m/s^2."""
    read = PRINTED_GRAVITY * np.sin(BANK), PRINTED_GRAVITY * np.cos(BANK)
    across = {side: float(read[0] * np.cos(angle) + read[1] * np.sin(angle)) for side, angle in
              (("printed", BANK), ("angles_reversed", -BANK))}  # fmt: skip
    size = vehicle.vehicle
    lever = size["cg_height"].value - size["roll_center_height"].value
    return {**across, "lever_printed_m": size["roll_center_height"].value, "lever_of_the_lateral_shift_m": lever}


def load_formulas(assumed: ParameterSet | None = None) -> Finding:
    """Static loads, transfer per unit of acceleration, balances of the level car, and the sign of (14), (16)."""
    car = parameters() if assumed is None else assumed
    motions = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    rest, driving, turning = (vertical_loads(car, *a, gravity=PRINTED_GRAVITY) for a in motions)
    residual, conflict = balance(car, parameters()), sign_conflict(car)
    computed = {
        "static_N": {"front": float(rest.front), "rear": float(rest.rear), **corners(rest)},
        "per_unit_a_x_N": {"front": float(driving.front - rest.front), "rear": float(driving.rear - rest.rear)},
        "per_unit_a_y_N": {name: value - corners(rest)[name] for name, value in corners(turning).items()},
        "largest_residual": {"vertical_N": residual.vertical, "pitch_Nm": residual.pitch, "roll_Nm": residual.roll},
        "at_rest_on_3_deg_bank": conflict,
    }
    reading = (
        f"Level car: static axle loads {float(rest.front):.1f} and {float(rest.rear):.1f} N, "
        f"{float(driving.rear - rest.rear):.2f} N moved per m/s^2 of a_x, "
        f"{computed['per_unit_a_y_N']['front_right']:.2f} and {computed['per_unit_a_y_N']['rear_right']:.2f} N per "
        f"side and m/s^2 of a_y; forces and moments balance to {residual.worst:.1e}. With body angles (14), (16) "
        f"contradict (11): at rest on a bank of 3 degrees they give {conflict['printed']:.2f} instead of "
        f"{abs(conflict['angles_reversed']):.0f} m/s^2 across. (17) takes h_rc as lever of the lateral shift, where "
        f"the roll arm is {conflict['lever_of_the_lateral_shift_m']:.2f} m."
    )
    return Finding(computed, judged(residual.worst <= TOLERANCE), reading)


def corners(loads: Loads) -> dict[str, float]:
    """Corner loads by name, N, of one motion."""
    names = ("front_left", "front_right", "rear_left", "rear_right")
    return {name: float(getattr(loads, name)) for name in names}


CLAIMS: dict[str, ClaimFunction] = {"P1-loads": load_formulas}
