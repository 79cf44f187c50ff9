"""The errors of design: each says what is wrong, where, and what to do."""

from __future__ import annotations

from estimators.errors import GainsmithError


class ModelError(GainsmithError):
    """A model that is not fully defined: stray symbol, wrong shape, missing unit or range.

    `offset` is the character of a formula at which it fails, where that is known.
    """

    def __init__(self, message: str, offset: int | None = None) -> None:
        super().__init__(message)
        self.offset = offset


class SpecError(GainsmithError):
    """A specification or parameter file that cannot be used."""


class ProblemError(GainsmithError):
    """An LMI problem that is not affine, not polynomial, or unsuitable for the chosen relaxation."""
