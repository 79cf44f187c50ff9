"""The errors of drives, real and simulated: each says what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from estimators.errors import EstimatorError, GainsmithError
from synthesis.errors import SpecError


class LogError(GainsmithError):
    """A log that cannot be replayed: the message names the file, the line or column, and the remedy."""


class IdentifyError(GainsmithError):
    """A log that no parameter can be identified from: the message names what is missing and the remedy."""


class SimulationError(GainsmithError):
    """A simulated run that left the range of numbers: the message names run and time."""


@contextmanager
def refused_at(place: str) -> Iterator[None]:
    """What an estimator refuses inside becomes a SpecError that starts with the ``place`` in the user's file."""
    try:
        yield
    except EstimatorError as error:
        raise SpecError(f"{place}: {error}") from error
