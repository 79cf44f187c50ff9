"""Sample-time jitter and constant delay of sampled observers: closed forms, simulation, sequences, negative controls."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from flint import fmpq_mat
from scipy.linalg import expm
from scipy.signal import place_poles

from analysis.errors import AnalysisError
from analysis.uncertainty.delay import delay_margin
from analysis.uncertainty.jitter import holds, jitter_claim, sample_time_jitter, stable_for_sample_times
from analysis.uncertainty.jitter_loop import observer_of
from synthesis.lmi.result import Verdict
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.polynomials.rational import decimal
from tests.support.lmi_cases import parameter, small_model

C = np.array([[1.0, 0.0]])
SWING = np.array([[0.0, 1.0], [-400.0, -0.2]])


def gain(A: np.ndarray, period: float, poles: list[float]) -> np.ndarray:
    return np.asarray(place_poles(expm(A * period).T, C.T, poles).gain_matrix.T)


def test_a_scalar_observer() -> None:
    """e+ = (e^T - 1) e with T about 0.5: stable in any order while T < log 2, so j* = log 2/0.5 - 1."""
    found = sample_time_jitter([[1.0]], [[1.0]], [[1.0]], 0.5)
    exact = np.log(2.0) / 0.5 - 1.0
    assert found.lower < exact < found.upper * (1 + 1e-12)
    assert found.upper - found.lower < 2e-3
    assert found.witness is not None
    assert stable_for_sample_times([[1.0]], [[1.0]], [[1.0]], found.witness) is Verdict.REFUTED
    assert stable_for_sample_times([[1.0]], [[1.0]], [[1.0]], [0.9 * t for t in found.witness]) is Verdict.CERTIFIED


def test_an_order_of_sample_times_destroys_what_each_keeps_stable() -> None:
    """A lightly damped plant: every constant sample time of the interval is stable, one order of two of them is not."""
    K = gain(SWING, 0.1, [0.1, 0.15])
    found = sample_time_jitter(SWING, C, K, 0.1)
    assert 0.3 < found.lower < found.upper < 1.06 * found.lower
    assert found.witness is not None and len(set(found.witness)) > 1
    product = np.eye(2)
    for length in found.witness:
        product = (expm(SWING * length) - K @ C) @ product
    assert np.abs(np.linalg.eigvals(product)).max() == pytest.approx(1.0, abs=1e-2)
    observer = observer_of(SWING, C, K)
    inside = 0.1 * (1 - found.lower), 0.1 * (1 + found.lower)
    assert found.claim is not None and holds(observer, *inside, found.claim)
    assert not holds(observer, 0.1 * (1 - 1.02 * found.upper), 0.1 * (1 + 1.02 * found.upper), found.claim)


def test_a_scheduled_observer_with_jitter() -> None:
    """x' = (p - 0.5) x with K = 0.8, |p| <= 0.4: e^(T (p - 0.5)) - 0.8 stays inside the circle for T in [0.05, 0.4].

    K = 1.99 does not.
    """
    p = sp.Symbol("p")
    model = small_model([[p - sp.Rational(1, 2)]], [[1]], [parameter("p", -0.4, 0.4, 1.0)])
    plant, ends = plant_of(model), ((decimal(-0.4), decimal(0.4)),)

    def observer(K: float) -> ObserverLoop:
        table = {(0,): fmpq_mat([[decimal(K)]]), (1,): fmpq_mat([[decimal(K)]])}
        return ObserverLoop(plant, ends, table, "sampled", decimal(0.1))

    claim = jitter_claim(observer(0.8), model.parameters, 0.05, 0.4)
    assert claim is not None and holds(observer(0.8), 0.05, 0.4, claim)
    assert not holds(observer(1.99), 0.05, 0.4, claim)
    assert jitter_claim(observer(1.99), model.parameters, 0.05, 0.4) is None
    held = ObserverLoop(plant, ends, observer(0.8).table, "held", decimal(0.1))
    with pytest.raises(AnalysisError, match="sampled"):
        jitter_claim(held, model.parameters, 0.05, 0.4)


def test_a_scheduled_observer_of_a_rational_plant() -> None:
    """x' = (1/(1 + p) - 1) x, p from 1/4 to 1: e^(-T/2) is least at T = 0.4, so that K holds up to 1.8187."""
    p = sp.Symbol("p")
    model = small_model([[1 / (1 + p) - 1]], [[1]], [parameter("p", 0.25, 1.0, 1.0)])
    plant, ends = plant_of(model), ((decimal(0.25), decimal(0.6), decimal(1.0)),)
    assert not plant.is_polynomial

    def observer(K: float) -> ObserverLoop:
        return ObserverLoop(plant, ends, {(i,): fmpq_mat([[decimal(K)]]) for i in range(3)}, "sampled", decimal(0.1))

    claim = jitter_claim(observer(1.81), model.parameters, 0.05, 0.4, degree=0)
    assert claim is not None and holds(observer(1.81), 0.05, 0.4, claim)
    assert not holds(observer(1.82), 0.05, 0.4, claim)
    assert jitter_claim(observer(1.82), model.parameters, 0.05, 0.4, degree=0) is None


