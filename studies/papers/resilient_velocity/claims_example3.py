"""Example 3: drops with p = 0.2, and drops in any pattern."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from analysis.dropout import drop_radius
from analysis.joint_spectral_radius import joint_spectral_radius
from analysis.second_moment import spectral_radius
from studies.claim import ClaimFunction, ClaimVerdict, Finding, judged
from studies.papers.plain import by_speed, floats
from studies.papers.resilient_velocity.drops import harmless_from, radius, updates
from studies.papers.resilient_velocity.setting import HIGHEST_SPEED, PRINTED, Setting
from studies.papers.verdicts import among_readings
from synthesis.polynomials.matrix import FloatArray

PRINTED_RADIUS, HALF_DIGIT = 0.9026, 5e-5
SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 281)
SHOWN = np.array([0.0, 10.0, 40.0, 140.0])
PATTERN_SPEEDS = (1.0, 10.0, 20.0, 25.0, 30.0, 40.0, 80.0, 140.0)  # rad/s
WIDTH = 1e-5  # relative width of the brackets, and what counts as 1


def tustin(setting: Setting, speeds: FloatArray) -> FloatArray:
    """(I - A_e T/2)^-1 (I + A_e T/2), longitudinal: another discretisation that keeps stability."""
    half = 0.5 * setting.sample_time * setting.error("longitudinal", speeds)[0]
    return np.asarray(np.linalg.solve(np.eye(2) - half, np.eye(2) + half), np.float64)


def met_at(function: Callable[[float], float], level: float) -> float | None:
    """A wheel speed in rad/s at which a function of it equals `level`; None without a change of sign on the grid."""
    values = np.array([function(float(w)) for w in SPEEDS[::10]]) - level
    change = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    if not len(change):
        return None
    low, high = SPEEDS[::10][change[0] : change[0] + 2]
    return float(brentq(lambda w: function(w) - level, low, high, xtol=1e-10))


def twenty_percent(setting: Setting = PRINTED) -> Finding:
    """P3-ex3."""
    p = setting.example_drop
    found = radius(setting, "longitudinal", SPEEDS, p)
    other = drop_radius(setting.dropped("longitudinal", SPEEDS), tustin(setting, SPEEDS), p)
    swapped = met_at(lambda w: float(radius(setting, "longitudinal", w, 1.0 - p)[0]), PRINTED_RADIUS)
    lateral = met_at(lambda w: float(radius(setting, "lateral", w, p)[0]), PRINTED_RADIUS)
    computed = {
        "longitudinal": by_speed(SHOWN, radius(setting, "longitudinal", SHOWN, p)),
        "range_over_0_to_140": [float(found.min()), float(found.max())],
        "tustin_range_over_0_to_140": [float(other.min()), float(other.max())],
        "with_p_0.8_met_at_rad_per_s": swapped,
        "lateral_met_at_rad_per_s": lateral,
    }
    return Finding(
        computed,
        among_readings(np.concatenate([found, other]), PRINTED_RADIUS, HALF_DIGIT),
        f"The wheel speed is not stated, but no wheel speed in 0..140 rad/s gives the print: {found.min():.4f} to "
        f"{found.max():.4f} with the exact update, up to {other.max():.4f} with Tustin's. "
        + (
            ""
            if swapped is None
            else f"It is met with the probabilities swapped (p = {1.0 - p:g}) at {swapped:.2f} rad/s"
        )
        + ("." if lateral is None else f", or by the lateral observer with p = {p:g} at {lateral:.2f} rad/s."),
    )


def any_pattern(setting: Setting = PRINTED) -> Finding:
    """P3-ex3-arb: proved brackets of the joint spectral radius of the received and the dropped update."""
    A0, A1 = updates(setting, "longitudinal", PATTERN_SPEEDS)
    found = [joint_spectral_radius(np.stack([b, a]), tolerance=WIDTH) for a, b in zip(A0, A1, strict=True)]
    marginal = [j.lower >= 1.0 and j.upper <= 1.0 + WIDTH for j in found]
    grows = [j.lower > 1.0 + WIDTH for j in found]
    always = spectral_radius(setting.dropped("longitudinal", SPEEDS))
    start = harmless_from(setting, "longitudinal")
    computed = {
        "joint_spectral_radius": {f"{w:g}": [j.lower, j.upper] for w, j in zip(PATTERN_SPEEDS, found, strict=True)},
        "worst_pattern_drops_to_one_update": {
            f"{w:g}": len(j.product) - 1 for w, j, g in zip(PATTERN_SPEEDS, found, grows, strict=True) if g
        },
        "marginal_from_rad_per_s": start,
        "radius_with_every_sample_lost": floats([always.min(), always.max()]),
    }
    verdict = judged(all(marginal), ClaimVerdict.PARTLY if any(marginal) else ClaimVerdict.NOT_REPRODUCED)
    worst = max(found, key=lambda j: j.lower)
    undecided = len(found) - sum(marginal) - sum(grows)
    below = (
        f"; below, one update after several lost samples overshoots and a pattern grows, by {worst.lower:.3f} a "
        f"sample at {PATTERN_SPEEDS[found.index(worst)]:g} rad/s (proved from below and above)"
        if any(grows)
        else f"; no growing pattern was found elsewhere, and {undecided} brackets stay open"
    )
    return Finding(
        computed,
        verdict,
        "With every sample lost the radius is 1 exactly, the integrator. Under any pattern of losses that is the "
        "worst only "
        + ("at no wheel speed" if start is None else f"from {start:.2f} rad/s on")
        + ("" if all(marginal) else below)
        + ". The wheel speed of the example is not stated.",
    )


CLAIMS: dict[str, ClaimFunction] = {"P3-ex3": twenty_percent, "P3-ex3-arb": any_pattern}
