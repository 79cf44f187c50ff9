r"""Upper bounds of the joint spectral radius from one ellipsoid: A_i'P A_i <= gamma^2 P for all modes gives rho <= gamma."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.exact import as_float_up, congruence, is_positive, rationals
from analysis.switching.common_lyapunov import common_quadratic_lyapunov
from estimators.arrays import FloatArray
from synthesis.lmi.result import Verdict
from synthesis.polynomials.rational import rational

BISECTIONS = 40


@dataclass(frozen=True)
class Ellipsoid:
    """`P` (n, n) and the proved `bound`; the infimum over all ellipsoids is between `floor` and `bound`."""

    P: FloatArray
    bound: float
    floor: float


def best_ellipsoid(modes: FloatArray, lower: float, tolerance: float) -> Ellipsoid:
    """Bisection on gamma between a proved lower bound and the Euclidean norm; every accepted P is checked exactly."""
    size = modes.shape[-1]
    P = np.eye(size)
    bound = proved_bound(modes, P, float(np.linalg.norm(modes, 2, axis=(-2, -1)).max()))
    floor = lower
    for _ in range(BISECTIONS):
        if bound <= floor * (1.0 + 0.25 * tolerance):
            break
        gamma = np.sqrt(floor * bound) if floor > 0.0 else 0.5 * bound
        found = common_quadratic_lyapunov(modes / gamma, discrete=True)
        if found.verdict is Verdict.CERTIFIED and found.P is not None:
            tried = proved_bound(modes, found.P, gamma)
            if tried < bound:
                P, bound = found.P, tried
                continue
        floor = float(gamma)
    return Ellipsoid(P / np.abs(P).max(), bound, floor)


def proved_bound(modes: FloatArray, P: FloatArray, guess: float) -> float:
    """The least float near `guess` or the norm in P for which gamma^2 P - A_i'P A_i > 0 holds in exact arithmetic."""
    L = np.linalg.cholesky(P)
    inside = np.linalg.solve(L, np.swapaxes(modes, -1, -2) @ L)  # transposes of L'A L'^-1
    gamma = min(float(np.linalg.norm(inside, 2, axis=(-2, -1)).max()), guess)
    exact = rationals(P)
    forms = [congruence(rationals(mode.T), exact) for mode in modes]
    if not is_positive(exact):
        return float("inf")
    for step in (1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6, 1e-4, 1e-2):
        squared = (rational(gamma) * (1 + rational(step))) ** 2
        if all(is_positive(exact * squared - form) for form in forms):
            return as_float_up(rational(gamma) * (1 + rational(step)))
    return float("inf")
