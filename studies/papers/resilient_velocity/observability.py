"""(9), Remark 2: where the two-row observability matrix loses rank."""

from __future__ import annotations

import numpy as np

from analysis.observability import observability_matrix
from analysis.observability_modes import frozen_modes, hautus_test
from analysis.rank_loss import rank_loss
from studies.claim import Finding, judged
from studies.papers.resilient_velocity.inputs import DIRECTIONS, HIGHEST_SPEED, PACKAGE, PRINTED, SPEEDS, Setting
from studies.papers.topic import Topic
from studies.study import PartResult, Scope

TOPIC = Topic(PACKAGE)
SEARCH = (0, 400)  # rad/s: rank loss is looked for beyond the range as well


@TOPIC.claim("P3-obs")
def rank_of_observability(setting: Setting = PRINTED) -> Finding:
    """The exact set on which the time-varying observability matrix (9) loses rank."""
    computed: dict[str, dict[str, object]] = {}
    lost_inside, detectable = [], True
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
    where = ", ".join(lost_inside)
    return Finding(
        computed,
        judged(not lost_inside),
        (f"Rank 2 is lost inside 0..140 rad/s: {where} at constant speed. " if lost_inside else "Rank 2 everywhere. ")
        + "det O_2 = (sigma_0 - sigma_1 a)(sigma_0 + sigma_2 a) + sigma_1 (sigma_1 + sigma_2) da/dt with a = kappa "
        "R_e omega vanishes on a curve in wheel speed and acceleration. "
        + (
            "What is lost is the bristle deflection, which decays, so the pair stays detectable."
            if detectable
            else "The pair is not detectable."
        ),
    )


@TOPIC.part("observability", "The observability rank", 1.1)
def rank(_: Scope) -> PartResult:
    """The rank condition (9)."""
    return PartResult(TOPIC.found())
