"""The errors of design: each says what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class GainsmithError(ValueError):
    """Bad input: the message names the place and the remedy. The command line turns it into exit code 2."""


class ModelError(GainsmithError):
    """A model that is not fully defined: stray symbol, wrong shape, missing unit or range."""


class SpecError(GainsmithError):
    """A specification or parameter file that cannot be used."""


class ProblemError(GainsmithError):
    """An LMI problem that is not affine, not polynomial, or unsuitable for the chosen relaxation."""


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """One sentence that names the unknown word and the nearest known ones."""
    names = sorted(known)
    close = get_close_matches(name, names, n=3)
    hint = f"did you mean {', '.join(close)}?" if close else f"known: {', '.join(names) or 'none'}"
    return f"unknown {what} '{name}'; {hint}"
