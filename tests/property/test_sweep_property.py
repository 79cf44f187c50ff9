"""Order statistics, permutations and variance shares on inputs that nobody chose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc, sobol_indices

from analysis.errors import AnalysisError
from analysis.sensitivity.indices import SaltelliSums, variance_indices
from analysis.sensitivity.points import permuted
from analysis.sensitivity.quantiles import PASSES, RadixSearch, rank_of, sortable

NUMBERS = st.lists(st.floats(allow_nan=False), min_size=1, max_size=60)


@settings(deadline=None)
@given(NUMBERS, st.data())
def test_order_statistics_are_those_of_sorting(values: list[float], data: st.DataObject) -> None:
    ranks = data.draw(st.lists(st.integers(0, len(values) - 1), min_size=1, max_size=4))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(values)), max_size=3)))
    parts = np.split(np.array(values), cuts)
    search = RadixSearch(ranks)
    for _ in range(PASSES):
        for part in parts:
            search.show(part)
        search.end_pass()
    np.testing.assert_array_equal(search.found(), np.sort(values)[ranks])


@settings(deadline=None)
@given(NUMBERS)
def test_keys_have_the_order_of_the_numbers(values: list[float]) -> None:
    array = np.array(values)
    order = np.argsort(sortable(array), kind="stable")
    np.testing.assert_array_equal(array[order], np.sort(array))


@settings(deadline=None)
@given(NUMBERS, st.floats(0.01, 1.0))
def test_quantiles_are_the_inverse_of_the_distribution(values: list[float], share: float) -> None:
    finite = np.array([v for v in values if np.isfinite(v)] or [0.0])
    wanted = np.quantile(finite, share, method="inverted_cdf")
    assert np.sort(finite)[rank_of(share, len(finite))] == wanted


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 3000), st.integers(0, 2**32), st.integers(0, 50))
def test_permutation_is_one(count: int, seed: int, stream: int) -> None:
    found = permuted(np.arange(count, dtype=np.uint64), count, seed, stream)
    np.testing.assert_array_equal(np.sort(found), np.arange(count))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 1000), st.lists(st.integers(1, 63), max_size=4), st.floats(-1e3, 1e3))
def test_shares_from_sums_are_those_from_all_samples(seed: int, cuts: list[int], shift: float) -> None:
    draw = np.random.default_rng(seed)
    linear, mixed = draw.normal(size=3), draw.normal(size=(3, 3))

    def measure(columns: dict[str, np.ndarray]) -> np.ndarray:
        x = np.stack([columns[name] for name in "abc"], axis=1)
        return shift + x @ linear + np.einsum("ni,ij,nj->n", x, mixed, x)

    at_once = variance_indices(measure, dict.fromkeys("abc", (-1.0, 2.0)), samples=64, seed=seed)
    points = -1.0 + 3.0 * qmc.Sobol(6, rng=np.random.default_rng(seed)).random_base2(6)
    A, B = points[:, :3], points[:, 3:]
    rows = [A, B, *(np.where(np.arange(3) == i, B, A) for i in range(3))]
    blocks = np.stack([measure(dict(zip("abc", r.T, strict=True))) for r in rows], axis=1) - shift
    sums = SaltelliSums(3, 8)
    for part in np.split(np.arange(64), sorted(set(cuts))):
        sums.add(blocks[part], part * 8 // 64)
    found = sums.shares()
    f = {"f_A": blocks[:, :1].T, "f_B": blocks[:, 1:2].T, "f_AB": blocks[:, 2:].T[:, None]}
    wanted = sobol_indices(func=f, n=64)
    for first, total in (
        (found.first_order, found.total),
        (at_once.first_order.values, at_once.total.values),
    ):
        np.testing.assert_allclose(first, np.ravel(wanted.first_order), rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(total, np.ravel(wanted.total_order), rtol=1e-6, atol=1e-8)


def test_confidence_covers_the_known_shares() -> None:
    """Additive a + 2 b + 3 c: shares 1/14, 4/14, 9/14; the intervals of 40 independent runs must nearly all hold them."""
    wanted = np.array([1.0, 4.0, 9.0]) / 14.0
    hits = []
    for seed in range(40):
        points = np.random.default_rng(seed).random((512, 6))
        A, B = points[:, :3], points[:, 3:]
        rows = [A, B, *(np.where(np.arange(3) == i, B, A) for i in range(3))]
        sums = SaltelliSums(3, 32)
        sums.add(np.stack([r @ [1.0, 2.0, 3.0] - 3.0 for r in rows], axis=1), np.arange(512) * 32 // 512)
        found = sums.shares()
        hits.append(np.abs(found.first_order - wanted) <= found.first_order_confidence)
        assert (found.first_order_confidence < 0.25).all()
    assert 0.85 < np.mean(hits) <= 1.0


def test_sums_refuse_what_has_no_variance() -> None:
    sums = SaltelliSums(2, 4)
    with pytest.raises(AnalysisError, match="infinite"):
        sums.add(np.array([[1.0, np.inf, 0.0, 0.0]]), np.array([0]))
    sums.add(np.ones((4, 4)), np.arange(4))
    assert np.isnan(sums.shares().total).all()
    with pytest.raises(AnalysisError, match="two groups"):
        SaltelliSums(2, 4).shares()
