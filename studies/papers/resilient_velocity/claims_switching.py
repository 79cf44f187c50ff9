"""(20) and Example 2: the two gains under arbitrary switching."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from analysis.second_moment import spectral_radius
from analysis.switching import common_growth, diagonal_window, exact_pair_test, joint_spectral_radius, pair_margin
from studies.claim import ClaimFunction, Finding, judged
from studies.papers.plain import by_speed, floats
from studies.papers.resilient_velocity.setting import HIGHEST_SPEED, PRINTED, Setting
from studies.papers.verdicts import among_readings
from synthesis.lmi.result import Verdict as Proof
from synthesis.polynomials.matrix import FloatArray

SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 141)
PROVED = (0.0, 20.0, 36.0, 38.0, 80.0, 140.0)  # rad/s, where a common quadratic function is decided in exact arithmetic
PRINTED_RADIUS, HALF_DIGIT = 0.9960, 5e-5
SHOWN = (8.0, 9.0, 10.0, 40.0)


def both_gains(setting: Setting, speeds: FloatArray) -> FloatArray:
    """A_e of the normal and the high-slip gain, longitudinal, (2, g, 2, 2)."""
    return np.stack(
        [setting.error("longitudinal", speeds, g)[0] for g in (setting.gains["longitudinal"], setting.high_slip)]
    )


def windows(setting: Setting, speeds: FloatArray) -> FloatArray:
    """The open intervals of gamma with which T = diag(gamma, 1) proves each mode stable, (mode, end, g)."""
    return np.stack([np.stack(diagonal_window(A)) for A in both_gains(setting, speeds)])


def common_function_from(setting: Setting) -> float | None:
    """The wheel speed in rad/s above which the modes share a quadratic Lyapunov function; None without a change of sign."""

    def margin(speed: float) -> float:
        first, second = both_gains(setting, np.array([speed]))
        return float(pair_margin(first, second)[0])

    if margin(0.0) * margin(HIGHEST_SPEED) >= 0.0:
        return None
    return float(brentq(margin, 0.0, HIGHEST_SPEED, xtol=1e-10))


def common_decay(setting: Setting = PRINTED) -> Finding:
    """P3-20."""
    modes = both_gains(setting, SPEEDS)
    T = setting.transform
    at = both_gains(setting, np.array([setting.example_speed]))
    worst = common_growth(modes, T)
    each = [common_growth(A, T) for A in modes]
    (low, high) = np.moveaxis(windows(setting, SPEEDS), 1, 0)
    shared = np.maximum(low[0], low[1]) < np.minimum(high[0], high[1])
    exact = {w: exact_pair_test(*both_gains(setting, np.array([w]))[:, 0]) for w in PROVED}
    threshold = common_function_from(setting)
    sampled = [setting.sampled("longitudinal", SPEEDS, g) for g in (setting.gains["longitudinal"], setting.high_slip)]
    discrete = bool((pair_margin(sampled[0], sampled[1], discrete=True) > 0.0).all())
    computed = {
        "lambda_bar_at_40_rad_per_s": common_growth(at, T),
        "lambda_bar_over_0_to_140_rad_per_s": worst,
        "normal_gain_alone": each[0],
        "high_slip_gain_alone": each[1],
        "gamma_that_proves_normal_gain": [float(low[0].min()), float(low[0].max()), float(high[0].min())],
        "gamma_that_proves_high_slip_gain_below": [float(high[1].min()), float(high[1].max())],
        "speeds_where_one_diagonal_T_serves_both": floats(SPEEDS[shared]),
        "common_quadratic_function_exists": {f"{w:g}": v is Proof.CERTIFIED for w, v in exact.items()},
        "common_quadratic_function_from_rad_per_s": threshold,
        "sampled_modes_share_one_at_every_speed": discrete,
    }
    return Finding(
        computed,
        judged(worst < 0.0),
        f"With T = diag({setting.similarity:g}, 1) lambda_bar is {worst:+.0f} 1/s, from the high-slip gain "
        f"({each[1]:+.0f}; the normal gain alone gives {each[0]:+.0f}). "
        + (
            "No diagonal T serves both gains at any wheel speed"
            if not shared.any()
            else f"A diagonal T serves both gains at {int(shared.sum())} of {len(SPEEDS)} wheel speeds"
        )
        + (
            f", and below {threshold:.2f} rad/s the two continuous modes share no quadratic Lyapunov function at all "
            "(exact test)."
            if threshold is not None
            else "."
        )
        + (" Sampled at 5 ms they do, at every wheel speed held." if discrete else ""),
    )


def arbitrary_switching(setting: Setting = PRINTED) -> Finding:
    """P3-ex2-arb: the printed number against the radius and its square, as the wheel speed is not stated."""
    radius = spectral_radius(setting.sampled("longitudinal", SPEEDS, setting.high_slip))
    square = radius**2
    shown = spectral_radius(setting.sampled("longitudinal", SHOWN, setting.high_slip))
    proved = joint_spectral_radius(
        np.stack(
            [setting.sampled("longitudinal", 40.0, g)[0] for g in (setting.gains["longitudinal"], setting.high_slip)]
        )
    )
    matches = [matching_speed(setting, PRINTED_RADIUS + s * HALF_DIGIT) for s in (-1.0, 1.0)]
    computed = {
        "second_moment_radius": by_speed(SHOWN, shown**2),
        "radius": by_speed(SHOWN, shown),
        "radius_over_0_to_140": [float(radius.min()), float(radius.max())],
        "square_over_0_to_140": [float(square.min()), float(square.max())],
        "speeds_where_square_rounds_to_print": matches,
        "joint_spectral_radius_at_40": [proved.lower, proved.upper],
    }
    never = among_readings(radius, PRINTED_RADIUS, HALF_DIGIT)
    return Finding(
        computed,
        among_readings(np.concatenate([radius, square]), PRINTED_RADIUS, HALF_DIGIT),
        f"The fastest growth is that of the high-slip gain alone. Its spectral radius, {radius.min():.5f} to "
        f"{radius.max():.5f} over 0..140 rad/s, "
        + ("never rounds to the print" if never == "not reproduced" else "rounds to the print in places")
        + "; its square, the second-moment radius rho(A2 x A2), does "
        + (
            f"from {matches[0]:.2f} to {matches[1]:.2f} rad/s"
            if matches[0] is not None and matches[1] is not None
            else "nowhere"
        )
        + f". The wheel speed is not stated; at 40 rad/s the square is {shown[-1] ** 2:.7f}.",
    )


def matching_speed(setting: Setting, level: float) -> float | None:
    """The wheel speed at which the squared radius of the high-slip gain equals `level`; None if there is none."""

    def excess(speed: float) -> float:
        return float(spectral_radius(setting.sampled("longitudinal", speed, setting.high_slip))[0]) ** 2 - level

    if excess(0.0) * excess(HIGHEST_SPEED) >= 0.0:
        return None
    return float(brentq(excess, 0.0, HIGHEST_SPEED, xtol=1e-10))


CLAIMS: dict[str, ClaimFunction] = {"P3-20": common_decay, "P3-ex2-arb": arbitrary_switching}
