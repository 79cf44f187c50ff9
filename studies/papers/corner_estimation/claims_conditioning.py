"""P1-aqs-scale: without scaling a solver misses true certificates and accepts false ones."""

from __future__ import annotations

import numpy as np

from studies.claim import ClaimFunction, Finding, JsonValue
from studies.papers.corner_estimation.conditioning import best_margin, natural_scale, vertices_only
from studies.papers.corner_estimation.inputs import DESIGNS, PAPER
from studies.papers.verdicts import derived
from synthesis.lmi.result import Verdict

CAPS = (1e3, 1e4)  # condition numbers that a general-purpose scaling might allow
BALANCED = 2.0


def conditioning(scaled: bool = True) -> Finding:
    """Margins with a cap on cond(P), in the units of the model and with z scaled; and what vertices alone prove."""
    computed: dict[str, JsonValue] = {}
    for name, direction in DESIGNS:
        g = natural_scale(name, direction)
        loose = vertices_only(name, direction)
        computed[f"{PAPER[name]} {direction}"] = {
            "scale_of_z": g,
            "natural_condition_number": g * g,
            "margin_unscaled": {f"{cap:g}": best_margin(name, direction, 1.0, cap) for cap in CAPS},
            f"margin_scaled_condition_{BALANCED:g}": best_margin(name, direction, g if scaled else 1.0, BALANCED),
            "vertices_only": {
                "solver": loose.status, "verdict": str(loose.verdict), "largest_growth_1_s": float(np.max(loose.growth)),
                "at_rad_s": float(loose.omega[np.argmax(loose.growth)]), "certified": loose.verdict is Verdict.CERTIFIED,
            },
        }  # fmt: skip
    rows = list(computed.values())
    missed = sum(row["margin_unscaled"][f"{CAPS[0]:g}"] < 0.0 for row in rows)
    helped = sum(row[f"margin_scaled_condition_{BALANCED:g}"] > 0.0 for row in rows)
    false = sum(row["vertices_only"]["largest_growth_1_s"] > 0.0 for row in rows)
    low, high = (pick(row["natural_condition_number"] for row in rows) for pick in (min, max))
    reading = (
        f"In metres and metres per second the natural condition number of P is g^2 = |c/b|, {low:.2g} to "
        f"{high:.2g}. Capped at {CAPS[0]:g}, {missed} of {len(rows)} printed designs have no constant P at all; "
        f"with z multiplied by g, {helped} of {len(rows)} have one with condition number {BALANCED:g}. Asked at the "
        f"vertices alone the solver says '{rows[0]['vertices_only']['solver']}', and {false} of {len(rows)} answers "
        "let V grow between the vertices. Scale, then re-evaluate on the whole range."
    )
    return Finding(computed, derived(missed == helped == false == len(rows)), reading)


CLAIMS: dict[str, ClaimFunction] = {"P1-aqs-scale": conditioning}
