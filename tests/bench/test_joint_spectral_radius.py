"""Brackets of the joint spectral radius: time by size, and how far they close."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from analysis.switching.joint_spectral_radius import joint_spectral_radius
from analysis.switching.jsr_gauge import gauge_and_support


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


def test_four_modes_of_five_states(benchmark) -> None:
    """A polytope of 240 to 420 vertices, as rounding has it: a linear program for each image once took most of the time."""
    family = np.random.default_rng(1).normal(size=(4, 5, 5))
    most = {"most_vertices": 1000}
    found = benchmark.pedantic(joint_spectral_radius, args=(family,), kwargs=most, rounds=1, iterations=1)
    assert found.closed and found.proof == "polytope"
    benchmark.extra_info.update(lower=found.lower, upper=found.upper, vertices=len(found.vertices))


@pytest.mark.benchmark(group="gauges of 1000 points, 150 vertices in five dimensions")
@pytest.mark.parametrize("road", ["all at once", "one linear program each"])
def test_gauges(benchmark, road) -> None:
    draw = np.random.default_rng(0)
    vertices, points = draw.normal(size=(150, 5)), draw.normal(size=(1000, 5))
    both = np.concatenate([vertices, -vertices]).T
    few = points[:50]  # a linear program takes milliseconds

    def programs() -> np.ndarray:
        return np.array([linprog(np.ones(300), A_eq=both, b_eq=point, method="highs-ds").fun for point in few])

    if road == "all at once":
        found = benchmark(lambda: gauge_and_support(vertices, points)[0])[:50]
    else:
        benchmark.extra_info["points"] = len(few)
        found = benchmark.pedantic(programs, rounds=1)
    np.testing.assert_allclose(found, programs(), rtol=1e-9)


@pytest.mark.parametrize(("modes", "states"), [(4, 2), (8, 2), (2, 3), (2, 4), (4, 4)])
def test_growth_with_size(benchmark, modes, states) -> None:
    family = np.random.default_rng(1).normal(size=(modes, states, states))
    found = benchmark.pedantic(
        joint_spectral_radius, args=(family,), kwargs={"most_vertices": 120}, rounds=1, iterations=1
    )
    assert found.lower <= found.upper
    benchmark.extra_info.update(lower=found.lower, upper=found.upper, closed=found.closed, proof=found.proof)
