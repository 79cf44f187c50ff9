"""The root of all errors and those of the runtime: each says what is wrong, where, in which unit, and what to do."""

from __future__ import annotations

from collections.abc import Iterable


class GainsmithError(ValueError):
    """Bad input: the message names the place and the remedy. The command line turns it into exit code 2."""


class EstimatorError(GainsmithError):
    """Bad input to an estimator: the message names the place and the remedy."""


class ScheduleError(EstimatorError):
    """A schedule file or its content that cannot be trusted or understood."""


class RangeError(EstimatorError):
    """A parameter or a rate outside the box for which the schedule was proved."""


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """One sentence that names the unknown word and the nearest known ones."""
    from difflib import get_close_matches  # needed for a refusal alone

    names = sorted(known)
    close = get_close_matches(name, names, n=3)
    hint = f"did you mean {', '.join(close)}?" if close else f"known: {', '.join(names) or 'none'}"
    return f"unknown {what} '{name}'; {hint}"
