r"""What the runtime observer does with a sample, received or dropped, as matrices for the error e = x - xhat.

With Phi and Gamma of the update that the runtime performs (`estimators.velocity.exact_update`), over one sample T:

    received           e+ = Phi e
    dropped, coast     e+ = e^{A T} e                                       (no gain: kinematics alone, P3 (24))
    dropped, hold      e+ = Phi e + Gamma s,   s+ = s + C (x+ - x)          (the last measurement is used again)

    update "held"      Phi = e^{(A - L C) T},   Gamma = int_0^T e^{(A - L C) t} dt L   (P1 notes 9)
    update "sampled"   Phi = e^{A T} - K C,     Gamma = K

and s = C x - (measurement used), the staleness, which a received sample resets to zero. Where a measurement is held, the loop
stays closed: dropping cannot destabilise it, and every p < 1 leaves a bounded error for a bounded motion of the plant; but the
error follows that motion, without bound on an unstable plant, where coasting has no such term. "received" is exact for
"sampled"; for "held" it leaves out what the plant's motion within the sample adds, as long as the plant stands still.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from scipy.linalg import expm

from analysis.checks import as_stack, leading, positive, square
from analysis.errors import AnalysisError
from analysis.mode_objects import with_output
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from estimators.schedule import GainSchedule, Update
from synthesis.models.discretise import zero_order_hold

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

DropPolicy = Literal["coast", "hold", "hold with plant"]


@dataclass(frozen=True, repr=False)
class DropModes(Display):
    """Update matrices (..., N, N) of a dropped and of a received sample on the states of the policy.

    coast: e. hold: (e, s), the motion of the plant acting from outside. hold with plant: (e, x, measurement used last), an
    autonomous system, with the error that the update "held" makes by holding y over the sample: for plants that come to rest.
    """

    dropped: FloatArray
    received: FloatArray
    policy: DropPolicy


def runtime_drop_modes(
    A: ArrayLike,
    C: ArrayLike | None,
    gain: ArrayLike,
    sample_time: float,
    policy: DropPolicy = "coast",
    update: Update = "held",
) -> DropModes:
    """Both updates for A (..., n, n) in 1/s, C (..., k, n), gain L or K (..., n, k) and the sample time in s.

    A continuous-time object in the place of A brings C, too: give None for it.

    Raises AnalysisError for arrays that do not fit or are not finite, a sample time that is not positive, an unknown policy or
    update.

    >>> modes = runtime_drop_modes([[-1.0]], [[1.0]], [[4.0]], 0.1)
    >>> modes.received.round(4).tolist(), modes.dropped.round(4).tolist()  # e^-0.5 and e^-0.1
    ([[0.6065]], [[0.9048]])
    """
    if policy not in get_args(DropPolicy):
        raise AnalysisError(unknown("drop policy", str(policy), get_args(DropPolicy)))
    if update not in get_args(Update):
        raise AnalysisError(unknown("update", str(update), get_args(Update)))
    A, C = with_output(A, C, discrete=False)
    A, C, L = square("A", A), as_stack("C", C), as_stack("gain", gain)
    T = positive("sample_time", sample_time)
    n, k = A.shape[-1], C.shape[-2]
    if C.shape[-1] != n or L.shape[-2:] != (n, k):
        raise AnalysisError(
            f"A {A.shape}, C {C.shape} and gain {L.shape} do not fit; they must be (..., n, n), (..., k, n), (..., n, k)"
        )
    lead = leading({"A": A, "C": C, "gain": L})
    plant = np.asarray(expm(A * T))
    if policy == "coast":
        return DropModes(plant, plant - L @ C if update == "sampled" else expm((A - L @ C) * T), policy)
    gamma = np.broadcast_to(L, (*lead, n, k))
    if update == "sampled":
        phi = plant - L @ C
    else:
        phi, gamma = zero_order_hold(A - L @ C, gamma, T)
    if policy == "hold":
        received, dropped = np.zeros((2, *lead, n + k, n + k))
        received[..., :n, :n] = dropped[..., :n, :n] = phi
        dropped[..., :n, n:] = gamma
        dropped[..., n:, n:] = np.eye(k)
        return DropModes(dropped, received, policy)
    received, dropped = np.zeros((2, *lead, 2 * n + k, 2 * n + k))
    for matrix in (received, dropped):
        matrix[..., :n, :n] = phi
        matrix[..., n : 2 * n, n : 2 * n] = plant
    received[..., :n, n : 2 * n] = plant - phi - gamma @ C
    received[..., 2 * n :, n : 2 * n] = C
    dropped[..., :n, n : 2 * n] = plant - phi
    dropped[..., :n, 2 * n :] = -gamma
    dropped[..., 2 * n :, 2 * n :] = np.eye(k)
    return DropModes(dropped, received, policy)


def schedule_drop_modes(schedule: GainSchedule, parameter: ArrayLike, policy: DropPolicy = "coast") -> DropModes:
    """Both modes of a schedule with its stored table and its own update, at parameters (...).

    Raises RangeError outside the certified range; AnalysisError for an unknown policy.

    >>> modes = schedule_drop_modes(GainSchedule.shipped("longitudinal-speed"), 50.0)
    >>> modes.received.shape, modes.dropped.shape
    ((2, 2), (2, 2))
    """
    plant = schedule.plant_at(np.asarray(parameter, float))
    return runtime_drop_modes(
        plant.A, plant.C, schedule.gain(parameter), schedule.sample_time, policy, schedule.observer_update
    )
