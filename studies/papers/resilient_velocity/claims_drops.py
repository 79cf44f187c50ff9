"""Figs 7, 8 and Remark 4: the critical drop probability and the second moment of the error under drops."""

from __future__ import annotations

import numpy as np

from analysis.dropout import drop_radius, mean_square_stable_intervals
from analysis.markov import MarkovJumpSystem
from studies.claim import ClaimFunction, Finding, agrees, judged
from studies.papers.plain import by_speed
from studies.papers.resilient_velocity.drops import critical, harmless_from, kept, radius, updates
from studies.papers.resilient_velocity.setting import DIRECTIONS, HIGHEST_SPEED, PRINTED, Setting
from studies.papers.verdicts import derived, open_choice
from synthesis.polynomials.matrix import FloatArray

SHOWN = np.array([0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 28.0, 60.0, 140.0])
SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 141)
FIG8_SPEEDS = np.array([0.0, 40.0, 140.0])
FIG8_DROPS = (0.2, 0.5, 0.8)
REMARK_SPEED, REMARK_DROP = 10.0, 0.6  # inside the stable range: p_cr = 0.706 there
STEPS = 400


def separates(open_loop: FloatArray, closed_loop: FloatArray, p: float) -> bool:
    """Whether the drop probabilities with radius below 1 are exactly those below p."""
    pieces = mean_square_stable_intervals(open_loop, closed_loop)
    return len(pieces) == 1 and pieces[0][0] == 0.0 and agrees(pieces[0][1], p, 1e-9)


def critical_probability(setting: Setting = PRINTED) -> Finding:
    """P3-pcr."""
    computed: dict[str, object] = {}
    holds, lowest, words = True, {}, []
    for direction in DIRECTIONS:
        found = critical(setting, direction, SPEEDS)
        A0, A1 = updates(setting, direction, SPEEDS)
        holds &= all(separates(a, b, float(p)) for a, b, p in zip(A0[::10], A1[::10], found[::10], strict=True))
        lowest[direction] = float(found.min())
        start = harmless_from(setting, direction)
        computed[direction] = by_speed(SHOWN, critical(setting, direction, SHOWN))
        computed[f"{direction}_is_1_from_rad_per_s"] = start
        words.append(
            f"{direction} {found[0]:.3f} at standstill" + ("" if start is None else f", 1 from {start:.2f} rad/s on")
        )
    example = all(value > setting.example_drop for value in lowest.values())
    computed["smallest"] = lowest
    return Finding(
        computed,
        judged(holds and example),
        "Fig. 7 prints no numbers; what it says is checked, for exp(A T) while dropped and exp(A_e T) otherwise, T "
        "= 5 ms: "
        + (
            "one critical probability separates stable from unstable at every wheel speed"
            if holds
            else "no single probability separates"
        )
        + f" ({'; '.join(words)}), and p = {setting.example_drop:g} of Example 3 lies "
        + ("below it everywhere." if example else "above it somewhere."),
    )


def exact_critical_probability(setting: Setting = PRINTED) -> Finding:
    """P3-pcr-exact: the closed form against bisection of the radius, and against the condition for p_cr = 1."""
    computed: dict[str, float] = {}
    holds = True
    for direction in DIRECTIONS:
        speeds = np.concatenate([[0.0, 0.25, 0.5, 0.75], SPEEDS[1:]])
        A0, A1 = updates(setting, direction, speeds)
        found = critical(setting, direction, speeds)
        apart = float(np.abs(found - bisected(A0, A1)).max())
        one = np.abs(kept(setting, direction, speeds[1:])) <= 1.0
        same = bool(np.array_equal(found[1:] == 1.0, one))
        computed[f"{direction}_largest_difference_from_bisection"] = apart
        computed[f"{direction}_speeds_with_p_cr_1"] = int(one.sum())
        holds &= apart <= 1e-10 and same
    return Finding(
        computed,
        derived(holds),
        "p_cr = 1/mu with mu the largest real eigenvalue of (I - S(A1))^-1 (S(A0) - S(A1)) on the 3 x 3 symmetric "
        "square; the integrator of A0 puts an exact root at p = 1, which is divided out, so a quadratic remains. "
        "p_cr = 1 if and only if |e2' A1 [1/a, 1]'| <= 1, a = kappa R_e |omega|.",
    )


