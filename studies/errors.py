"""The errors of drives, real and simulated: each says what is wrong, where, and what to do."""

from __future__ import annotations

from estimators.errors import GainsmithError


class LogError(GainsmithError):
    """A log that cannot be replayed: the message names the file, the line or column, and the remedy."""


class IdentifyError(GainsmithError):
    """A log that no parameter can be identified from: the message names what is missing and the remedy."""


class SimulationError(GainsmithError):
    """A simulated run that left the range of numbers: the message names run and time."""
