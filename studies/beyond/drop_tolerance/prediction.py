"""What the analysis predicts: critical drop probability, Gilbert-Elliott boundary, second moment after so many samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from analysis.drops.frozen import critical_drop_probability
from analysis.drops.gilbert_elliott import critical_recovery_probability, gilbert_elliott
from analysis.drops.modes import schedule_drop_modes
from analysis.markov.second_moment import unpack
from analysis.markov.system import MarkovJumpSystem
from estimators import GainSchedule
from estimators.arrays import BoolArray, FloatArray

LONGEST_BURST = 300.0  # samples; 1.5 s at 200 Hz
FAILURES = (1e-4, 1.0)  # failure probabilities of the boundary
FLOOR = 1e-9  # keeps a norm definite where an eigenvector lies on the edge of the cone


@dataclass(frozen=True)
class Channel:
    """c cases: wheel speed in rad/s, Pr(lost next | received now) and Pr(received next | lost now), (c,) each."""

    speed: FloatArray
    failure: FloatArray
    recovery: FloatArray

    @property
    def loss_rate(self) -> FloatArray:
        """Share of lost samples in the long run, (c,)."""
        return np.asarray(self.failure / (self.failure + self.recovery))


def independent_drops(speed: ArrayLike, probability: ArrayLike) -> Channel:
    """Every sample lost with the same probability, whatever was lost before."""
    w, p = np.broadcast_arrays(np.asarray(speed, float), np.asarray(probability, float))
    return Channel(w.ravel(), p.ravel(), 1.0 - p.ravel())


def bursts(speed: ArrayLike, loss_rate: ArrayLike, length: ArrayLike) -> Channel:
    """Losses in bursts of a mean `length` in samples, `loss_rate` of all samples. length >= loss/(1 - loss)."""
    w, pi, b = np.broadcast_arrays(*(np.asarray(x, float) for x in (speed, loss_rate, length)))
    recovery = 1.0 / b.ravel()
    return Channel(w.ravel(), np.minimum(recovery * pi.ravel() / (1.0 - pi.ravel()), 1.0), recovery)


def joined(channels: Sequence[Channel]) -> Channel:
    """All cases of several channels, in order."""
    return Channel(*(np.concatenate([getattr(c, name) for c in channels]) for name in ("speed", "failure", "recovery")))


def critical(schedule: GainSchedule, speed: ArrayLike) -> FloatArray:
    """Critical drop probability, shape of `speed`."""
    modes = schedule_drop_modes(schedule, np.asarray(speed, float))
    return critical_drop_probability(modes.dropped, modes.received)


def harmless_from(schedule: GainSchedule) -> float:
    """The wheel speed in rad/s from which every loss below 100 % is survived; the end of the range if there is none."""
    grid = np.linspace(schedule.parameter.min, schedule.parameter.max, 1121)
    below = np.flatnonzero(critical(schedule, grid) < 1.0)
    if not len(below):
        return float(grid[0])
    if below[-1] == len(grid) - 1:
        return float(grid[-1])
    low, high = float(grid[below[-1]]), float(grid[below[-1] + 1])
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(critical(schedule, middle)) < 1.0 else (low, middle)
    return high


def radius(schedule: GainSchedule, channel: Channel) -> FloatArray:
    """Second-moment radius of each case, (c,)."""
    return system(schedule, channel).second_moment_radius()


def boundary(schedule: GainSchedule, speed: float) -> tuple[FloatArray, FloatArray]:
    """The Gilbert-Elliott boundary at one wheel speed: share of lost samples and mean burst length in samples, (g,) each.

    One point for each failure probability at which a boundary exists; ordered by rising loss.
    """
    failure = np.geomspace(*FAILURES, 240)
    recovery = _critical_recovery(schedule, speed, failure)
    known = np.isfinite(recovery) & (recovery > 1.0 / LONGEST_BURST)
    failure, recovery = failure[known], recovery[known]
    return failure / (failure + recovery), 1.0 / recovery


def critical_bursts(schedule: GainSchedule, speed: float, loss_rates: Sequence[float]) -> list[float | None]:
    """Mean burst lengths in samples at which stability is lost; None where it is not within 300 samples or not unique."""
    loss, _ = boundary(schedule, speed)
    if not len(loss) or (np.diff(loss) <= 0.0).any():
        return [None] * len(loss_rates)

    def recovery(failure: float) -> float:
        return float(_critical_recovery(schedule, speed, np.array([failure]))[0])

    def excess(log_failure: float, loss_rate: float) -> float:
        failure = float(np.exp(log_failure))
        return failure / (failure + recovery(failure)) - loss_rate

    found: list[float | None] = [None] * len(loss_rates)
    for k, loss_rate in enumerate(loss_rates):
        if loss[0] < loss_rate < loss[-1]:
            ends = math.log(FAILURES[0]), math.log(FAILURES[1])
            found[k] = 1.0 / recovery(float(np.exp(brentq(excess, *ends, args=(loss_rate,), xtol=1e-10))))
    return found


def _critical_recovery(schedule: GainSchedule, speed: float, failure: FloatArray) -> FloatArray:
    modes = schedule_drop_modes(schedule, np.array(speed))
    return critical_recovery_probability(modes.dropped, modes.received, failure)


@dataclass(frozen=True)
class Norm:
    """h(e, mode) = e' P_mode e for each case, P (c, 2, n, n), mode 0 received next and 1 lost next."""

    P: FloatArray

    def of(self, error: FloatArray, lost: BoolArray) -> FloatArray:
        """h (c, ...) of errors (c, ..., n) whose next sample is lost or not (c, ...)."""
        good, bad = (np.einsum("c...i,cij,c...j->c...", error, self.P[:, mode], error) for mode in (0, 1))
        return np.asarray(np.where(lost, bad, good))


def system(schedule: GainSchedule, channel: Channel) -> MarkovJumpSystem:
    """The jump systems of all cases."""
    modes = schedule_drop_modes(schedule, channel.speed)
    return gilbert_elliott(modes.dropped, modes.received, channel.failure, channel.recovery)


def natural_norm(schedule: GainSchedule, channel: Channel) -> Norm:
    """The norm whose mean grows by one factor, the radius, from the first sample on: left eigenvectors of the second moment.

    Any positive definite norm grows at the same rate in the end; in this one simulated sizes spread least.
    """
    jump = system(schedule, channel)
    values, vectors = np.linalg.eig(np.swapaxes(jump.second_moment_operator, -1, -2))
    leading = np.abs(values).argmax(axis=-1)
    left = np.take_along_axis(vectors, leading[:, None, None], axis=-1)[..., 0].real
    P = unpack(left.reshape(len(left), 2, -1), jump.size)
    P = P / np.trace(P.sum(axis=1), axis1=-2, axis2=-1)[:, None, None, None]  # of either sign: now positive
    return Norm(np.asarray(P + FLOOR * np.eye(jump.size) * np.diagonal(P, axis1=-2, axis2=-1)[..., None, :]))


def log_second_moment(
    schedule: GainSchedule, channel: Channel, norm: Norm, start: FloatArray, steps: int
) -> FloatArray:
    """log E h(e(k)) of each case after 0 and after `steps` samples, exactly, (2, c); channel in its steady state."""
    chance = np.stack([1.0 - channel.loss_rate, channel.loss_rate], axis=-1)
    moment = system(schedule, channel).propagate_second_moment(np.outer(start, start), chance, steps)
    return np.asarray(np.log(np.einsum("kcmij,cmij->kc", moment[[0, steps]], norm.P)))
