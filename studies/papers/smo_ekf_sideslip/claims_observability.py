"""P5-obs and P5-ekf-obs: ranks of the two models."""

from __future__ import annotations

import sympy as sp

from analysis.lie_rank import LieRankTest
from analysis.lie_structure import generic_rank
from studies.claim import Finding, judged
from studies.papers.smo_ekf_sideslip.stiffness_rank import rank_loss_identities, third_row_repeats
from synthesis.models.catalogue.single_track import adaptive_stiffness_model, axle_force_model
from synthesis.models.nonlinear import NonlinearModel

RANGES = {
    "sideslip": (-0.1, 0.1), "front_stiffness_change": (-2e4, 2e4), "rear_stiffness_change": (-2e4, 2e4),
    "steering_angle": (-0.1, 0.1), "yaw_rate": (-0.5, 0.5), "speed": (5.0, 30.0), "front_force_x": (-3e3, 3e3),
}  # fmt: skip


def force_determinant() -> sp.Expr:
    """Determinant of [h_x; (h_x f_x) of the yaw rate] of the force model (linear: exact for every state)."""
    model = axle_force_model()
    x = list(model.state_symbols)
    H, A = model.h.jacobian(x), model.f.jacobian(x)
    return sp.factor(sp.Matrix.vstack(H, (H * A)[0, :]).det())


def force_model(model: NonlinearModel | None = None) -> Finding:
    """Rank of the force model, and of the one with a rear longitudinal force."""
    chosen = model or axle_force_model()
    found = LieRankTest(chosen).at(dict.fromkeys((s.name for s in chosen.states), 0))
    both = axle_force_model(rear_longitudinal_force=True)
    with_rear = generic_rank(both, {s.name: (-1.0, 1.0) for s in both.states}, samples=1)
    steered = sp.Symbol("steering_angle") in (chosen.f.free_symbols | chosen.h.free_symbols)
    computed = {
        "rank": found.rank,
        "states": len(chosen.states),
        "determinant": str(force_determinant()),
        "contains_steering_angle": steered,
        "rank_with_rear_longitudinal_force": with_rear.rank,
        "states_with_rear_longitudinal_force": len(both.states),
        "hidden_with_rear_longitudinal_force": list(with_rear.structure.describe()),
    }
    reading = (
        "The steering angle is not in the model at all; the determinant of outputs and yaw acceleration is (L_1 + "
        "L_2) / (m^2 I_z) up to its sign, so the rank is 4 for every car, speed and steering angle. With the rear "
        "longitudinal force as a fifth state one direction is lost and does not decay, which is why the paper "
        "neglects it."
    )
    return Finding(computed, judged(found.rank == len(chosen.states) and not steered), reading)


def sideslip_model(model: NonlinearModel | None = None) -> Finding:
    """Generic rank of the adaptive model, and the closed form of where it is lost."""
    chosen = model or adaptive_stiffness_model()
    generic = generic_rank(chosen, RANGES, samples=2)
    test = LieRankTest(adaptive_stiffness_model())
    zero = {"sideslip": 0, "front_stiffness_change": 0, "rear_stiffness_change": 0}
    ahead = {"steering_angle": 0, "yaw_rate": 0, "speed": 20, "front_force_x": 0}
    closed_form = all(identity == 0 for identity in rank_loss_identities())
    computed = {
        "generic_rank": generic.rank,
        "rank_of_outputs_alone": generic.samples[0].by_order[0],
        "rank_with_first_derivatives": generic.samples[0].by_order[1],
        "rank_straight_ahead": test.at(zero, ahead).rank,
        "rank_as_a_turn_begins": test.at(zero, {**ahead, "yaw_rate": [0, "0.1"]}).rank,
        "rank_in_a_steady_turn": steady_turn_rank(),
        "closed_form_of_rank_loss_proved": closed_form,
        "acceleration_adds_no_rank": third_row_repeats(),
    }
    reading = (
        f"The rank is {generic.rank} at almost every state: 2 from the forces, the third from their rates. Outputs "
        "and their first derivatives lose it exactly where both slip angles follow beta_i' = -(V'/V) beta_i. So it "
        "is 2 for good in a steady turn at constant speed, where sideslip cannot be told from the two stiffnesses, "
        "and 1 straight ahead. The slip angles must keep changing, as they do in a slalom."
    )
    return Finding(computed, judged(generic.rank == 3), reading)


def steady_turn_rank() -> int:
    """Lie rank, inputs held, of a steady turn: beta = delta = 0 and F_x = 0 make V' = 0 in rational numbers.

    K_1 = 20 and K_2 = 20 (m V^2 + K_1 L_1) / (20 L_2) kN/rad with V = 20 m/s balance the sideslip rate; the yaw moment is not
    zero, but the yaw rate is an input here and held.
    """
    mass, front, rear, speed = (sp.Rational(text) for text in ("1447", "1.12", "1.46", "20"))
    stiffness_front = sp.Integer(20000)
    stiffness_rear = (mass * speed**2 + stiffness_front * front) / rear
    state = {
        "sideslip": 0,
        "front_stiffness_change": stiffness_front - 65000,
        "rear_stiffness_change": stiffness_rear - 50000,
    }
    inputs = {"steering_angle": 0, "yaw_rate": sp.Rational(1, 5), "speed": speed, "front_force_x": 0}
    return LieRankTest(adaptive_stiffness_model(), 4).at(state, inputs).rank


CLAIMS = {"P5-obs": force_model, "P5-ekf-obs": sideslip_model}
