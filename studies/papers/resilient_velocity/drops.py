"""Lost force measurements (24), (25): Figs 7 and 8, Remark 4, Example 3, and the radius over wheel speed and drop probability."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from analysis.drops.frozen import critical_drop_probability, drop_radius, mean_square_stable_intervals
from analysis.markov.second_moment import spectral_radius
from analysis.markov.system import MarkovJumpSystem
from analysis.switching.joint_spectral_radius import joint_spectral_radius
from estimators.arrays import FloatArray
from studies.claim import Finding, JsonValue, agrees, reproduced
from studies.papers.plain import by_speed, column_table, floats
from studies.papers.resilient_velocity import inputs
from studies.papers.resilient_velocity.inputs import COLOUR, DIRECTIONS, FINE, PRINTED, SPEED_AXIS, SPEEDS, Setting
from studies.papers.topic import Topic
from studies.papers.verdicts import among_readings, derived, open_choice, partly
from studies.plots import DASHES, Axis, Contours, Figure, Level, Line, Map, Mark, Panel, Words, dots
from studies.plots.colours import CURVES, GREY, ORANGE
from studies.study import Table
from synthesis.models.catalogue.corner import Direction

TOPIC = Topic(inputs.PACKAGE)
SLOW = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 28.0)
SHOWN, TABLE_SPEEDS = np.array([*SLOW, 60.0, 140.0]), np.array([*SLOW, 40.0, 80.0, 140.0])
FIG8_SPEEDS, FIG8_DROPS = np.array([0.0, 40.0, 140.0]), (0.2, 0.5, 0.8)
EXAMPLE_SPEEDS = np.array([0.0, 10.0, 40.0, 140.0])
PATTERN_SPEEDS = (1.0, 10.0, 20.0, 25.0, 30.0, 40.0, 80.0, 140.0)  # rad/s
WIDTH = 1e-5  # relative width of the brackets of Example 3, and what counts as 1
PRINTED_RADIUS = TOPIC.printed("P3-ex3")
REMARK_SPEED, REMARK_DROP = 10.0, 0.6  # inside the stable range: p_cr = 0.706 there
LEVELS = {
    "longitudinal": (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1),
    "lateral": (0.86, 0.88, 0.9, 0.92, 0.94, 0.96, 0.98),
}


def updates(setting: Setting, direction: Direction, speeds: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """exp(A T) of a dropped and exp(A_e T) of a received sample, (g, 2, 2) each."""
    return setting.dropped(direction, speeds), setting.sampled(direction, speeds)


def critical(setting: Setting, direction: Direction, speeds: ArrayLike) -> FloatArray:
    """The critical drop probability (g,) of Fig. 7."""
    return critical_drop_probability(*updates(setting, direction, speeds))


def radius(setting: Setting, direction: Direction, speeds: ArrayLike, probability: ArrayLike) -> FloatArray:
    """Second-moment radius of Fig. 8; speeds (g,), probability broadcasts with (g,)."""
    return drop_radius(*updates(setting, direction, speeds), probability)


def persistent(setting: Setting, direction: Direction, speeds: ArrayLike) -> FloatArray:
    """e_2' A_1 [1/a, 1]' (g,): what one received sample makes of the only error that the open loop keeps.

    After many dropped samples the error is a multiple of [1/a, 1]', the eigenvector of A_0 to its eigenvalue 1; a received
    one and then many dropped ones multiply it by this number. A size above 1 means growth.
    """
    A1 = setting.sampled(direction, speeds)
    a = setting.rolling_rate(direction, np.atleast_1d(np.asarray(speeds, float)))
    return np.asarray(A1[..., 1, 0] / a + A1[..., 1, 1])


def harmless_from(setting: Setting, direction: Direction) -> float | None:
    """The wheel speed in rad/s from which every drop probability below 1 is mean-square stable; None if there is none.

    Raises ValueError if |persistent| crosses 1 more than once on 0..140 rad/s.
    """
    grid = np.linspace(1e-3, SPEEDS[-1], 2001)
    above = np.abs(persistent(setting, direction, grid)) > 1.0
    changes = np.flatnonzero(above[1:] != above[:-1])
    if len(changes) > 1:
        raise ValueError(f"{direction}: |e2' A1 [1/a, 1]'| crosses 1 more than once; no single speed separates")
    if not len(changes):
        return None
    low, high = grid[changes[0]], grid[changes[0] + 1]
    return float(brentq(lambda w: abs(float(persistent(setting, direction, w)[0])) - 1.0, low, high, xtol=1e-12))


def met_at(setting: Setting, direction: Direction, probability: float) -> float | None:
    """A wheel speed in rad/s at which the radius is what Example 3 prints."""
    return inputs.crossing(lambda w: float(radius(setting, direction, w, probability)[0]), PRINTED_RADIUS, SPEEDS[::5])


@TOPIC.claim("P3-pcr")
def critical_probability(setting: Setting = PRINTED) -> Finding:
    """One probability separates stable from unstable at every wheel speed, and Example 3 lies below it."""
    computed: dict[str, JsonValue] = {}
    holds, lowest, words = True, dict[str, float](), list[str]()
    for direction in DIRECTIONS:
        found, start = critical(setting, direction, SPEEDS), harmless_from(setting, direction)
        for p, *pair in zip(found[::10], *updates(setting, direction, SPEEDS[::10]), strict=True):
            stable = mean_square_stable_intervals(*pair)
            holds &= len(stable) == 1 and stable[0][0] == 0.0 and agrees(stable[0][1], float(p), 1e-9)
        lowest[direction] = float(found.min())
        computed[direction] = by_speed(SHOWN, critical(setting, direction, SHOWN))
        computed[f"{direction}_is_1_from_rad_per_s"] = start
        words.append(f"{direction} {found[0]:.3f} at standstill")
        words[-1] += "" if start is None else f", 1 from {start:.2f} rad/s on"
    below = all(value > setting.example_drop for value in lowest.values())
    return Finding({**computed, "smallest": lowest}, reproduced(holds and below), (
        "Fig. 7 prints no numbers; what it says is checked, for exp(A T) while dropped and exp(A_e T) otherwise, T = 5 ms: "
        + ("one critical probability separates stable from unstable at every wheel speed" if holds else
           "no single probability separates")
        + f" ({'; '.join(words)}), and p = {setting.example_drop:g} of Example 3 lies "
        + ("below it everywhere." if below else "above it somewhere.")))  # fmt: skip


@TOPIC.claim("P3-pcr-exact")
def exact_critical_probability(setting: Setting = PRINTED) -> Finding:
    """The closed form against bisection of the radius, and against the condition for p_cr = 1."""
    computed: dict[str, float] = {}
    holds = True
    for direction in DIRECTIONS:
        speeds = np.concatenate([[0.0, 0.25, 0.5, 0.75], SPEEDS[1:]])
        found = critical(setting, direction, speeds)
        apart = float(np.abs(found - bisected(*updates(setting, direction, speeds))).max())
        one = np.abs(persistent(setting, direction, speeds[1:])) <= 1.0
        computed[f"{direction}_largest_difference_from_bisection"] = apart
        computed[f"{direction}_speeds_with_p_cr_1"] = int(one.sum())
        holds &= apart <= 1e-10 and bool(np.array_equal(found[1:] == 1.0, one))
    return Finding(computed, derived(holds), (
        "p_cr = 1/mu with mu the largest real eigenvalue of (I - S(A1))^-1 (S(A0) - S(A1)) on the 3 x 3 symmetric "
        "square; the integrator of A0 puts an exact root at p = 1, which is divided out, so a quadratic remains. "
        "p_cr = 1 if and only if |e2' A1 [1/a, 1]'| <= 1, a = kappa R_e |omega|."))  # fmt: skip


def bisected(A0: FloatArray, A1: FloatArray, steps: int = 50) -> FloatArray:
    """The drop probability (g,) at which the radius reaches 1, by bisection between 0 and just below 1; 1 if it does not."""
    low, high = np.zeros(len(A0)), np.full(len(A0), 1.0 - 1e-7)
    unstable = drop_radius(A0, A1, high) > 1.0
    for _ in range(steps):
        middle = 0.5 * (low + high)
        above = drop_radius(A0, A1, middle) >= 1.0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(unstable, 0.5 * (low + high), 1.0)


@TOPIC.claim("P3-fig8")
def radius_under_drops(setting: Setting = PRINTED) -> Finding:
    """The drop probability of the figure is not stated."""
    readings = {p: {d: radius(setting, d, FIG8_SPEEDS, p) for d in DIRECTIONS} for p in FIG8_DROPS}
    computed = {f"{d}_p_{p:g}": by_speed(FIG8_SPEEDS, readings[p][d]) for d in DIRECTIONS for p in FIG8_DROPS}
    verdict = open_choice([np.concatenate(list(readings[p].values())) for p in FIG8_DROPS], 1e-3)
    return Finding(computed, verdict, (
        "The drop probability of the figure is not stated: p = 0.2, 0.5 and 0.8 give different curves, at standstill "
        + ", ".join(f"{readings[p]['longitudinal'][0]:.3f}" for p in FIG8_DROPS)
        + " longitudinally. The curve of any p follows from (22) with (25)."))  # fmt: skip


@TOPIC.claim("P3-rem4")
def detectable_mixture(setting: Setting = PRINTED) -> Finding:
    """The dropped update alone is marginal, the mixture below p_cr is mean-square stable."""
    A0, A1 = (stack[0] for stack in updates(setting, "longitudinal", REMARK_SPEED))
    alone = float(np.abs(np.linalg.eigvals(A0)).max())
    integrator = bool(A0[1, 1] == 1.0 and A0[1, 0] == 0.0)
    p_cr = float(critical(setting, "longitudinal", REMARK_SPEED)[0])
    mixed = float(drop_radius(A0, A1, REMARK_DROP))
    chance = [1.0 - REMARK_DROP, REMARK_DROP]
    system = MarkovJumpSystem(np.stack([A1, A0]), np.array([chance, chance]))
    moment = np.trace(system.propagate_second_moment(np.eye(2), chance, 400), axis1=-2, axis2=-1).sum(-1)
    growth = float((moment[-1] / moment[-51]) ** (1.0 / 50.0))
    holds = integrator and alone == 1.0 and p_cr > REMARK_DROP and mixed < 1.0 and agrees(growth, mixed, 1e-9)
    holds &= all(bool((critical(setting, d, SPEEDS) <= 1.0).all()) for d in DIRECTIONS)
    computed = {
        "radius_without_force": alone, "growth_of_second_moment_at_p_0.6_and_10_rad_per_s": growth,
        "second_moment_radius": mixed, "p_cr_at_10_rad_per_s": p_cr}  # fmt: skip
    return Finding(computed, derived(holds), (
        "Without the force the velocity error is an exact integrator, eigenvalue 1, and does not decay by itself; "
        f"the mixture does: at {REMARK_SPEED:g} rad/s and p = {REMARK_DROP:g} the second moment falls by the factor "
        f"{growth:.6f} a sample, which is the radius of (22)."))  # fmt: skip


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
        "longitudinal": by_speed(EXAMPLE_SPEEDS, radius(setting, "longitudinal", EXAMPLE_SPEEDS, p)),
        "range_over_0_to_140": [float(found.min()), float(found.max())],
        "tustin_range_over_0_to_140": [float(other.min()), float(other.max())],
        "with_p_0.8_met_at_rad_per_s": swapped, "lateral_met_at_rad_per_s": lateral}  # fmt: skip
    reading = (
        f"The wheel speed is not stated, but no wheel speed in 0..140 rad/s gives the print: {found.min():.4f} to "
        f"{found.max():.4f} with the exact update, up to {other.max():.4f} with Tustin's. "
        + ("" if swapped is None else f"It is met with the probabilities swapped (p = {1.0 - p:g}) at {swapped:.2f} rad/s")
        + ("." if lateral is None else f", or by the lateral observer with p = {p:g} at {lateral:.2f} rad/s."))  # fmt: skip
    verdict = among_readings(np.concatenate([found, other]), PRINTED_RADIUS, 5e-5)
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
        "marginal_from_rad_per_s": start, "radius_with_every_sample_lost": floats([always.min(), always.max()])}  # fmt: skip
    worst = max(named, key=lambda w: named[w].lower)
    below = (
        f"; below, one update after several lost samples overshoots and a pattern grows, by {named[worst].lower:.3f} a "
        f"sample at {worst} rad/s (proved from below and above)" if grows else
        f"; no growing pattern was found elsewhere, and {len(found) - sum(marginal)} brackets stay open")  # fmt: skip
    return Finding(computed, partly(all(marginal), any(marginal)), (
        "With every sample lost the radius is 1 exactly, the integrator. Under any pattern of losses that is the worst only "
        + ("at no wheel speed" if start is None else f"from {start:.2f} rad/s on")
        + ("" if all(marginal) else below)
        + ". The wheel speed of the example is not stated."))  # fmt: skip


def _table() -> Table:
    columns: dict[str, ArrayLike] = {"wheel speed [rad/s]": TABLE_SPEEDS}
    p = PRINTED.example_drop
    for d in DIRECTIONS:
        columns[f"{d}, critical drop probability [1]"] = critical(PRINTED, d, TABLE_SPEEDS)
        columns[f"{d}, radius at p = {p:g} [1]"] = radius(PRINTED, d, TABLE_SPEEDS, p)
    return column_table("drops",
        "Critical drop probability of the force measurement and second-moment radius at the drop probability of Example 3, "
        "exact update at 200 Hz, printed gains.", columns)  # fmt: skip


def _critical_figure() -> Figure:
    near = np.linspace(0.0, 2.0, 201)
    panels: list[list[Mark]] = [[], []]
    for direction, dash in zip(DIRECTIONS, DASHES, strict=False):
        colour, start = COLOUR[direction], harmless_from(PRINTED, direction)
        for marks, speeds in zip(panels, (FINE, near), strict=True):
            marks.append(Line(speeds, critical(PRINTED, direction, speeds), direction, colour, dash, 1.9))
        if start is not None:
            words = Words(start, 1.0, f"1 from {start:.2f} rad/s", colour, offset=(5, -13))
            panels[int(start <= near[-1])] += [dots(start, 1.0, color=colour, size=6, hollow=True), words]
    p = PRINTED.example_drop
    panels[0].append(Level(y=p, label=f"p = {p:g} of Example 3", color=GREY, dash="dotted", width=1.0))
    y = Axis("critical drop probability [1]", 0.0, 1.05)
    return Figure("fig-7-critical-drop-probability",
        "Fig. 7 regenerated: critical drop probability of the force measurement over the wheel speed, printed "
        "gains, exact update at 200 Hz. Below a curve the error is mean-square stable. It is 1, every loss below "
        "100 % is survived, from the circles on. Right: near standstill the lateral value is below 1 as well.",
        "Longitudinal curve rising from 0.577 at standstill to 1 at 28 rad/s, lateral curve rising from 0.957 to 1 "
        "within the first 0.84 rad/s.",
        [Panel(panels[0], SPEED_AXIS, y, "whole range", legend="center right"),
         Panel(panels[1], Axis(SPEED_AXIS.label, 0.0, near[-1]), y, "near standstill")], (9.2, 3.7))  # fmt: skip


def _radius_figure() -> Figure:
    panels, label, p = [], f"{PRINTED_RADIUS} of Example 3", PRINTED.example_drop
    for d, low, high, other in zip(DIRECTIONS, (0.0, 0.82), (1.25, 1.01), (1.0 - p, p), strict=True):
        marks: list[Mark] = [
            Line(FINE, radius(PRINTED, d, FINE, q), f"p = {q:g}", colour, dash)
            for q, colour, dash in zip((0.2, 0.4, 0.5, 0.6, 0.8), CURVES, DASHES, strict=False)
        ]
        marks += [Level(y=1.0), Level(y=PRINTED_RADIUS, label=label, color=GREY, dash="dotted", width=1.0)]
        met = met_at(PRINTED, d, other)
        if met is not None:
            marks.append(dots(met, PRINTED_RADIUS, color="0.1", size=6, hollow=True))
        panels.append(Panel(marks, SPEED_AXIS, Axis("second-moment radius ρ [1]", low, high), d))
    return Figure("fig-8-radius-under-drops",
        "Fig. 8 regenerated for five drop probabilities, as the paper does not state its own: spectral radius of the second "
        "moment of the error over the wheel speed, printed gains, exact update at 200 Hz. Above 1 the mean square grows. "
        "Dotted: the 0.9026 that Example 3 prints for the longitudinal observer at p = 0.2; the blue curve of the left panel "
        "never comes near it. Circles: where other readings meet it, p = 0.8 longitudinally and p = 0.2 laterally.",
        "Two panels of radius over wheel speed: longitudinal curves fall from up to 1.2 towards their drop "
        "probability, lateral curves, on a finer scale, rise slowly towards 1.",
        panels, (9.2, 3.9), "below", 6)  # fmt: skip


def _map_figure() -> Figure:
    probabilities = np.linspace(0.0, 1.0, 101)
    panels = []
    for d, label in zip(DIRECTIONS, ("", "second-moment radius ρ [1]"), strict=True):
        found, border = radius(PRINTED, d, SPEEDS, probabilities[:, None]), critical(PRINTED, d, FINE)
        marks: list[Mark] = [
            Map(SPEEDS, probabilities, found, label, low=0.2, high=1.2),
            Contours(SPEEDS, probabilities, found, LEVELS[d], "white", width=0.7),
            Line(FINE, np.where(border < 1.0, border, np.nan), color=ORANGE, width=2.0)]  # fmt: skip
        panels.append(Panel(marks, SPEED_AXIS, "drop probability p [1]", d, grid=False))
    return Figure("radius-map",
        "Second-moment radius of the error over wheel speed and drop probability, printed gains, exact update at "
        "200 Hz. Orange: the critical drop probability, radius 1; unstable above it. At p = 1 the radius is 1 "
        "everywhere, the integrator of the velocity error.",
        "Two maps; the longitudinal one has an unstable region in the upper left corner, below 28 rad/s and above "
        "58 to 100 per cent drops; the lateral one practically none.",
        panels, (9.2, 4.0), share_y="all")  # fmt: skip


def _readings_figure() -> Figure:
    p, (x, y) = PRINTED.example_drop, COLOUR.values()
    marks: list[Mark] = [
        Line(FINE, radius(PRINTED, "longitudinal", FINE, p), "longitudinal, exact update", x, width=1.9),
        Line(FINE, tustin_radius(PRINTED), "longitudinal, Tustin's update", x, "dashed"),
        Line(FINE, radius(PRINTED, "lateral", FINE, p), "lateral, exact update", y, "dash-dot"),
        Level(y=PRINTED_RADIUS, label=f"printed, {PRINTED_RADIUS}", color=GREY, dash="dotted", width=1.0)]  # fmt: skip
    return Figure("example-3-readings",
        f"Example 3 under the readings that its text allows: spectral radius of the second moment with {p:.0%} of "
        "the force measurements lost, over the wheel speed, which is not stated. The printed 0.9026 belongs to the "
        "lateral observer near 51 rad/s, not to the longitudinal gain that the example names.",
        "Four lines over wheel speed; the two longitudinal ones fall from 0.47 and 0.88 and stay below the printed "
        "level, the lateral one crosses it near 51 rad/s.",
        Panel(marks, SPEED_AXIS, Axis("second-moment radius ρ [1]", 0.0, 1.0), legend="center right"), (7.2, 3.6))  # fmt: skip


TOPIC.show(
    "drops", "Lost force measurements (Figs 7 and 8)", 1.4, ("P3-pcr", "P3-pcr-exact", "P3-fig8", "P3-rem4"),
    [_table], [_critical_figure, _radius_figure, _map_figure], [inputs.NOTE])  # fmt: skip
TOPIC.show("example-3", "Example 3", 1.2, ("P3-ex3", "P3-ex3-arb"), figures=[_readings_figure])
