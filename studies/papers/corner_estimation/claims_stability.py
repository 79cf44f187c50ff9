"""P1-aqs-feas, P1-aqs-box: are the printed gains and gain boxes affinely quadratically stable?"""

from __future__ import annotations

import numpy as np

from studies.claim import ClaimFunction, Finding, JsonValue, judged
from studies.papers.corner_estimation.inputs import (
    DESIGNS,
    DIRECTIONS,
    PAPER,
    STATED_SPEED,
    corner_model,
    printed_box,
    printed_gains,
)
from studies.papers.corner_estimation.quadratic import Box, diagonal_proof
from synthesis.lmi.result import Verdict as Proof
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray
from synthesis.stability import affine_quadratic_stability

# Affine P with multi-convexity at the vertices, affine P on the continuum, constant P: (name, relaxation, degree).
ROADS: tuple[tuple[str, Relaxation, int], ...] = (
    ("with multi-convexity", "vertex", 1), ("without", "exact", 1), ("constant P", "exact", 0),
)  # fmt: skip


def printed_gains_are_stable(gains: dict[tuple[str, Direction], tuple[float, ...]] | None = None) -> Finding:
    """(28), (40) by LMI on three roads, and a constant diagonal P in exact arithmetic, for the gains of P1 and of P3."""
    computed: dict[str, JsonValue] = {}
    holds = []
    for key in DESIGNS:
        name, direction = key
        given = printed_gains(direction, name) if gains is None else gains[key]
        model, column = corner_model(direction, STATED_SPEED, name), np.array(given)[:, None]
        verdicts = {
            road: affine_quadratic_stability(model, column, degree, settings=LmiSettings(relaxation=relaxation)).verdict
            for road, relaxation, degree in ROADS
        }
        proof = diagonal_proof(direction, tuple((gain, gain) for gain in given), name)
        holds.append(proof.proved and all(verdict is Proof.CERTIFIED for verdict in verdicts.values()))
        computed[f"{PAPER[name]} {direction}"] = {
            "gains": list(given), "lmi": {road: str(verdict) for road, verdict in verdicts.items()},
            "weights_of_diag_w_1": [proof.low, proof.high], "weight": proof.chosen, "proved_exactly": proof.proved,
        }  # fmt: skip
    weights = ", ".join(f"{entry['weight']:,}" for entry in computed.values())
    reading = (
        f"{sum(holds)} of {len(holds)} sets of printed gains (P1 and P3, both directions) are stable with P = "
        f"diag(w, 1) that does not depend on the wheel speed, w = {weights}, proved in rational numbers on 0 to "
        f"{STATED_SPEED:g} rad/s for any rate: plain quadratic stability holds already, the affine form and "
        "multi-convexity are not needed."
    )
    return Finding(computed, judged(all(holds)), reading)


def printed_boxes_are_stable(boxes: dict[Direction, Box] | None = None) -> Finding:
    """One constant P for all gains of each printed box, exact at the eight vertices of (omega, L1, L2)."""
    computed: dict[str, JsonValue] = {}
    for direction in DIRECTIONS:
        box = printed_box(direction) if boxes is None else boxes[direction]
        proof = diagonal_proof(direction, box)
        slowest = slowest_poles(direction, *gain_grid(box, 21))
        computed[direction] = {
            "L1": list(box[0]), "L2": list(box[1]), "vertices": proof.vertices,
            "weights_of_diag_w_1": [proof.low, proof.high], "weight": proof.chosen, "proved_exactly": proof.proved,
            "slowest_pole_1_s": float(slowest.max()),
        }  # fmt: skip
    x, y = (computed[direction] for direction in DIRECTIONS)
    proved = bool(x["proved_exactly"] and y["proved_exactly"])
    reading = (
        "A_e is affine in omega, L1 and L2 one at a time, so a constant P decides at the eight vertices. "
        + (
            f"P = diag({x['weight']:,}, 1) longitudinally and diag({y['weight']:,}, 1) laterally prove every gain "
            f"of both boxes on 0 to {STATED_SPEED:g} rad/s, for any rate, in rational numbers. "
            if proved
            else "No constant diagonal P proves both boxes. "
        )
        + f"The slowest pole on a grid is {x['slowest_pole_1_s']:.3g} and {y['slowest_pole_1_s']:.3g} 1/s."
    )
    return Finding(computed, judged(proved), reading)


def gain_grid(box: Box, points: int) -> tuple[FloatArray, FloatArray]:
    """L1 and L2 over a box, each (points, points)."""
    first, second = (np.linspace(low, high, points) for low, high in box)
    L1, L2 = np.meshgrid(first, second)
    return L1, L2


def slowest_poles(direction: Direction, L1: FloatArray, L2: FloatArray, speeds: int = 91) -> FloatArray:
    """Largest real part of the frozen poles in 1/s over all wheel speeds, for each pair of gains."""
    numeric = corner_model(direction).on(np.linspace(0.0, STATED_SPEED, speeds))
    gains = np.stack([L1, L2], axis=-1)[..., None, :, None]
    return np.asarray(np.linalg.eigvals(numeric.A - gains @ numeric.C).real.max(axis=(-2, -1)))


CLAIMS: dict[str, ClaimFunction] = {"P1-aqs-feas": printed_gains_are_stable, "P1-aqs-box": printed_boxes_are_stable}
