r"""Second moments of the runtime observer's error under lost measurements, without the heavy tail of a plain average.

|e(k)|^2 is a product of random factors: after many samples its mean rests on runs too rare to be drawn. So the runs of one seed
form a population. Every few samples each run is repeated in proportion to its size h(e) and set back to size 1, and the mean
size is kept as a factor. The product of the factors has exactly the mean E h(e(k)) (Del Moral 2004, Feynman-Kac models), for
any number of runs and any norm h, and its spread over seeds stays small.

The error is the observer's own estimate: the truth is zero, the input is zero, a received measurement is 0 and a lost one
NaN. The observer is linear in its state, so setting runs back to size 1 changes nothing but the scale.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from estimators import GainSchedule, LpvVelocityObserver
from estimators.arrays import BoolArray, FloatArray, IntArray
from studies.beyond.drop_tolerance.prediction import Channel, Norm

EVERY = 4  # samples from one resampling to the next
START = np.array([0.0, 1.0])  # m, m/s


def simulate(
    schedule: GainSchedule, channel: Channel, norm: Norm, steps: int, seeds: int, runs: int, generator: Generator
) -> FloatArray:
    """log of an unbiased estimate of E h(e(steps)) for each case and seed, (c, seeds); EVERY divides `steps`.

    Populations of `runs` runs for each of `seeds` seeds and every case; all cases see the same random numbers.
    """
    names = ("speed", "failure", "recovery", "loss_rate")
    speed, failure, recovery, rate = (getattr(channel, name)[:, None, None] for name in names)
    speed = np.ascontiguousarray(np.broadcast_to(speed, (len(speed), seeds, runs)))

    def follow(lost: BoolArray) -> BoolArray:
        draw = generator.random((seeds, runs))
        return np.asarray(np.where(lost, draw >= recovery, draw < failure))

    def size(_: int, error: FloatArray, lost: BoolArray) -> FloatArray:
        return norm.of(error, lost)

    first = generator.random((seeds, runs)) < rate
    return np.asarray(evolve(schedule, first, lambda _: speed, follow, size, steps, EVERY, generator)[-1])


def evolve(
    schedule: GainSchedule, lost: BoolArray, speed: Callable[[int], FloatArray], follow: Callable[[BoolArray], BoolArray],
    size: Callable[[int, FloatArray, BoolArray], FloatArray], steps: int, every: int, generator: Generator,
) -> FloatArray:  # fmt: skip
    """log of unbiased estimates of E size(k) at k = every, 2 every, ..., (steps // every, c, seeds).

    `lost` (c, seeds, runs) says which runs lose sample 0, `follow` which lose the next one; `speed(k)` is the wheel speed of
    sample k, of the same shape; `size(k, error, lost)` >= 0 is quadratic in the error (c, seeds, runs, n).
    """
    runtime = LpvVelocityObserver(schedule, lost.shape)
    runtime.reset(state=START)
    logarithm, zero, logs = np.zeros(lost.shape[:2]), np.zeros(lost.shape), []
    for k in range(1, steps + 1):
        estimate = runtime.step(zero, np.where(lost, np.nan, 0.0), speed(k - 1)).estimate
        lost = follow(lost)
        if k % every:
            continue
        sizes = size(k, estimate, lost)
        logarithm = logarithm + np.log(sizes.mean(axis=-1))
        logs.append(logarithm)
        chosen = resampled(sizes, generator.random((lost.shape[1], 1)))
        lost = np.take_along_axis(lost, chosen, axis=2)
        scale = np.sqrt(np.take_along_axis(sizes, chosen, axis=2))[..., None]
        runtime.reset(state=np.take_along_axis(estimate, chosen[..., None], axis=2) / scale)
    return np.stack(logs)


def resampled(weights: FloatArray, offset: FloatArray) -> IntArray:
    """Systematic resampling along the last axis: n indices, i about n w_i / sum(w) times, in expectation exactly so.

    weights (..., n) >= 0; offset in [0, 1), broadcasts to (..., 1).
    """
    n, upper = weights.shape[-1], np.cumsum(weights, axis=-1)
    upper = upper / upper[..., -1:]
    rows = np.arange(upper.size // n).reshape(*upper.shape[:-1], 1)
    place = np.broadcast_to((np.arange(n) + offset) / n, upper.shape)
    # all rows in one search: row r occupies (r, r + 1]
    found = np.searchsorted((upper + rows).ravel(), (place + rows).ravel(), side="right").reshape(upper.shape)
    return np.asarray(np.minimum(found - rows * n, n - 1))
