"""Figs 3 to 5 (sensitivity to tire constants) and (9), Remark 2 (observability)."""

from __future__ import annotations

import numpy as np

from analysis.observability import observability_matrix
from analysis.observability_modes import frozen_modes, hautus_test
from analysis.rank_loss import rank_loss
from analysis.sensitivity import OneAtATime
from studies.claim import ClaimFunction, ClaimVerdict, Finding, judged
from studies.papers.resilient_velocity.deviations import (
    CHANGE,
    CONSTANTS,
    FACTORS,
    margin_deviations,
    norm_deviations,
    relative,
)
from studies.papers.resilient_velocity.setting import DIRECTIONS, HIGHEST_SPEED, PRINTED, Setting

SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 141)
SEARCH = (0, 400)  # rad/s: rank loss is looked for beyond the range as well


def small_deviations(setting: Setting = PRINTED) -> Finding:
    """P3-fig345: `small` is read as: no larger in proportion than the 20 % that caused it, and stable throughout."""
    computed: dict[str, object] = {}
    worst: dict[str, float] = {}
    stable, lost = True, 0.0
    for direction in DIRECTIONS:
        margin, norm = (f(setting, direction, SPEEDS) for f in (margin_deviations, norm_deviations))
        stable &= bool((margin.values.values < 0.0).all())
        lost = loss(margin)  # of the last, the lateral one
        computed[direction] = {
            "margin_per_s": margin.nominal.at(wheel_speed=40.0).item(),
            "margin_deviation_at_40_per_s": {
                name: [margin.deviations.at(parameter=name, factor=f, wheel_speed=40.0).item() for f in FACTORS]
                for name in CONSTANTS
            },
            "largest_relative_margin_deviation": dict(
                zip(CONSTANTS, relative(margin).max(axis=(1, 2)).tolist(), strict=True)
            ),
            "largest_relative_norm_deviation": dict(
                zip(CONSTANTS, relative(norm).max(axis=(1, 2)).tolist(), strict=True)
            ),
            "least_stable_margin_per_s": float(margin.values.values.max()),
            "largest_relative_margin_loss": loss(margin),
        }
        for name, found in (("margin", margin), ("norm", norm)):
            size = relative(found).max(axis=(1, 2))
            for constant, value in zip(CONSTANTS, size, strict=True):
                worst[f"{direction} {name}, {constant}"] = float(value)
    large = {name: value for name, value in worst.items() if value > CHANGE}
    rest = max(value for name, value in worst.items() if not name.endswith("sigma1"))
    verdict = judged(stable and not large, ClaimVerdict.PARTLY if stable else ClaimVerdict.NOT_REPRODUCED)
    return Finding(
        computed,
        verdict,
        f"No number is printed; small is read as at most the {CHANGE:.0%} that caused it. "
        + ("Every perturbed observer stays stable" if stable else "A perturbed observer is unstable")
        + f", and sigma_0, sigma_2 and kappa move margin and norm by {rest:.1%} at most; but "
        + (", ".join(f"{name}: {value:.0%}" for name, value in large.items()) or "nothing moves by more")
        + f" of the nominal value. Most of it is gained; the most that is lost is {lost:.0%} of the lateral margin. "
        "Only sigma_1 matters.",
    )


def loss(margin: OneAtATime) -> float:
    """The largest share of the stability margin that a perturbation takes away."""
    return float((margin.deviations.values / np.abs(margin.nominal.values)).max())


def observability(setting: Setting = PRINTED) -> Finding:
    """P3-obs: the exact set on which the time-varying observability matrix (9) loses rank."""
    computed: dict[str, dict[str, object]] = {}
    lost_inside = []
    detectable = True
    for direction in DIRECTIONS:
        model = setting.models[direction]
        loss = rank_loss(observability_matrix(model))
        roots = [r for r in loss.roots("wheel_speed") if r > 0]
        intervals = loss.interval_over_rates("wheel_speed", search=SEARCH)
        lost_inside += [f"{direction} {float(r):.2f} rad/s" for r in loss.roots_inside("wheel_speed")]
        numeric = model.on(np.union1d(SPEEDS, [float(r) for r in roots if r <= HIGHEST_SPEED]))
        detectable &= bool(hautus_test(numeric.A, numeric.C).frozen_detectable.all())
        computed[direction] = {
            "determinant": str(loss.condition),
            "root_at_constant_speed_rad_per_s": [float(r) for r in roots],
            "root_exact": [str(r) for r in roots],
            "over_wheel_accelerations_of_800_rad_per_s2": [[float(a), float(b)] for a, b in intervals],
            "hidden_mode": [str(m.eigenvalue) for m in frozen_modes(model.A, model.C) if m.eigenvalue != 0],
        }
    return Finding(
        computed,
        judged(not lost_inside),
        (
            f"Rank 2 is lost inside 0..140 rad/s: {', '.join(lost_inside)} at constant speed. "
            if lost_inside
            else "Rank 2 everywhere. "
        )
        + "det O_2 = (sigma_0 - sigma_1 a)(sigma_0 + sigma_2 a) + sigma_1 (sigma_1 + sigma_2) da/dt with a = kappa "
        "R_e omega vanishes on a curve in wheel speed and acceleration. "
        + (
            "What is lost is the bristle deflection, which decays, so the pair stays detectable."
            if detectable
            else "The pair is not detectable."
        ),
    )


CLAIMS: dict[str, ClaimFunction] = {"P3-fig345": small_deviations, "P3-obs": observability}
