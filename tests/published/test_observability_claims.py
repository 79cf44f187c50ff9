"""What the papers claim on observability: P1 (10)-(12), P2 (24), P3 (9), P4 section IV-A, P5 notes 6.

`reference` names an entry of the shared claims, an independent recomputation.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.lie_rank import LieRankTest
from analysis.observability.lie_structure import generic_rank
from analysis.observability.matrix import observability_matrix, observability_of, rate_symbol
from analysis.observability.modes import frozen_modes, hautus_test
from analysis.observability.rank_loss import rank_loss
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.catalogue.four_wheel import four_wheel_model
from synthesis.models.catalogue.longitudinal_speed import WHEEL_MOTION, longitudinal_speed_model
from synthesis.models.catalogue.planar_force import planar_force_model
from synthesis.models.catalogue.single_track import adaptive_stiffness_model, axle_force_model
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.parameter_set import load_parameter_set

# parameter set, direction, exact root at zero rate, interval over |rate| <= 800 rad/s^2 (reference: P3-obs).
CORNERS = [
    ("resilient-velocity", "longitudinal", sp.Rational(12820000, 45441), 282.124, (281.063, 283.185)),
    ("resilient-velocity", "lateral", sp.Rational(3287500, 90651), 36.26546, (31.276, 41.253)),
    ("corner-estimation", "longitudinal", sp.Rational(6584375, 21736), 302.925, None),
    ("corner-estimation", "lateral", sp.Rational(1375000, 26001), 52.8826, (49.312, 56.453)),
    ("longitudinal-speed", "longitudinal", sp.Rational(51000, 203), 251.2315, None),
]


@pytest.mark.parametrize(("name", "direction", "exact", "printed", "interval"), CORNERS)
def test_two_state_models_lose_rank_on_a_curve_in_wheel_speed_and_acceleration(
    name: str, direction: str, exact: sp.Expr, printed: float, interval: tuple[float, float] | None
) -> None:
    """P3 (9), Remark 2: rank 2 over the operating range holds longitudinally and fails laterally."""
    parameters = load_parameter_set(name)
    model = corner_velocity_model(parameters, direction, 180.0)  # type: ignore[arg-type]
    loss = rank_loss(observability_matrix(model))
    assert not loss.frozen and not loss.always
    (root,) = (r for r in loss.roots("wheel_speed") if r > 0)
    tire = parameters.tire[direction]
    closed = tire.sigma0.value / (tire.sigma1.value * tire.kappa.value * parameters.vehicle["effective_radius"].value)
    assert root == exact
    assert float(root) == pytest.approx(closed, rel=1e-14)
    assert float(root) == pytest.approx(printed, abs=0.5 * 10.0 ** -len(str(printed).split(".")[1]))
    ((low, high),) = loss.interval_over_rates("wheel_speed", search=(0, 400))
    if interval:
        np.testing.assert_allclose([float(low), float(high)], interval, atol=6e-4)
    assert bool(loss.roots_inside("wheel_speed")) == (direction == "lateral")
    # What is lost is the bristle deflection, which decays at kappa R_e omega: a held pair stays detectable.
    lost = next(m for m in frozen_modes(model.A, model.C) if m.eigenvalue != 0)
    values = observability_matrix(model).values
    assert lost.vectors == sp.Matrix([1, 0])
    assert sp.simplify(lost.hidden_if.subs(dict(values)).subs("wheel_speed", root)) == 0
    numeric = model.on(np.linspace(0.0, 180.0, 181))
    assert hautus_test(numeric.A, numeric.C).frozen_detectable.all()


def test_p2_three_state_model_loses_rank_at_every_constant_wheel_speed() -> None:
    """P2 (24) asks rank(O_3) = 3; at wheel acceleration and jerk zero it is 2 at every wheel speed (reference: P2-O3)."""
    model = longitudinal_speed_model(load_parameter_set("longitudinal-speed"))
    matrix = observability_matrix(model, motion=WHEEL_MOTION)
    s0, s1, s2, k, R = sp.symbols("sigma0 sigma1 sigma2 kappa effective_radius")
    w, acceleration, jerk = sp.symbols("wheel_speed wheel_acceleration wheel_acceleration_rate")
    b = k * R
    (det,) = matrix.minors(symbolic=True)
    expected = (
        b
        * s1**2
        * (jerk * (s0 + s2 * b * w) + b * acceleration**2 * (s1 - s2) - b * w * acceleration * (s0 + s2 * b * w))
    )
    assert sp.expand(det - expected) == 0
    steady = rank_loss(matrix, {"wheel_acceleration_rate": 0})
    assert steady.factors[0] == acceleration
    assert rank_loss(matrix, {"wheel_acceleration_rate": 0, "wheel_acceleration": 0}).always
    # The second piece of the set: acceleration = w (s0 + s2 b w) / (s1 - s2), within 800 rad/s^2 only below 1.14 rad/s.
    second = max(steady.curve("wheel_acceleration"), key=sp.count_ops)
    (top,) = (r for r in sp.real_roots(sp.numer(sp.together(second - 800))) if r > 0)
    assert float(top) == pytest.approx(800 * (0.87 - 0.0016) / 612, rel=1e-4)
    for speed in (1, 40, 140):
        assert matrix.rank_at({"wheel_speed": speed, "wheel_acceleration": 0, "wheel_acceleration_rate": 0}) == 2
        assert matrix.rank_at({"wheel_speed": speed, "wheel_acceleration": 1, "wheel_acceleration_rate": 0}) == 3
        assert matrix.rank_at({"wheel_speed": speed, "wheel_acceleration": 0, "wheel_acceleration_rate": 1}) == 3
    grid = np.stack([np.array([0.0, 1.0, 40.0, 140.0]), np.zeros(4)], axis=1)
    held = hautus_test(model.on(grid).A, model.on(grid).C)
    np.testing.assert_array_equal(held.frozen_observable, False)
    np.testing.assert_array_equal(held.frozen_detectable, [False, True, True, True])  # not at standstill


def test_p2_third_row_is_the_derivative_of_the_first() -> None:
    """P2 (19): M^-1 gives B = [0, 1, 1]' and z'' = V_r' - kappa R_e omega' z - kappa R_e omega z' (reference: P2-19M)."""
    model = longitudinal_speed_model(load_parameter_set("longitudinal-speed"))
    M = sp.Matrix([[1, 0, 0], [0, 1, 0], [0, -1, 1]])
    assert M * model.A == model.A  # the second row of A is zero
    assert model.B == M.inv() * sp.Matrix([0, 1, 0]) == sp.Matrix([0, 1, 1])
    t = sp.Symbol("t")
    z, v, speed = (sp.Function(name)(t) for name in ("z", "v", "w"))
    b = sp.Symbol("kappa") * sp.Symbol("effective_radius")
    first = v - b * speed * z
    row = (model.A * sp.Matrix([z, v, z.diff(t)]) + model.B * v.diff(t))[2]
    row = row.subs({sp.Symbol("wheel_speed"): speed, sp.Symbol("wheel_acceleration"): speed.diff(t)})
    assert sp.simplify(first.diff(t) - row) == 0


def planar(third: str) -> tuple[sp.Matrix, sp.Matrix]:
    model = planar_force_model(load_parameter_set("corner-estimation"), third)  # type: ignore[arg-type]
    return sp.Matrix(model.f.jacobian(model.state_symbols)), sp.Matrix(model.h.jacobian(model.state_symbols))


def test_p1_lateral_force_model_has_rank_three_unless_the_wheels_are_straight() -> None:
    """P1 (10), (12): rank(O_3) = 3 iff delta != k pi, with r' as third output (reference: P1-O3)."""
    A, C = planar("yaw_acceleration")
    d = sp.Symbol("steering_angle")
    motion = {d: rate_symbol("d"), rate_symbol("d"): rate_symbol("d", 2)}
    matrix = observability_of(A, C, motion, 3)
    minors = matrix.minors({"d_rate": 0, "d_rate2": 0})
    m, inertia, track = sp.symbols("mass yaw_inertia front_track")
    assert {sp.simplify(abs(sp.Integer(1)) * minor / sp.sin(d) ** 2) for minor in minors} == {
        track / (2 * m**2 * inertia)
    }
    assert sp.solveset(sp.sin(d) ** 2, d, sp.Interval(-4, 4)) == {-sp.pi, 0, sp.pi}
    values = {"mass": 2270, "yaw_inertia": 4650, "front_axle_distance": "1.42", "rear_axle_distance": "1.43",
              "front_track": "1.62"}  # fmt: skip
    straight = {**values, "steering_angle": 0}
    assert matrix.rank_at({**straight, "d_rate": 0, "d_rate2": 0}) == 2
    assert matrix.rank_at({**straight, "d_rate": "0.01", "d_rate2": 0}) == 3  # passing through straight is enough
    assert matrix.rank_at({**straight, "d_rate": 0, "d_rate2": "0.01"}) == 3
    (hidden,) = matrix.hidden_at({**straight, "d_rate": 0, "d_rate2": 0})
    assert hidden == sp.Matrix([0, 0, 1])  # the left/right difference of the front forces


