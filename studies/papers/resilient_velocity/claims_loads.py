"""(26), (27): axle and corner loads."""

from __future__ import annotations

import math

import sympy as sp

from analysis.loads import vertical_loads
from studies.claim import ClaimFunction, Finding, agrees
from studies.papers.resilient_velocity.leaning import (
    AS_PRINTED,
    AXLE_MASS,
    CORRECTED,
    GRAVITY,
    HEIGHT,
    ROLL,
    ROLL_HEIGHT,
    TRACK,
    axle_sum,
    pitched_car,
    residual,
)
from studies.papers.resilient_velocity.setting import PRINTED, Setting
from studies.papers.verdicts import erratum

LEAN = math.radians(3.0)


def loads(setting: Setting = PRINTED) -> Finding:
    """P3-26: sums, lever rule and transfer hold; leaning at rest the printed roll sign and arm fail, the corrected ones hold."""
    v = {name: q.value for name, q in setting.parameters.vehicle.items()}
    base = v["front_axle_distance"] + v["rear_axle_distance"]
    g, motions = setting.gravity, ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    rest, driving, turning = (vertical_loads(setting.parameters, *a, gravity=g) for a in motions)
    front, rear = float(rest.front), float(rest.rear)
    longitudinal = float(driving.rear) - rear
    lateral = float(turning.front_right - rest.front_right)
    lever = (
        agrees(front, v["mass"] * g * v["rear_axle_distance"] / base, 1e-9 * front)
        and agrees(longitudinal, v["mass"] * v["cg_height"] / base, 1e-9 * longitudinal)
        and agrees(lateral, front / g * v["cg_height"] / v["front_track"], 1e-9 * lateral)
    )
    sums = axle_sum(AS_PRINTED) == 0 and axle_sum(CORRECTED) == 0
    printed, corrected = residual(AS_PRINTED), residual(CORRECTED)
    at = {
        ROLL: LEAN, GRAVITY: g, AXLE_MASS: front / g, HEIGHT: v["cg_height"], ROLL_HEIGHT: v["roll_center_height"],
        TRACK: v["front_track"],
    }  # fmt: skip
    off = [float(sp.N(e.subs(at))) for e in printed]
    printed_holds = all(e == 0 for e in printed)
    corrected_holds = all(e == 0 for e in corrected)
    return Finding(
        {
            "static_front_rear_N": [front, rear],
            "longitudinal_transfer_N_per_m_per_s2": longitudinal,
            "front_lateral_transfer_N_per_m_per_s2": lateral,
            "sums_conserved_exactly": sums,
            "pitch_reading_at_rest_nose_down": float(pitched_car()),
            "lateral_reading_at_rest_leaning_3_deg_m_per_s2": off[0],
            "front_left_load_error_at_rest_leaning_3_deg_N": off[1],
            "corrected_errors": [float(e) for e in corrected] if corrected_holds else [str(e) for e in corrected],
        },
        erratum(printed_holds, corrected_holds and lever and sums and pitched_car() == 0),
        f"Static loads {front:.1f} and {rear:.1f} N by the lever rule, transfer {longitudinal:.1f} N per m/s^2, "
        "sums conserved exactly. But (27) takes roll as left side up while a_phi_y levels with the opposite sign: "
        f"standing and leaning by 3 degrees it reads {off[0]:.2f} m/s^2 instead of 0 (g sin 2 phi). With a_phi_y = "
        "a_y cos phi - a_n sin phi and the roll arm h_CG - h_RC in place of h_RC the balance of moments holds "
        "exactly.",
    )


CLAIMS: dict[str, ClaimFunction] = {"P3-26": loads}