def bisected(A0: FloatArray, A1: FloatArray, steps: int = 50) -> FloatArray:
    """The drop probability (g,) at which the radius reaches 1, by bisection between 0 and just below 1; 1 if it does not."""
    low, high = np.zeros(len(A0)), np.full(len(A0), 1.0 - 1e-7)
    crossing = drop_radius(A0, A1, high) > 1.0
    for _ in range(steps):
        middle = 0.5 * (low + high)
        above = drop_radius(A0, A1, middle) >= 1.0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(crossing, 0.5 * (low + high), 1.0)


def radius_under_drops(setting: Setting = PRINTED) -> Finding:
    """P3-fig8: the drop probability of the figure is not stated."""
    readings = {d: [radius(setting, d, FIG8_SPEEDS, p) for p in FIG8_DROPS] for d in DIRECTIONS}
    computed = {
        f"{d}_p_{p:g}": by_speed(FIG8_SPEEDS, value)
        for d, values in readings.items()
        for p, value in zip(FIG8_DROPS, values, strict=True)
    }
    spread = [np.concatenate([readings[d][k] for d in DIRECTIONS]) for k in range(len(FIG8_DROPS))]
    return Finding(
        computed,
        open_choice(spread, 1e-3),
        "The drop probability of the figure is not stated: p = 0.2, 0.5 and 0.8 give different curves, at standstill "
        + ", ".join(f"{values[0]:.3f}" for values in readings["longitudinal"])
        + " longitudinally. The curve of any p follows from (22) with (25).",
    )


def detectable_mixture(setting: Setting = PRINTED) -> Finding:
    """P3-rem4: the dropped update alone is marginal, the mixture below p_cr is mean-square stable."""
    A0, A1 = (stack[0] for stack in updates(setting, "longitudinal", REMARK_SPEED))
    alone = float(np.abs(np.linalg.eigvals(A0)).max())
    integrator = bool(A0[1, 1] == 1.0 and A0[1, 0] == 0.0)
    p_cr = float(critical(setting, "longitudinal", REMARK_SPEED)[0])
    mixed = float(drop_radius(A0, A1, REMARK_DROP))
    chance = [1.0 - REMARK_DROP, REMARK_DROP]
    system = MarkovJumpSystem(np.stack([A1, A0]), np.array([chance, chance]))
    moment = np.trace(system.propagate_second_moment(np.eye(2), chance, STEPS), axis1=-2, axis2=-1).sum(-1)
    growth = float((moment[STEPS] / moment[STEPS - 50]) ** (1.0 / 50.0))
    everywhere = all(bool((critical(setting, d, SPEEDS) <= 1.0).all()) for d in DIRECTIONS)
    holds = (
        integrator
        and alone == 1.0
        and p_cr > REMARK_DROP
        and mixed < 1.0
        and agrees(growth, mixed, 1e-9)
        and everywhere
    )
    return Finding(
        {
            "radius_without_force": alone,
            "growth_of_second_moment_at_p_0.6_and_10_rad_per_s": growth,
            "second_moment_radius": mixed,
            "p_cr_at_10_rad_per_s": p_cr,
        },
        derived(holds),
        "Without the force the velocity error is an exact integrator, eigenvalue 1, and does not decay by itself; "
        f"the mixture does: at {REMARK_SPEED:g} rad/s and p = {REMARK_DROP:g} the second moment falls by the factor "
        f"{growth:.6f} a sample, which is the radius of (22).",
    )


CLAIMS: dict[str, ClaimFunction] = {
    "P3-pcr": critical_probability,
    "P3-pcr-exact": exact_critical_probability,
    "P3-fig8": radius_under_drops,
    "P3-rem4": detectable_mixture,
}
