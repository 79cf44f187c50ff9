"""Systems built around a known norm, in random coordinates."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.norms.hinf import hinf_norm
from tests.support.level_crossing import crosses_level


def build(seed: int, modes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Parallel oscillators on orthogonal channels, in random orthogonal coordinates: the norm is the tallest peak."""
    rng = np.random.default_rng(seed)
    # milder than that, rounding of A itself would move the peak by more than 1e-8
    w, z = 10.0 ** rng.uniform(-1, 2, modes), 10.0 ** rng.uniform(-3, -0.2, modes)
    k = 10.0 ** rng.uniform(-1, 1, modes)
    A, B, C = np.zeros((2 * modes,) * 2), np.zeros((2 * modes, modes)), np.zeros((modes, 2 * modes))
    for i in range(modes):
        A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[0.0, w[i]], [-w[i], -2.0 * z[i] * w[i]]]
        B[2 * i + 1, i], C[i, 2 * i] = w[i] * k[i], 1.0
    peak = np.where(z < np.sqrt(0.5), 1.0 / (2.0 * z * np.sqrt(np.maximum(1.0 - z**2, 1e-300))), 1.0)
    Q, U, V = (np.linalg.qr(rng.normal(size=(n, n)))[0] for n in (2 * modes, modes, modes))
    return Q @ A @ Q.T, Q @ B @ U, V @ C @ Q.T, float((k * peak).max())


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), modes=st.integers(1, 4))
def test_the_tallest_peak_is_found(seed: int, modes: int) -> None:
    A, B, C, answer = build(seed, modes)
    found = float(hinf_norm(A, B, C).norm)
    assert abs(found / answer - 1.0) < 1e-8


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6), discrete=st.booleans())
def test_norm_scales_is_transposed_and_forgets_coordinates(seed: int, n: int, discrete: bool) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    poles = np.linalg.eigvals(A)
    A = A * (0.95 / np.abs(poles).max()) if discrete else A - (poles.real.max() + 0.1) * np.eye(n)
    B, C, D = rng.normal(size=(n, 2)), rng.normal(size=(3, n)), rng.normal(size=(3, 2))
    base = hinf_norm(A, B, C, D, discrete).norm
    T = rng.normal(size=(n, n)) + 3.0 * np.eye(n)
    moved = hinf_norm(T @ A @ np.linalg.inv(T), T @ B, C @ np.linalg.inv(T), D, discrete).norm
    np.testing.assert_allclose(moved, base, rtol=1e-7)
    np.testing.assert_allclose(hinf_norm(A.T, C.T, B.T, D.T, discrete).norm, base, rtol=2e-9)
    np.testing.assert_allclose(hinf_norm(A, 7.0 * B, C, 7.0 * D, discrete).norm, 7.0 * base, rtol=2e-9)
    assert crosses_level(A, B, C, D, base * (1 - 1e-8), discrete)
    assert not crosses_level(A, B, C, D, base * (1 + 1e-8), discrete)