def test_p1_with_the_yaw_rate_as_printed_never_sees_the_difference() -> None:
    A, C = planar("none")
    d = sp.Symbol("steering_angle")
    matrix = observability_of(A, C, {d: rate_symbol("d"), rate_symbol("d"): rate_symbol("d", 2)}, 3)
    assert rank_loss(matrix).always
    assert matrix.rank_at({"mass": 2270, "steering_angle": "0.2", "d_rate": "0.3", "d_rate2": "-0.1"}) == 2


RANGES = {
    "yaw_rate": (-0.6, 0.6), "speed": (5.0, 40.0), "sideslip": (-0.05, 0.05), "force_fl": (-4e3, 4e3),
    "force_fr": (-4e3, 4e3), "force_rl": (-4e3, 4e3), "force_rr": (-4e3, 4e3), "front_force_x": (-4e3, 4e3),
    "steering_angle": (-0.2, 0.2), "load_fl": (1e3, 6e3), "load_fr": (1e3, 6e3), "load_rl": (1e3, 6e3),
    "load_rr": (1e3, 6e3),
}  # fmt: skip


def test_p4_model_is_never_observable_and_loses_one_more_when_steering_is_zero() -> None:
    """P4 section IV-A claims rank 8 except at delta = 0 or V = 0 (reference: P4-obs).

    The difference of the rear forces reaches no output: the outputs and the other states see only their sum, and the
    sum obeys an equation of its own. Rank is 7 at most, for any tire constants; what is lost decays at V / sigma_2.
    """
    model = four_wheel_model()
    found = generic_rank(model, RANGES, order=4, seed=1)
    assert found.rank == 7
    assert all(sample.residual < 1e-60 for sample in found.samples)
    assert found.structure.proved
    assert found.structure.describe() in (
        ("force_rl - force_rr",),
        ("- force_rl + force_rr",),
        ("force_rr - force_rl",),
    )
    assert found.structure.dynamics == sp.Matrix([[-2 * sp.Symbol("speed")]])  # sigma_2 = 0.5 m
    straight = generic_rank(model, {**RANGES, "steering_angle": (0.0, 0.0)}, order=4, seed=2)
    assert straight.rank == 6
    assert straight.structure.proved and straight.structure.basis.cols == 2


