"""P2-O3: rank of the time-varying observability matrix, symbolically."""

from __future__ import annotations

from functools import cache

import sympy as sp

from analysis.observability import ObservabilityMatrix, observability_matrix
from analysis.rank_loss import rank_loss
from studies.claim import ClaimFunction, Finding, judged
from studies.papers.longitudinal_speed.inputs import speed_model
from synthesis.models.catalogue.longitudinal_speed import WHEEL_MOTION

SPEEDS = (1, 40, 140)  # rad/s
ACCELERATION, JERK = "wheel_acceleration", "wheel_acceleration_rate"


@cache
def speed_observability() -> ObservabilityMatrix:
    """O_3 of (24) with omega' as the parameter of the model and omega'' as its rate."""
    return observability_matrix(speed_model(), motion=WHEEL_MOTION)


def exact_ranks(acceleration: object = 0, jerk: object = 0) -> list[int]:
    """rank(O_3) at three wheel speeds, in rational numbers."""
    matrix = speed_observability()
    return [matrix.rank_at({"wheel_speed": w, ACCELERATION: acceleration, JERK: jerk}) for w in SPEEDS]


def second_piece(limit: int = 800) -> float:
    """Wheel speed in rad/s below which rank may be lost while accelerating, for accelerations up to `limit` rad/s^2."""
    steady = rank_loss(speed_observability(), {JERK: 0})
    curve = max(steady.curve(ACCELERATION), key=sp.count_ops)
    (top,) = (root for root in sp.real_roots(sp.numer(sp.together(curve - limit))) if root > 0)
    return float(top)


def rank_over_the_region(accelerations: tuple[object, ...] = (0, 1, "-5")) -> Finding:
    """Rank at constant speed, while accelerating, and while the acceleration changes; the operating region has them all."""
    ranks = {f"acceleration {a} rad/s^2": exact_ranks(a) for a in accelerations}
    changing = exact_ranks(0, 1)
    (determinant,) = speed_observability().minors(symbolic=True)
    held = rank_loss(speed_observability(), {JERK: 0, ACCELERATION: 0})
    computed = {
        "determinant": str(determinant),
        "wheel_speeds_rad_s": list(SPEEDS),
        "ranks": ranks,
        "ranks_with_changing_acceleration": changing,
        "lost_at_every_constant_speed": held.always,
        "lost_while_accelerating_below_rad_s": second_piece(),
    }
    lowest = min(min(row) for row in ranks.values())
    reading = (
        "The determinant vanishes with the wheel acceleration and its rate: at any constant wheel speed the rank "
        f"is {min(exact_ranks())}, because the third state repeats the first two and both modes decay at kappa R_e "
        f"omega. It is {max(changing)} while the wheel accelerates (apart from speeds below {second_piece():.3g} "
        "rad/s). What is hidden decays while the wheel turns, so the model is detectable, except at standstill."
    )
    return Finding(computed, judged(lowest == 3), reading)


CLAIMS: dict[str, ClaimFunction] = {"P2-O3": rank_over_the_region}
