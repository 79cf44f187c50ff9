"""Independent computations of what the study of P1 says of the H-infinity design, the Kalman gains, forces and loads."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest

from analysis.norms.hinf import hinf_norm
from studies.claim import ClaimVerdict
from studies.papers.corner_estimation.force_observers import filter_lag
from studies.papers.corner_estimation.hinf_design import OMEGA, fitted, optima, schedule, signed_model, velocity_floor
from studies.papers.corner_estimation.inputs import CORNERS, PACKAGE, Corner
from studies.papers.corner_estimation.solve_size import expressions, one_by_one, relaxed_problem, solve_size
from studies.papers.published import printed_numbers
from synthesis.lmi.relaxation import RelaxedProblem
from tests.support.p1_findings import PRINT, RADIUS, finding

# ---- (30): H-infinity -----------------------------------------------------------------------------------------------------


def test_gamma_lies_between_the_floor_and_the_frozen_norms() -> None:
    """Every gamma is at least the static gain, and the frozen loops with the returned gains reach no more than gamma."""
    for corner in CORNERS.values():
        for found in optima(corner):
            model = corner.design_model
            A_e, B_e = model.on(OMEGA).error_dynamics(found.gain(OMEGA))
            norm = hinf_norm(A_e, B_e[..., :2], np.eye(2)).norm
            floor = velocity_floor(corner, "corrected", OMEGA)
            assert (norm >= floor * (1 - 1e-9)).all()
            assert norm.max() <= found.gamma * (1 + 1e-7)
            assert floor.max() == 1.0


def test_static_gain_for_both_signs_by_solving_the_error_at_rest() -> None:
    """-A_e^-1 B_e with arbitrary gains, for the printed and the corrected sign."""
    omega = np.array([0.0, 40.0, 140.0])
    for corner, sign in product(CORNERS.values(), ("printed", "corrected")):
        numeric = signed_model(corner, sign).on(omega)  # type: ignore[arg-type]
        A_e, B_e = numeric.error_dynamics(np.array([[0.9], [33.0]]))
        gain = np.abs(-np.linalg.solve(A_e, B_e)[:, 1, 0])
        np.testing.assert_allclose(gain, velocity_floor(corner, sign, omega), rtol=1e-9)  # type: ignore[arg-type]
    a = 12.84 * 0.33 * 140.0
    assert abs(1.621 * a / (181.5 + 0.001 * a) - 1.0 - 4.2808) < 5e-5


@pytest.mark.parametrize("corner", CORNERS.values(), ids=CORNERS)
def test_kalman_gains_by_spectral_factorisation(corner: Corner) -> None:
    """L2 is constant and L1 has the closed form of the module; the Riccati equation must agree, also near sigma0 = sigma1 a."""
    s0, s1, s2, kappa, *_ = (float(value) for value in PRINT[corner.direction])
    noise = fitted(corner, corner.gains, 70.0)
    omega = np.array([0.0, 20.0, 50.0, 52.8, 60.0, 140.0])
    a = kappa * float(RADIUS) * omega
    sensor = 1.0 + s1 * s1 * noise.friction
    L2 = np.sqrt(noise.acceleration / sensor)
    p0 = L2 * (s0 + s2 * a)
    p1 = np.sqrt(2 * p0 + (noise.friction * s0**2 + noise.acceleration * (s1 + s2) ** 2 + a * a) / sensor)
    L1 = (p1 - a - L2 * (s1 + s2)) / (s0 - s1 * a)
    np.testing.assert_allclose(schedule(corner, noise, omega), np.stack([L1, np.full(6, L2)], axis=1), rtol=1e-7)


# ---- (30): its size ---------------------------------------------------------------------------------------------------------


def test_size_of_the_conic_problem_by_hand() -> None:
    """Per point P > 0 (2x2) and two rates of the compact gain block (4x4); sums of squares of degrees 1 and 2 on an interval."""
    points, degree, (states, disturbances) = 140, 1, (2, 2)

    def triangle(size: int) -> int:
        return size * (size + 1) // 2

    block = states + disturbances
    free = (degree + 1) * (triangle(states) + states) + 1  # P, chi, gamma^2
    found = finding("P1-hinf-time").computed
    assert found["conic_problem"] == {
        "unknowns": free,
        "rows": points * (triangle(states) + 2 * triangle(block)),
        "cones": {f"{states}x{states}": points, f"{block}x{block}": 2 * points},
    }
    # degree 1: (1 + u) X1 + (1 - u) X2 at 2 nodes; degree 2: [1 u]' X1 [1 u] + (1 - u^2) X2 at 3, for both rates
    cones = [states] * 2 + [2 * block, block] * 2
    gram = sum(map(triangle, cones))
    assert found["exact_relaxation"] == found["exact_relaxation_with_twice_the_points"] == {
        "unknowns": free + gram,
        "rows": gram + 2 * triangle(states) + 2 * 3 * triangle(block),
        "cones": {"2x2": 2, "4x4": 2, "8x8": 2},
    }  # fmt: skip


def test_the_layer_walks_the_same_for_every_point() -> None:
    """Three inequalities a point, each of at least a product, a constant and a sum; no other work than that of the points."""
    counts = {points: expressions(one_by_one(relaxed_problem(points, 1, "grid"))) for points in (5, 10, 20)}
    assert counts[20] == 2 * counts[10] == 4 * counts[5]
    assert counts[5] >= 5 * 3 * 3


def test_a_layer_that_hands_over_something_else_is_found_out() -> None:
    def forgetful(relaxed: RelaxedProblem) -> Any:
        problem = one_by_one(relaxed)
        return type(problem)(problem.objective, problem.constraints[:-1])

    def rounding(relaxed: RelaxedProblem) -> Any:
        """The last inequality in single precision."""
        last = relaxed.sampled[-1]
        coarse = replace(last, values=last.values.astype(np.float32).astype(float))
        return one_by_one(replace(relaxed, sampled=(*relaxed.sampled[:-1], coarse)))

    assert solve_size(10).verdict is ClaimVerdict.DERIVED
    assert solve_size(5).verdict is ClaimVerdict.NOT_REPRODUCED  # 5 points have fewer rows than the exact relaxation
    for layer in (forgetful, rounding):
        found = solve_size(10, layer=layer)
        assert not found.computed["layer_hands_over_the_same_problem"]
        assert found.verdict is ClaimVerdict.NOT_REPRODUCED


def test_no_clock_decides_what_a_solve_costs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the same words and numbers, and no clock is read for them."""

    def stopped() -> float:
        raise AssertionError("the claim read a clock")

    for module in (
        "time.perf_counter",
        "time.monotonic",
        "studies.papers.corner_estimation.solve_size.perf_counter",
    ):
        monkeypatch.setattr(module, stopped)
    assert solve_size(10) == solve_size(10)


