"""Second-moment radii: 10,000 small systems at once, and how the cost grows with states and modes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.markov.continuous import second_moment_flow
from analysis.markov.coupled_lyapunov import solve_coupled_lyapunov
from analysis.markov.power import abscissa_estimate, radius_estimate
from analysis.markov.second_moment import spectral_radius
from analysis.markov.system import MarkovJumpSystem, second_moment_operator


def random_systems(states: int, modes: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    draw = np.random.default_rng(0)
    return draw.normal(0, 0.5 / np.sqrt(states), (count, modes, states, states)), draw.dirichlet(
        np.ones(modes), (count, modes)
    )


def test_ten_thousand_systems(benchmark: Any) -> None:
    """Two states, two modes; to be below 0.2 s."""
    modes, transition = random_systems(2, 2, 10_000)
    radius = benchmark(lambda: MarkovJumpSystem(modes, transition).second_moment_radius())
    assert radius.shape == (10_000,)


def test_ten_thousand_systems_on_the_full_operator(benchmark: Any) -> None:
    """P3 (22) with its 8 x 8 Kronecker products, vectorised: what the half-vectorised operator saves."""
    modes, transition = random_systems(2, 2, 10_000)

    def full() -> np.ndarray:
        squares = np.einsum("...mik,...mjl->...mijkl", modes, modes).reshape(-1, 2, 4, 4)
        blocks = np.swapaxes(transition, 1, 2)[:, :, None, :, None] * np.moveaxis(squares, 1, 2)[:, None]
        return np.abs(np.linalg.eigvals(blocks.reshape(-1, 8, 8))).max(axis=-1)

    radius = benchmark.pedantic(full, rounds=3)
    np.testing.assert_allclose(radius, MarkovJumpSystem(modes, transition).second_moment_radius(), rtol=1e-7)


@pytest.mark.benchmark(group="radius of 16 states and 8 modes")
@pytest.mark.parametrize("road", ["steps, bounded from both sides", "operator as a matrix"])
def test_sixteen_states_and_eight_modes(benchmark: Any, road: str) -> None:
    """The operator has 1088 rows; steps with Collatz and Wielandt's bounds to be at least 50 times faster."""
    A, P = (array[0] for array in random_systems(16, 8, 1))
    if road == "operator as a matrix":
        radius = float(benchmark.pedantic(lambda: spectral_radius(second_moment_operator(A, P)), rounds=1))
    else:
        radius = benchmark(radius_estimate, A, P).value
    found = radius_estimate(A, P)
    benchmark.extra_info["relative width of the bracket"] = (found.upper - found.lower) / found.upper
    assert found.lower <= radius <= found.upper


@pytest.mark.benchmark(group="abscissa of 16 states and 8 modes")
@pytest.mark.parametrize("road", ["steps, bounded from both sides", "operator as a matrix"])
def test_sixteen_states_and_eight_modes_in_continuous_time(benchmark: Any, road: str) -> None:
    A, P = (array[0] for array in random_systems(16, 8, 1))
    A, Q = 2.0 * A - np.eye(16), P - np.eye(8)
    if road == "operator as a matrix":
        value = benchmark.pedantic(np.linalg.eigvals, args=(second_moment_flow(A, Q),), rounds=1).real.max()
    else:
        value = benchmark(lambda: abscissa_estimate(A, Q).value)
    assert value == pytest.approx(abscissa_estimate(A, Q).value, abs=1e-9)


@pytest.mark.parametrize("modes", [2, 4, 8])
@pytest.mark.parametrize("states", [2, 4, 8, 16, 24, 32])
def test_growth(benchmark: Any, states: int, modes: int) -> None:
    A, P = (array[0] for array in random_systems(states, modes, 1))
    benchmark.extra_info["size of the operator"] = modes * states * (states + 1) // 2
    radius = benchmark.pedantic(lambda: MarkovJumpSystem(A, P).second_moment_radius(), rounds=3)
    assert radius < 1.0


def test_coupled_lyapunov(benchmark: Any) -> None:
    A, P = (array[0] for array in random_systems(4, 4, 1))
    system = MarkovJumpSystem(A, P)
    benchmark(solve_coupled_lyapunov, system, np.eye(4))
