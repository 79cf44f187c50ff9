"""The errors of analysis: each says what is wrong, where, and what to do."""

from __future__ import annotations

from estimators.errors import GainsmithError


class AnalysisError(GainsmithError):
    """An invalid question: matrices that do not fit, are not finite, or break an assumption of the method."""
