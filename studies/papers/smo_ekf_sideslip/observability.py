r"""P5-obs and P5-ekf-obs: where both models are observable, in closed form and along simulated runs.

With F_i = K_i beta_i the direction n = (1, K_1/beta_1, K_2/beta_2) changes no output: slips grow by as much as stiffnesses
fall. The first derivative of F_i sees it unless beta_i' = g beta_i, where g = -V'/V is the relative deceleration that the
forces of (10) stand for. Both at once, and rank is lost: for example in every steady turn at constant speed.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from analysis.observability.lie_rank import LieRankTest
from analysis.observability.lie_structure import generic_rank
from estimators.arrays import FloatArray
from studies.claim import Finding, reproduced
from studies.papers.smo_ekf_sideslip.inputs import PACKAGE, SAMPLE_TIME
from studies.papers.smo_ekf_sideslip.observers import LINEAR, SimulatedRun, simulate, slalom, steady_turn
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Line, Mark, Panel
from studies.plots.colours import BLUE, RED
from synthesis.models.catalogue.single_track import adaptive_stiffness_model, axle_force_model
from synthesis.models.nonlinear import NonlinearModel

TOPIC = Topic(PACKAGE)
RANGES = {
    "sideslip": (-0.1, 0.1), "front_stiffness_change": (-2e4, 2e4), "rear_stiffness_change": (-2e4, 2e4),
    "steering_angle": (-0.1, 0.1), "yaw_rate": (-0.5, 0.5), "speed": (5.0, 30.0), "front_force_x": (-3e3, 3e3)}  # fmt: skip
STATE_SIZE = np.array([0.05, 3e4, 3e4])  # rad, N/rad, N/rad
FORCE_SIZE = np.array([2e3, 2e3, 2e4, 2e4])  # N and N/s


@TOPIC.claim("P5-obs")
def force_model(model: NonlinearModel | None = None) -> Finding:
    """Rank of the force model, and of the one with a rear longitudinal force."""
    chosen = model or axle_force_model()
    found = LieRankTest(chosen).at(dict.fromkeys((s.name for s in chosen.states), 0))
    # Of [h_x; (h_x f_x) of the yaw rate] of the force model (linear: exact for every state).
    usual, both = axle_force_model(), axle_force_model(rear_longitudinal_force=True)
    H, A = (function.jacobian(list(usual.state_symbols)) for function in (usual.h, usual.f))
    determinant = sp.factor(sp.Matrix.vstack(H, (H * A)[0, :]).det())
    with_rear = generic_rank(both, {s.name: (-1.0, 1.0) for s in both.states}, samples=1)
    steered = sp.Symbol("steering_angle") in (chosen.f.free_symbols | chosen.h.free_symbols)
    computed = {
        "rank": found.rank, "states": len(chosen.states), "determinant": str(determinant),
        "contains_steering_angle": steered, "rank_with_rear_longitudinal_force": with_rear.rank,
        "states_with_rear_longitudinal_force": len(both.states),
        "hidden_with_rear_longitudinal_force": list(with_rear.structure.describe())}  # fmt: skip
    return Finding(computed, reproduced(found.rank == len(chosen.states) and not steered), (
        "The steering angle is not in the model at all; the determinant of outputs and yaw acceleration is (L_1 + L_2) / "
        "(m^2 I_z) up to its sign, so the rank is 4 for every car, speed and steering angle. With the rear longitudinal "
        "force as a fifth state one direction is lost and does not decay, which is why the paper neglects it."))  # fmt: skip


@TOPIC.claim("P5-ekf-obs")
def sideslip_model(model: NonlinearModel | None = None) -> Finding:
    """Generic rank of the adaptive model, and the closed form of where it is lost."""
    generic = generic_rank(model or adaptive_stiffness_model(), RANGES, samples=2)
    test = LieRankTest(adaptive_stiffness_model())
    zero = {"sideslip": 0, "front_stiffness_change": 0, "rear_stiffness_change": 0}
    ahead = {"steering_angle": 0, "yaw_rate": 0, "speed": 20, "front_force_x": 0}
    H, *_ = gradients()  # m dy_3 = cos(delta) dy_1 + dy_2
    repeated = H[2, :] * sp.Symbol("mass") - H[0, :] * sp.cos(sp.Symbol("steering_angle")) - H[1, :]
    computed = {
        "generic_rank": generic.rank, "rank_of_outputs_alone": generic.samples[0].by_order[0],
        "rank_with_first_derivatives": generic.samples[0].by_order[1], "rank_straight_ahead": test.at(zero, ahead).rank,
        "rank_as_a_turn_begins": test.at(zero, {**ahead, "yaw_rate": [0, "0.1"]}).rank,
        "rank_in_a_steady_turn": steady_turn_rank(),
        "closed_form_of_rank_loss_proved": all(identity == 0 for identity in rank_loss_identities()),
        "acceleration_adds_no_rank": all(sp.simplify(entry) == 0 for entry in repeated)}  # fmt: skip
    return Finding(computed, reproduced(generic.rank == 3), (
        f"The rank is {generic.rank} at almost every state: 2 from the forces, the third from their rates. Outputs and their "
        "first derivatives lose it exactly where both slip angles follow beta_i' = -(V'/V) beta_i. So it is 2 for good in a "
        "steady turn at constant speed, where sideslip cannot be told from the two stiffnesses, and 1 straight ahead. The "
        "slip angles must keep changing, as they do in a slalom."))  # fmt: skip


def steady_turn_rank() -> int:
    """Lie rank, inputs held, of a steady turn: beta = delta = 0 and F_x = 0 make V' = 0 in rational numbers.

    K_1 = 20 and K_2 = 20 (m V^2 + K_1 L_1) / (20 L_2) kN/rad with V = 20 m/s balance the sideslip rate; the yaw moment is not
    zero, but the yaw rate is an input here and held.
    """
    mass, front, rear, speed, K_1 = (sp.Rational(text) for text in ("1447", "1.12", "1.46", "20", "20000"))
    K_2 = (mass * speed**2 + K_1 * front) / rear
    state = {"sideslip": 0, "front_stiffness_change": K_1 - 65000, "rear_stiffness_change": K_2 - 50000}
    inputs = {"steering_angle": 0, "yaw_rate": sp.Rational(1, 5), "speed": speed, "front_force_x": 0}
    return LieRankTest(adaptive_stiffness_model(), 4).at(state, inputs).rank


def gradients() -> tuple[sp.Matrix, sp.Matrix, list[sp.Expr]]:
    """Gradients of the outputs (3, 3) and of their first derivatives (3, 3), inputs moving; and the slip angles."""
    model = adaptive_stiffness_model()
    x, u = list(model.state_symbols), list(model.input_symbols)
    H = model.h.jacobian(x)
    motion = H * model.f + model.h.jacobian(u) * sp.Matrix([sp.Symbol(f"{symbol}_rate") for symbol in u])
    delta, r, v, _ = u
    front, rear = sp.symbols("front_axle_distance rear_axle_distance")
    return H, motion.jacobian(x), [delta - x[0] - front * r / v, -x[0] + rear * r / v]


def rank_loss_identities() -> list[sp.Expr]:
    r"""det [dF_1; dF_2; dF_i'] - K_i beta_(3-i) (beta_i' - g beta_i) for i = 1, 2: zero if the closed form is right."""
    (H, moved, (b1, b2)), model = gradients(), adaptive_stiffness_model()
    delta, _, v, drive = model.input_symbols
    beta, d1, d2 = model.state_symbols
    m, c1, c2 = sp.symbols("mass front_stiffness rear_stiffness")
    k1, k2 = c1 + d1, c2 + d2
    along = drive * sp.cos(delta - beta) - k1 * b1 * sp.sin(delta - beta) + k2 * b2 * sp.sin(beta)
    g = -along / (m * v)
    found = []
    for i, (slip, other, stiffness) in enumerate(((b1, b2, k1), (b2, b1, k2))):
        rate = slip.diff(beta) * model.f[0] + sum(slip.diff(u) * sp.Symbol(f"{u}_rate") for u in model.input_symbols)
        det = H[0, :].cross(H[1, :]).dot(moved[i, :])
        found.append(sp.expand(det - stiffness * other * (rate - g * slip)))
    return found


def third_singular_value(run: SimulatedRun) -> FloatArray:
    """Third singular value over the first (n,) of [dF_1; dF_2; dF_1'; dF_2'] in typical sizes; no stiffness correction."""
    (H, moved, _), model = gradients(), adaptive_stiffness_model()
    constants = {sp.Symbol(name): constant.value for name, constant in model.constants.items()}
    rows = sp.Matrix.vstack(H[:2, :], moved[:2, :]).subs(constants)
    moving = [sp.Symbol(f"{symbol}_rate") for symbol in model.input_symbols]
    numeric = sp.lambdify([*model.state_symbols, *model.input_symbols, *moving], rows, "numpy", cse=True)
    zero, inputs = np.zeros_like(run.time), [run.steering, run.yaw_rate, run.speed, run.front_force_x]
    rates = [np.gradient(value, SAMPLE_TIME) for value in inputs]
    samples = np.stack([run.sideslip, zero, zero, *inputs, *rates], axis=1)
    found = np.array([np.asarray(numeric(*sample), float) for sample in samples])
    singular = np.linalg.svd(found * STATE_SIZE / FORCE_SIZE[:, None], compute_uv=False)
    return np.asarray(singular[:, 2] / singular[:, 0])


def _stiffness_observability() -> Figure:
    slips, values = list[Mark](), list[Mark]()
    for steering, name, color in ((slalom, "slalom", BLUE), (steady_turn, "steady turn", RED)):
        run = simulate(steering, seconds=14.0, friction=LINEAR)
        slips.append(Line(run.time, np.degrees(run.slips[:, 0]), f"front, {name}", color))
        slips.append(Line(run.time, np.degrees(run.slips[:, 1]), f"rear, {name}", color, "dashed", 1.0))
        values.append(Line(run.time, np.maximum(third_singular_value(run), 1e-9), name, color))
    value = Axis("third singular value / largest [1]", 1e-9, 10.0, "log")
    return Figure("stiffness-observability",
        "When the sideslip filter can tell sideslip from stiffness: third singular value of the gradients of the two axle "
        "forces and of their rates (states in typical sizes), along a slalom and along a turn that becomes steady, linear "
        "axles as printed, both at constant 17 m/s. Straight ahead nothing is seen of the stiffnesses; in the steady turn "
        "the value falls to zero although both axles slip (left), because slip angles that do not change cannot be told from "
        "softer tires. In the slalom it stays large.",
        "Left: slip angles over time, oscillating in the slalom and constant in the turn. Right: the singular value on a "
        "logarithmic scale, large throughout the slalom, falling steadily in the steady turn.",
        [Panel(slips, "time [s]", Axis("slip angle [deg]", high=9.0), legend="upper left", columns=2),
         Panel(values, "time [s]", value, legend="upper left")], size=(9.2, 3.7), share_x="all")  # fmt: skip


TOPIC.show("observability", "Observability of both models", 2.0, figures=[_stiffness_observability])
