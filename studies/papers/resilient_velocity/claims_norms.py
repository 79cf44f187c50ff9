"""Fig. 2: H-infinity norms of the error dynamics over the wheel speed, and the floor that no gain can lower."""

from __future__ import annotations

import numpy as np

from analysis.dc_floor import static_gain
from analysis.error_norms import error_hinf_norm
from studies.claim import ClaimFunction, Finding, judged
from studies.papers.plain import by_speed
from studies.papers.resilient_velocity.exact_norms import norm_crosses_one
from studies.papers.resilient_velocity.setting import DIRECTIONS, DISTURBANCES, HIGHEST_SPEED, PRINTED, Setting
from studies.papers.verdicts import derived
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray

SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 141)
SHOWN = np.array([0.0, 40.0, 80.0, 140.0])
AXES: dict[Direction, tuple[float, float]] = {"longitudinal": (0.9985, 1.0), "lateral": (0.995, 1.005)}
DRAWN: dict[Direction, float] = {"longitudinal": 5e-5, "lateral": 5e-4}
"""Half the last digit of the axis labels of Fig. 2: nothing finer can be read from the plot."""
NON_EXPANSIVE = 1e-6


def norms(setting: Setting, direction: Direction, speeds: FloatArray, *disturbances: str) -> FloatArray:
    """The H-infinity norm from the named disturbances (both if none is named) to both errors at each speed (g,)."""
    chosen = disturbances or DISTURBANCES
    return error_hinf_norm(setting.models[direction], setting.gains[direction], speeds, chosen).norm


def floor(setting: Setting, direction: Direction, speeds: FloatArray) -> FloatArray:
    """sigma_0/(sigma_0 + sigma_2 kappa R_e |omega|) (g,): what every stable gain lets through from friction to slip velocity."""
    tire = setting.parameters.tire[direction]
    return np.asarray(
        tire.sigma0.value / (tire.sigma0.value + tire.sigma2.value * setting.rolling_rate(direction, speeds))
    )


def _within_axes(setting: Setting, direction: Direction) -> tuple[bool, FloatArray]:
    found = norms(setting, direction, SPEEDS)
    low, high = AXES[direction]
    return bool(found.min() >= low - DRAWN[direction] and found.max() <= high + DRAWN[direction]), found


def longitudinal(setting: Setting = PRINTED) -> Finding:
    """P3-fig2-x."""
    inside, found = _within_axes(setting, "longitudinal")
    return Finding(
        by_speed(SHOWN, norms(setting, "longitudinal", SHOWN)),
        judged(inside),
        "Continuous error dynamics (8), both disturbances to both errors, peak at zero frequency: "
        f"{found.min():.5f} to {found.max():.7f} over 0..140 rad/s, on the axis of the figure to the accuracy of "
        "its labels.",
    )


def lateral(setting: Setting = PRINTED) -> Finding:
    """P3-fig2-y."""
    inside, found = _within_axes(setting, "lateral")
    friction = norms(setting, "lateral", SPEEDS, "friction")
    computed = {
        "both_disturbances": by_speed(SHOWN, norms(setting, "lateral", SHOWN)),
        "friction_only": by_speed(SHOWN, norms(setting, "lateral", SHOWN, "friction")),
    }
    return Finding(
        computed,
        judged(inside),
        f"Error dynamics (13), both disturbances to both errors: {found.max():.5f} at standstill down to "
        f"{found.min():.5f} at 140 rad/s, inside the axis of the figure; friction alone would give "
        f"{friction.min():.4f} to {friction.max():.4f}, which fits it too.",
    )


def non_expansive(setting: Setting = PRINTED) -> Finding:
    """P3-fig2-nonexp."""
    both = {d: norms(setting, d, SPEEDS) for d in DIRECTIONS}
    alone = {d: float(norms(setting, d, SPEEDS, "friction").max()) for d in DIRECTIONS}
    crossings = {d: norm_crosses_one(setting, d) for d in DIRECTIONS}
    computed = {
        d: {
            "at_0_rad_per_s": float(both[d][0]),
            "largest": float(both[d].max()),
            "crosses_1_at_rad_per_s": crossings[d],
            "largest_friction_only": alone[d],
        }
        for d in DIRECTIONS
    }
    where = "; ".join(
        f"{d} by {both[d].max() - 1.0:.2g} at most, below {', '.join(f'{r:.4g}' for r in crossings[d])} rad/s"
        for d in DIRECTIONS
        if both[d].max() > 1.0 + NON_EXPANSIVE
    )
    friction = all(value <= 1.0 + NON_EXPANSIVE for value in alone.values())
    return Finding(
        computed,
        judged(not where),
        (f"With both disturbances the norm exceeds 1 ({where}). " if where else "The norm stays at 1 or below. ")
        + (
            "For the friction disturbance alone the statement holds."
            if friction
            else "It fails for friction alone as well."
        ),
    )


def any_gain(setting: Setting = PRINTED) -> Finding:
    """P3-hinf-floor: the static gain from friction to slip velocity with a symbolic gain, and the printed gains above it."""
    computed: dict[str, object] = {"formula": "sigma0 / (sigma0 + sigma2 kappa Re |omega|)"}
    holds = True
    for direction in DIRECTIONS:
        symbolic = static_gain(setting.models[direction], "friction", "relative_velocity")
        lowest = floor(setting, direction, SPEEDS)
        constants = {name: c.value for name, c in setting.models[direction].constants.items()}
        evaluated = np.array([float(symbolic.expression.subs({**constants, "wheel_speed": w})) for w in SHOWN])
        attained = error_hinf_norm(
            setting.models[direction], setting.gains[direction], SPEEDS, ("friction",), ("relative_velocity",)
        ).norm
        holds &= symbolic.free_of_gain
        holds &= bool(np.abs(np.abs(evaluated) - floor(setting, direction, SHOWN)).max() <= 1e-12)
        holds &= bool((attained >= lowest - 1e-12).all())
        computed[direction] = by_speed(SHOWN, floor(setting, direction, SHOWN))
        computed[f"{direction}_printed_gain_excess"] = float((attained - lowest).max())
    return Finding(
        computed,
        derived(holds),
        "At zero frequency friction and slip velocity look alike to the force: the gain from one to the other is "
        "-sigma0/(sigma0 + sigma2 kappa R_e |omega|) for every L with L_2 != 0. No tuning lowers the norm below "
        "it, it is 1 at standstill, and the printed gains sit on it.",
    )


CLAIMS: dict[str, ClaimFunction] = {
    "P3-fig2-x": longitudinal,
    "P3-fig2-y": lateral,
    "P3-fig2-nonexp": non_expansive,
    "P3-hinf-floor": any_gain,
}
