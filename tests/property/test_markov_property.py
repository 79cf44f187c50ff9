"""Markov jump systems whose answer is known by construction."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.markov.coupled_lyapunov import expected_cost, solve_coupled_lyapunov
from analysis.markov.system import MarkovJumpSystem

seeds = st.integers(0, 2**32 - 1)
sizes = st.tuples(st.integers(1, 4), st.integers(1, 4))


def chain(draw: np.random.Generator, modes: int) -> np.ndarray:
    return draw.dirichlet(np.full(modes, 0.5), modes)


@settings(max_examples=60, deadline=None)
@given(seeds, sizes, st.floats(0.05, 3.0))
def test_radius_that_was_put_in(seed: int, size: tuple[int, int], radius: float) -> None:
    """A_i = sqrt(radius) times orthogonal: E|x|^2 is multiplied by the radius at every step, whatever the chain."""
    m, n = size
    draw = np.random.default_rng(seed)
    rotations = np.linalg.qr(draw.normal(size=(m, n, n)))[0]
    shear = draw.normal(size=(n, n)) + 3.0 * np.eye(n)
    modes = np.sqrt(radius) * shear @ rotations @ np.linalg.inv(shear)
    system = MarkovJumpSystem(modes, chain(draw, m))
    np.testing.assert_allclose(system.second_moment_radius(), radius, rtol=1e-8)
    assert bool(system.is_mean_square_stable()) == (system.second_moment_radius() < 1.0)


@settings(max_examples=60, deadline=None)
@given(seeds, sizes)
def test_names_of_modes_and_units_of_states_do_not_matter(seed: int, size: tuple[int, int]) -> None:
    m, n = size
    draw = np.random.default_rng(seed)
    modes, P, order = draw.normal(size=(m, n, n)), chain(draw, m), draw.permutation(m)
    scale = 10.0 ** draw.uniform(-2, 2, n)
    given_, moved = (
        MarkovJumpSystem(modes, P),
        MarkovJumpSystem((modes * (scale[:, None] / scale))[order], P[np.ix_(order, order)]),
    )
    np.testing.assert_allclose(moved.second_moment_radius(), given_.second_moment_radius(), rtol=1e-7)


@settings(max_examples=40, deadline=None)
@given(seeds, sizes)
def test_cost_matrices_that_were_put_in(seed: int, size: tuple[int, int]) -> None:
    """Choose P_i > 0, take W_i = P_i - A_i' E_i(P) A_i: the equation must give P_i back."""
    m, n = size
    draw = np.random.default_rng(seed)
    modes, transition = draw.normal(size=(m, n, n)), chain(draw, m)
    root = draw.normal(size=(m, n, n))
    P = root @ np.swapaxes(root, 1, 2) + np.eye(n)
    step = np.swapaxes(modes, 1, 2) @ np.einsum("ij,jkl->ikl", transition, P) @ modes
    inverse = np.linalg.inv(np.linalg.cholesky(P))
    largest = np.linalg.eigvalsh(inverse @ step @ np.swapaxes(inverse, 1, 2))[..., -1].max()
    modes, step = modes * np.sqrt(0.9 / largest), step * 0.9 / largest
    system = MarkovJumpSystem(modes, transition)
    weights = P - step
    assert system.second_moment_radius() <= 0.9 + 1e-9  # the Lyapunov function proves that much
    np.testing.assert_allclose(solve_coupled_lyapunov(system, weights), P, rtol=1e-7, atol=1e-8)
    pi = draw.dirichlet(np.ones(m))
    np.testing.assert_allclose(expected_cost(system, weights, np.eye(n), pi), np.einsum("i,ikk", pi, P), rtol=1e-7)
