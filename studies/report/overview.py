"""The first page: what holds, what does not, and what a reader should do differently."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from studies.claim import ClaimVerdict, JsonValue
from studies.report.scoreboard import is_published

Row = Mapping[str, JsonValue]
LONGEST = 200  # characters of a sentence
SAYINGS = {
    ClaimVerdict.REPRODUCED: "as printed",
    ClaimVerdict.PARTLY: "in part",
    ClaimVerdict.ERRATUM: "once a misprint is corrected",
    ClaimVerdict.NOT_REPRODUCED: "under no reading that we found",
    ClaimVerdict.UNDER_SPECIFIED: "depending on what the paper leaves open",
}
"""How a claim with a verdict holds."""
HOLDS = (ClaimVerdict.REPRODUCED, ClaimVerdict.ERRATUM, ClaimVerdict.PARTLY)
DOES_NOT = (ClaimVerdict.NOT_REPRODUCED, ClaimVerdict.UNDER_SPECIFIED)


@dataclass(frozen=True)
class Group:
    """Published claims of one verdict; ``how`` they hold."""

    verdict: ClaimVerdict
    how: str
    claims: tuple[Row, ...]


@dataclass(frozen=True)
class Overview:
    """Groups that hold and that do not, and claims with an advice, by paper."""

    holds: tuple[Group, ...]
    does_not: tuple[Group, ...]
    advice: dict[str, tuple[Row, ...]]


def overview(claims: Sequence[Row]) -> Overview:
    """Sort ``claims``, rows of ``claims.json``; an advice that several claims give is given once."""
    given: dict[str, Row] = {}
    for claim in claims:
        if claim.get("advice"):
            given.setdefault(str(claim["advice"]), claim)
    papers = dict.fromkeys(str(claim["paper"])[:2] for claim in given.values())
    return Overview(
        _groups(claims, HOLDS),
        _groups(claims, DOES_NOT),
        {paper: tuple(c for c in given.values() if str(c["paper"])[:2] == paper) for paper in papers},
    )


def _groups(claims: Sequence[Row], verdicts: Sequence[ClaimVerdict]) -> tuple[Group, ...]:
    published = [claim for claim in claims if is_published(claim)]
    groups = (
        Group(verdict, SAYINGS[verdict], tuple(claim for claim in published if claim["verdict"] == verdict))
        for verdict in verdicts
    )
    return tuple(group for group in groups if group.claims)


def sentence(claim: Row) -> str:
    """What was found: the claim's own sentence, else the first one of its reading, at most 200 characters."""
    text = str(claim.get("found") or "") or re.split(r"(?<=[.:;]) ", str(claim["reading"]))[0]
    if len(text) <= LONGEST:
        return text
    return text[: text.rfind(" ", 0, LONGEST - 2)].rstrip(" ,;:") + " …"
