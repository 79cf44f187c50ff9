"""Second-moment radii: 10,000 small systems at once, and how the cost grows with states and modes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.markov.coupled_lyapunov import solve_coupled_lyapunov
from analysis.markov.system import MarkovJumpSystem


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


@pytest.mark.parametrize("modes", [2, 4, 8])
@pytest.mark.parametrize("states", [2, 4, 8, 16])
def test_growth(benchmark: Any, states: int, modes: int) -> None:
    A, P = (array[0] for array in random_systems(states, modes, 1))
    benchmark.extra_info["size of the operator"] = modes * states * (states + 1) // 2
    radius = benchmark.pedantic(lambda: MarkovJumpSystem(A, P).second_moment_radius(), rounds=3)
    assert radius < 1.0


def test_coupled_lyapunov(benchmark: Any) -> None:
    A, P = (array[0] for array in random_systems(4, 4, 1))
    system = MarkovJumpSystem(A, P)
    benchmark(solve_coupled_lyapunov, system, np.eye(4))
