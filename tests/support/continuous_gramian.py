"""The observability gramian in continuous time, by quadrature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from analysis.checks import as_stack, square
from analysis.errors import AnalysisError
from analysis.observability.gramians import Gramians
from estimators.arrays import FloatArray

NODES = 8


def continuous_gramian(
    A: Callable[[float], FloatArray],
    C: Callable[[float], FloatArray],
    start: float,
    stop: float,
    intervals: int = 64,
    relative_tolerance: float = 1e-11,
) -> Gramians:
    r"""int_start^stop phi(t, start)' C(t)' C(t) phi(t, start) dt for A(t) (n, n), C(t) (m, n); time in s.

    phi' = A(t) phi by an eighth-order Runge-Kutta method, the integral by Gauss-Legendre with 8 nodes on each of
    `intervals` pieces (exact for polynomials of degree 15). The factor is the QR factor of the weighted samples, so its
    small singular values are not squared away. Raises AnalysisError for an empty interval and values that do not fit.
    """
    if not (np.isfinite(start) and np.isfinite(stop) and start < stop):
        raise AnalysisError(f"interval [{start}, {stop}] s is empty or not finite; give start < stop")
    if intervals < 1:
        raise AnalysisError(f"intervals = {intervals} must be at least 1")
    n = square("A(start)", A(start)).shape[-1]
    if as_stack("C(start)", C(start)).shape[-1] != n:
        raise AnalysisError(f"C(start) has the shape {np.shape(C(start))}; A needs {n} columns")
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    edges = np.linspace(start, stop, intervals + 1)
    half = 0.5 * np.diff(edges)
    times = (0.5 * (edges[:-1] + edges[1:])[:, None] + half[:, None] * nodes).ravel()
    with np.errstate(all="ignore"):  # what overflows is refused below
        solution = solve_ivp(
            lambda t, phi: (np.asarray(A(t), float) @ phi.reshape(n, n)).ravel(),
            (start, stop),
            np.eye(n).ravel(),
            method="DOP853",
            t_eval=[*times, stop],
            rtol=relative_tolerance,
            atol=1e-14,
            max_step=(stop - start) / intervals,
        )
    if not solution.success or not np.isfinite(solution.y).all():
        raise AnalysisError(f"the transition matrix could not be integrated ({solution.message}); shorten the interval")
    phi = solution.y.T.reshape(-1, n, n)
    outputs = np.stack([as_stack("C(t)", C(t)) for t in times]) @ phi[:-1]
    rows = outputs * np.sqrt((half[:, None] * weights).ravel())[:, None, None]
    padded = np.concatenate([rows.reshape(-1, n), np.zeros((n, n))])
    return Gramians(np.asarray(np.linalg.qr(padded, mode="r")), phi[-1])
