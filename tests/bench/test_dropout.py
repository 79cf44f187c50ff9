"""Critical drop probabilities at 141 wheel speeds: the exact answer against bisection on the radius."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.drops.frozen import critical_drop_probability
from analysis.drops.gilbert_elliott import critical_recovery_probability
from analysis.drops.mean_square import mean_square_schedule
from analysis.drops.modes import schedule_drop_modes
from analysis.drops.schedule import frozen_critical_probability
from estimators import GainSchedule
from tests.support.schedule_content import schedule_content

MODES = schedule_drop_modes(
    GainSchedule.from_content(schedule_content("resilient-longitudinal")), np.linspace(0.0, 140.0, 141)
)
SHIPPED = GainSchedule.shipped("corner-estimation-longitudinal")


def bisection(A0: np.ndarray, A1: np.ndarray) -> float:
    """What one writes without the theory: 34 halvings to 1e-10 of the radius of the 4 x 4 operator."""
    K0, K1 = np.kron(A0, A0), np.kron(A1, A1)
    low, high = 0.0, 1.0
    while high - low > 1e-10:
        p = 0.5 * (low + high)
        if np.abs(np.linalg.eigvals(p * K0 + (1 - p) * K1)).max() < 1.0:
            low = p
        else:
            high = p
    return 0.5 * (low + high)


def vectorised_bisection(A0: np.ndarray, A1: np.ndarray) -> np.ndarray:
    """The same, all speeds at once."""
    K0, K1 = (np.einsum("gik,gjl->gijkl", A, A).reshape(-1, 4, 4) for A in (A0, A1))
    low, high = np.zeros(len(A0)), np.ones(len(A0))
    while (high - low).max() > 1e-10:
        p = 0.5 * (low + high)
        stable = np.abs(np.linalg.eigvals(p[:, None, None] * K0 + (1 - p)[:, None, None] * K1)).max(-1) < 1.0
        low, high = np.where(stable, p, low), np.where(stable, high, p)
    return 0.5 * (low + high)


def test_exact(benchmark: Any) -> None:
    p = benchmark(critical_drop_probability, MODES.dropped, MODES.received)
    assert p.shape == (141,) and p.min() < 0.6 and p.max() == 1.0


def test_bisection(benchmark: Any) -> None:
    p = benchmark.pedantic(
        lambda: [bisection(a, b) for a, b in zip(MODES.dropped, MODES.received, strict=True)], rounds=3
    )
    np.testing.assert_allclose(p, critical_drop_probability(MODES.dropped, MODES.received), atol=1e-9)


def test_bisection_vectorised(benchmark: Any) -> None:
    p = benchmark.pedantic(vectorised_bisection, (MODES.dropped, MODES.received), rounds=3)
    np.testing.assert_allclose(p, critical_drop_probability(MODES.dropped, MODES.received), atol=1e-9)


@pytest.mark.parametrize("states", [2, 4, 8, 16])
def test_growth(benchmark: Any, states: int) -> None:
    """One pair; two states take the closed form, the others an eigenvalue problem of size n(n+1)/2."""
    draw = np.random.default_rng(1)
    A0, A1 = draw.normal(size=(2, states, states)) / np.sqrt(states)
    A0 *= 1.3 / np.abs(np.linalg.eigvals(A0)).max()
    A1 *= 0.5 / np.abs(np.linalg.eigvals(A1)).max()
    p = benchmark.pedantic(critical_drop_probability, (A0, A1), rounds=5)
    assert 0.0 < p < 1.0


def test_gilbert_elliott_boundary(benchmark: Any) -> None:
    """141 speeds times 50 failure probabilities."""
    r = benchmark.pedantic(
        critical_recovery_probability,
        (MODES.dropped[:, None], MODES.received[:, None], np.linspace(0.02, 1.0, 50)),
        rounds=3,
    )
    assert r.shape == (141, 50)


def test_schedule_frozen(benchmark: Any) -> None:
    assert benchmark.pedantic(frozen_critical_probability, (SHIPPED,), rounds=3).smallest < 1.0


def test_schedule_certificate(benchmark: Any) -> None:
    assert benchmark.pedantic(mean_square_schedule, (SHIPPED, 0.6), rounds=3).verdict == "certified"
