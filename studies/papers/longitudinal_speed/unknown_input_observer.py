"""P2-uio: Theorem 1 against runs of the worst sign."""

from __future__ import annotations

import numpy as np

from analysis.bounds.forces import sharp_unknown_input_bound, unknown_input_bound
from estimators.arrays import FloatArray
from studies.claim import Finding, reproduced
from studies.papers.longitudinal_speed.inputs import topic
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, colours, dots
from studies.study import PartResult, Scope

TOPIC = topic()
RUNS, STEPS, STEP = 200, 400, 2e-3
TOLERANCE = 1e-12  # rad/s, absolute and relative: the runs are of size 1 to 100


def worst_runs() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time (n,), error sizes (n, RUNS) under the disturbance that always pushes outward, and K, b, |e(0)|, xi of each run.

    e' = -K e + b sign(e), exact over each step, with random K [1/s], b [rad/s^2], e(0) [rad/s] and xi: (RUNS, 4).
    """
    random = np.random.default_rng(7)
    K, b = random.uniform(1.0, 50.0, RUNS), random.uniform(0.0, 200.0, RUNS)
    e, xi = 20.0 * random.normal(size=RUNS), random.uniform(0.05, 0.95, RUNS)
    decay = np.exp(-K * STEP)
    path = np.empty((STEPS + 1, RUNS))
    for k in range(STEPS + 1):
        path[k] = e
        e = decay * e + (1.0 - decay) / K * b * np.where(e < 0.0, -1.0, 1.0)
    return STEP * np.arange(STEPS + 1.0), np.abs(path), np.stack([K, b, np.abs(path[0]), xi], axis=1)


def bounds(time: FloatArray, runs: FloatArray, claimed_gain: float = 1.0) -> FloatArray:
    """Theorem 1 for every run, (n, RUNS); `claimed_gain` multiplies K, 1 is the theorem."""
    return np.stack([unknown_input_bound(claimed_gain * K, b, start, xi).at(time) for K, b, start, xi in runs], axis=1)


@TOPIC.claim("P2-uio")
def theorem_1(claimed_gain: float = 1.0) -> Finding:
    """Largest excess over the bound, and over the sharp one; the best xi."""
    time, size, runs = worst_runs()
    bound = bounds(time, runs, claimed_gain)
    excess = float((size - bound).max())
    sharp = np.stack([sharp_unknown_input_bound(K, b, start, time) for K, b, start, _ in runs], axis=1)
    attained = float((np.abs(size - sharp) / np.maximum(sharp, 1.0)).max())
    best = max(abs(float(unknown_input_bound(K, b).ultimate * K / b - 1.0)) for K, b, _, _ in runs)
    violations = int((size > bound + TOLERANCE).any(axis=0).sum())
    computed = {"runs": RUNS, "largest_excess_rad_s": excess, "violations": violations,
                "distance_from_sharp_bound": attained, "ultimate_at_xi_half_over_b_by_K_minus_1": best}  # fmt: skip
    reading = (
        f"In {RUNS} random runs whose disturbance always pushes outward {violations} exceed the bound (largest "
        f"excess {excess:.1e} rad/s). xi = 1/2 gives the smallest ultimate value b/K, which a constant force attains; the "
        f"exact worst case is exp(-K t)|e(0)| + (b/K)(1 - exp(-K t)), met to {attained:.0e}."
    )
    return Finding(computed, reproduced(excess <= TOLERANCE and attained <= 1e-10 and best <= 1e-12), reading)


@TOPIC.part("unknown-input", "Error bound of the unknown-input observer")
def unknown_input(scope: Scope) -> PartResult:
    """Theorem 1: worst-sign runs over their bound, and the ultimate bound over xi."""
    (time, size, runs), xi = worst_runs(), np.linspace(0.02, 0.98, 193)
    share = size / bounds(time, runs)
    left: list[Mark] = [
        Line(time, share[:, ::5], width=0.5, alpha=0.35),
        Line(time, share.max(axis=1), "largest of 200 runs", colours.RED), Level(y=1.0, width=0.9),
    ]  # fmt: skip
    level = Level(y=1.0, color=colours.GREY, dash="dotted", width=1.5)
    right: list[Mark] = [Line(xi, 0.5 / np.sqrt(xi * (1.0 - xi))), level, dots(0.5, 1.0, color=colours.RED)]
    runs_panel = Panel(left, "time [s]", Axis("|e| over the bound of Theorem 1 [1]", 0.0, 1.08), legend="lower right")
    best_xi = Panel(right, "ξ [1]", Axis("ultimate bound over the attained b/K [1]", 0.0, 4.0))
    figure = Figure(
        "theorem-1",
        "Left: wheel speed error of the unknown-input observer in 200 random runs (K, b, start, ξ) with the disturbance "
        "always pushing outward, as a share of Theorem 1's bound (every fifth run thin); none reaches one. Right: the "
        "ultimate bound over the error b/K that a constant force leaves: ξ = 1/2 is sharp. P2 (9).",
        "Left: thin lines below one. Right: a curve with its minimum one at one half.",
        [runs_panel, best_xi], (7.2, 3.4),
    )  # fmt: skip
    return PartResult(TOPIC.found(), figures=[figure])
