r"""The error of an update along parameter trajectories, from plant and table alone: independent of the runtime.

    held     e+ = e^M e + T phi(M) (E - L F) d + T (phi(TA) - phi(M)) x',   M = T (A - L C)
    sampled  e+ = (e^(TA) - K C) e + (T phi(TA) E - K F) d

with everything at the parameter of the sample's start (synthesis.loop.observer). No balls, no Taylor models, no estimates.
"""

from __future__ import annotations

import numpy as np

from analysis.simulation.flow import phi_times
from analysis.simulation.plants import matrices_of
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule


def error_update(schedule: GainSchedule, p: FloatArray) -> tuple[FloatArray, dict[str, FloatArray]]:
    """A (g, nx, nx), and B of "disturbances" (g, nx, nd) and "motion" (g, nx, nx), at parameters (g, p)."""
    period, n = schedule.sample_time, len(schedule.states)
    A, _, C, _, E, F = matrices_of(schedule, p)
    gain = schedule.gain(p[:, 0] if len(schedule.parameters) == 1 else p)
    eye = np.broadcast_to(np.eye(n), A.shape)
    if schedule.update == "sampled":
        found = phi_times(period * A, np.concatenate([period * A, period * E], axis=-1))
        return eye + found[..., :n] - gain @ C, {"disturbances": found[..., n:] - gain @ F, "motion": 0.0 * A}
    M = period * (A - gain @ C)
    closed = phi_times(M, np.concatenate([M, period * (E - gain @ F), period * eye], axis=-1))
    coast = phi_times(period * A, period * eye)
    return eye + closed[..., :n], {"disturbances": closed[..., n:-n], "motion": coast - closed[..., -n:]}
