"""Corner forces that agree with the acceleration of the whole car: what single wheels cannot know, their sum does."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arrays import BoolArray, FloatArray


class Reconciled(NamedTuple):
    """Leading axes are those of the batch."""

    force: FloatArray  # (..., 4) N
    deviation: FloatArray  # (..., 4) N
    innovation: FloatArray  # (...) N, total minus the sum before; NaN where the total is missing
    used: BoolArray  # (...) whether the total was there


LIFTED = 0.05
"""Share of its static load below which a wheel counts as lifted: its F/F_z means nothing."""


def normalised(
    force: FloatArray, load: FloatArray, static: FloatArray | float, unknown: BoolArray | None = None
) -> FloatArray:
    """mu = F/F_z (..., 4), P1 (13), from forces and loads, N; NaN where a wheel is lifted, or its force is `unknown`.

    `static`: N, what the wheels carry at rest.
    """
    lifted: BoolArray = load < LIFTED * static
    if unknown is not None:
        lifted = lifted | unknown
    if not np.count_nonzero(lifted):
        ratio: FloatArray = force / load
        return ratio
    return np.where(lifted, np.nan, force / np.where(lifted, 1.0, load))


def reconcile(
    force: FloatArray,
    deviation: FloatArray,
    total: npt.ArrayLike,
    total_deviation: float,
    load: FloatArray,
    unknown: BoolArray,
    unknown_share: float = 0.25,
) -> Reconciled:
    """Least squares between corner forces and their sum, F + w (total - sum F)/(sum w + s^2), w = deviation^2.

    A corner that its wheel equation leaves `unknown` (wheel stopped, torque lost) first gets its share by load,
    total F_z/sum F_z (a quarter where no wheel carries any), with a deviation of `unknown_share` of its load: all
    wheels using the same part of their load is a fair guess, and at standstill it is zero. Corners that changed much
    since the last sample are the uncertain ones (`WheelForceStep.deviation`), and take most of the correction.

    Where the total is missing, forces and deviations come back unchanged (an unknown one with its load as deviation).

    Args:
        force, deviation, load: (..., 4) N, load not negative.
        total: (...) N, m a_x of the level car, in the direction of the wheel planes: plus F_y,f sin(delta) with the front
            wheels steered, plus drag and m g sin(grade) where known.
        total_deviation: N; the mass times what the accelerometer may be wrong.
        unknown: (..., 4) mask, `WheelForceStep.unknown`.
        unknown_share: of the load.
    """
    given = np.asarray(total, dtype=np.float64)
    known = force.shape == (4,) and total_deviation > 0.0 and math.isfinite(given)
    if known and not np.count_nonzero(unknown):  # on plain numbers, to the last bit, in a third of the time
        return _of_one_car(force.tolist(), deviation.tolist(), given.item(), total_deviation)
    weight, prior, there = deviation**2, force, np.isfinite(given)
    calm = np.count_nonzero(there) == there.size  # three times faster than `all` and `any` for a few wheels
    if not calm or np.count_nonzero(unknown):
        present = there[..., None]
        whole = load.sum(axis=-1, keepdims=True)
        part = np.where(whole > 0.0, load, 1.0) / np.where(whole > 0.0, whole, 4.0)  # no load at all: a quarter each
        share = np.where(there, given, 0.0)[..., None] * part
        prior = np.where(unknown & present, share, force)
        weight = np.where(unknown, (np.where(present, unknown_share, 1.0) * load) ** 2, weight)
    gap = given - np.add.reduce(prior, -1)
    gain = weight / (np.add.reduce(weight, -1, keepdims=True) + total_deviation**2)
    if not calm:
        gain = np.where(there[..., None], gain, 0.0)
    change = gain * (gap if calm else np.where(there, gap, 0.0))[..., None]
    return Reconciled(prior + change, np.sqrt(weight * (1.0 - gain)), gap, there)


def _of_one_car(force: list[float], deviation: list[float], total: float, total_deviation: float) -> Reconciled:
    """Four wheels and a sum that are all known."""
    w1, w2, w3, w4 = weight = [value * value for value in deviation]
    f1, f2, f3, f4 = force
    gap, scale = total - (f1 + f2 + f3 + f4), w1 + w2 + w3 + w4 + total_deviation**2
    gain = [w / scale for w in weight]
    agreed = [f + g * gap for f, g in zip(force, gain, strict=True)]
    left = [math.sqrt(w * (1.0 - g)) for w, g in zip(weight, gain, strict=True)]
    return Reconciled(np.array(agreed), np.array(left), np.array(gap), np.array(True))
