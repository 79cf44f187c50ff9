"""Gramians of sampled sequences against their definition, and window tests against brute force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.errors import AnalysisError
from analysis.observability.gramians import (
    growing_observability,
    sampled_sequence,
    sequence_controllability,
    sequence_observability,
    sliding_controllability,
    sliding_observability,
)
from analysis.observability.windows import uniform_detectability, uniform_stabilisability
from synthesis.lmi.result import Verdict
from synthesis.models.catalogue.longitudinal_speed import longitudinal_speed_model
from synthesis.models.discretise import zero_order_hold
from synthesis.models.parameter_set import load_parameter_set

Array = Any


def random_sequence(seed: int, count: int = 19, n: int = 3, m: int = 1) -> tuple[Array, Array]:
    random = np.random.default_rng(seed)
    return 0.6 * random.normal(size=(count, n, n)), random.normal(size=(count, m, n))


def by_definition(A: Array, C: Array, first: int, last: int) -> Array:
    """P2 (A1) term by term."""
    phi, total = np.eye(A.shape[-1]), np.zeros(A.shape[-2:])
    for k in range(first, last + 1):
        total = total + phi.T @ C[k].T @ C[k] @ phi
        phi = A[k] @ phi
    return total


def reached(A: Array, G: Array, first: int, last: int) -> Array:
    """P2 (A2) term by term, k2 = last + 1."""
    total = np.zeros(A.shape[-2:])
    for k in range(first, last + 1):
        phi = np.eye(A.shape[-1])
        for j in range(k + 1, last + 1):
            phi = A[j] @ phi
        total = total + phi @ G[k] @ G[k].T @ phi.T
    return total


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), window=st.integers(1, 19), outputs=st.integers(1, 4))
def test_sliding_growing_and_whole_gramians_follow_the_definition(seed: int, window: int, outputs: int) -> None:
    A, C = random_sequence(seed, m=outputs)
    sliding = sliding_observability(A, C, window)
    assert sliding.factor.shape == (20 - window, 3, 3)
    for k in range(20 - window):
        np.testing.assert_allclose(sliding.gramian[k], by_definition(A, C, k, k + window - 1), rtol=1e-9, atol=1e-9)
    growing = growing_observability(A, C)
    np.testing.assert_allclose(growing.gramian[window - 1], by_definition(A, C, 0, window - 1), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(sequence_observability(A, C).gramian, growing.gramian[-1], rtol=1e-10, atol=1e-10)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), window=st.integers(1, 19))
def test_controllability_is_the_sum_over_noise_that_arrives(seed: int, window: int) -> None:
    A, C = random_sequence(seed, m=2)
    G = np.swapaxes(C, -1, -2)
    sliding = sliding_controllability(A, G, window)
    for k in range(20 - window):
        np.testing.assert_allclose(sliding.gramian[k], reached(A, G, k, k + window - 1), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(sequence_controllability(A, G).gramian, reached(A, G, 0, 18), rtol=1e-9, atol=1e-9)


def test_leading_axes_are_batches() -> None:
    pairs = [random_sequence(seed) for seed in range(6)]
    A, C = (np.stack([p[i] for p in pairs]).reshape(2, 3, 19, -1, 3) for i in (0, 1))
    batch = sliding_observability(A, C, 5)
    assert batch.factor.shape == (2, 3, 15, 3, 3)
    np.testing.assert_allclose(batch.gramian[1, 2], sliding_observability(*pairs[5], 5).gramian, rtol=1e-12, atol=1e-12)


def test_state_scale_is_a_change_of_units_for_both_gramians() -> None:
    A, C = random_sequence(3, m=2)
    scale = np.array([1e-3, 1.0, 20.0])
    changed_A, changed_C = A * scale / scale[:, None], C * scale
    np.testing.assert_allclose(
        sequence_observability(A, C, scale).gramian, sequence_observability(changed_A, changed_C).gramian, rtol=1e-10
    )
    G = np.swapaxes(C, -1, -2)
    np.testing.assert_allclose(
        sequence_controllability(A, G, scale).gramian,
        sequence_controllability(changed_A, G / scale[:, None]).gramian,
        rtol=1e-10,
    )


def test_rank_and_condition_keep_digits_that_the_squared_gramian_loses() -> None:
    """Sensitivities 1 and 1e-10: the gramian has condition 1e20, beyond double precision; its factor has not."""
    C = np.array([[[1.0, 0.0], [0.0, 1e-10]]])
    found = sequence_observability(np.eye(2)[None], C)
    np.testing.assert_allclose(found.condition, 1e20, rtol=1e-10)
    assert found.rank(1e-12) == 2
    assert found.rank(1e-9) == 1
    assert sequence_observability(np.eye(2)[None], np.array([[[1.0, 0.0]]])).condition == np.inf


def test_a_moving_sensor_sees_what_no_frozen_pair_sees() -> None:
    """A = I, C_k = [1, k]: every frozen pair has rank 1, two samples have rank 2."""
    k = np.arange(10.0)
    C = np.stack([np.ones(10), k], axis=1)[:, None, :]
    A = np.broadcast_to(np.eye(2), (10, 2, 2))
    assert growing_observability(A, C).rank().tolist() == [1] + [2] * 9
    np.testing.assert_allclose(sequence_observability(A, C).gramian, [[10, k.sum()], [k.sum(), (k**2).sum()]])


def test_window_information_is_the_least_over_directions_that_last() -> None:
    A, C = random_sequence(11)
    found = uniform_detectability(A, C, window=6, horizon=4, contraction=0.3)
    V = sliding_observability(A, C, 6).gramian
    phi = sliding_observability(A, C, 4).transition
    v = np.random.default_rng(0).normal(size=(100_000, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    for k in range(found.information.shape[-1]):
        lasting = np.linalg.norm(v @ phi[k].T, axis=1) >= 0.3
        values = np.einsum("ij,jk,ik->i", v, V[k], v)[lasting]
        least = values.min() if len(values) else np.inf
        assert found.information[k] <= least * (1 + 1e-9)  # a bound for every direction
        assert least <= 1.05 * found.information[k] + 1e-6  # and the best one, to the resolution of the sampling


def test_detectable_and_undetectable_sequences_are_told_apart() -> None:
    count = 40
    C = np.broadcast_to([[1.0, 0.0]], (count, 1, 2))

    def hidden(pole: float) -> Array:
        return np.broadcast_to(np.diag([1.0, pole]), (count, 2, 2))

    good = uniform_detectability(hidden(0.8), C, window=10)
    assert good.verdict is Verdict.CERTIFIED and good.uniform > 0.0
    bad = uniform_detectability(hidden(0.99), C, window=10)  # 0.99^10 = 0.90 > c_1 = 0.5: must be seen, and is not
    assert bad.verdict is Verdict.REFUTED
    assert uniform_detectability(hidden(0.99), C, window=10, contraction=0.95).verdict is Verdict.CERTIFIED
    assert uniform_detectability(hidden(0.8), C, window=10, required=1e3).verdict is Verdict.REFUTED
    vacuous = uniform_detectability(0.1 * hidden(0.1), 0.0 * C, window=10)
    assert vacuous.verdict is Verdict.CERTIFIED and np.isinf(vacuous.uniform)


def test_stabilisability_is_the_dual() -> None:
    count = 30
    A = np.broadcast_to(np.diag([1.0, 0.8]), (count, 2, 2))
    first, second = (np.broadcast_to(np.eye(2)[:, [j]], (count, 2, 1)) for j in (0, 1))
    assert uniform_stabilisability(A, first, window=10).verdict is Verdict.CERTIFIED
    assert uniform_stabilisability(A, second, window=10).verdict is Verdict.REFUTED
    random_A, random_C = random_sequence(4)
    G = np.swapaxes(random_C, -1, -2)
    for window, horizon in ((6, 6), (6, 4), (4, 6)):
        found = uniform_stabilisability(random_A, G, window, horizon)
        mirrored = uniform_detectability(np.swapaxes(random_A, -1, -2)[::-1], random_C[::-1], window, horizon)
        np.testing.assert_allclose(found.information[::-1], mirrored.information, rtol=1e-9)


def test_sampled_sequence_holds_the_parameters_over_each_sample() -> None:
    model = longitudinal_speed_model(load_parameter_set("longitudinal-speed"))
    grid = np.array([[10.0, 5.0], [40.0, -100.0]])
    found = sampled_sequence(model, grid, 0.005)
    numeric = model.on(grid)
    Phi, Gamma = zero_order_hold(numeric.A, numeric.B, 0.005)
    np.testing.assert_allclose(found.A, Phi, rtol=1e-13, atol=1e-16)
    np.testing.assert_allclose(found.B, Gamma, rtol=1e-12, atol=1e-18)
    assert found.E.shape == (2, 3, 4) and found.C.shape == (2, 1, 3)
    np.testing.assert_allclose(found.E, zero_order_hold(numeric.A, numeric.E, 0.005)[1], rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(
    ("A", "C", "word"),
    [
        (np.eye(2)[None], np.ones((2, 1, 2)), "same number of samples"),
        (np.eye(2)[None], np.ones((1, 1, 3)), "same number of samples"),
        (np.ones((1, 2, 3)), np.ones((1, 1, 2)), "square"),
        (np.eye(2), np.ones((1, 2)), "at least 3 axes"),
        (np.full((1, 2, 2), np.nan), np.ones((1, 1, 2)), "not finite"),
        (np.zeros((0, 2, 2)), np.zeros((0, 1, 2)), "K >= 1"),
        (np.zeros((2, 4, 2, 2)), np.zeros((3, 4, 1, 2)), "do not broadcast"),
    ],
)
def test_bad_sequences_are_refused(A: Array, C: Array, word: str) -> None:
    with pytest.raises(AnalysisError, match=word):
        growing_observability(A, C)


def test_bad_settings_are_refused() -> None:
    A, C = random_sequence(0)
    with pytest.raises(AnalysisError, match="window = 20"):
        sliding_observability(A, C, 20)
    with pytest.raises(AnalysisError, match="window = 0"):
        sliding_observability(A, C, 0)
    with pytest.raises(AnalysisError, match="contraction = 1"):
        uniform_detectability(A, C, 3, contraction=1.0)
    with pytest.raises(AnalysisError, match="horizon = 0"):
        uniform_detectability(A, C, 3, horizon=0)
    with pytest.raises(AnalysisError, match="required = -1"):
        uniform_detectability(A, C, 3, required=-1.0)
    with pytest.raises(AnalysisError, match="state_scale"):
        sequence_observability(A, C, state_scale=[1.0, -1.0, 1.0])
    with pytest.raises(AnalysisError, match="state_scale"):
        sequence_controllability(A, np.swapaxes(C, -1, -2), state_scale=[0.0, 1.0, 1.0])
    with pytest.raises(AnalysisError, match="relative_tolerance"):
        sequence_observability(A, C).rank(0.0)
    with pytest.raises(AnalysisError, match="sample_time"):
        sampled_sequence(longitudinal_speed_model(load_parameter_set("longitudinal-speed")), [[1.0, 0.0]], 0.0)
