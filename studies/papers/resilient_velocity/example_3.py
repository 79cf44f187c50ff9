"""Example 3: drops with p = 0.2, and drops in any pattern."""

from __future__ import annotations

import numpy as np

from analysis.drops.frozen import drop_radius
from analysis.markov.second_moment import spectral_radius
from analysis.switching.joint_spectral_radius import joint_spectral_radius
from estimators.arrays import FloatArray
from studies.claim import ClaimVerdict, Finding, reproduced
from studies.papers.plain import by_speed, floats
from studies.papers.resilient_velocity.drops import harmless_from, met_at, radius, updates
from studies.papers.resilient_velocity.inputs import COLOUR, FINE, PACKAGE, PRINTED, SPEED_AXIS, Setting
from studies.papers.topic import Topic
from studies.papers.verdicts import among_readings
from studies.plots import Axis, Figure, Level, Line, Mark, Panel
from studies.plots.colours import GREY
from studies.study import PartResult, Scope

TOPIC = Topic(PACKAGE)
HALF_DIGIT = 5e-5
SHOWN = np.array([0.0, 10.0, 40.0, 140.0])
PATTERN_SPEEDS = (1.0, 10.0, 20.0, 25.0, 30.0, 40.0, 80.0, 140.0)  # rad/s
WIDTH = 1e-5  # relative width of the brackets, and what counts as 1


def tustin_radius(setting: Setting) -> FloatArray:
    """Second-moment radius over `FINE` with (I - A_e T/2)^-1 (I + A_e T/2), longitudinal: it keeps stability, too."""
    half = 0.5 * setting.sample_time * setting.error("longitudinal", FINE)[0]
    update = np.asarray(np.linalg.solve(np.eye(2) - half, np.eye(2) + half), np.float64)
    return drop_radius(setting.dropped("longitudinal", FINE), update, setting.example_drop)


@TOPIC.claim("P3-ex3")
def twenty_percent(setting: Setting = PRINTED) -> Finding:
    """The print against every wheel speed, another discretisation, swapped probabilities and the lateral observer."""
    p = setting.example_drop
    found, other = radius(setting, "longitudinal", FINE, p), tustin_radius(setting)
    swapped, lateral = met_at(setting, "longitudinal", 1.0 - p), met_at(setting, "lateral", p)
    computed = {
        "longitudinal": by_speed(SHOWN, radius(setting, "longitudinal", SHOWN, p)),
        "range_over_0_to_140": [float(found.min()), float(found.max())],
        "tustin_range_over_0_to_140": [float(other.min()), float(other.max())],
        "with_p_0.8_met_at_rad_per_s": swapped, "lateral_met_at_rad_per_s": lateral,
    }  # fmt: skip
    reading = (
        f"The wheel speed is not stated, but no wheel speed in 0..140 rad/s gives the print: {found.min():.4f} to "
        f"{found.max():.4f} with the exact update, up to {other.max():.4f} with Tustin's. "
        + ("" if swapped is None else f"It is met with the probabilities swapped (p = {1.0 - p:g}) at {swapped:.2f} rad/s")
        + ("." if lateral is None else f", or by the lateral observer with p = {p:g} at {lateral:.2f} rad/s.")
    )  # fmt: skip
    verdict = among_readings(np.concatenate([found, other]), TOPIC.printed("P3-ex3"), HALF_DIGIT)
    return Finding(computed, verdict, reading)


@TOPIC.claim("P3-ex3-arb")
def any_pattern(setting: Setting = PRINTED) -> Finding:
    """Proved brackets of the joint spectral radius of the received and the dropped update."""
    A0, A1 = updates(setting, "longitudinal", PATTERN_SPEEDS)
    found = [joint_spectral_radius(np.stack([b, a]), tolerance=WIDTH) for a, b in zip(A0, A1, strict=True)]
    named = {f"{w:g}": bracket for w, bracket in zip(PATTERN_SPEEDS, found, strict=True)}
    marginal = [j.lower >= 1.0 and j.upper <= 1.0 + WIDTH for j in found]
    grows = {w: j for w, j in named.items() if j.lower > 1.0 + WIDTH}
    always = spectral_radius(setting.dropped("longitudinal", FINE))
    start = harmless_from(setting, "longitudinal")
    computed = {
        "joint_spectral_radius": {w: [j.lower, j.upper] for w, j in named.items()},
        "worst_pattern_drops_to_one_update": {w: len(j.product) - 1 for w, j in grows.items()},
        "marginal_from_rad_per_s": start, "radius_with_every_sample_lost": floats([always.min(), always.max()]),
    }  # fmt: skip
    worst = max(named, key=lambda w: named[w].lower)
    below = (
        f"; below, one update after several lost samples overshoots and a pattern grows, by {named[worst].lower:.3f} a "
        f"sample at {worst} rad/s (proved from below and above)" if grows else
        f"; no growing pattern was found elsewhere, and {len(found) - sum(marginal)} brackets stay open"
    )  # fmt: skip
    return Finding(
        computed,
        reproduced(all(marginal), ClaimVerdict.PARTLY if any(marginal) else ClaimVerdict.NOT_REPRODUCED),
        "With every sample lost the radius is 1 exactly, the integrator. Under any pattern of losses that is the worst only "
        + ("at no wheel speed" if start is None else f"from {start:.2f} rad/s on")
        + ("" if all(marginal) else below)
        + ". The wheel speed of the example is not stated.",
    )


@TOPIC.part("example-3", "Example 3", 1.2)
def example_3(_: Scope) -> PartResult:
    """Example 3."""
    return PartResult(TOPIC.found(), (), [readings_figure()])


def readings_figure(setting: Setting = PRINTED) -> Figure:
    """Example 3 under two discretisations that keep stability."""
    p, printed = setting.example_drop, TOPIC.printed("P3-ex3")
    x, y = COLOUR["longitudinal"], COLOUR["lateral"]
    marks: list[Mark] = [
        Line(FINE, radius(setting, "longitudinal", FINE, p), "longitudinal, exact update", x, width=1.9),
        Line(FINE, tustin_radius(setting), "longitudinal, Tustin's update", x, "dashed"),
        Line(FINE, radius(setting, "lateral", FINE, p), "lateral, exact update", y, "dash-dot"),
        Level(y=printed, label=f"printed, {printed}", color=GREY, dash="dotted", width=1.0),
    ]
    return Figure(
        "example-3-readings",
        f"Example 3 under the readings that its text allows: spectral radius of the second moment with {p:.0%} of "
        "the force measurements lost, over the wheel speed, which is not stated. The printed 0.9026 belongs to the "
        "lateral observer near 51 rad/s, not to the longitudinal gain that the example names.",
        "Four lines over wheel speed; the two longitudinal ones fall from 0.47 and 0.88 and stay below the printed "
        "level, the lateral one crosses it near 51 rad/s.",
        Panel(marks, SPEED_AXIS, Axis("second-moment radius ρ [1]", 0.0, 1.0), legend="center right"),
        size=(7.2, 3.6),
    )
