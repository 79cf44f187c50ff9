"""Benchmark problems of the field on Markov jumps and intermittent measurements, with their published answers."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.drops.intermittent import kalman_critical_arrival, static_critical_arrival
from analysis.markov.coupled_lmi import mean_square_lmi
from analysis.markov.coupled_riccati import jump_regulator
from analysis.markov.system import MarkovJumpSystem
from synthesis.lmi.result import Verdict

# Blair and Sworder 1975, as given by Costa and Aya (Automatica, 2002): Samuelson's multiplier-accelerator model, three modes.
SAMUELSON = {
    "P": [[0.67, 0.17, 0.16], [0.3, 0.47, 0.23], [0.26, 0.1, 0.64]],
    "A": [[[0, 1], [-2.5, 3.2]], [[0, 1], [-4.3, 4.5]], [[0, 1], [5.3, -5.2]]],
    "B": [[0], [1]],
    "C": [
        [[1.8974, -2.0028], [0, 0.9268], [0, 0]],
        [[3.1623, -0.9487], [0, 2.6646], [0, 0]],
        [[2.2361, -2.0125], [0, 0.6708], [0, 0]],
    ],
    "R": [2.6, 1.165, 1.1111111111111112],
}
PUBLISHED_GAINS = [[2.31717677, -2.33169061], [4.168449, -3.71314585], [-5.16574215, 5.79334185]]
PUBLISHED_COST = [
    [[18.66177577, -18.95610168], [-18.95610168, 28.10885744]],
    [[30.88198653, -21.60107817], [-21.60107817, 36.27417714]],
    [[35.42062478, -38.6164977], [-38.6164977, 49.71203005]],
]


def test_samuelson() -> None:
    C = np.array(SAMUELSON["C"])
    system = MarkovJumpSystem(SAMUELSON["A"], SAMUELSON["P"])
    found = jump_regulator(system, SAMUELSON["B"], np.swapaxes(C, 1, 2) @ C, np.reshape(SAMUELSON["R"], (3, 1, 1)))
    np.testing.assert_allclose(found.gains[:, 0], PUBLISHED_GAINS, rtol=1e-7)
    np.testing.assert_allclose(found.cost, PUBLISHED_COST, rtol=1e-7)
    assert found.radius == pytest.approx(0.460941439, rel=1e-7)  # independent reference for the closed loop
    assert system.second_moment_radius() > 1.0


def test_samuelson_with_a_transposed_chain_is_another_problem() -> None:
    C, P = np.array(SAMUELSON["C"]), np.array(SAMUELSON["P"]).T
    P = P / P.sum(axis=1, keepdims=True)
    system = MarkovJumpSystem(SAMUELSON["A"], P)
    found = jump_regulator(system, SAMUELSON["B"], np.swapaxes(C, 1, 2) @ C, np.reshape(SAMUELSON["R"], (3, 1, 1)))
    assert np.abs(found.gains[:, 0] - PUBLISHED_GAINS).max() > 1e-3


def test_one_unstable_scalar_mode() -> None:
    """Costa, Fragoso and Marques 2005: modes 4/3 and 1/3, equal chances: radius (16/9 + 1/9) / 2 = 17/18."""
    system = MarkovJumpSystem([[[4 / 3]], [[1 / 3]]], [[0.5, 0.5], [0.5, 0.5]])
    assert system.second_moment_radius() == pytest.approx(17 / 18, rel=1e-12)
    assert mean_square_lmi(system).verdict is Verdict.CERTIFIED


def test_two_unstable_modes_are_mean_square_stable_together() -> None:
    """Costa, Fragoso and Marques 2005; Ji and Chizeck: both modes have the eigenvalue 2."""
    modes = np.array([[[2.0, -1.0], [0.0, 0.0]], [[0.0, 1.0], [0.0, 2.0]]])
    system = MarkovJumpSystem(modes, [[0.1, 0.9], [0.9, 0.1]])
    assert system.second_moment_radius() == pytest.approx(0.4, rel=1e-10)
    assert mean_square_lmi(system).verdict is Verdict.CERTIFIED
    # Negative control: the modes stay longer, and the same matrices diverge.
    staying = MarkovJumpSystem(modes, [[0.9, 0.1], [0.1, 0.9]])
    assert not staying.is_mean_square_stable()
    assert mean_square_lmi(staying).verdict is Verdict.REFUTED


@pytest.mark.parametrize("method", ["riccati", "lmi"])
def test_sinopoli_scalar(method: str) -> None:
    """Sinopoli et al. 2004: A = -1.25 gives 1 - 1/1.25^2 = 0.36 for both bounds."""
    found = static_critical_arrival([[-1.25]], [[1.0]], method=method)  # type: ignore[arg-type]
    assert found.verdict is Verdict.CERTIFIED
    assert (found.lower, found.upper) == pytest.approx((0.36, 0.36), rel=1e-6)
    assert kalman_critical_arrival([[-1.25]], [[1.0]]).lower == pytest.approx(0.36, rel=1e-12)
