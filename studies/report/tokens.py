"""The smallest pieces of a formula in plain text: numbers, names and marks."""

from __future__ import annotations

import re
from dataclasses import dataclass

TOKEN = re.compile(
    r"(?P<number>(?<![\w.])(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:e[-+]?\d+)?(?![A-Za-z_]))"
    r"|(?P<name>(?<!\w)[A-Za-z][A-Za-z0-9]*(?:_(?:[A-Za-z0-9]+|\([^()]*\)))*)"
    r"|(?P<mark><=|>=|\*\*|\+-|[-+*/^=<>|'()\[\],;−])"
)


@dataclass(frozen=True)
class Token:
    """A number, name or mark; ``spaced`` when a space stands before it."""

    kind: str
    text: str
    start: int
    end: int
    spaced: bool


def tokens_of(text: str) -> list[Token]:
    """Every token of ``text`` in order; words and punctuation between them are left out."""
    found: list[Token] = []
    for match in TOKEN.finditer(text):
        kind, start = str(match.lastgroup), match.start()
        spaced = start > 0 and text[start - 1].isspace()
        joined = start > 0 and text[start - 1] == "'" and re.fullmatch("[A-Z][a-z]", match[0])  # e'Pe
        pieces = [(k, k + 1) for k in (start, start + 1)] if joined else [(start, match.end())]
        found += [Token(kind, text[a:b], a, b, spaced and a == start) for a, b in pieces]
    return found
