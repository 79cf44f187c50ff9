"""A gain that shows detectability, and how far the pair may move before that gain fails."""

from __future__ import annotations

from warnings import catch_warnings, simplefilter

import numpy as np

from estimators.arrays import FloatArray

WEIGHTS = (1.0, 1e-3, 1e-6, 1e3)


def witness_gain(
    A: FloatArray, C: FloatArray, discrete: bool, enough: float = np.inf
) -> tuple[float, FloatArray | None]:
    r"""(distance, L): A + E - L (C + G) is stable for every |[E; G]| < distance; (0, None) if no gain was found.

    L from a Riccati equation at several noise levels, until a distance is above `enough`. The proof is a Lyapunov inequality
    for F = A - L C, evaluated anew: with F'P + P F = -Q < 0 the loop stays stable while 2 |P| |E - L G| < lambda_min(Q), and
    |E - L G| <= sqrt(1 + |L|^2) |[E; G]|; in discrete time while |R F R^-1| + |R| |R^-1| |E - L G| < 1, P = R'R.
    """
    from scipy import linalg

    n, m = A.shape[-1], C.shape[-2]
    best, chosen = 0.0, None
    for weight in WEIGHTS:
        try:
            with np.errstate(all="ignore"), catch_warnings():
                simplefilter("ignore", RuntimeWarning)  # scipy perturbs a singular equation: P is checked below
                noise = weight * np.eye(m)
                if discrete:
                    X = linalg.solve_discrete_are(A.T, C.T, np.eye(n), noise)
                    L = np.asarray(np.linalg.solve(C @ X @ C.T + noise, C @ X @ A.T).T, float)
                    P = linalg.solve_discrete_lyapunov((A - L @ C).T, np.eye(n))
                else:
                    X = linalg.solve_continuous_are(A.T, C.T, np.eye(n), noise)
                    L = np.asarray(X @ C.T / weight, float)
                    P = linalg.solve_continuous_lyapunov((A - L @ C).T, -np.eye(n))
        except (np.linalg.LinAlgError, ValueError):
            continue
        found = proved_distance(A, C, L, np.asarray(P, float), discrete)
        if found > best:
            best, chosen = found, L
        if best > enough:
            break
    return best, chosen


def proved_distance(A: FloatArray, C: FloatArray, L: FloatArray, P: FloatArray, discrete: bool) -> float:
    """The distance that P proves for the loop A - L C; 0 where P proves nothing."""
    if not (np.isfinite(P).all() and np.isfinite(L).all()):
        return 0.0
    F, P = A - L @ C, 0.5 * (P + P.T)
    sizes = np.linalg.eigvalsh(P)
    rounding = 8.0 * len(F) * np.finfo(float).eps
    if not sizes[0] > rounding * sizes[-1]:
        return 0.0
    reach = float(np.hypot(1.0, np.linalg.norm(L, 2)))
    if discrete:
        R = np.linalg.cholesky(P).T
        condition = float(np.sqrt(sizes[-1] / sizes[0]))
        size = float(np.linalg.norm(np.linalg.solve(R.T, (R @ F).T).T, 2))
        left = (1.0 - size) / condition - rounding * (np.linalg.norm(F, 2) + reach)
    else:
        Q = -(F.T @ P + P @ F)
        left = float(np.linalg.eigvalsh(0.5 * (Q + Q.T))[0]) / (2.0 * sizes[-1]) - rounding * (
            np.linalg.norm(F, 2) + reach
        )
    return max(float(left), 0.0) / reach
