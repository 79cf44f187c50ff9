"""H-infinity norms: the batch against a loop over control.ss and control.linfnorm (SLICOT ab13dd), in one run.

`linfnorm` needs the package slycot; without it the loop is over control.norm(..., 'inf'), which is some twenty times
slower. Ratios are reported in extra_info, differences are asserted, clocks are not.
"""

from __future__ import annotations

import tracemalloc
from importlib.util import find_spec
from time import perf_counter

import numpy as np
import pytest

from analysis.norms.hinf import hinf_norm
from analysis.perturbed import PerturbedModel
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.parameter_set import load_parameter_set
from tests.support.level_crossing import crosses_level

control = pytest.importorskip("control")
SUBSET = 400 if find_spec("slycot") else 40


def reference(systems, dt=0):
    """Norms by the loop that a user would write, its name and its seconds a system."""
    try:
        import slycot  # noqa: F401

        name, function = "control.linfnorm", lambda system: control.linfnorm(system)[0]
    except ImportError:
        name = "control.norm"

        def function(system):
            return control.norm(system, p="inf", tol=1e-9, method="scipy")

    start = perf_counter()
    values = [function(control.ss(*matrices, dt)) for matrices in zip(*systems, strict=True)]
    return np.array(values), name, (perf_counter() - start) / len(values)


def report(benchmark, count, seconds_each, name):
    if benchmark.stats is None:  # benchmarks disabled
        return
    ours = benchmark.stats.stats.median
    benchmark.extra_info.update(
        systems=count,
        loop=name,
        loop_seconds=seconds_each * count,
        batch_seconds=ours,
        ratio=seconds_each * count / ours,
    )


def test_tire_systems_over_speed_parameter_and_perturbation(benchmark) -> None:
    """141 wheel speeds x 11 parameters (4 tire constants, radius, 2 gains and 4 entries of B_e) x 21 perturbations."""
    parameters = load_parameter_set("resilient-velocity")
    family = PerturbedModel(corner_velocity_model(parameters, "longitudinal"))
    gain = np.array(parameters.tire["longitudinal"].published.gains)[:, None]
    speeds, factors = np.linspace(0.0, 140.0, 141)[:, None], np.linspace(0.8, 1.2, 21)
    matrices = []
    for name, value in family.nominal.items():
        matrices.append(family.at(wheel_speed=speeds, **{name: value * factors}).error_dynamics(gain))
    nominal = family.at(wheel_speed=speeds, kappa=np.full(21, family.nominal["kappa"]))
    for row in range(2):
        scaled = np.where(np.arange(2)[:, None] == row, factors[:, None, None] * gain, gain)
        matrices.append(nominal.error_dynamics(scaled))
    A_0, B_0 = nominal.error_dynamics(gain)
    for entry in np.ndindex(2, 2):
        B = B_0.copy()
        B[..., entry[0], entry[1]] *= factors
        matrices.append((A_0, B))
    A = np.stack([pair[0] for pair in matrices], axis=1)
    B = np.stack([pair[1][..., :2] for pair in matrices], axis=1)
    assert A.shape == (141, 11, 21, 2, 2)
    found = benchmark(hinf_norm, A, B, np.eye(2))
    pick = np.random.default_rng(0).choice(141 * 11 * 21, SUBSET, replace=False)
    flat = [M.reshape(-1, 2, 2)[pick] for M in (A, B)]
    fixed = [np.broadcast_to(M, (SUBSET, 2, 2)) for M in (np.eye(2), np.zeros((2, 2)))]
    values, name, seconds = reference([*flat, *fixed])
    np.testing.assert_allclose(found.norm.ravel()[pick], values, atol=1e-8, rtol=0.0)
    report(benchmark, found.norm.size, seconds, name)


def resonant(count, states, discrete=False, seed=0):
    """Random oscillators, damping ratios 1e-3..1, in random orthogonal coordinates, half of them with feedthrough."""
    rng = np.random.default_rng(seed)
    A = np.zeros((count, states, states))
    for k in range(0, states, 2):
        w, z = (
            10.0 ** (rng.uniform(-2, 0.5, count) if discrete else rng.uniform(-1, 3, count)),
            10.0 ** rng.uniform(-3, 0, count),
        )
        pole = w * (-z + 1j * np.sqrt(1.0 - z**2))
        pole = np.exp(pole) if discrete else pole
        A[:, k, k] = A[:, k + 1, k + 1] = pole.real
        A[:, k, k + 1], A[:, k + 1, k] = pole.imag, -pole.imag
    Q = np.linalg.qr(rng.normal(size=(count, states, states)))[0]
    A = Q @ A @ np.swapaxes(Q, -1, -2)
    D = rng.normal(size=(count, 2, 2)) * (rng.random((count, 1, 1)) < 0.5)
    return A, rng.normal(size=(count, states, 2)), rng.normal(size=(count, 2, states)), D


@pytest.mark.parametrize("discrete", [False, True], ids=["continuous", "discrete"])
@pytest.mark.parametrize(
    ("states", "count"), [(2, 1000), (2, 10_000), (4, 500), (4, 5000), (8, 200), (8, 2000), (30, 20)]
)
def test_random_resonant_systems(benchmark, states, count, discrete) -> None:
    count = min(count, SUBSET) if benchmark.disabled else count
    systems = resonant(count, states, discrete)
    found = benchmark.pedantic(
        hinf_norm, args=systems, kwargs={"discrete": discrete}, rounds=5, iterations=1, warmup_rounds=1
    )
    subset = [M[:SUBSET] for M in systems]
    values, name, seconds = reference(subset, True if discrete else 0)
    if name == "control.linfnorm":
        relative = found.norm[:SUBSET] / values - 1.0
        # With feedthrough ab13dd stops below a peak now and then (by up to 12 % here, confirmed in 40 digits); never above
        assert relative.min() > -1e-8
        assert (np.abs(relative) < 1e-8).mean() > 0.95
    assert crosses_level(*subset, found.norm[:SUBSET] * (1.0 - 1e-7), discrete).all()
    assert not crosses_level(*subset, found.norm[:SUBSET] * (1.0 + 1e-7), discrete).any()
    assert (found.norm <= found.upper).all() and (found.upper <= found.norm * (1.0 + 1e-5)).all()
    report(benchmark, count, seconds, name)
    if benchmark.stats is not None:
        tracemalloc.start()
        hinf_norm(*systems, discrete=discrete)
        benchmark.extra_info["memory_over_input"] = tracemalloc.get_traced_memory()[1] / sum(M.nbytes for M in systems)
        tracemalloc.stop()