def test_p4_at_given_points() -> None:
    test = LieRankTest(four_wheel_model(), order=4)
    state = {"yaw_rate": "0.21", "speed": "19.3", "sideslip": "0.013", "force_fl": 1500, "force_fr": 2100,
             "force_rl": 1200, "force_rr": 1700, "front_force_x": 700}  # fmt: skip
    loads = {"load_fl": 3500, "load_fr": 4500, "load_rl": 2500, "load_rr": 3600}
    assert test.at(state, {"steering_angle": "0.05", **loads}).by_order == (4, 7, 7, 7, 7)
    assert test.at(state, {"steering_angle": 0, **loads}).rank == 6
    assert test.at(state, {"steering_angle": [0, "0.1"], **loads}).rank == 7  # steering through straight
    resting = {**dict.fromkeys(state, 0)}
    with pytest.raises(AnalysisError, match=r"speed.* = 0 divides"):  # no Lie derivative exists at V_g = 0
        test.at(resting, {"steering_angle": "0.05", **loads})


def test_p4_with_a_sensor_of_the_rear_difference_has_rank_eight() -> None:
    """The control: what is missing is exactly that direction."""
    plain = four_wheel_model()
    more = NonlinearModel(
        plain.name, plain.source, plain.states, (*plain.outputs, plain.states[6]), plain.f,
        sp.Matrix.vstack(plain.h, sp.Matrix([sp.Symbol("force_rr")])), plain.inputs, plain.constants,
    )  # fmt: skip
    assert generic_rank(more, RANGES, samples=1, order=3).rank == 8


def test_p4_output_equation_follows_from_the_force_balance() -> None:
    """(12) prints x_6 sin u_1 in y_4; (1) gives F_x1 sin delta = x_8 sin u_1 (reference: P4-y4)."""
    model = four_wheel_model()
    x = dict(zip((s.name for s in model.states), model.state_symbols, strict=True))
    d, m = sp.Symbol("steering_angle"), sp.Symbol("mass")
    lateral = (
        (x["force_fl"] + x["force_fr"]) * sp.cos(d) + x["force_rl"] + x["force_rr"] + x["front_force_x"] * sp.sin(d)
    ) / m
    assert sp.simplify(model.h[3] - lateral) == 0
    # y_4 must be V (beta' + r) cos(beta) + V' sin(beta), whatever the forces are.
    v, beta, r = x["speed"], x["sideslip"], x["yaw_rate"]
    kinematic = v * (model.f[2] + r) * sp.cos(beta) + model.f[1] * sp.sin(beta)
    assert sp.simplify(sp.expand_trig(sp.expand(kinematic - model.h[3]))) == 0


