"""The scoreboard: how many claims of each paper came to which verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from studies.claim import PAPERS, ClaimVerdict, JsonValue, paper_rank

MARKS = {
    ClaimVerdict.REPRODUCED: "✓", ClaimVerdict.PARTLY: "½", ClaimVerdict.NOT_REPRODUCED: "✗", ClaimVerdict.ERRATUM: "!",
    ClaimVerdict.UNDER_SPECIFIED: "?", ClaimVerdict.DERIVED: "+",
}  # fmt: skip
"""A sign for each verdict, so that none is told by its colour alone."""

MEANINGS = {
    ClaimVerdict.REPRODUCED: "our value agrees with the printed one within half its last digit",
    ClaimVerdict.PARTLY: "part of the claim holds, the reading says which",
    ClaimVerdict.NOT_REPRODUCED: "under no reading that we found does our value agree",
    ClaimVerdict.ERRATUM: "the paper prints a formula or number that contradicts itself; the reading corrects it",
    ClaimVerdict.UNDER_SPECIFIED: "the paper leaves open what the number depends on; "
    "the reading says under which choice it holds",
    ClaimVerdict.DERIVED: "not claimed by the paper, and computed here because other claims rest on it",
}


def is_published(claim: Mapping[str, JsonValue]) -> bool:
    """Whether a paper claims it; results derived because claims rest on them are no published claims."""
    return bool(claim.get("claimed", claim["verdict"] != ClaimVerdict.DERIVED))


@dataclass(frozen=True)
class PaperScore:
    """One row: the claims of ``paper`` (P1..P5, or "other") in order, ``name`` the study that computes them."""

    paper: str
    name: str
    claims: tuple[dict[str, JsonValue], ...]

    @property
    def published(self) -> int:
        """Claims that the paper makes."""
        return sum(is_published(claim) for claim in self.claims)

    @property
    def derived(self) -> int:
        """Results that the paper does not claim."""
        return len(self.claims) - self.published

    def count(self, verdict: ClaimVerdict) -> int:
        """Claims with ``verdict``."""
        return sum(claim["verdict"] == verdict for claim in self.claims)


@dataclass(frozen=True)
class Scoreboard:
    """All papers that have claims, P1 first."""

    papers: tuple[PaperScore, ...]

    @property
    def total(self) -> int:
        """Claims altogether."""
        return sum(len(paper.claims) for paper in self.papers)

    @property
    def published(self) -> int:
        """Claims that a paper makes."""
        return sum(paper.published for paper in self.papers)

    @property
    def derived(self) -> int:
        """Results that no paper claims, computed because claims rest on them."""
        return self.total - self.published

    @property
    def heading(self) -> str:
        """What the board shows, as a title."""
        if self.total == 0:
            return "Studies beyond the papers"
        return f"{self.published} published claim{'' if self.published == 1 else 's'}, recomputed"

    def count(self, verdict: ClaimVerdict) -> int:
        """Claims of all papers with ``verdict``."""
        return sum(paper.count(verdict) for paper in self.papers)


def scoreboard(claims: Sequence[dict[str, JsonValue]], names: Mapping[str, str]) -> Scoreboard:
    """Sort ``claims`` (rows of ``claims.json``) by paper; ``names`` are study ids by paper."""
    labels = (*PAPERS, "other")
    grouped: dict[str, list[dict[str, JsonValue]]] = {label: [] for label in labels}
    for claim in claims:
        grouped[labels[paper_rank(str(claim["paper"]))]].append(claim)
    papers = (PaperScore(paper, names.get(paper, ""), tuple(rows)) for paper, rows in grouped.items() if rows)
    return Scoreboard(tuple(papers))
