"""How far estimates scatter when residuals are not white.

Neighbouring residuals are alike (filters, unmodelled dynamics, a reference that wanders), and so are the corners of one
instant, which share the reference. So n rows stand for n/tau independent ones, tau = 1 + 2 sum_l rho_l, and

    cov = s^2 tau (J'J)^-1        (s the residual size),

exact where the regressors move slowly against the residual. It says nothing of a residual that grows with the regressor;
the long-run covariance of the scores u_t = J_t' e_t, summed over the rows of one instant, does:

    Omega = sum_{|l| <= L} (1 - |l|/(L + 1)) sum_t u_t u_{t+l}',    cov = (J'J)^-1 Omega (J'J)^-1   (Newey, West 1987),

but falls short where few independent stretches of a log tell a parameter: one jump of the torque is one experiment however
many samples it has. So each parameter gets the widest of three intervals: the first and the second with Student's t of
n/tau - p degrees of freedom, and their mean, the second weighed by the number m of such stretches
(:func:`effective_stretches`), the first by 4, with m + 4 degrees. Bandwidth L (for tau as well): Andrews (1991) for the
Bartlett kernel, 1.1447 (alpha n)^(1/3), alpha from first-order autoregressions.

What the intervals cover: noise of the sensors, residuals that hang together, priors, and what is held at one. Fits of low
slip (:mod:`.slip_limit`) add what narrower limits say otherwise. Not covered: wrong masses, lengths and heights of the drive
file, and scales of its sensors: a stiffness is in units of their forces.
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray, IntArray


def long_run_covariance(scores: FloatArray, least_bandwidth: int) -> tuple[FloatArray, int]:
    """Omega (p, p) and bandwidth L, samples, of the scores (n, p) over all n instants in time order; zero where nothing was used.

    ``least_bandwidth`` is the correlation length that the prefilter alone brings, samples.
    """
    used = np.any(scores != 0, axis=1)
    n = max(int(np.count_nonzero(used)), 1)
    bandwidth = int(min(max(least_bandwidth, np.ceil(_andrews(scores, n))), max(n // 6, 1)))
    omega = scores.T @ scores
    for lag in range(1, min(bandwidth, len(scores) - 1) + 1):
        gamma = scores[:-lag].T @ scores[lag:]
        omega += (1 - lag / (bandwidth + 1)) * (gamma + gamma.T)
    return omega * n / max(n - scores.shape[1], 1), bandwidth


def _andrews(scores: FloatArray, n: int) -> float:
    """1.1447 (alpha n)^(1/3), alpha = sum_p 4 rho^2 s^4/((1-rho)^6 (1+rho)^2) / sum_p s^4/(1-rho)^4, each score scaled."""
    if len(scores) < 3:
        return 1.0
    power = np.sum(scores**2, axis=0)
    keep = power > 0
    if not keep.any():
        return 1.0
    u = scores[:, keep] / np.sqrt(power[keep])
    rho = np.clip(np.sum(u[1:] * u[:-1], axis=0) / np.sum(u[:-1] ** 2, axis=0), -0.97, 0.97)
    noise = 1 - rho**2  # innovations of a score of unit power
    top = np.sum(4 * rho**2 * noise**2 / ((1 - rho) ** 6 * (1 + rho) ** 2))
    return float(1.1447 * (top / np.sum(noise**2 / (1 - rho) ** 4) * n) ** (1 / 3))


def correlation_time(residual: FloatArray, least_bandwidth: int) -> float:
    """How many of the rows (n, k) stand for one independent one: correlation over time and among rows of one instant.

    1 + 2 sum_l (1 - l/(L+1)) rho_l of the sums over k; ``residual`` is 0 where nothing was used.
    """
    total = residual.sum(axis=1, keepdims=True)
    power = float(np.sum(residual**2))
    return float(long_run_covariance(total, least_bandwidth)[0][0, 0]) / power if power > 0 else 1.0


def effective_stretches(influence: FloatArray, rows: IntArray, length: int) -> FloatArray:
    """How many independent stretches tell each parameter: (sum g_b)^2/sum g_b^2, g_b the influence squared in stretch b.

    ``influence`` (n, p) of the residuals on the estimates, ``rows`` (n,) their instants, ``length`` of a stretch in samples.
    A variance known from m stretches has m degrees of freedom (Bell and McCaffrey 2002, with equal residuals).
    """
    power = np.zeros((int(rows.max()) // length + 1, influence.shape[1]))
    np.add.at(power, rows // length, influence**2)
    total = power.sum(axis=0)
    return np.asarray(total**2 / np.maximum(np.sum(power**2, axis=0), 1e-300 + 1e-12 * total**2))
