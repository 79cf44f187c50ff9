"""P5-100Hz: the sign functions as linear zones whose widths are not printed: chatter at 100 Hz, and the lag of the split."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.bounds.sliding_mode import (
    OUTPUTS,
    PUBLISHED,
    SlidingModeGains,
    linear_zone_matrix,
    sampled_radius,
    smallest_zone_widths,
)
from estimators.arrays import FloatArray
from studies.claim import ClaimVerdict, Finding
from studies.papers.smo_ekf_sideslip.force_observer import RATE, error_motion
from studies.papers.smo_ekf_sideslip.inputs import CAR, LARGEST, PACKAGE, PRINTED, SAMPLE_TIME, WHEELBASE
from studies.papers.topic import Topic
from studies.plots import Axis, Contours, Figure, Level, Line, Map, Mark, Panel, Words, dots
from studies.plots.colours import BLUE, GREEN, GREY, ORANGE, RED, TRUTH
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
WIDE, NARROW = (0.2, 1.0, 1.0), (0.05, 0.1, 0.1)  # rad/s, m/s^2, m/s^2: two readings
LEAST = tuple(smallest_zone_widths(PUBLISHED, CAR, SAMPLE_TIME)[name] for name in OUTPUTS)
SETTLED, END = 3.0, 8.0  # s
STARTS = 400


def radius(widths: Sequence[float]) -> float:
    """Spectral radius of the error inside the linear zones."""
    return sampled_radius(linear_zone_matrix(PUBLISHED, CAR, dict(zip(OUTPUTS, widths, strict=True))), SAMPLE_TIME)


def late_peaks(widths: Sequence[float] | None, starts: int = STARTS) -> FloatArray:
    """Largest |error| (starts, 4) after 3 s, from starts spread over the printed maxima."""
    start = LARGEST * np.random.default_rng(1).uniform(-1.0, 1.0, (starts, 4))
    path = error_motion(start, END, SAMPLE_TIME, widths)
    return np.asarray(np.abs(path[round(SETTLED / SAMPLE_TIME) :]).max(axis=0))


def split_tracking(frequency: ArrayLike, yaw_width: float, gains: SlidingModeGains = PUBLISHED) -> FloatArray:
    r"""|error / true| of the split L_1 F_y1 - L_2 F_yw2 that oscillates with `frequency` [Hz], inside the yaw rate zone.

    s (s + d) / (s^2 + d s + k) with d = Omega_1 / width and k = Omega_4 (L_1 + L_2) / (width I_z), from (1) and (6) with s(e) =
    e / width. For slow motion it is |s| d / k = |s| Omega_1 I_z / (Omega_4 (L_1 + L_2)): a lag of 0.29 s for every width.
    """
    s = 2j * np.pi * np.asarray(frequency, float)
    d, k = gains[1] / yaw_width, gains[4] * WHEELBASE / (yaw_width * CAR.yaw_inertia)
    return np.abs(s * (s + d) / (s**2 + d * s + k))


@TOPIC.claim("P5-100Hz")
def sampled_switching(readings: Sequence[Sequence[float]] = (WIDE, NARROW)) -> Finding:
    """Chatter of the bare sign, and both answers that widths can give."""
    bare = late_peaks(None)
    low, high = bare.min(axis=0), bare.max(axis=0)
    zones: list[dict[str, Any]] = [
        {
            "widths": list(widths),
            "spectral_radius": radius(widths),
            "largest_force_after_3_s_N": float(late_peaks(widths)[:, 1:].max()),
        }
        for widths in readings
    ]
    names = ("front_lateral", "rear_lateral", "longitudinal")
    computed = {
        "sign_peak_yaw_rate_rad_s": float(high[0]),
        **{f"sign_peak_{name}_N": [float(low[k]), float(high[k])] for k, name in enumerate(names, 1)}, "zones": zones,
        "least_widths": list(LEAST),
    }  # fmt: skip
    stable = [zone["spectral_radius"] < 1.0 for zone in zones]
    verdict = (
        ClaimVerdict.REPRODUCED
        if all(stable)
        else ClaimVerdict.UNDER_SPECIFIED
        if any(stable)
        else ClaimVerdict.NOT_REPRODUCED
    )
    reading = (
        f"The bare sign chatters at 100 Hz by up to {high[0]:.3f} rad/s and by force peaks that depend on the start (front up "
        f"to {high[1]:.0f} N, longitudinal {low[3]:.0f} to {high[3]:.0f} N). The widths of the linear zones are not printed "
        f"and decide: each has a lower limit (gain times half a sample: {LEAST[0]:.2f} rad/s, {LEAST[1]:.2f} and "
        f"{LEAST[2]:.2f} m/s^2). Two readings: "
        + "; ".join(f"{tuple(z['widths'])} gives a spectral radius of {z['spectral_radius']:.4f}" for z in zones)
        + "."
    )
    return Finding(computed, verdict, reading)


@TOPIC.part("sampling", "100 Hz: chatter and linear zones", 2.5)
def sampling(scope: Scope) -> PartResult:
    """100 Hz and the widths of the linear zones."""
    return PartResult(TOPIC.found(), [zone_table()], [chatter(), zone_widths(31 if scope.quick else 121)])


@TOPIC.part("moving-forces", "The lag of the front-rear split", 0.2)
def moving_forces(_: Scope) -> PartResult:
    """The lag of the split while the true forces move."""
    return PartResult(figures=[tracking()])


def zone_table() -> Table:
    """Readings of the unprinted widths."""
    rows: list[list[Cell]] = []
    above = tuple(1.1 * width for width in LEAST)
    cases = (("bare sign", None), ("at the limits", LEAST), ("10 % above the limits", above), ("used here", WIDE),
             ("too narrow", NARROW))  # fmt: skip
    for name, widths in cases:
        yaw, *peaks = late_peaks(widths, starts=60).max(axis=0)
        known: list[Cell] = [round(float(w), 4) for w in (*widths, radius(widths))] if widths else [None] * 4
        rows.append([name, *known, round(float(yaw), 5), *(round(float(peak), 2) for peak in peaks)])
    return Table(
        "zone-widths",
        "The observer at 100 Hz with different widths of the linear zones (P5 prints none): spectral radius inside the "
        "zones, and largest errors after 3 s over 60 starts within the printed maxima, true forces constant.",
        ("reading", "yaw width [rad/s]", "lateral width [m/s^2]", "longitudinal width [m/s^2]", "spectral radius [1]",
         "yaw rate error [rad/s]", "front force error [N]", "rear force error [N]", "longitudinal force error [N]"),
        rows)  # fmt: skip


def chatter() -> Figure:
    """Yaw rate and front force error at 100 Hz for the sign and two linear zones."""
    upper, lower = [], []
    for widths, title in ((None, "bare sign"), (WIDE, f"linear zone {WIDE}"), (NARROW, f"linear zone {NARROW}")):
        path = error_motion(LARGEST * [0.5, 1.0, -1.0, 1.0], 2.0, SAMPLE_TIME, widths)
        time = SAMPLE_TIME * np.arange(1, len(path) + 1)
        marks: list[Mark] = [Line(time, path[:, 0], color=BLUE, width=1.0)]
        if widths is not None:
            value = radius(widths)
            text = f"spectral radius {value:.4g}: {'stable' if value < 1 else 'unstable'}"
            marks.append(Words(0.98, 0.95, text, horizontal="right", vertical="top", relative=True))
        first = widths is None
        upper.append(Panel(marks, "", "yaw rate error [rad/s]" if first else "", title))
        force = [Line(time, path[:, 1] / 1e3, color=RED, width=1.0)]
        lower.append(Panel(force, "time [s]", "front force error [kN]" if first else ""))
    return Figure(
        "chatter",
        "The same start at 100 Hz with Euler steps: error of yaw rate and front lateral force with the bare sign, and with "
        "linear zones of two widths (rad/s, m/s², m/s²; P5 prints none). The sign chatters by 0.1 rad/s and several hundred "
        "newtons; zones wide enough converge smoothly, zones narrower than gain times half a sample keep chattering.",
        "Six panels over two seconds: ragged bands for the bare sign and the narrow zone, smooth decay for the wide zone.",
        [upper, lower], size=(9.2, 4.6), share_x="all", share_y="row")  # fmt: skip


def zone_widths(points: int = 121) -> Figure:
    """Spectral radius over the widths of the linear zones."""
    yaw, across = np.geomspace(0.01, 2.0, points), np.geomspace(0.03, 10.0, points)
    field = np.array([[radius((w, a, 1.0)) for w in yaw] for a in across])
    critical = PUBLISHED[1] / (4.0 * RATE)
    limit = Level(x=LEAST[0], color=GREY, dash="dotted", width=1.2)
    plane: list[Mark] = [
        Map(yaw, across, np.log10(np.clip(field, None, 10.0)), "log₁₀ of the spectral radius [1]", "RdBu_r", -0.3, 0.3),
        Contours(yaw, across, field, [1.0], TRUTH, width=1.4, numbers=""),
        limit,
        Level(y=LEAST[1], color=GREY, dash="dotted", width=1.2),
    ]
    for widths, marker, color in ((WIDE, "o", "black"), (NARROW, "X", "white")):
        plane += [
            dots(*widths[:2], color=TRUTH, marker=marker, size=7.0, hollow=True),
            Words(1.25 * widths[0], widths[1], f"{radius(widths):.3g}", color, vertical="center"),
        ]
    cut: list[Mark] = [
        Line(yaw, [radius((w, 1.0, 1.0)) for w in yaw], "spectral radius at 1 m/s²", BLUE),
        Level(y=1.0),
        Level(y=np.exp(-RATE * SAMPLE_TIME), label="sliding motion, exp(−3.44 · 0.01)", color=GREEN, dash="dashed", width=1.0),
        limit,
        Level(x=critical, color=RED, dash="dotted", width=1.0),
        Words(0.94 * critical, 1.045, f"critical damping\n{critical:.2f} rad/s", RED, horizontal="right"),
    ]  # fmt: skip
    name = "width of the yaw rate zone [rad/s]"
    return Figure(
        "zone-widths",
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


def tracking() -> Figure:
    """How well the split is followed while the true forces move."""
    frequency = np.geomspace(0.02, 5.0, 200)
    x = Axis("frequency of the slalom [Hz]", scale="log", ticks=(0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5))
    slow = Line(frequency, 2.0 * np.pi * frequency / RATE, "2πf / 3.44, slow motion", TRUTH, "dashed", 1.0)
    shares: list[Mark] = []
    forces: list[Mark] = []
    for width, color in ((0.05, ORANGE), (WIDE[0], BLUE), (0.7, GREEN)):
        share = split_tracking(frequency, width)
        force = CAR.yaw_inertia * 2.0 * np.pi * frequency * LARGEST[0] * share / WHEELBASE
        shares.append(Line(frequency, share, f"yaw rate zone {width:g} rad/s", color))
        forces.append(Line(frequency, force, color=color))
    for name in ("F_y1", "F_y2"):
        mean, largest = (PRINTED["slalom"]["forces"][name][key] for key in ("mean", "largest"))
        amplitude = 0.5 * np.pi * 0.01 * mean * largest  # of a sine with this mean size
        text = f"mean {mean:g} % of {name} (Table 1)"
        forces += [
            Level(y=amplitude, color=RED, dash="dotted", width=1.1),
            Words(5.0, 0.9 * amplitude, text, RED, horizontal="right", vertical="top"),
        ]
    return Figure(
        "tracking",
        "What the proof of Appendix A leaves out: true forces that move. Left: share of the front-rear split that the "
        "observer misses in steady oscillation, printed gains, linear zones of three widths. Slow motion is followed with a "
        "lag of 0.29 s whatever the width. Right: the force error that follows on both axles for the printed largest yaw "
        "rate (33.6 deg/s; the split is yaw inertia times yaw acceleration). The means of Table 1 (red) belong to a slalom "
        "slower than about 0.25 Hz by this bound; the paper prints neither speed nor period.",
        "Left: three curves of the relative error rising with frequency to about one. Right: force error rising with the "
        "square of the frequency, crossed by two red lines.",
        [Panel([*shares, slow], x, Axis("split error / true split [1]", 0.02, 3.0, "log"), legend="lower right"),
         Panel(forces, x, Axis("amplitude of the error of each axle force [N]", 5.0, 2e4, "log"))], size=(9.2, 3.6))  # fmt: skip
