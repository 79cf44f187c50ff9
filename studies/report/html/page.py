"""Fills the templates of the report; figures become data URIs, so that the page needs no other file."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from functools import cache
from hashlib import sha256
from importlib import resources
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from studies.claim import ClaimVerdict, JsonValue
from studies.report.html.text import alignments, anchor, brief, cell, counted, fits, label, number, prose
from studies.report.mathml import squared
from studies.report.overview import overview, sentence
from studies.report.pictures import pictures
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
    made.filters |= {"slug": slug, "squared": squared}
    made.globals |= {"verdicts": list(ClaimVerdict), "marks": MARKS, "meanings": MEANINGS}
    made.globals |= {"alignments": alignments, "fits": fits, "counted": counted, "sentence": sentence}
    return made


def slug(verdict: str) -> str:
    """The verdict as a class name: ``not-reproduced``."""
    return anchor(str(verdict).partition(" (")[0])


def script() -> tuple[Markup, str]:
    """The one script of the page, and its hash as a Content-Security-Policy names it: no other one runs."""
    text = (resources.files("studies.report") / "html" / "search.js").read_text(encoding="utf-8")
    return Markup(text), f"sha256-{b64encode(sha256(text.encode()).digest()).decode()}"


def report_page(records: Sequence[StudyRecord], claims: Sequence[dict[str, JsonValue]], board: Scoreboard) -> str:
    """The whole page as text."""
    drawings = pictures(
        [(part.folder, f["name"]) for record in records for part in record.stored for f in part.figures]
    )
    return filled(
        "report.html.jinja", records=records, claims=claims, board=board, first=overview(claims), pictures=drawings
    )


def filled(template: str, **values: Any) -> str:
    """A page that looks like the report."""
    text, digest = script()
    return environment().get_template(template).render(values, script=text, digest=digest)
