"""The root of all errors and those of the runtime: each says what is wrong, where, in which unit, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import accumulate

LONGEST_WORD, LONGEST_LIST = 60, 140  # characters of an unknown word, and of all known ones, in a message


class GainsmithError(ValueError):
    """Bad input: the message names the place and the remedy. The command line turns it into exit code 2."""


class EstimatorError(GainsmithError):
    """Bad input to an estimator: the message names the place and the remedy."""


class ScheduleError(EstimatorError):
    """A schedule file or its content that cannot be trusted or understood."""


class RangeError(EstimatorError):
    """A parameter or a rate outside the box for which the schedule was proved."""


def printable(text: str, most: int = 10**6) -> str:
    """Text for a message: no control characters, on one line, cut to a length."""
    clean = "".join(c if c.isprintable() else "?" for c in text[: most + 1])
    return clean if len(clean) <= most else clean[: most - 3] + "..."


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """One sentence that names the unknown word and the nearest known ones."""
    from difflib import get_close_matches  # needed for a refusal alone

    names = sorted(known)
    word = printable(name, LONGEST_WORD)
    close = get_close_matches(word, names, n=3)
    fit = sum(total <= LONGEST_LIST for total in accumulate(len(known) + 2 for known in names))
    more = f" and {len(names) - fit} more" if fit < len(names) else ""
    hint = f"did you mean {', '.join(close)}?" if close else f"known: {', '.join(names[:fit]) or 'none'}{more}"
    return f"unknown {what} '{word}'; {hint}"
