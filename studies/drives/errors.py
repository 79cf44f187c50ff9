"""What can be wrong with a recorded drive."""

from __future__ import annotations

from synthesis.errors import GainsmithError


class LogError(GainsmithError):
    """A log that cannot be replayed: the message names the file, the line or column, and the remedy."""
