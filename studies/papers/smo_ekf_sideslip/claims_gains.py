"""P5-gains, P5-A4, P5-A12: the gain conditions of Appendix A."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from analysis.bounds_sliding_mode import (
    PUBLISHED,
    SlidingModeGains,
    reaching_time,
    sliding_mode_convergence,
)
from studies.claim import Finding, agrees, judged
from studies.papers.smo_ekf_sideslip.error_motion import CAR, LARGEST, error_motion, split

EXACT_FRONT, EXACT_REAR, EXACT_INERTIA = Fraction("1.12"), Fraction("1.46"), Fraction(3000)  # m, m, kg m^2
FINE = 2e-5  # s, step of the simulated sliding motion
WINDOW = (0.2, 0.9)  # s, over which the simulated decay is measured


def gain_condition(gains: SlidingModeGains = PUBLISHED) -> Finding:
    """Omega_5 by (7) in exact numbers, against the printed one."""
    exact = EXACT_REAR / EXACT_FRONT * Fraction(gains[8])
    residual = EXACT_REAR * Fraction(gains[8]) - EXACT_FRONT * Fraction(gains[5])
    computed = {
        "omega5_N_s": float(exact),
        "omega5_exact": str(exact),
        "printed_relative_error": float((Fraction(gains[5]) - exact) / exact),
        "residual_Nm_s": float(residual),
    }
    reading = (
        f"(7) gives {float(exact):.3f} N/s; the printed {gains[5]:g} is rounded to thousands and leaves a residual "
        f"of {float(residual):g} N m/s in (A.11). It is harmless: on the sliding surface the equivalent value of the "
        "lateral sign is zero, so the residual does not act there and the split decays at the same rate."
    )
    return Finding(computed, judged(agrees(float(exact), gains[5], 0.5)), reading)


def dominance(gains: SlidingModeGains = PUBLISHED) -> Finding:
    """(A.4) with the sign of (A.5), for the worst start; and a start that shows the printed plus to be no condition."""
    worst = CAR.front_axle_distance * LARGEST[1] + CAR.rear_axle_distance * LARGEST[2]
    found = sliding_mode_convergence(gains, CAR, yaw_moment_error=float(worst))
    # Equal and opposite moments: the printed sum is zero, the true difference beyond the limit.
    moment = 0.55 * found.yaw_moment_limit
    growth = 2.0 * moment / CAR.yaw_inertia - gains[1]  # of |x1| in rad/s^2, from (A.5)
    computed = {
        "yaw_moment_limit_Nm": found.yaw_moment_limit,
        "worst_start_Nm": float(worst),
        "epsilon_yaw_rad_s2": found.yaw_margin,
        "epsilon_longitudinal_N_s": found.longitudinal_margin,
        "growth_where_printed_sign_is_zero_rad_s2": float(growth),
        "reaching_time_from_60_kNm_s": reaching_time(_exact(gains), CAR, 0.0, 60_000.0),
    }
    reading = (
        f"Omega_1 dominates while |L_1 x_2 - L_2 x_3| < {found.yaw_moment_limit / 1e3:g} kN m, the worst start from "
        f"the printed maxima has {worst / 1e3:.2f} kN m; Omega_12 always dominates. So the condition is local, not "
        "global. (A.4) prints L_1 x_2 + L_2 x_3; with that sign it is no condition (an error with zero sum makes "
        "the yaw error grow), (A.5) has the minus."
    )
    return Finding(computed, judged(found.holds and found.yaw_margin > 0.0 and growth > 0.0), reading)


def split_decay(gains: SlidingModeGains = PUBLISHED, tolerance: float = 1e-3) -> Finding:
    """The rate of (A.12) in exact numbers, and of a simulated sliding motion with the bare sign."""
    exact = -Fraction(gains[7]) * (EXACT_FRONT + EXACT_REAR) / (Fraction(gains[1]) * EXACT_INERTIA)
    path = split(error_motion(LARGEST * [0.0, 1.0, -1.0, 0.0], 1.0, FINE, gains=gains))
    time = FINE * np.arange(1, len(path) + 1)
    inside = (time > WINDOW[0]) & (time < WINDOW[1])
    slope = np.polyfit(time[inside], np.log(np.abs(path[inside])), 1)[0]
    found = sliding_mode_convergence(gains, CAR)
    computed = {
        "decay_rate_1_s": float(exact),
        "decay_rate_exact": str(exact),
        "time_constant_s": float(1 / exact),
        "simulated_decay_1_s": float(-slope),
        "epsilon_lateral_N_s": found.lateral_margin,
    }
    reading = (
        f"The split error decays at Omega_4 (L_1 + L_2) / (Omega_1 I_z) = {exact} = {float(exact):g} 1/s (time "
        f"constant {float(1 / exact):.3f} s), in the simulated sliding motion at {-slope:.4f} 1/s: far slower than "
        "the sum of the forces, which is reached in finite time. Proved for constant true forces only."
    )
    good = exact > 0 and found.lateral_margin > 0.0 and abs(-slope / float(exact) - 1.0) < tolerance
    return Finding(computed, judged(good), reading)


def _exact(gains: SlidingModeGains) -> SlidingModeGains:
    """The gains with Omega_5 as (7) asks for it."""
    matrix = gains.matrix.copy()
    matrix[1, 1] = CAR.rear_axle_distance / CAR.front_axle_distance * gains[8]
    return SlidingModeGains(matrix)


CLAIMS = {"P5-gains": gain_condition, "P5-A4": dominance, "P5-A12": split_decay}
