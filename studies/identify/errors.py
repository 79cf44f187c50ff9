"""What keeps a log from being identified."""

from __future__ import annotations

from synthesis.errors import GainsmithError


class IdentifyError(GainsmithError):
    """A log that no parameter can be identified from: the message names what is missing and the remedy."""
