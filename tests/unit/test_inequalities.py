"""The inequalities of claims, written once: the numbers that they stand for, and that they say what their words say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov, solve_discrete_are, solve_discrete_lyapunov

from synthesis.certificate.inequalities import Question, inequalities
from synthesis.certificate.verify import Balls
from synthesis.loop.system import System, Time
from synthesis.polynomials.definite import is_positive_definite
from synthesis.polynomials.enclosure import PolynomialMatrix, constant
from synthesis.polynomials.rational import rational

PERIOD = 0.05


def exact(array: Any) -> PolynomialMatrix:
    rows = np.atleast_2d(np.asarray(array, float))
    return constant(fmpq_mat([[rational(float(x)) for x in row] for row in rows]), 1).balls()


def numbers(matrix: PolynomialMatrix) -> np.ndarray:
    found = matrix.at((fmpq(0),))
    return np.array([float(x.mid()) for x in found.entries()]).reshape(matrix.shape)


class Case:
    """A random system with three states, two inputs and two outputs."""

    def __init__(self, time: Time, seed: int, denominator: float | None = None) -> None:
        rng = np.random.default_rng(seed)
        self.time: Time = time
        A = rng.normal(size=(3, 3))
        if time == "continuous":
            self.A = A - (np.linalg.eigvals(A).real.max() + rng.uniform(0.3, 2.0)) * np.eye(3)
        else:
            self.A = A * rng.uniform(0.3, 0.95) / np.abs(np.linalg.eigvals(A)).max()
        self.lost = rng.normal(size=(3, 3)) * 0.4
        self.B, self.C, self.D = rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), rng.normal(size=(2, 2)) * 0.3
        self.denominator = denominator

    def named(
        self, kind: str, level: float, P: np.ndarray, later: np.ndarray, **more: Any
    ) -> dict[str, PolynomialMatrix]:
        below = self.denominator or 1.0
        system = System(
            self.time, exact(self.A * below), {"disturbances": exact(self.B * below)}, exact(self.C),
            {"disturbances": exact(self.D)}, exact(self.lost), None if self.denominator is None else exact([[below]]),
        )  # fmt: skip
        chosen = (more.get("W", np.eye(2)), more.get("Z", np.eye(2)))
        W, Z = (fmpq_mat([[rational(float(x)) for x in row] for row in m]) for m in chosen)
        question = Question(kind, rational(level), "disturbances", W, Z, rational(PERIOD))
        return dict(inequalities(question, system, exact(P), exact(later), Balls()))

    def holds(self, kind: str, level: float, P: np.ndarray, later: np.ndarray, **more: Any) -> bool:
        named = self.named(kind, level, P, later, **more)
        return all(is_positive_definite(matrix.at((fmpq(0),))) for matrix in named.values())

    def gain(self) -> float:
        """The largest singular value over frequencies."""
        if self.time == "continuous":
            points = 1j * np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 4000)])
        else:
            points = np.exp(1j * np.linspace(0.0, np.pi, 4000))
        response = self.C @ np.linalg.solve(points[:, None, None] * np.eye(3) - self.A, self.B.astype(complex)) + self.D
        return float(np.linalg.norm(response, 2, axis=(-2, -1)).max())

    def gain_matrix(self, level: float) -> np.ndarray:
        """P of the bounded real lemma, from a Riccati equation with a little to spare."""
        R, Q = -(level**2 * np.eye(2) - self.D.T @ self.D), self.C.T @ self.C + 1e-7 * np.eye(3)
        solve = solve_continuous_are if self.time == "continuous" else solve_discrete_are
        return np.asarray(solve(self.A, self.B, Q, R, s=self.C.T @ self.D))


def random_P(seed: int) -> np.ndarray:
    half = np.random.default_rng([seed, 1]).normal(size=(3, 3))
    return half @ half.T + 0.1 * np.eye(3)


@pytest.mark.parametrize("denominator", [None, 2.5])
@pytest.mark.parametrize("seed", range(4))
def test_continuous_inequalities_are_these_numbers(seed: int, denominator: float | None) -> None:
    case, P, P_dot = Case("continuous", seed, denominator), random_P(seed), random_P(seed + 50) - np.eye(3)
    below, S = denominator or 1.0, P @ case.A + case.A.T @ P
    W, Z = np.array([[0.5], [2.0]]), np.array([[1.0, 0.0]])

    def same(found: PolynomialMatrix, wanted: np.ndarray) -> None:
        np.testing.assert_allclose(numbers(found), below * wanted, rtol=1e-12, atol=1e-12)

    np.testing.assert_allclose(numbers(case.named("decay rate", 0.7, P, P_dot)["P > 0"]), P, rtol=1e-12)
    same(case.named("decay rate", 0.7, P, P_dot)["decay rate"], -(S + P_dot + 1.4 * P))
    same(case.named("fastest pole", 7.0, P, P_dot)["fastest pole"], S + 14.0 * P)
    C, D = Z @ case.C, Z @ case.D @ W
    side = -(P @ case.B @ W + C.T @ D)
    wanted = np.block([[-(S + P_dot + C.T @ C), side], [side.T, 9.0 * np.eye(1) - D.T @ D]])
    same(case.named("gain", 3.0, P, P_dot, W=W, Z=Z)["gain"], wanted)


@pytest.mark.parametrize("seed", range(4))
def test_discrete_inequalities_are_these_numbers(seed: int) -> None:
    case, P, later = Case("discrete", seed), random_P(seed), random_P(seed + 50)
    W, Z = np.array([[0.5], [2.0]]), np.array([[1.0, 0.0]])

    def same(found: PolynomialMatrix, wanted: np.ndarray) -> None:
        np.testing.assert_allclose(numbers(found), wanted, rtol=1e-12, atol=1e-12)

    fallen = case.A.T @ later @ case.A
    for kind in ("internal update", "sampled error"):
        same(case.named(kind, 0.7, P, later)[kind], np.exp(-1.4 * PERIOD) * P - fallen)
    drops = case.named("drop probability", 0.3, P, later)
    same(drops["received"], P - fallen)
    same(drops["received or lost"], P - 0.7 * fallen - 0.3 * case.lost.T @ later @ case.lost)
    C, D, B = Z @ case.C, Z @ case.D @ W, case.B @ W
    side = -(case.A.T @ later @ B + C.T @ D)
    wanted = np.block([[P - C.T @ C - fallen, side], [side.T, 9.0 * np.eye(1) - D.T @ D - B.T @ later @ B]])
    for kind in ("sampled gain", "motion gain"):
        same(case.named(kind, 3.0, P, later, W=W, Z=Z)["gain"], wanted)


@pytest.mark.parametrize("time", ["continuous", "discrete"])
@pytest.mark.parametrize("seed", range(6))
def test_gains_are_what_frequencies_say(time: Time, seed: int) -> None:
    """With the P of a Riccati equation a gain is proved just above the largest response, and below it with no P of the tries."""
    case = Case(time, seed)
    gain, kind = case.gain(), "gain" if time == "continuous" else "sampled gain"
    P = case.gain_matrix(1.002 * gain)
    later = np.zeros((3, 3)) if time == "continuous" else P
    assert case.holds(kind, 1.01 * gain, P, later)
    assert not case.holds(kind, 0.99 * gain, P, later)
    rng = np.random.default_rng([seed, 2])
    for _ in range(50):
        near = P * (1.0 + 0.2 * rng.normal()) + 0.1 * np.abs(P).max() * (lambda m: m @ m.T)(rng.normal(size=(3, 3)))
        assert not case.holds(kind, 0.99 * gain, near, near if time == "discrete" else later)


@pytest.mark.parametrize("seed", range(6))
def test_rates_are_what_poles_say(seed: int) -> None:
    case = Case("continuous", seed)
    poles = np.linalg.eigvals(case.A).real
    slow, fast = -poles.max(), -poles.min()
    none = np.zeros((3, 3))
    P = solve_continuous_lyapunov((case.A + 0.99 * slow * np.eye(3)).T, -np.eye(3))
    assert case.holds("decay rate", 0.989 * slow, P, none) and not case.holds("decay rate", 1.001 * slow, P, none)
    P = solve_continuous_lyapunov(-(case.A + 1.01 * fast * np.eye(3)).T, -np.eye(3))
    assert case.holds("fastest pole", 1.011 * fast, P, none) and not case.holds("fastest pole", 0.999 * fast, P, none)


@pytest.mark.parametrize("seed", range(6))
def test_decay_over_a_sample_is_what_the_radius_says(seed: int) -> None:
    case = Case("discrete", seed)
    rate = -np.log(np.abs(np.linalg.eigvals(case.A)).max()) / PERIOD
    P = solve_discrete_lyapunov((case.A * np.exp(0.99 * rate * PERIOD)).T, np.eye(3))
    assert case.holds("internal update", 0.989 * rate, P, P) and not case.holds("internal update", 1.001 * rate, P, P)
    assert not case.holds("internal update", 0.989 * rate, P, 1.2 * P)  # P one sample later counts


@pytest.mark.parametrize("seed", range(6))
def test_drop_probabilities_are_what_second_moments_say(seed: int) -> None:
    """The lost update grows alone; the critical probability from the second-moment operator, P from its adjoint equation."""
    case = Case("discrete", seed)
    case.lost = case.lost * 1.4 / np.abs(np.linalg.eigvals(case.lost)).max()
    used, lost = np.kron(case.A, case.A), np.kron(case.lost, case.lost)

    def radius(q: float) -> float:
        return float(np.abs(np.linalg.eigvals((1 - q) * used + q * lost)).max())

    low, high = 0.0, 1.0
    for _ in range(60):
        low, high = (0.5 * (low + high), high) if radius(0.5 * (low + high)) < 1.0 else (low, 0.5 * (low + high))
    operator = ((1 - 0.98 * low) * used + 0.98 * low * lost).T
    P = np.linalg.solve(np.eye(9) - operator, np.eye(3).ravel()).reshape(3, 3)
    received = P - case.A.T @ P @ case.A
    if np.linalg.eigvalsh(received).min() > 0.0:
        assert case.holds("drop probability", 0.97 * low, P, P)
    assert not case.holds("drop probability", 1.02 * low, P, P)


@pytest.mark.parametrize("time", ["continuous", "discrete"])
@pytest.mark.parametrize("seed", range(4))
def test_h2_norms_are_what_gramians_say(time: Time, seed: int) -> None:
    """A P a little above the gramian proves a little more than the norm, and none near it less; also over a denominator."""
    case = Case(time, seed, 1.6 if time == "continuous" and seed % 2 else None)
    small = 1e-6 * np.eye(3)
    if time == "continuous":
        case.D = np.zeros((2, 2))
        P = solve_continuous_lyapunov(case.A.T, -case.C.T @ case.C - small)
        X = solve_continuous_lyapunov(case.A, -case.B @ case.B.T - small)
        kinds, later, root = ("H2 norm", "energy to peak"), np.zeros((3, 3)), 1.0
    else:
        P = solve_discrete_lyapunov(case.A.T, case.C.T @ case.C + small)
        X = solve_discrete_lyapunov(case.A, case.B @ case.B.T + small)
        kinds, later, root = ("sampled H2 norm", "sampled energy to peak"), P, np.sqrt(PERIOD)  # sums and integrals
    norm = float(np.sqrt(np.trace(case.B.T @ P @ case.B + case.D.T @ case.D))) / root
    assert case.holds(kinds[0], 1.01 * norm, P, later)
    assert not case.holds(kinds[0], 0.99 * norm, P, later)
    assert not case.holds(kinds[0], 1.01 * norm, 0.98 * P, 0.98 * later)
    peak = float(np.sqrt(np.linalg.eigvalsh(case.C @ X @ case.C.T + case.D @ case.D.T)[-1]))
    stored, peak = np.linalg.inv(X) * (1.01 * peak) ** 2, peak / root
    after = later if time == "continuous" else stored
    assert case.holds(kinds[1], 1.02 * peak, stored, after)
    smaller = stored * (0.98 / 1.01) ** 2
    assert not case.holds(kinds[1], 0.99 * peak, smaller, after if time == "continuous" else smaller)
