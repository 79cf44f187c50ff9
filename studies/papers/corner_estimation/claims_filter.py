"""P1-ukf, P1-O3: the sigma point weights and the observability of the lateral force model."""

from __future__ import annotations

from functools import cache

import sympy as sp

from analysis.observability import ObservabilityMatrix, observability_of, rate_symbol
from studies.claim import ClaimFunction, Finding, judged
from studies.papers.corner_estimation.inputs import parameters
from studies.papers.corner_estimation.sigma_points import Form, weights
from studies.papers.verdicts import erratum
from synthesis.models.catalogue.planar_force import planar_force_model

SIZES = (3, 1)  # states of the lateral filter of P1, and of the force filter of P2
STEER = sp.Symbol("steering_angle")
RATE, RATE2 = rate_symbol("steering_angle"), rate_symbol("steering_angle", 2)


def sigma_weights(printed_form: Form = "printed", sizes: tuple[int, ...] = SIZES) -> Finding:
    """Sums of the weights and second moments in rational numbers, both forms."""
    forms: tuple[Form, Form] = (printed_form, "corrected")
    printed, corrected = ({n: weights(n, form) for n in sizes} for form in forms)
    computed = {
        f"N={n}": {
            "N_plus_eta": float(corrected[n].tau_squared),
            "outer_weight": {"printed": float(printed[n].outer), "corrected": float(corrected[n].outer)},
            "sum_of_mean_weights": {"printed": float(printed[n].total), "corrected": float(corrected[n].total)},
            "second_moment": {
                "printed": float(printed[n].second_moment),
                "corrected": float(corrected[n].second_moment),
            },
            "centre_weights": [float(corrected[n].centre_mean), float(corrected[n].centre_spread)],
        }
        for n in sizes
    }
    sums = ", ".join(f"{printed[n].total} for N = {n}" for n in sizes)
    reading = (
        f"(N + eta)/2 gives mean weights that add up to {sums}. 1/(2 (N + eta)) gives {corrected[sizes[0]].outer}, "
        f"a sum of {corrected[sizes[0]].total} and the right second moment, with tau = "
        f"sqrt({corrected[sizes[0]].tau_squared})."
    )
    good = [all(w.total == 1 and w.second_moment == 1 for w in form.values()) for form in (printed, corrected)]
    return Finding(computed, erratum(*good), reading)


@cache
def force_observability(third_output: str = "yaw_acceleration") -> ObservabilityMatrix:
    """O_3 of (12) for the model of (9), (10), with r' as third output, or without ("none": r as printed says nothing)."""
    model = planar_force_model(parameters(), "yaw_acceleration" if third_output == "yaw_acceleration" else "none")
    A, C = (sp.Matrix(part.jacobian(model.state_symbols)) for part in (model.f, model.h))
    return observability_of(A, C, {STEER: RATE, RATE: RATE2}, 3)


def ranks(third_output: str = "yaw_acceleration") -> dict[str, int]:
    """Exact rank while steering (0.1 rad), straight ahead, and straight with the steering moving or accelerating."""
    matrix = force_observability(third_output)
    names = {str(s) for s in matrix.matrix.free_symbols}
    car = {key: str(q.value) for key, q in parameters().vehicle.items() if key in names}
    cases = {"steering": ("0.1", 0, 0), "straight": (0, 0, 0), "through_straight": (0, "0.01", 0),
             "starting_to_steer": (0, 0, "0.01")}  # fmt: skip
    keys = [str(s) for s in (STEER, RATE, RATE2)]
    return {name: matrix.rank_at({**car, **dict(zip(keys, case, strict=True))}) for name, case in cases.items()}


def determinants(third_output: str = "yaw_acceleration") -> tuple[sp.Expr, ...]:
    """Maximal minors of O_3 with the steering held: only det C is left of them."""
    return force_observability(third_output).minors({str(RATE): 0, str(RATE2): 0}, symbolic=True)


def lateral_force_rank(third_output: str = "yaw_acceleration") -> Finding:
    """rank(O_3) = 3 iff delta != k pi at a constant angle: the minors vanish with sin(delta) and nowhere else."""
    minors, found, without = determinants(third_output), ranks(third_output), ranks("none")
    shares = [sp.simplify(minor / sp.sin(STEER) ** 2) for minor in minors]
    only_sine = bool(shares) and not any(STEER in share.free_symbols or share == 0 for share in shares)
    computed = {
        "determinant": str(minors[0]) if minors else "0",
        "ranks": found,
        "ranks_with_r_as_third_output": without,
    }
    reading = (
        f"With (a_x, a_y, dr/dt) as outputs the determinant at a constant angle is {computed['determinant']}: rank "
        f"{found['steering']} while steering and {found['straight']} at delta = k pi, where the right-left "
        "difference of the front forces is hidden. Steering through straight ahead shows it (rank "
        f"{found['through_straight']}). With r itself as third output, as printed, the yaw row is missing and the "
        f"rank is {without['steering']}."
    )
    return Finding(computed, judged(only_sine and found["steering"] == 3 and found["straight"] == 2), reading)


CLAIMS: dict[str, ClaimFunction] = {"P1-ukf": sigma_weights, "P1-O3": lateral_force_rank}