def test_delays_by_whole_samples() -> None:
    """e+ = e - K e_(k-s) of an integrator is stable while K < 2 sin(pi/(2 (2 s + 1))) (Levin, May 1976)."""
    for s in range(4):
        border = 2.0 * np.sin(np.pi / (2.0 * (2 * s + 1)))
        below, above = (delay_margin([[0.0]], [[1.0]], [[K]], 1.0, s + 1) for K in (0.999 * border, 1.001 * border))
        assert below.lower >= s + 1 and below.upper == np.inf
        assert above.upper <= s and above.lower <= s


def test_a_delay_between_samples() -> None:
    """e+ = (e^T - K e^(-d)) e of x' = x: stable while d < log(K/(e^T - 1)); with T = 0.5 and K = 0.8 that is 0.2093."""
    found = delay_margin([[1.0]], [[1.0]], [[0.8]], 0.5, 1)
    exact = np.log(0.8 / (np.exp(0.5) - 1.0))
    assert found.lower <= exact <= found.upper
    assert found.upper - found.lower < 1e-3


def test_delays_against_a_simulation_of_the_observer() -> None:
    """Plant and observer in continuous time, corrected at the samples, with the estimate's history."""
    A, T = np.array([[0.0, 1.0], [-25.0, -1.0]]), 0.1
    K = gain(A, T, [-0.3, -0.2])
    jump = expm(-A * T) @ K  # made at t_k it becomes K at t_(k+1)
    found = delay_margin(A, C, K, T, 2)
    assert 0.0 < found.lower < found.upper < T
    assert found.upper - found.lower < 1e-3 * T

    def growth(delay: float) -> float:
        after, errors = [np.zeros(2)], []  # the estimate after the correction at t_j
        for k in range(1, 300):
            measured = k * T - delay
            j = int(np.floor(measured / T + 1e-12))
            innovation = C @ (expm(A * measured) @ [1.0, 0.0] - expm(A * (measured - j * T)) @ after[j])
            before = expm(A * T) @ after[-1]
            after.append(before + jump @ innovation)
            errors.append(float(np.linalg.norm(expm(A * k * T) @ [1.0, 0.0] - before)))
        return float(np.log(max(errors[-30:]) / max(errors[100:130])))

    assert growth(0.97 * found.lower) < -0.5
    assert growth(1.03 * found.upper) > 0.5


def test_bad_questions_are_refused() -> None:
    with pytest.raises(AnalysisError, match="not stable at its sample time"):
        sample_time_jitter([[1.0]], [[1.0]], [[5.0]], 0.1)
    with pytest.raises(AnalysisError, match="sample_time"):
        delay_margin([[1.0]], [[1.0]], [[1.0]], -0.1)
    with pytest.raises(AnalysisError, match="shape"):
        sample_time_jitter(np.eye(2), [[1.0]], [[1.0]], 0.1)
    with pytest.raises(AnalysisError, match="no interval"):
        jitter_claim(observer_of(np.eye(1), np.eye(1), np.eye(1)), (), 0.2, 0.1)
