"""(20) to (23), Example 2 and Fig. 6: the two gains switched in any order, and by a Markov chain."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat
from numpy.typing import ArrayLike

from analysis.exact import Rational, rationals
from analysis.markov.second_moment import lifted, spectral_radius
from analysis.markov.system import MarkovJumpSystem, second_moment_operator
from analysis.switching.joint_spectral_radius import joint_spectral_radius
from analysis.switching.pair import exact_pair_test, pair_margin
from analysis.switching.similarity import common_growth, diagonal_window
from estimators.arrays import FloatArray, IntArray
from studies.claim import Finding, reproduced
from studies.papers.plain import by_speed, column_table, floats
from studies.papers.resilient_velocity.inputs import FINE, NOTE, PACKAGE, PRINTED, SPEED_AXIS, SPEEDS, Setting, crossing
from studies.papers.topic import Topic
from studies.papers.verdicts import among_readings, derived
from studies.plots import DASHES, ZERO, Axis, Band, Figure, Level, Line, Mark, Panel, Words
from studies.plots.colours import BLUE, CURVES, GREY, RED
from studies.study import Table
from synthesis.lmi.result import Verdict as Proof

TOPIC = Topic(PACKAGE)
PROVED = (0.0, 20.0, 36.0, 38.0, 80.0, 140.0)  # rad/s, where a common quadratic function is decided in exact arithmetic
HALF_DIGIT = 5e-5
SHOWN = (8.0, 9.0, 10.0, 40.0)
STAY_NORMAL = 0.9  # p_11 of P_dry (23)
STAYS = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
CHAIN_SPEEDS = np.array([1.0, 20.0, 40.0, 80.0, 140.0])
OTHER_GAINS = (0.68, 183.1), (0.0, 0.0)  # as further modes: that of P1, longitudinal, and none
TWO, CYCLIC = np.array([[9, 1], [5, 5]]), np.array([[1, 8, 1], [1, 1, 8], [8, 1, 1]])  # P in tenths


def both_gains(setting: Setting, speeds: ArrayLike) -> FloatArray:
    """A_e of the normal and the high-slip gain, longitudinal, (2, g, 2, 2)."""
    return np.stack([setting.error("longitudinal", speeds, gain)[0] for gain in setting.switched])


def windows(setting: Setting, speeds: FloatArray) -> FloatArray:
    """The open intervals of gamma with which T = diag(gamma, 1) proves each mode stable, (mode, end, g)."""
    return np.stack([np.stack(diagonal_window(A)) for A in both_gains(setting, speeds)])


def common_function_from(setting: Setting) -> float | None:
    """The wheel speed in rad/s above which the modes share a quadratic Lyapunov function; None without a change of sign."""
    return crossing(lambda speed: float(pair_margin(*both_gains(setting, speed))[0]))


@TOPIC.claim("P3-20")
def common_decay(setting: Setting = PRINTED) -> Finding:
    """T of Proposition 1, any diagonal T, and any common quadratic function for both modes."""
    modes, T = both_gains(setting, SPEEDS), setting.transform
    worst, (normal, high_slip) = common_growth(modes, T), (common_growth(A, T) for A in modes)
    low, high = np.moveaxis(windows(setting, SPEEDS), 1, 0)
    shared, threshold = np.maximum(*low) < np.minimum(*high), common_function_from(setting)
    first, second = (setting.sampled("longitudinal", SPEEDS, gain) for gain in setting.switched)
    discrete = bool((pair_margin(first, second, discrete=True) > 0.0).all())
    proofs = {f"{w:g}": exact_pair_test(*both_gains(setting, w)[:, 0]) is Proof.CERTIFIED for w in PROVED}
    computed = {
        "lambda_bar_at_40_rad_per_s": common_growth(both_gains(setting, setting.example_speed), T),
        "lambda_bar_over_0_to_140_rad_per_s": worst, "normal_gain_alone": normal, "high_slip_gain_alone": high_slip,
        "gamma_that_proves_normal_gain": [float(low[0].min()), float(low[0].max()), float(high[0].min())],
        "gamma_that_proves_high_slip_gain_below": [float(high[1].min()), float(high[1].max())],
        "speeds_where_one_diagonal_T_serves_both": floats(SPEEDS[shared]),
        "common_quadratic_function_exists": proofs, "common_quadratic_function_from_rad_per_s": threshold,
        "sampled_modes_share_one_at_every_speed": discrete}  # fmt: skip
    return Finding(computed, reproduced(worst < 0.0), (
        f"With T = diag({setting.similarity:g}, 1) lambda_bar is {worst:+.0f} 1/s, from the high-slip gain "
        f"({high_slip:+.0f}; the normal gain alone gives {normal:+.0f}). "
        + ("No diagonal T serves both gains at any wheel speed" if not shared.any() else
           f"A diagonal T serves both gains at {int(shared.sum())} of {len(SPEEDS)} wheel speeds")
        + ("." if threshold is None else f", and below {threshold:.2f} rad/s the two continuous modes share no quadratic "
           "Lyapunov function at all (exact test).")
        + (" Sampled at 5 ms they do, at every wheel speed held." if discrete else "")))  # fmt: skip


@TOPIC.claim("P3-ex2-arb")
def arbitrary_switching(setting: Setting = PRINTED) -> Finding:
    """The printed number against the radius and its square, as the wheel speed is not stated."""

    def radius_at(speeds: ArrayLike) -> FloatArray:
        return spectral_radius(setting.sampled("longitudinal", speeds, setting.high_slip))

    published, radius, shown = TOPIC.printed("P3-ex2-arb"), radius_at(SPEEDS), radius_at(SHOWN)
    square = radius**2
    proved = joint_spectral_radius(np.stack([setting.sampled("longitudinal", 40.0, g)[0] for g in setting.switched]))
    matches = [crossing(lambda w: float(radius_at(w)[0]) ** 2, published + end) for end in (-HALF_DIGIT, HALF_DIGIT)]
    computed = {
        "second_moment_radius": by_speed(SHOWN, shown**2), "radius": by_speed(SHOWN, shown),
        "radius_over_0_to_140": [float(radius.min()), float(radius.max())],
        "square_over_0_to_140": [float(square.min()), float(square.max())],
        "speeds_where_square_rounds_to_print": matches, "joint_spectral_radius_at_40": [proved.lower, proved.upper]}  # fmt: skip
    never = among_readings(radius, published, HALF_DIGIT) == "not reproduced"
    return Finding(computed, among_readings(np.concatenate([radius, square]), published, HALF_DIGIT), (
        f"The fastest growth is that of the high-slip gain alone. Its spectral radius, {radius.min():.5f} to "
        f"{radius.max():.5f} over 0..140 rad/s, "
        + ("never rounds to the print" if never else "rounds to the print in places")
        + "; its square, the second-moment radius rho(A2 x A2), does "
        + (f"from {matches[0]:.2f} to {matches[1]:.2f} rad/s" if None not in matches else "nowhere")
        + f". The wheel speed is not stated; at 40 rad/s the square is {shown[-1] ** 2:.7f}."))  # fmt: skip


def _window_figure() -> Figure:
    normal, high_slip = windows(PRINTED, FINE)
    marks: list[Mark] = [
        Band(FINE, normal[0], normal[1], "normal gain [1.18, 387] proved", BLUE, 0.25),
        Band(FINE, high_slip[0], high_slip[1], "high-slip gain [0.22, 0.1] proved", RED, 0.5),
        Level(y=PRINTED.similarity, label=f"γ = {PRINTED.similarity:g} of Proposition 1", width=1.2)]  # fmt: skip
    threshold = common_function_from(PRINTED)
    if threshold is not None:
        words = f"no common quadratic\nfunction of any kind\nbelow {threshold:.1f} rad/s"
        marks.append(Level(x=threshold, color=GREY, dash="dotted", width=1.0))
        marks.append(Words(threshold, 1.4e5, words, offset=(6, -8), vertical="top"))
    return Figure("eq-20-windows",
        "Why (20) fails: values of γ for which T = diag(γ, 1) makes the symmetric part of the transformed error "
        "matrix negative definite, over the wheel speed, for either gain. The two bands never meet, so no diagonal "
        "T proves both gains, and the printed γ = 9000 proves the normal one only. Left of the dotted line the "
        "exact test excludes every common quadratic Lyapunov function of the two continuous modes.",
        "Two bands on a logarithmic scale: the upper one from about 125 to 200000, the lower one below 17; a "
        "horizontal line at 9000 runs inside the upper one.",
        Panel(marks, SPEED_AXIS, Axis("γ of T = diag(γ, 1) [1/s]", scale="log")), legend="below", columns=3)  # fmt: skip


def margins(setting: Setting, stays: FloatArray, speeds: FloatArray) -> FloatArray:
    """1 - rho of (22) with P_dry (23), (stay probability, wheel speed)."""
    stay = np.full_like(stays, STAY_NORMAL)
    transition = np.stack([np.stack([stay, 1.0 - stay], -1), np.stack([1.0 - stays, stays], -1)], -2)
    modes = np.stack([setting.sampled("longitudinal", speeds, gain) for gain in setting.switched], axis=1)
    return MarkovJumpSystem(modes[None], transition[:, None]).margin


@TOPIC.claim("P3-fig6")
def markov_margin(setting: Setting = PRINTED) -> Finding:
    """Positive over the whole figure, and falling as the slow mode stays longer."""
    shown = margins(setting, STAYS, CHAIN_SPEEDS)
    dense = margins(setting, np.linspace(0.0, 1.0, 41), SPEEDS[::2])
    stable, falling = bool((dense > 0.0).all()), bool((np.diff(dense, axis=0) < 0.0).all())
    computed = {
        "stay_probability": floats(STAYS), "wheel_speed_rad_per_s": floats(CHAIN_SPEEDS),
        "margin": [floats(row) for row in shown], "smallest_over_0_to_1_and_0_to_140": float(dense.min()),
        "largest_distance_from_1_minus_stay": float(np.abs(shown - (1.0 - STAYS[:, None])).max())}  # fmt: skip
    return Finding(computed, reproduced(stable and falling), (
        "Fig. 6 prints no numbers; what it shows is checked: with P_dry of (23) the switched observer is mean-square stable "
        + ("for every stay probability and wheel speed" if stable else "not everywhere")
        + f" (smallest margin {dense.min():.4f}, at 1), and the margin "
        + ("falls as high slip lasts longer" if falling else "does not fall monotonically")
        + ", close to 1 minus the probability of staying in high slip, because the normal gain takes most of "
        "the error away in one sample."))  # fmt: skip


@TOPIC.claim("P3-kron")
def orientation(setting: Setting = PRINTED) -> Finding:
    """Characteristic polynomials in exact rationals, so `identical` means identical."""
    gains = setting.gains["longitudinal"], *OTHER_GAINS
    modes = np.stack([setting.sampled("longitudinal", 10.0, gain)[0] for gain in gains])
    pair = modes[[0, 2]]
    same_side = _polynomial(pair, TWO) == _polynomial(pair, TWO, left=False)
    same_transposed = _polynomial(pair, TWO) == _polynomial(pair, TWO.T)
    three_differ = _polynomial(modes, CYCLIC) != _polynomial(modes, CYCLIC.T)
    computed = {
        "left_and_right_identical": same_side, "two_modes_P_and_transpose_identical": same_transposed,
        "three_modes_P_and_transpose_differ": three_differ,
        "two_modes": _radius(pair, TWO), "two_modes_transposed": _radius(pair, TWO.T),
        "three_modes": _radius(modes, CYCLIC), "three_modes_transposed": _radius(modes, CYCLIC.T)}  # fmt: skip
    return Finding(computed, derived(same_side and same_transposed and three_differ), (
        "The factor P' x I may stand left or right of the block matrix, and with two modes P may be transposed: "
        "the characteristic polynomials are equal in exact arithmetic, because every chain of two modes is "
        "reversible. With three modes in a cycle the transposed matrix gives another radius, so only a test with "
        "three modes can find a wrong orientation."))  # fmt: skip


def _radius(modes: FloatArray, tenths: IntArray) -> float:
    # not through MarkovJumpSystem, which refuses a transposed matrix, as it should
    return float(spectral_radius(second_moment_operator(modes, tenths / 10)))


def _polynomial(modes: FloatArray, tenths: IntArray, left: bool = True) -> Any:
    """Characteristic polynomial of (P' x I) diag(S(A_i)), or with the factors swapped, in exact rationals."""
    S = [rationals(A) for A in lifted(modes)]
    m, d = range(len(S)), range(S[0].nrows())
    # (P' x I) D has the block P_ji S_j in place (i, j), D (P' x I) the block S_i P_ji.
    entries = [fmpq(int(tenths[j, i]), 10) * S[j if left else i][r, c] for i in m for r in d for j in m for c in d]
    matrix: Rational = fmpq_mat(len(m) * len(d), len(m) * len(d), entries)
    return matrix.charpoly()


def _table() -> Table:
    found = margins(PRINTED, STAYS, CHAIN_SPEEDS)
    speeds = {f"{w:g} rad/s": column for w, column in zip(CHAIN_SPEEDS, found.T, strict=True)}
    return column_table("markov-margins",
        "Margin 1 - rho of mean-square stability with the transition matrix (23): rows by the probability of staying in high "
        "slip, columns by wheel speed.", {"probability of staying [1]": STAYS} | speeds)  # fmt: skip


def _markov_figure() -> Figure:
    stays = np.linspace(0.0, 1.0, 101)
    found, rest = margins(PRINTED, stays, CHAIN_SPEEDS), 1.0 - stays
    left, right = list[Mark](), list[Mark]([ZERO])
    for column, speed, colour, dash in zip(found.T, CHAIN_SPEEDS, CURVES, DASHES, strict=False):
        left.append(Line(stays, column, f"{speed:g} rad/s", colour, dash))
        right.append(Line(stays, column - rest, "", colour, dash))
    left.append(Line(stays, rest, "1 − γ̄", GREY, width=0.8))
    x, y = Axis("probability γ̄ of staying in high slip [1]", 0.0, 1.0), Axis("margin 1 − ρ [1]", 0.0, 1.0)
    return Figure("fig-6-markov-margin",
        "Fig. 6 regenerated: margin 1 − ρ of mean-square stability when the gain switches between [1.18, 387] "
        f"(stays with probability {STAY_NORMAL:g}) and the high-slip gain [0.22, 0.1] (stays with probability γ̄), "
        "longitudinal observer at 200 Hz, five wheel speeds. Left: the margin is positive everywhere and close to "
        "1 − γ̄. Right: the difference from 1 − γ̄, which tells the wheel speeds apart. At γ̄ = 1 a margin of "
        f"{found[-1].min():.4f} to {found[-1].max():.4f} remains, that of the high-slip gain alone.",
        "Left: five almost coinciding straight lines falling from about 0.95 to zero. Right: their difference from "
        "one minus the probability, at most 0.06 below it, at 1 rad/s.",
        [Panel(left, x, y, legend="upper right"), Panel(right, x, "margin − (1 − γ̄) [1]")], (9.2, 3.7))  # fmt: skip


TOPIC.show(
    "switching", "Switching the two gains in any order", 0.2, ("P3-20", "P3-ex2-arb"), (), [_window_figure], [NOTE])  # fmt: skip
TOPIC.show(
    "markov", "Switching by a Markov chain (Fig. 6)", 0.2, ("P3-fig6", "P3-kron"), [_table], [_markov_figure])  # fmt: skip
