"""What every design asks alike: one channel that is minimised, bounds on degree, decay, poles and back-off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np

from estimators.errors import unknown
from synthesis.design.norms import NORMS, Norm
from synthesis.errors import ProblemError

HIGHEST_DEGREE = 8


class Asked(Protocol):
    """A channel of an observer or of a feedback law."""

    @property
    def name(self) -> str:
        """In words."""

    @property
    def bound(self) -> float | None:
        """None: the gain is minimised."""

    @property
    def disturbances(self) -> tuple[str, ...]:
        """Where it begins."""

    @property
    def norm(self) -> Norm:
        """In which it is measured."""


Kind = TypeVar("Kind", bound=Asked)


def check_channels(channels: Sequence[Asked], ends: Sequence[tuple[str, ...]], what: str) -> None:
    """Exactly one channel is minimised, the others have positive bounds, and none is without a `what` at its end.

    Raises ProblemError.
    """
    if sum(channel.bound is None for channel in channels) != 1:
        raise ProblemError("exactly one channel must have no bound: it is the one that is minimised")
    for channel, end in zip(channels, ends, strict=True):
        if channel.bound is not None and not channel.bound > 0.0:
            raise ProblemError(f"channel '{channel.name}' has the bound {channel.bound}; give a positive number")
        if not channel.disturbances or not end:
            raise ProblemError(f"channel '{channel.name}' needs at least one disturbance and one {what}")
        if channel.norm not in NORMS:
            raise ProblemError(f"channel '{channel.name}': {unknown('norm', channel.norm, NORMS)}")


def minimised_channel(channels: Sequence[Kind]) -> Kind:
    """The channel without a bound."""
    return next(channel for channel in channels if channel.bound is None)


def check_degree_and_poles(degree: int, decay_rate: float, fastest_pole: float | None) -> None:
    """Raises ProblemError for a degree, a decay rate or a fastest pole (1/s) that cannot be."""
    if not 0 <= degree <= HIGHEST_DEGREE:
        raise ProblemError(f"degree {degree} of the gains must lie between 0 and {HIGHEST_DEGREE}")
    if not 0.0 <= decay_rate < np.inf:
        raise ProblemError(f"decay rate {decay_rate} 1/s must be a number and must not be negative")
    if fastest_pole is not None and not decay_rate < fastest_pole < np.inf:
        raise ProblemError(f"fastest pole {fastest_pole} 1/s must exceed the decay rate {decay_rate} 1/s")


def check_shares(backoff: float, reserve: float) -> None:
    """Raises ProblemError for a back-off or a reserve that is no share."""
    for name, share in (("backoff", backoff), ("reserve", reserve)):
        if not 0.0 <= share < 1.0:
            raise ProblemError(f"{name} {share} must lie in [0, 1)")
