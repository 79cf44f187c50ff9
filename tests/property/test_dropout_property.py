"""Drop probabilities that are known by construction."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from analysis.drops.frozen import critical_drop_probability, drop_radius
from analysis.drops.gilbert_elliott import critical_recovery_probability
from analysis.drops.planar import largest_cubic_root

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=80, deadline=None)
@given(seeds, st.integers(1, 4), st.floats(0.02, 0.98), st.floats(0.05, 0.95))
def test_probability_that_was_put_in(seed: int, n: int, p: float, contraction: float) -> None:
    """Multiples of orthogonal matrices in a common basis: p a^2 + (1 - p) c^2 = 1, with a solved for the wanted p."""
    draw = np.random.default_rng(seed)
    rotations = np.linalg.qr(draw.normal(size=(2, n, n)))[0]
    shear = draw.normal(size=(n, n)) + 3.0 * np.eye(n)
    assume(np.linalg.cond(shear) < 1e2)  # beyond that float64 does not hold the pair that was built
    a = np.sqrt((1.0 - (1.0 - p) * contraction**2) / p)
    A0, A1 = (g * shear @ Q @ np.linalg.inv(shear) for g, Q in zip((a, contraction), rotations, strict=True))
    np.testing.assert_allclose(critical_drop_probability(A0, A1), p, rtol=1e-6)


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(1, 3))
def test_stable_below_and_on_the_boundary_at_the_answer(seed: int, n: int) -> None:
    draw = np.random.default_rng(seed)
    A0, A1 = draw.normal(size=(2, n, n))
    A1 *= draw.uniform(0.1, 0.95) / max(np.abs(np.linalg.eigvals(A1)).max(), 1e-3)
    p = float(critical_drop_probability(A0, A1))
    assert 0.0 < p <= 1.0
    below = drop_radius(A0, A1, p * np.linspace(0.0, 0.9999, 60))
    assert (below < 1.0).all()
    if p < 1.0:
        assert abs(drop_radius(A0, A1, p) - 1.0) < 1e-7


@settings(max_examples=60, deadline=None)
@given(seeds, st.floats(0.05, 1.0))
def test_recovery_boundary_is_a_boundary(seed: int, failure: float) -> None:
    draw = np.random.default_rng(seed)
    A0, A1 = draw.normal(size=(2, 2, 2))
    A1 *= 0.7 / max(np.abs(np.linalg.eigvals(A1)).max(), 1e-3)
    r = float(critical_recovery_probability(A0, A1, failure))
    assume(np.isfinite(r))
    from analysis.drops.gilbert_elliott import gilbert_elliott

    above = gilbert_elliott(A0, A1, failure, r + (1.0 - r) * np.linspace(1e-4, 1.0, 40)).second_moment_radius()
    assert (above < 1.0).all()
    if r > 0.0:
        np.testing.assert_allclose(gilbert_elliott(A0, A1, failure, r).second_moment_radius(), 1.0, atol=1e-7)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=3, max_size=3))
def test_largest_cubic_root_that_was_put_in(roots: list[float]) -> None:
    """Real roots, well apart (a multiple root is only determined to the root of the rounding error)."""
    x, y, z = sorted(roots)
    assume(z - y > 1e-2)
    found = largest_cubic_root(np.array(x + y + z), np.array(x * y + y * z + z * x), np.array(x * y * z))
    np.testing.assert_allclose(found, z, atol=1e-9)


@settings(max_examples=100, deadline=None)
@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.1, 5))
def test_only_real_root_beside_a_complex_pair(real: float, middle: float, imaginary: float) -> None:
    product = middle**2 + imaginary**2
    found = largest_cubic_root(
        np.array(real + 2 * middle), np.array(product + 2 * middle * real), np.array(real * product)
    )
    np.testing.assert_allclose(found, real, atol=1e-8)
