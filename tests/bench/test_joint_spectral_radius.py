"""Brackets of the joint spectral radius: time by size, and how far they close."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.switching.joint_spectral_radius import joint_spectral_radius


@pytest.mark.parametrize("case", ["golden", "no finite product", "random 0", "random 1", "random 2"])
def test_two_modes_of_two_states_to_1e_4(benchmark, case) -> None:
    pair = np.array([[[1.0, 1.0], [0.0, 1.0]], [[1.0, 0.0], [1.0, 1.0]]])
    if case == "no finite product":
        pair = pair * np.array([1.0, 0.749326546330367])[:, None, None]  # Hare et al. 2011
    elif case.startswith("random"):
        pair = np.random.default_rng(int(case[-1])).normal(size=(2, 2, 2))
    found = benchmark.pedantic(joint_spectral_radius, args=(pair,), rounds=1, iterations=1)
    assert found.closed
    benchmark.extra_info.update(lower=found.lower, upper=found.upper, product=found.product, proof=found.proof)


@pytest.mark.parametrize(("modes", "states"), [(4, 2), (8, 2), (2, 3), (2, 4), (4, 4)])
def test_growth_with_size(benchmark, modes, states) -> None:
    family = np.random.default_rng(1).normal(size=(modes, states, states))
    found = benchmark.pedantic(
        joint_spectral_radius, args=(family,), kwargs={"most_vertices": 120}, rounds=1, iterations=1
    )
    assert found.lower <= found.upper
    benchmark.extra_info.update(lower=found.lower, upper=found.upper, closed=found.closed, proof=found.proof)
