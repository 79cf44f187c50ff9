"""P5-gains, P5-A4, P5-A12: the gain conditions of Appendix A."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from analysis.bounds.sliding_mode import PUBLISHED, SlidingModeGains, reaching_time, sliding_mode_convergence
from estimators.arrays import FloatArray
from studies.claim import Finding, agrees, reproduced
from studies.papers.smo_ekf_sideslip.inputs import CAR, LARGEST, PACKAGE, SAMPLE_TIME
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Level, Line, Mark, Panel
from studies.plots.colours import BLUE, GREEN, RED, TRUTH
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
FRONT, REAR, INERTIA = Fraction("1.12"), Fraction("1.46"), Fraction(3000)  # m, m, kg m^2: exact
FINE = 2e-5  # s, step of the simulated sliding motion
WINDOW = (0.2, 0.9)  # s, over which the simulated decay is measured
RATE = sliding_mode_convergence(PUBLISHED, CAR).split_decay_rate  # 1/s, (A.12)
WORST_MOMENT = float(CAR.front_axle_distance * LARGEST[1] + CAR.rear_axle_distance * LARGEST[2])  # N m, at the start


def error_motion(
    start: ArrayLike,
    seconds: float,
    sample_time: float = SAMPLE_TIME,
    widths: ArrayLike | None = None,
    gains: SlidingModeGains = PUBLISHED,
) -> FloatArray:
    """P5 (A.1) with constant true forces, Euler steps: errors (n, ..., 4) after each step from `start` (..., 4).

    `widths` (3,) of the linear zones; None: the bare sign.
    """
    model, outputs = np.zeros((4, 4)), np.zeros((3, 4))
    model[0, 1:3] = CAR.front_axle_distance / CAR.yaw_inertia, -CAR.rear_axle_distance / CAR.yaw_inertia
    outputs[0, 0], outputs[1, 1:3], outputs[2, 3] = 1.0, 1.0 / CAR.mass, 1.0 / CAR.mass
    error, path = np.array(start, float), []
    for _ in range(round(seconds / sample_time)):
        y = error @ outputs.T
        switching = np.sign(y) if widths is None else np.clip(y / np.asarray(widths), -1.0, 1.0)
        error = error + sample_time * (error @ model.T - switching @ gains.matrix.T)
        path.append(error)
    return np.array(path)


def split(error: FloatArray) -> FloatArray:
    """L_1 x_2 - L_2 x_3 in N m: the yaw moment that the error of the split stands for."""
    return np.asarray(CAR.front_axle_distance * error[..., 1] - CAR.rear_axle_distance * error[..., 2])


@TOPIC.claim("P5-gains")
def gain_condition(gains: SlidingModeGains = PUBLISHED) -> Finding:
    """Omega_5 by (7) in exact numbers, against the printed one."""
    exact = REAR / FRONT * Fraction(gains[8])
    residual = REAR * Fraction(gains[8]) - FRONT * Fraction(gains[5])
    computed = {
        "omega5_N_s": float(exact), "omega5_exact": str(exact),
        "printed_relative_error": float((Fraction(gains[5]) - exact) / exact), "residual_Nm_s": float(residual),
    }  # fmt: skip
    reading = (
        f"(7) gives {float(exact):.3f} N/s; the printed {gains[5]:g} is rounded to thousands and leaves a residual of "
        f"{float(residual):g} N m/s in (A.11). It is harmless: on the sliding surface the equivalent value of the lateral "
        "sign is zero, so the residual does not act there and the split decays at the same rate."
    )
    return Finding(computed, reproduced(agrees(float(exact), gains[5], 0.5)), reading)


@TOPIC.claim("P5-A4")
def dominance(gains: SlidingModeGains = PUBLISHED) -> Finding:
    """(A.4) with the sign of (A.5), for the worst start; and a start that shows the printed plus to be no condition."""
    found = sliding_mode_convergence(gains, CAR, yaw_moment_error=WORST_MOMENT)
    # Equal and opposite moments: the printed sum is zero, the true difference beyond the limit.
    moment = 0.55 * found.yaw_moment_limit
    growth = 2.0 * moment / CAR.yaw_inertia - gains[1]  # of |x1| in rad/s^2, from (A.5)
    matrix = gains.matrix.copy()
    matrix[1, 1] = CAR.rear_axle_distance / CAR.front_axle_distance * gains[8]  # Omega_5 as (7) asks for it
    computed = {
        "yaw_moment_limit_Nm": found.yaw_moment_limit, "worst_start_Nm": WORST_MOMENT,
        "epsilon_yaw_rad_s2": found.yaw_margin, "epsilon_longitudinal_N_s": found.longitudinal_margin,
        "growth_where_printed_sign_is_zero_rad_s2": float(growth),
        "reaching_time_from_60_kNm_s": reaching_time(SlidingModeGains(matrix), CAR, 0.0, 60_000.0),
    }  # fmt: skip
    reading = (
        f"Omega_1 dominates while |L_1 x_2 - L_2 x_3| < {found.yaw_moment_limit / 1e3:g} kN m, the worst start from the "
        f"printed maxima has {WORST_MOMENT / 1e3:.2f} kN m; Omega_12 always dominates. So the condition is local, not global. "
        "(A.4) prints L_1 x_2 + L_2 x_3; with that sign it is no condition (an error with zero sum makes the yaw error "
        "grow), (A.5) has the minus."
    )
    return Finding(computed, reproduced(found.holds and found.yaw_margin > 0.0 and growth > 0.0), reading)


@TOPIC.claim("P5-A12")
def split_decay(gains: SlidingModeGains = PUBLISHED, tolerance: float = 1e-3) -> Finding:
    """The rate of (A.12) in exact numbers, and of a simulated sliding motion with the bare sign."""
    exact = -Fraction(gains[7]) * (FRONT + REAR) / (Fraction(gains[1]) * INERTIA)
    path = split(error_motion(LARGEST * [0.0, 1.0, -1.0, 0.0], 1.0, FINE, gains=gains))
    time = FINE * np.arange(1, len(path) + 1)
    inside = (time > WINDOW[0]) & (time < WINDOW[1])
    slope = np.polyfit(time[inside], np.log(np.abs(path[inside])), 1)[0]
    lateral_margin = sliding_mode_convergence(gains, CAR).lateral_margin
    computed = {
        "decay_rate_1_s": float(exact), "decay_rate_exact": str(exact), "time_constant_s": float(1 / exact),
        "simulated_decay_1_s": float(-slope), "epsilon_lateral_N_s": lateral_margin,
    }  # fmt: skip
    reading = (
        f"The split error decays at Omega_4 (L_1 + L_2) / (Omega_1 I_z) = {exact} = {float(exact):g} 1/s (time constant "
        f"{float(1 / exact):.3f} s), in the simulated sliding motion at {-slope:.4f} 1/s: far slower than the sum of the "
        "forces, which is reached in finite time. Proved for constant true forces only."
    )
    good = exact > 0 and lateral_margin > 0.0 and abs(-slope / float(exact) - 1.0) < tolerance
    return Finding(computed, reproduced(good), reading)


@TOPIC.part("gains", "Gain conditions of Appendix A", 1.5)
def gains_part(_: Scope) -> PartResult:
    """Appendix A with the printed gains."""
    return PartResult(TOPIC.found(), [gain_conditions()], [convergence()])


def gain_conditions() -> Table:
    """Each condition of Appendix A with its margin at the worst start."""
    found, g = sliding_mode_convergence(PUBLISHED, CAR, yaw_moment_error=WORST_MOMENT), PUBLISHED
    rows: list[list[Cell]] = [
        ["(A.4) Omega_1 > |L1 x2 - L2 x3| / I_z", "rad/s^2", round(found.yaw_margin, 4), found.yaw_margin > 0],
        ["(A.4) Omega_12 > |Omega_10| + |Omega_11|", "N/s", found.longitudinal_margin, found.longitudinal_margin > 0],
        ["(A.8) Omega_5 + Omega_8 > |Omega_6| + |Omega_9|", "N/s", found.lateral_margin, found.lateral_margin > 0],
        ["(7) Omega_4 = -Omega_7", "N/s", g[4] + g[7], g[4] == -g[7]],
        ["(7) L1 Omega_5 = L2 Omega_8 (residual)", "N m/s", round(found.split_residual, 6), abs(found.split_residual) < 1e-6],
        ["(A.12) decay of the split", "1/s", round(found.split_decay_rate, 6), found.split_decay_rate > 0],
    ]  # fmt: skip
    return Table(
        "gain-conditions",
        "Conditions of Appendix A with the printed gains, at the worst start that the printed maxima of Table 1 allow (|L1 "
        f"x2 - L2 x3| = {WORST_MOMENT / 1e3:.2f} kN m); (A.4) with the minus sign of (A.5). Margins in the unit given.",
        ("condition", "unit", "margin or value", "holds"), rows)  # fmt: skip


def convergence() -> Figure:
    """The errors of the four Lyapunov functions from the worst start, bare sign at a fine step."""
    path = error_motion(LARGEST * [0.5, 1.0, -1.0, 1.0], 1.2, FINE)
    time, start = FINE * np.arange(1, len(path) + 1), round(0.2 / FINE)
    thin = slice(None, None, 20)
    moment = np.abs(split(path)) / 1e3
    shown = (
        (path[:, 1], "front lateral", BLUE), (path[:, 2], "rear lateral", RED),
        (path[:, 1] + path[:, 2], "their sum", TRUTH), (path[:, 3], "longitudinal", GREEN),
    )  # fmt: skip
    decay = moment[start] * np.exp(-RATE * (time[thin] - 0.2))
    forces = [Line(time[thin], values[thin] / 1e3, label, color) for values, label, color in shown]
    marks: list[Mark] = [
        Line(time[thin], moment[thin], "|L₁x₂ − L₂x₃| simulated", BLUE),
        Line(time[thin], decay, f"exp(−{RATE:g} t), (A.12)", TRUTH, "dashed", 1.0),
        Level(y=30.0, label="limit of (A.4), 30 kN m", color=RED, dash="dotted", width=1.0),
    ]
    return Figure(
        "convergence",
        "Error of the sliding-mode observer from the worst start that the printed maxima allow (6.28 kN in front, −3.66 kN "
        "at the rear), printed gains, bare sign at 50 kHz, constant true forces. Left: the sum of the lateral forces and the "
        "longitudinal force are reached within 0.13 s; what remains is a wrong split between the axles. Right: that split "
        "decays at 3.44 1/s, as (A.12) says, and stays below the limit up to which Omega_1 dominates.",
        "Left: force errors over time; the sum drops to zero at once, front and rear errors decay slowly towards zero from "
        "opposite sides. Right: the split on a logarithmic scale, parallel to a dashed exponential.",
        [Panel(forces, "time [s]", "force error [kN]", legend="best"),
         Panel(marks, "time [s]", Axis("yaw moment error of the split [kN m]", 0.1, 60.0, "log"), legend="best")],
        size=(9.2, 3.7))  # fmt: skip
