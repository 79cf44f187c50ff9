"""P5-gains, P5-A4, P5-A12: the gain conditions of Appendix A; P5-100Hz: the sign as linear zones of unprinted widths."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from analysis.bounds import sliding_mode
from analysis.bounds.sliding_mode import OUTPUTS, PUBLISHED, SlidingModeGains, sliding_mode_convergence
from estimators.arrays import FloatArray
from studies.claim import ClaimVerdict, Finding, JsonValue, agrees, reproduced
from studies.papers.smo_ekf_sideslip.inputs import CAR, LARGEST, PACKAGE, PRINTED, SAMPLE_TIME, WHEELBASE
from studies.papers.topic import Topic
from studies.plots import Axis, Contours, Figure, Level, Line, Map, Mark, Panel, Words, dots
from studies.plots.colours import BLUE, GREEN, GREY, ORANGE, RED, TRUTH
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
FRONT, REAR, INERTIA = Fraction("1.12"), Fraction("1.46"), Fraction(3000)  # m, m, kg m^2: exact
FINE = 2e-5  # s, step of the simulated sliding motion
RATE = sliding_mode_convergence(PUBLISHED, CAR).split_decay_rate  # 1/s, (A.12)
WORST_MOMENT = float(CAR.front_axle_distance * LARGEST[1] + CAR.rear_axle_distance * LARGEST[2])  # N m, at the start
WIDE, NARROW = (0.2, 1.0, 1.0), (0.05, 0.1, 0.1)  # rad/s, m/s^2, m/s^2: two readings
LEAST = tuple(sliding_mode.smallest_zone_widths(PUBLISHED, CAR, SAMPLE_TIME)[name] for name in OUTPUTS)


def error_motion(
    start: ArrayLike, seconds: float, sample_time: float = SAMPLE_TIME, widths: ArrayLike | None = None,
    gains: SlidingModeGains = PUBLISHED,
) -> FloatArray:  # fmt: skip
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
        "printed_relative_error": float((Fraction(gains[5]) - exact) / exact), "residual_Nm_s": float(residual)}  # fmt: skip
    return Finding(computed, reproduced(agrees(float(exact), gains[5], 0.5)), (
        f"(7) gives {float(exact):.3f} N/s; the printed {gains[5]:g} is rounded to thousands and leaves a residual of "
        f"{float(residual):g} N m/s in (A.11). It is harmless: on the sliding surface the equivalent value of the lateral "
        "sign is zero, so the residual does not act there and the split decays at the same rate."))  # fmt: skip


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
        "reaching_time_from_60_kNm_s": sliding_mode.reaching_time(SlidingModeGains(matrix), CAR, 0.0, 60_000.0)}  # fmt: skip
    return Finding(computed, reproduced(found.holds and found.yaw_margin > 0.0 and growth > 0.0), (
        f"Omega_1 dominates while |L_1 x_2 - L_2 x_3| < {found.yaw_moment_limit / 1e3:g} kN m, the worst start from the "
        f"printed maxima has {WORST_MOMENT / 1e3:.2f} kN m; Omega_12 always dominates. So the condition is local, not global. "
        "(A.4) prints L_1 x_2 + L_2 x_3; with that sign it is no condition (an error with zero sum makes the yaw error "
        "grow), (A.5) has the minus."))  # fmt: skip


@TOPIC.claim("P5-A12")
def split_decay(gains: SlidingModeGains = PUBLISHED) -> Finding:
    """The rate of (A.12) in exact numbers, and of a simulated sliding motion with the bare sign."""
    exact = -Fraction(gains[7]) * (FRONT + REAR) / (Fraction(gains[1]) * INERTIA)
    path = split(error_motion(LARGEST * [0.0, 1.0, -1.0, 0.0], 1.0, FINE, gains=gains))
    time = FINE * np.arange(1, len(path) + 1)
    inside = (time > 0.2) & (time < 0.9)  # s
    slope = np.polyfit(time[inside], np.log(np.abs(path[inside])), 1)[0]
    lateral_margin = sliding_mode_convergence(gains, CAR).lateral_margin
    computed = {
        "decay_rate_1_s": float(exact), "decay_rate_exact": str(exact), "time_constant_s": float(1 / exact),
        "simulated_decay_1_s": float(-slope), "epsilon_lateral_N_s": lateral_margin}  # fmt: skip
    good = exact > 0 and lateral_margin > 0.0 and abs(-slope / float(exact) - 1.0) < 1e-3
    return Finding(computed, reproduced(good), (
        f"The split error decays at Omega_4 (L_1 + L_2) / (Omega_1 I_z) = {exact} = {float(exact):g} 1/s (time constant "
        f"{float(1 / exact):.3f} s), in the simulated sliding motion at {-slope:.4f} 1/s: far slower than the sum of the "
        "forces, which is reached in finite time. Proved for constant true forces only."))  # fmt: skip


def _gain_conditions() -> Table:
    found, g = sliding_mode_convergence(PUBLISHED, CAR, yaw_moment_error=WORST_MOMENT), PUBLISHED
    rows: list[list[Cell]] = [
        ["(A.4) Omega_1 > |L1 x2 - L2 x3| / I_z", "rad/s^2", round(found.yaw_margin, 4), found.yaw_margin > 0],
        ["(A.4) Omega_12 > |Omega_10| + |Omega_11|", "N/s", found.longitudinal_margin, found.longitudinal_margin > 0],
        ["(A.8) Omega_5 + Omega_8 > |Omega_6| + |Omega_9|", "N/s", found.lateral_margin, found.lateral_margin > 0],
        ["(7) Omega_4 = -Omega_7", "N/s", g[4] + g[7], g[4] == -g[7]],
        ["(7) L1 Omega_5 = L2 Omega_8 (residual)", "N m/s", round(found.split_residual, 6), abs(found.split_residual) < 1e-6],
        ["(A.12) decay of the split", "1/s", round(found.split_decay_rate, 6), found.split_decay_rate > 0]]  # fmt: skip
    return Table("gain-conditions",
        "Conditions of Appendix A with the printed gains, at the worst start that the printed maxima of Table 1 allow (|L1 "
        f"x2 - L2 x3| = {WORST_MOMENT / 1e3:.2f} kN m); (A.4) with the minus sign of (A.5). Margins in the unit given.",
        ("condition", "unit", "margin or value", "holds"), rows)  # fmt: skip


def _convergence() -> Figure:
    path = error_motion(LARGEST * [0.5, 1.0, -1.0, 1.0], 1.2, FINE)
    time, start = FINE * np.arange(1, len(path) + 1), round(0.2 / FINE)
    thin = slice(None, None, 20)
    moment = np.abs(split(path)) / 1e3
    shown = (
        (path[:, 1], "front lateral", BLUE), (path[:, 2], "rear lateral", RED),
        (path[:, 1] + path[:, 2], "their sum", TRUTH), (path[:, 3], "longitudinal", GREEN))  # fmt: skip
    decay = moment[start] * np.exp(-RATE * (time[thin] - 0.2))
    forces = [Line(time[thin], values[thin] / 1e3, label, color) for values, label, color in shown]
    marks: list[Mark] = [
        Line(time[thin], moment[thin], "|L₁x₂ − L₂x₃| simulated", BLUE),
        Line(time[thin], decay, f"exp(−{RATE:g} t), (A.12)", TRUTH, "dashed", 1.0),
        Level(y=30.0, label="limit of (A.4), 30 kN m", color=RED, dash="dotted", width=1.0)]  # fmt: skip
    return Figure("convergence",
        "Error of the sliding-mode observer from the worst start that the printed maxima allow (6.28 kN in front, −3.66 kN "
        "at the rear), printed gains, bare sign at 50 kHz, constant true forces. Left: the sum of the lateral forces and the "
        "longitudinal force are reached within 0.13 s; what remains is a wrong split between the axles. Right: that split "
        "decays at 3.44 1/s, as (A.12) says, and stays below the limit up to which Omega_1 dominates.",
        "Left: force errors over time; the sum drops to zero at once, front and rear errors decay slowly towards zero from "
        "opposite sides. Right: the split on a logarithmic scale, parallel to a dashed exponential.",
        [Panel(forces, "time [s]", "force error [kN]", legend="best"),
         Panel(marks, "time [s]", Axis("yaw moment error of the split [kN m]", 0.1, 60.0, "log"), legend="best")],
        size=(9.2, 3.7))  # fmt: skip


def radius(widths: Sequence[float]) -> float:
    """Spectral radius of the error inside the linear zones."""
    matrix = sliding_mode.linear_zone_matrix(PUBLISHED, CAR, dict(zip(OUTPUTS, widths, strict=True)))
    return sliding_mode.sampled_radius(matrix, SAMPLE_TIME)


def late_peaks(widths: Sequence[float] | None, starts: int = 400) -> FloatArray:
    """Largest |error| (starts, 4) after 3 s, from starts spread over the printed maxima."""
    start = LARGEST * np.random.default_rng(1).uniform(-1.0, 1.0, (starts, 4))
    path = error_motion(start, 8.0, SAMPLE_TIME, widths)
    return np.asarray(np.abs(path[round(3.0 / SAMPLE_TIME) :]).max(axis=0))


def split_tracking(frequency: ArrayLike, yaw_width: float) -> FloatArray:
    r"""|error / true| of the split L_1 F_y1 - L_2 F_yw2 that oscillates with `frequency` [Hz], inside the yaw rate zone.

    s (s + d) / (s^2 + d s + k) with d = Omega_1 / width and k = Omega_4 (L_1 + L_2) / (width I_z), from (1) and (6) with s(e) =
    e / width. For slow motion it is |s| d / k = |s| Omega_1 I_z / (Omega_4 (L_1 + L_2)): a lag of 0.29 s for every width.
    """
    s = 2j * np.pi * np.asarray(frequency, float)
    d, k = PUBLISHED[1] / yaw_width, PUBLISHED[4] * WHEELBASE / (yaw_width * CAR.yaw_inertia)
    return np.abs(s * (s + d) / (s**2 + d * s + k))


@TOPIC.claim("P5-100Hz")
def sampled_switching(readings: Sequence[Sequence[float]] = (WIDE, NARROW)) -> Finding:
    """Chatter of the bare sign, and both answers that widths can give."""
    bare = late_peaks(None)
    low, high = bare.min(axis=0), bare.max(axis=0)
    forces, radii = [float(late_peaks(widths)[:, 1:].max()) for widths in readings], [radius(w) for w in readings]
    zones = [
        {"widths": list(w), "spectral_radius": r, "largest_force_after_3_s_N": force}
        for w, r, force in zip(readings, radii, forces, strict=True)
    ]
    computed: JsonValue = {"sign_peak_yaw_rate_rad_s": float(high[0]), "zones": zones, "least_widths": list(LEAST)}
    for k, name in enumerate(("front_lateral", "rear_lateral", "longitudinal"), 1):
        computed[f"sign_peak_{name}_N"] = [float(low[k]), float(high[k])]
    otherwise = ClaimVerdict.UNDER_SPECIFIED if min(radii) < 1.0 else ClaimVerdict.NOT_REPRODUCED
    return Finding(computed, reproduced(max(radii) < 1.0, otherwise), (
        f"The bare sign chatters at 100 Hz by up to {high[0]:.3f} rad/s and by force peaks that depend on the start (front up "
        f"to {high[1]:.0f} N, longitudinal {low[3]:.0f} to {high[3]:.0f} N). The widths of the linear zones are not printed "
        f"and decide: each has a lower limit (gain times half a sample: {LEAST[0]:.2f} rad/s, {LEAST[1]:.2f} and "
        f"{LEAST[2]:.2f} m/s^2). Two readings: "
        + "; ".join(f"{tuple(w)} gives a spectral radius of {r:.4f}" for w, r in zip(readings, radii, strict=True))
        + "."))  # fmt: skip


def _zone_table() -> Table:
    rows: list[list[Cell]] = []
    above = tuple(1.1 * width for width in LEAST)
    cases = (("bare sign", None), ("at the limits", LEAST), ("10 % above the limits", above), ("used here", WIDE),
             ("too narrow", NARROW))  # fmt: skip
    for name, widths in cases:
        yaw, *peaks = late_peaks(widths, starts=60).max(axis=0)
        known: list[Cell] = [round(float(w), 4) for w in (*widths, radius(widths))] if widths else [None] * 4
        rows.append([name, *known, round(float(yaw), 5), *(round(float(peak), 2) for peak in peaks)])
    return Table("zone-widths",
        "The observer at 100 Hz with different widths of the linear zones (P5 prints none): spectral radius inside the "
        "zones, and largest errors after 3 s over 60 starts within the printed maxima, true forces constant.",
        ("reading", "yaw width [rad/s]", "lateral width [m/s^2]", "longitudinal width [m/s^2]", "spectral radius [1]",
         "yaw rate error [rad/s]", "front force error [N]", "rear force error [N]", "longitudinal force error [N]"),
        rows)  # fmt: skip


def _chatter() -> Figure:
    upper, lower = [], []
    for widths, title in ((None, "bare sign"), (WIDE, f"linear zone {WIDE}"), (NARROW, f"linear zone {NARROW}")):
        path = error_motion(LARGEST * [0.5, 1.0, -1.0, 1.0], 2.0, SAMPLE_TIME, widths)
        time = SAMPLE_TIME * np.arange(1, len(path) + 1)
        marks: list[Mark] = [Line(time, path[:, 0], color=BLUE, width=1.0)]
        if widths is not None:
            text = f"spectral radius {radius(widths):.4g}: {'stable' if radius(widths) < 1 else 'unstable'}"
            marks.append(Words(0.98, 0.95, text, horizontal="right", vertical="top", relative=True))
        first = widths is None
        upper.append(Panel(marks, "", "yaw rate error [rad/s]" if first else "", title))
        force = [Line(time, path[:, 1] / 1e3, color=RED, width=1.0)]
        lower.append(Panel(force, "time [s]", "front force error [kN]" if first else ""))
    return Figure("chatter",
        "The same start at 100 Hz with Euler steps: error of yaw rate and front lateral force with the bare sign, and with "
        "linear zones of two widths (rad/s, m/s², m/s²; P5 prints none). The sign chatters by 0.1 rad/s and several hundred "
        "newtons; zones wide enough converge smoothly, zones narrower than gain times half a sample keep chattering.",
        "Six panels over two seconds: ragged bands for the bare sign and the narrow zone, smooth decay for the wide zone.",
        [upper, lower], size=(9.2, 4.6), share_x="all", share_y="row")  # fmt: skip


def zone_widths(points: int) -> Figure:
    """Spectral radius over the widths of the linear zones."""
    yaw, across = np.geomspace(0.01, 2.0, points), np.geomspace(0.03, 10.0, points)
    field = np.array([[radius((w, a, 1.0)) for w in yaw] for a in across])
    critical = PUBLISHED[1] / (4.0 * RATE)
    limit = Level(x=LEAST[0], color=GREY, dash="dotted", width=1.2)
    plane: list[Mark] = [
        Map(yaw, across, np.log10(np.clip(field, None, 10.0)), "log₁₀ of the spectral radius [1]", "RdBu_r", -0.3, 0.3),
        Contours(yaw, across, field, [1.0], TRUTH, width=1.4, numbers=""),
        limit,
        Level(y=LEAST[1], color=GREY, dash="dotted", width=1.2)]  # fmt: skip
    for widths, marker, color in ((WIDE, "o", "black"), (NARROW, "X", "white")):
        plane.append(dots(*widths[:2], color=TRUTH, marker=marker, size=7.0, hollow=True))
        plane.append(Words(1.25 * widths[0], widths[1], f"{radius(widths):.3g}", color, vertical="center"))
    cut: list[Mark] = [
        Line(yaw, [radius((w, 1.0, 1.0)) for w in yaw], "spectral radius at 1 m/s²", BLUE),
        Level(y=1.0),
        Level(y=np.exp(-RATE * SAMPLE_TIME), label="sliding motion, exp(−3.44 · 0.01)", color=GREEN, dash="dashed", width=1.0),
        limit,
        Level(x=critical, color=RED, dash="dotted", width=1.0),
        Words(0.94 * critical, 1.045, f"critical damping\n{critical:.2f} rad/s", RED, horizontal="right")]  # fmt: skip
    name = "width of the yaw rate zone [rad/s]"
    return Figure("zone-widths",
        "Spectral radius of the observer error inside the linear zones at 100 Hz (longitudinal zone 1 m/s²). Left: black "
        "line radius 1, red unstable; dotted: the limits of each loop alone, Omega_1 T/2 = 0.05 rad/s and (Omega_5 + "
        "Omega_8) T/(2m) = 0.32 m/s². Circle: the widths used here; cross: a pair that chatters. Right: cut at 1 m/s²; above "
        "the limit the split decays at least as fast as in the sliding motion, fastest at critical damping, Omega_1² I_z / "
        "(4 Omega_4 (L_1 + L_2)); wider zones are sluggish.",
        "Left: map with a rectangular unstable region at small widths. Right: curve of the spectral radius that dips below "
        "one above 0.05 rad/s.",
        [Panel(plane, Axis(name, scale="log"),
               Axis("width of the lateral acceleration zone [m/s²]", scale="log"), grid=False),
         Panel(cut, Axis(name, 0.01, 2.0, "log"), Axis("spectral radius [1]", 0.9, 1.1), legend="upper right")],
        size=(9.2, 3.9))  # fmt: skip


TOPIC.show(
    "gains", "Gain conditions of Appendix A", 1.5, ("P5-gains", "P5-A4", "P5-A12"), [_gain_conditions], [_convergence]
)


@TOPIC.part("sampling", "100 Hz: chatter and linear zones", 2.5)
def sampling(scope: Scope) -> PartResult:
    """100 Hz and the widths of the linear zones."""
    return PartResult(TOPIC.found("P5-100Hz"), [_zone_table()], [_chatter(), zone_widths(31 if scope.quick else 121)])


@TOPIC.part("moving-forces", "The lag of the front-rear split", 0.2)
def moving_forces(_: Scope) -> PartResult:
    """How well the split is followed while the true forces move."""
    frequency = np.geomspace(0.02, 5.0, 200)
    x = Axis("frequency of the slalom [Hz]", scale="log", ticks=(0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5))
    slow = Line(frequency, 2.0 * np.pi * frequency / RATE, "2πf / 3.44, slow motion", TRUTH, "dashed", 1.0)
    shares, forces = list[Mark](), list[Mark]()
    for width, color in ((0.05, ORANGE), (WIDE[0], BLUE), (0.7, GREEN)):
        share = split_tracking(frequency, width)
        force = CAR.yaw_inertia * 2.0 * np.pi * frequency * LARGEST[0] * share / WHEELBASE
        shares.append(Line(frequency, share, f"yaw rate zone {width:g} rad/s", color))
        forces.append(Line(frequency, force, color=color))
    for name in ("F_y1", "F_y2"):
        mean, largest = (PRINTED["slalom"]["forces"][name][key] for key in ("mean", "largest"))
        amplitude = 0.5 * np.pi * 0.01 * mean * largest  # of a sine with this mean size
        forces.append(Level(y=amplitude, color=RED, dash="dotted", width=1.1))
        text = f"mean {mean:g} % of {name} (Table 1)"
        forces.append(Words(5.0, 0.9 * amplitude, text, RED, horizontal="right", vertical="top"))
    return PartResult(figures=[Figure("tracking",
        "What the proof of Appendix A leaves out: true forces that move. Left: share of the front-rear split that the "
        "observer misses in steady oscillation, printed gains, linear zones of three widths. Slow motion is followed with a "
        "lag of 0.29 s whatever the width. Right: the force error that follows on both axles for the printed largest yaw "
        "rate (33.6 deg/s; the split is yaw inertia times yaw acceleration). The means of Table 1 (red) belong to a slalom "
        "slower than about 0.25 Hz by this bound; the paper prints neither speed nor period.",
        "Left: three curves of the relative error rising with frequency to about one. Right: force error rising with the "
        "square of the frequency, crossed by two red lines.",
        [Panel([*shares, slow], x, Axis("split error / true split [1]", 0.02, 3.0, "log"), legend="lower right"),
         Panel(forces, x, Axis("amplitude of the error of each axle force [N]", 5.0, 2e4, "log"))], (9.2, 3.6))])  # fmt: skip