def test_p4_dugoff_sign_as_printed_makes_the_car_unstable() -> None:
    """(3) has a minus sign; with the slip angles of (2) straight driving at 20 m/s is then unstable (reference: P4-dugoff)."""
    point = dict.fromkeys((s.name for s in (*four_wheel_model().states, *four_wheel_model().inputs)), 0.0)
    point |= {"speed": 20.0, "load_fl": 4000.0, "load_fr": 4000.0, "load_rl": 3000.0, "load_rr": 3000.0}
    slowest = {}
    for sign in (1, -1):
        A = four_wheel_model(force_sign=sign).linearised(point)[0]
        moving = [0, 2, 3, 4, 5, 6]  # speed and F_x1 are integrators in either case
        slowest[sign] = np.linalg.eigvals(A[np.ix_(moving, moving)]).real.max()
    assert slowest[1] == pytest.approx(-3.5263, abs=1e-4)
    assert slowest[-1] == pytest.approx(3.7092, abs=1e-4)
    # Without the relaxation lag: the single-track matrix of P5's car.
    c1, c2, l1, l2, m, inertia, v = 65e3, 50e3, 1.12, 1.46, 1447.0, 3000.0, 20.0
    moment = c1 * l1 - c2 * l2
    forces = np.array([[-(c1 + c2) / (m * v), -moment / (m * v**2)],
                       [-moment / inertia, -(c1 * l1**2 + c2 * l2**2) / (inertia * v)]])  # fmt: skip
    turning = np.array([[0.0, -1.0], [0.0, 0.0]])
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(forces + turning).real), [-3.8848, -3.2242], atol=1e-4)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(-forces + turning).real), [3.0621, 4.0469], atol=1e-4)


def test_p5_force_model_is_observable_only_because_the_rear_longitudinal_force_is_neglected() -> None:
    """P5 (1)-(4), rank 4 with no steering angle in it (reference: P5-obs)."""
    test = LieRankTest(axle_force_model())
    assert test.at({"yaw_rate": 0, "front_force_y": 0, "rear_force_y": 0, "front_force_x": 0}).by_order[:2] == (3, 4)
    both = generic_rank(axle_force_model(rear_longitudinal_force=True),
                        {s.name: (-1.0, 1.0) for s in axle_force_model(rear_longitudinal_force=True).states})  # fmt: skip
    assert both.rank == 4 and both.structure.proved
    assert both.structure.dynamics == sp.zeros(1)  # and what is lost does not decay


def test_p5_stiffness_model_has_generic_rank_three_and_one_when_driving_straight() -> None:
    """P5 notes 6: rank 3 along the recorded drives (reference: P5-ekf-obs)."""
    model = adaptive_stiffness_model()
    ranges = {"sideslip": (-0.1, 0.1), "front_stiffness_change": (-2e4, 2e4), "rear_stiffness_change": (-2e4, 2e4),
              "steering_angle": (-0.1, 0.1), "yaw_rate": (-0.5, 0.5), "speed": (5.0, 30.0),
              "front_force_x": (-3e3, 3e3)}  # fmt: skip
    moving = generic_rank(model, ranges)
    assert moving.rank == 3 and moving.structure.proved and moving.structure.basis.cols == 0
    assert generic_rank(model, ranges, moving_inputs=False).rank == 3
    assert moving.samples[0].by_order[:3] == (2, 3, 3)
    test = LieRankTest(model)
    zero = {"sideslip": 0, "front_stiffness_change": 0, "rear_stiffness_change": 0}
    straight = {"steering_angle": 0, "yaw_rate": 0, "speed": 20, "front_force_x": 0}
    lost = test.at(zero, straight)
    assert lost.rank == 1  # both stiffnesses: no slip, no knowledge of the slope
    np.testing.assert_allclose(lost.unseen[0], 0.0, atol=1e-15)
    assert test.at(zero, {**straight, "yaw_rate": [0, "0.1"]}).rank == 3  # a turn that begins
    # The third output repeats the first two at once: it adds redundancy, no rank.
    x = model.state_symbols
    H = model.h.jacobian(x)
    assert sp.simplify(
        H[2, :] * sp.Symbol("mass") - H[0, :] * sp.cos(sp.Symbol("steering_angle")) - H[1, :]
    ).is_zero_matrix
