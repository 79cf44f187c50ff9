"""The disturbances and state errors that a norm or a channel is about, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import unknown
from synthesis.models.param import Signal


class Named(Protocol):
    """What has disturbances and states by name."""

    @property
    def disturbances(self) -> Sequence[Signal]: ...  # noqa: D102
    @property
    def states(self) -> Sequence[Signal]: ...  # noqa: D102


def selection(
    model: Named, disturbances: Sequence[str], errors: Sequence[str], owner: str, error: type[Exception]
) -> tuple[FloatArray, FloatArray]:
    """d (nd, k) that feeds the named disturbances and z (j, nx) that reads the named state errors, in that order.

    Raises `error` with `owner` in front for an unknown name.
    """
    places = []
    for what, names, signals in (("disturbance", disturbances, model.disturbances), ("state", errors, model.states)):
        known = [signal.name for signal in signals]
        for name in names:
            if name not in known:
                raise error(f"{owner}: {unknown(what, name, known)}")
        places.append([known.index(name) for name in names])
    return np.eye(len(model.disturbances))[:, places[0]], np.eye(len(model.states))[places[1]]