# ---- forces -----------------------------------------------------------------------------------------------------------------


def test_poles_of_the_wheel_error_in_closed_form() -> None:
    inertia, radius, eta1, eta2 = (Fraction(x) for x in ("1.68", RADIUS, "1.8", "11.4"))
    half = radius * eta1 / (2 * inertia)
    square = eta2 / inertia - half * half
    computed = finding("P1-pid-K").computed
    (real, imaginary), (_, mirrored) = computed["poles_1_s"]
    assert half > 0 and square > 0  # complex and stable
    assert (
        abs(real + float(half)) <= 1e-8 and abs(imaginary - np.sqrt(float(square))) <= 1e-8 and mirrored == -imaginary
    )
    assert computed["damping_ratio"] == pytest.approx(0.068, abs=5e-4)


def test_loads_in_fractions() -> None:
    mass, gravity, height, front, rear = (Fraction(x) for x in ("2270", "9.81", "0.65", "1.42", "1.43"))
    base, computed = front + rear, finding("P1-loads").computed
    static = {"front": mass * gravity * rear / base, "rear": mass * gravity * front / base}
    for axle, track in (("front", Fraction("1.62")), ("rear", Fraction("1.56"))):
        assert abs(computed["static_N"][axle] - float(static[axle])) <= 1e-4
        assert abs(computed["static_N"][f"{axle}_left"] - float(static[axle] / 2)) <= 1e-4
        shift = float(static[axle] / gravity * height / track)
        assert abs(computed["per_unit_a_y_N"][f"{axle}_right"] - shift) <= 1e-4
        assert abs(computed["per_unit_a_y_N"][f"{axle}_left"] + shift) <= 1e-4
    assert abs(computed["per_unit_a_x_N"]["rear"] - float(mass * height / base)) <= 1e-4
    assert computed["at_rest_on_3_deg_bank"]["printed"] == pytest.approx(9.81 * np.sin(np.deg2rad(6.0)), rel=1e-12)


def test_force_filter_lags_by_its_own_covariances() -> None:
    """P1 notes 11 item 8: 1 s and 3.5 s in newtons, 1.5 ms and up to 3.8 ms in kilonewtons."""
    for entry, newtons, kilo in zip(
        printed_numbers(PACKAGE)["force_filter"]["readings"], (3.5, 1.06), (3.8e-3, 1.57e-3), strict=True
    ):
        assert filter_lag(entry["process"], entry["measurement"], 1.0) == pytest.approx(newtons, rel=0.01)
        assert filter_lag(entry["process"], entry["measurement"], 1e3) == pytest.approx(kilo, rel=0.01)
