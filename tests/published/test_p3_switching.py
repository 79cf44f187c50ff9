"""Switching claims of P3: Example 1, Proposition 1, (20), Examples 2 and 3. References: independent recomputations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from analysis.switching.common_lyapunov import common_quadratic_lyapunov
from analysis.switching.joint_spectral_radius import joint_spectral_radius
from analysis.switching.pair import exact_pair_test, pair_margin
from analysis.switching.similarity import (
    best_diagonal_transform,
    common_growth,
    diagonal_window,
    similarity_bound,
    symmetric_growth,
)
from synthesis.lmi.result import Verdict
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.parameter_set import load_parameter_set

SPEEDS = np.arange(0.0, 141.0)
SAMPLE_TIME = 0.005  # 200 Hz
T = np.diag([9000.0, 1.0])  # Proposition 1


def modes(speeds, which):
    """A_e of the longitudinal observer: 1 = [1.18, 387], 2 = [0.22, 0.1] (high slip), 0 = no measurement."""
    parameters = load_parameter_set("resilient-velocity")
    published = parameters.tire["longitudinal"].published
    gain = {1: published.gains, 2: published.gains_high_slip, 0: (0.0, 0.0)}[which]
    model = corner_velocity_model(parameters, "longitudinal")
    return model.on(np.atleast_1d(speeds)).error_dynamics(np.array(gain)[:, None])


def sampled(speed, *which):
    return np.stack([expm(SAMPLE_TIME * modes(speed, k)[0][0]) for k in which])


def test_example_1_symmetric_part() -> None:
    """108750 is printed; Table I gives 105905 at 40 rad/s, and 108750 belongs to 33.5 rad/s (claim P3-ex1-sym)."""
    at_40 = float(symmetric_growth(modes(40.0, 1)[0])[0])
    assert at_40 == pytest.approx(105905.0, abs=0.5)
    assert abs(at_40 - 108750.0) > 2800.0
    speed = brentq(lambda w: float(symmetric_growth(modes(w, 1)[0])[0]) - 108750.0, 20.0, 60.0)
    assert speed == pytest.approx(33.529, abs=0.01)


def test_example_1_with_the_printed_transform() -> None:
    """-326.8 is printed; -326.9034 at 40 rad/s, and -326.8 only between 20 and 33 rad/s (claim P3-ex1-T)."""
    assert float(symmetric_growth(modes(40.0, 1)[0], T)[0]) == pytest.approx(-326.90342775, abs=1e-7)
    growth = symmetric_growth(modes(SPEEDS, 1)[0], T)
    rounded = SPEEDS[np.round(growth, 1) == -326.8]
    assert (rounded.min(), rounded.max()) == (21.0, 33.0)
    assert growth.max() < 0.0  # the assumption of Proposition 1 holds over the whole range


def test_the_best_diagonal_transform_removes_all_conservatism() -> None:
    """gamma* = 6599.603005 and lambda_max(A) itself, -327.143006 (claim P3-ex1-Topt)."""
    A = modes(40.0, 1)[0]
    found = best_diagonal_transform(A)
    assert found.gamma[0] == pytest.approx(6599.603005, rel=1e-9)
    assert found.growth[0] == pytest.approx(-327.143005949, abs=1e-8)
    assert symmetric_growth(A, np.diag([found.gamma[0], 1.0]))[0] == pytest.approx(
        np.linalg.eigvals(A).real.max(), abs=1e-8
    )


def test_proposition_1_over_the_range() -> None:
    for direction in ("longitudinal", "lateral"):
        parameters = load_parameter_set("resilient-velocity")
        model = corner_velocity_model(parameters, direction)
        A, B = model.on(SPEEDS).error_dynamics(np.array(parameters.tire[direction].published.gains)[:, None])
        gamma = 9000.0 if direction == "longitudinal" else float(best_diagonal_transform(A).gamma.mean())
        bound = similarity_bound(A, B[..., :2], np.diag([gamma, 1.0]), disturbance=0.5)
        assert bound.bounded
        floor = -bound.eta2 / bound.eta1
        assert bound.energy(10.0, 0.0) == pytest.approx(floor, rel=1e-6)
        assert (np.diff(bound.energy(np.linspace(0, 0.02, 50), 4 * floor)) < 0.0).all()


def test_arbitrary_switching_is_not_proved_by_the_transform_of_proposition_1() -> None:
    """(20) needs lambda_bar < 0: with T = diag(9000, 1) it is +7089 at 40 rad/s and +7174 over the range (claim P3-20)."""
    both = np.stack([modes(SPEEDS, 1)[0], modes(SPEEDS, 2)[0]])
    assert symmetric_growth(both[1, 40], T) == pytest.approx(3545.0, abs=0.5)  # P3 notes 9 item 6
    assert common_growth(both[:, 40], T) == pytest.approx(2 * 3544.67169, abs=1e-2)
    assert common_growth(both, T) == pytest.approx(7174.077, abs=1e-2)


def test_no_diagonal_transform_serves_both_modes() -> None:
    low_1, high_1 = diagonal_window(modes(SPEEDS, 1)[0])
    low_2, high_2 = diagonal_window(modes(SPEEDS, 2)[0])
    assert (low_1.min(), low_1.max()) == (pytest.approx(125.3, abs=0.05), pytest.approx(248.7, abs=0.05))
    assert (high_2.min(), high_2.max()) == (pytest.approx(14.12, abs=0.005), pytest.approx(17.43, abs=0.005))
    assert high_2.max() < low_1.min()
    assert (low_1 < high_1).all()
    assert (low_2 < high_2).all()


def test_no_common_quadratic_function_below_37_rad_s_in_continuous_time() -> None:
    """The exact 2 x 2 test and the LMI with its refutation agree at every tested speed (P3 notes 9 item 6)."""
    first, second = modes(SPEEDS, 1)[0], modes(SPEEDS, 2)[0]
    np.testing.assert_array_equal(pair_margin(first, second) <= 0.0, SPEEDS <= 36.0)
    for speed in (0, 20, 36, 37, 78, 140):
        expected = Verdict.REFUTED if speed <= 36 else Verdict.CERTIFIED
        assert exact_pair_test(first[speed], second[speed]) is expected
        assert common_quadratic_lyapunov(np.stack([first[speed], second[speed]])).verdict is expected


def test_the_sampled_modes_do_share_one_at_every_frozen_speed() -> None:
    """What the continuous test denies the update at 200 Hz has: arbitrary switching at a frozen speed is stable."""
    first, second = expm(SAMPLE_TIME * modes(SPEEDS, 1)[0]), expm(SAMPLE_TIME * modes(SPEEDS, 2)[0])
    assert (pair_margin(first, second, discrete=True) > 1.0).all()
    for speed in (0, 20, 37, 80, 140):
        pair = np.stack([first[speed], second[speed]])
        assert common_quadratic_lyapunov(pair, discrete=True).verdict is Verdict.CERTIFIED
        assert exact_pair_test(*pair, discrete=True) is Verdict.CERTIFIED


@pytest.mark.parametrize("speed", [0.0, 9.0, 40.0, 140.0])
def test_example_2_arbitrary_switching(speed) -> None:
    """The fastest growth is mode 2 itself, proved: its square is the printed 0.9960 near 9 rad/s only (claim P3-ex2-arb)."""
    found = joint_spectral_radius(sampled(speed, 1, 2), tolerance=1e-4)
    assert found.product == (1,)
    assert found.closed
    assert found.verdict is Verdict.CERTIFIED
    alone = np.abs(np.linalg.eigvals(sampled(speed, 2))).max()
    assert found.lower == pytest.approx(alone, rel=1e-12)
    if speed == 9.0:
        assert alone**2 == pytest.approx(0.99600809, abs=1e-8)
    if (
        speed == 40.0
    ):  # the claim's own square there, 0.99718853, is not the square of its radius; 30 digits: 0.9971887134
        assert alone == pytest.approx(0.99859336, abs=1e-8)
        assert alone**2 == pytest.approx(0.997188713375809, abs=1e-13)
    assert 0.9977 <= alone <= 0.9993


def test_example_2_printed_radius_needs_the_square_and_a_low_speed() -> None:
    def square(speed):
        return float(np.abs(np.linalg.eigvals(sampled(speed, 2))).max()) ** 2

    low, high = (brentq(lambda w, level=level: square(w) - level, 1.0, 40.0) for level in (0.99595, 0.99605))
    assert (low, high) == (pytest.approx(7.94, abs=0.01), pytest.approx(9.78, abs=0.01))


@pytest.mark.parametrize("speed", [40.0, 80.0, 140.0])
def test_example_3_arbitrary_loss_is_marginal_at_high_speed(speed) -> None:
    """rho = 1 as printed: the integrator of the open loop, and no product of updates grows (claim P3-ex3-arb)."""
    found = joint_spectral_radius(sampled(speed, 1, 0), tolerance=1e-5)
    assert found.lower == 1.0
    assert found.upper <= 1.0 + 1e-5
    assert found.product == (1,)
    assert found.verdict is Verdict.REFUTED  # marginal is not asymptotically stable


@pytest.mark.parametrize(("speed", "rate"), [(1.0, 1.15), (10.0, 1.085), (20.0, 1.03)])
def test_example_3_arbitrary_loss_grows_at_low_speed(speed, rate) -> None:
    """One update after several drops expands: `marginally stable` fails (P3 notes 9 item 9)."""
    found = joint_spectral_radius(sampled(speed, 1, 0), tolerance=1e-5)
    assert found.closed
    assert found.lower >= rate
    assert found.product.count(0) == 1
    assert found.verdict is Verdict.REFUTED


def test_example_3_becomes_marginal_where_drops_become_harmless() -> None:
    """Between 25 and 30 rad/s, where the critical drop probability reaches 1 (Fig. 7)."""
    assert joint_spectral_radius(sampled(25.0, 1, 0), tolerance=1e-5).lower > 1.009
    assert joint_spectral_radius(sampled(30.0, 1, 0), tolerance=1e-5).upper < 1.00001
