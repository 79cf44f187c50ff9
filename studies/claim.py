"""A claim of a paper: what is printed, what we compute, and what follows from the two."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from estimators.display import Display
from studies.sentence import fill

JsonValue = Any
"""Numbers, texts, lists and dictionaries of them: what a JSON file can hold."""


SENTENCE_FAILS = "The sentence about this claim cannot be filled"
PAPERS = ("P1", "P2", "P3", "P4", "P5")


def paper_rank(paper: str) -> int:
    """P1 before P5, ``P1/P2`` with P1, anything else last."""
    return next((rank for rank, known in enumerate(PAPERS) if paper.startswith(known)), len(PAPERS))


class ClaimVerdict(StrEnum):
    """What became of a published claim.

    >>> print(ClaimVerdict.REPRODUCED, "/", ClaimVerdict.NOT_REPRODUCED)
    reproduced / not reproduced
    """

    REPRODUCED = "reproduced"
    PARTLY = "partly reproduced"
    NOT_REPRODUCED = "not reproduced"
    ERRATUM = "erratum"
    UNDER_SPECIFIED = "under-specified"
    DERIVED = "derived (not claimed)"


@dataclass(frozen=True)
class Published:
    """A claim as the paper prints it: the fixed half, kept as data in the ``claims.toml`` of its study.

    ``found`` has a sentence for the verdict under which it was written, with fields that are filled from what is computed
    (`studies.sentence`); so has ``advice``, what a reader should do differently. ``claimed`` is False for what no paper
    claims and is computed because other claims rest on it.
    """

    id: str
    paper: str
    where: str
    statement: str
    published: JsonValue
    tolerance: str
    found: Mapping[str, str] = field(default_factory=dict)
    advice: str = ""
    claimed: bool = True


@dataclass(frozen=True, repr=False)
class Finding(Display):
    """Our half: the value computed now, the verdict that follows from it, and the reading under which it holds.

    >>> Finding(0.8, ClaimVerdict.REPRODUCED, "as printed").computed
    0.8
    """

    computed: JsonValue
    verdict: ClaimVerdict
    reading: str


@dataclass(frozen=True, repr=False)
class Claim(Display):
    """A published claim beside our finding.

    >>> from studies.claim import Published
    >>> printed = Published("two", "P1", "page 1", "Two and two is four", 4, "none")
    >>> Claim(printed, Finding(2 + 2, ClaimVerdict.REPRODUCED, "added")).row()["verdict"]
    'reproduced'
    """

    published: Published
    finding: Finding

    def row(self) -> dict[str, JsonValue]:
        """The entry of ``claims.json``."""
        p, f = self.published, self.finding
        return {
            "id": p.id, "paper": p.paper, "where": p.where, "statement": p.statement, "published": p.published,
            "computed": f.computed, "tolerance": p.tolerance, "verdict": str(f.verdict), "reading": f.reading,
            "claimed": p.claimed, "found": self._filled(p.found.get(f.verdict, "")), "advice": self._filled(p.advice),
        }  # fmt: skip

    def _filled(self, template: str) -> str:
        """The sentence, or which field of it has no value: a misspelt one costs no hours of computing, and tests refuse it."""
        try:
            return fill(template, self.finding.computed)
        except ValueError as error:
            return f"{SENTENCE_FAILS} ({error})"


ClaimFunction = Callable[[], Finding]
"""Computes one claim from the models and analyses; takes nothing and reads no stored result."""


def reproduced(holds: bool, otherwise: ClaimVerdict = ClaimVerdict.NOT_REPRODUCED) -> ClaimVerdict:
    """REPRODUCED when the computed value ``holds``, else ``otherwise``: a verdict follows from a comparison."""
    return ClaimVerdict.REPRODUCED if holds else otherwise


def agrees(computed: float, published: float, half_last_digit: float) -> bool:
    """Whether ``computed`` rounds to what is printed: closer than half the last printed digit (and never for NaN)."""
    return math.isfinite(computed) and abs(computed - published) <= half_last_digit * (1 + 1e-12)
