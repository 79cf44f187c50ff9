"""The errors of drives, real and simulated: each says what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from estimators.errors import EstimatorError, GainsmithError
from synthesis.errors import SpecError


def escaped(text: str) -> str:
    """Control characters as their escapes: a name from a file must not move the cursor."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


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
