"""Fills the templates of the report."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined

from studies.claim import ClaimVerdict, JsonValue
from studies.report.html.pictures import picture
from studies.report.html.text import alignments, anchor, brief, cell, fits, label, number, prose
from studies.report.scoreboard import MARKS, MEANINGS, Scoreboard

if TYPE_CHECKING:
    from studies.parts.record import StudyRecord


@cache
def environment() -> Environment:
    """Templates of this folder: everything is escaped, a misspelt name is an error."""
    made = Environment(
        loader=PackageLoader("studies.report", "html"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    made.filters |= {"number": number, "cell": cell, "brief": brief, "prose": prose, "anchor": anchor, "label": label}
    made.filters["slug"] = slug
    made.globals |= {"verdicts": list(ClaimVerdict), "marks": MARKS, "meanings": MEANINGS}
    made.globals |= {"picture": picture, "alignments": alignments, "fits": fits}
    return made


def slug(verdict: str) -> str:
    """The verdict as a class name: ``not-reproduced``."""
    return anchor(str(verdict).partition(" (")[0])


def report_page(records: Sequence[StudyRecord], claims: Sequence[dict[str, JsonValue]], board: Scoreboard) -> str:
    """The whole page as text."""
    owner = {claim["id"]: record.id for record in records for claim in record.claims}
    return environment().get_template("report.html.jinja").render(
        records=records, claims=claims, board=board, owner=owner
    )  # fmt: skip
