"""Lost force measurements (24), (25): the pair of updates, the critical drop probability, and where it reaches 1."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from analysis.dropout import critical_drop_probability, drop_radius
from studies.papers.resilient_velocity.setting import HIGHEST_SPEED, Setting
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray


def updates(setting: Setting, direction: Direction, speeds: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """exp(A T) of a dropped and exp(A_e T) of a received sample, (g, 2, 2) each."""
    return setting.dropped(direction, speeds), setting.sampled(direction, speeds)


def critical(setting: Setting, direction: Direction, speeds: ArrayLike) -> FloatArray:
    """The critical drop probability (g,) of Fig. 7."""
    return critical_drop_probability(*updates(setting, direction, speeds))


def radius(setting: Setting, direction: Direction, speeds: ArrayLike, probability: ArrayLike) -> FloatArray:
    """Second-moment radius of Fig. 8; speeds (g,), probability broadcasts with (g,)."""
    return drop_radius(*updates(setting, direction, speeds), probability)


def kept(setting: Setting, direction: Direction, speeds: ArrayLike) -> FloatArray:
    """e_2' A_1 [1/a, 1]' (g,): what one received sample makes of the only error that the open loop keeps.

    After many dropped samples the error is a multiple of [1/a, 1]', the eigenvector of A_0 to its eigenvalue 1; a received
    one and then many dropped ones multiply it by this number. A size above 1 means growth.
    """
    A1 = setting.sampled(direction, speeds)
    a = setting.rolling_rate(direction, np.atleast_1d(np.asarray(speeds, float)))
    return np.asarray(A1[..., 1, 0] / a + A1[..., 1, 1])


def harmless_from(setting: Setting, direction: Direction) -> float | None:
    """The wheel speed in rad/s from which every drop probability below 1 is mean-square stable; None if there is none.

    Raises ValueError if |kept| crosses 1 more than once on 0..140 rad/s.
    """

    def excess(speed: float) -> float:
        return abs(float(kept(setting, direction, speed)[0])) - 1.0

    grid = np.linspace(1e-3, HIGHEST_SPEED, 2001)
    above = np.abs(kept(setting, direction, grid)) > 1.0
    changes = np.flatnonzero(above[1:] != above[:-1])
    if len(changes) > 1:
        raise ValueError(f"{direction}: |e2' A1 [1/a, 1]'| crosses 1 more than once; no single speed separates")
    if not len(changes):
        return None
    return float(brentq(excess, grid[changes[0]], grid[changes[0] + 1], xtol=1e-12))
