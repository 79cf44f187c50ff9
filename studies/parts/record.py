"""Studies as they lie on disk after a run: what the results and the report are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from studies.claim import JsonValue, paper_rank
from studies.parts.marks import Marks
from studies.parts.store import StoredPart, check_names, part_folder, read_part
from studies.registry import Registry
from studies.study import Preparation, Scope, Study
from synthesis.errors import SpecError


@dataclass(frozen=True)
class PartRecord:
    """A part: ``stored`` is what it found, or None and ``failure`` says why not."""

    name: str
    title: str
    stored: StoredPart | None
    failure: str = ""


@dataclass(frozen=True)
class StudyRecord:
    """A study: its parts in their order, the ids of the published claims that no part delivered, the titles of parts left out."""

    id: str
    title: str
    paper: str
    summary: str
    scope: Scope
    fingerprint: str
    parts: tuple[PartRecord, ...]
    missing_claims: tuple[str, ...] = field(default=())
    left_out: tuple[str, ...] = field(default=())

    @property
    def stored(self) -> list[StoredPart]:
        """The parts that there are."""
        return [part.stored for part in self.parts if part.stored is not None]

    @property
    def incomplete(self) -> bool:
        """Whether a part or a published claim is missing."""
        return bool(self.missing_claims) or any(part.failure for part in self.parts)

    @property
    def claims(self) -> list[dict[str, JsonValue]]:
        """All claims as rows of ``claims.json``."""
        return [claim for part in self.stored for claim in part.claims]


def record_study(
    study: Study, registry: Registry, out: Path, marks: Marks, failures: Mapping[tuple[str, str], str]
) -> StudyRecord:
    """Read the parts of ``study`` with their fingerprints from ``out``; ``failures`` are messages by (study, part).

    A part whose table, figure or claim has a name that an earlier part uses is a failure, as one would hide the other.
    """
    taken: set[tuple[str, str]] = set()
    parts: list[PartRecord] = []
    chosen = study.chosen(marks.scope)
    for part in chosen:
        failure = failures.get((study.id, part.name), "")
        stored = None if failure else read_part(part_folder(out, study.id, part.name), marks.part(part))
        failure = failure or ("" if stored else "it has no stored result")
        if stored is not None:
            names = _names(stored)
            failure = ", ".join(f"{what} '{name}' is already there" for what, name in names if (what, name) in taken)
            taken |= set(names)
        parts.append(PartRecord(part.name, part.title, None if failure else stored, failure))
    about = study.id, study.title, study.paper, study.summary
    record = StudyRecord(*about, marks.scope, marks.study(study.id), tuple(parts))
    found = {str(claim["id"]) for claim in record.claims}
    missing = tuple(name for name in registry.claim_ids(study.id) if name not in found)
    left_out = tuple(part.title for part in study.parts if part not in chosen)
    return replace(record, missing_claims=missing, left_out=left_out)


def _names(stored: StoredPart) -> list[tuple[str, str]]:
    return [
        *(("table", table["name"]) for table in stored.tables),
        *(("figure", figure["name"]) for figure in stored.figures),
        *(("claim", str(claim["id"])) for claim in stored.claims),
    ]


def check_parts(studies: Sequence[Study]) -> None:
    """Raises SpecError when a name cannot be that of a folder, when two parts have one name, or two preparations."""
    known: dict[str, Preparation] = {}
    for study in studies:
        needs = [need for part in study.parts for need in part.needs]
        try:
            check_names("part", [part.name for part in study.parts])
            check_names("preparation", list(dict.fromkeys(need.name for need in needs)))
        except ValueError as error:
            raise SpecError(f"study '{study.id}': {error}") from error
        for need in needs:
            if known.setdefault(need.name, need) != need:
                raise SpecError(f"study '{study.id}': another preparation is called '{need.name}', too")


def all_claims(records: Sequence[StudyRecord]) -> list[dict[str, JsonValue]]:
    """Every claim of every study, P1 to P5, in the order of studies and parts within a paper.

    Raises SpecError when two studies deliver one claim.
    """
    claims = [claim for record in records for claim in record.claims]
    seen: set[str] = set()
    for claim in claims:
        if claim["id"] in seen:
            raise SpecError(f"claim '{claim['id']}' is delivered by two studies; leave it to one")
        seen.add(str(claim["id"]))
    return sorted(claims, key=lambda claim: paper_rank(str(claim["paper"])))
