"""Fills the templates of the report; figures become data URIs, so that the page needs no other file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined

from studies.claim import ClaimVerdict, JsonValue
from studies.report.html.text import alignments, anchor, brief, cell, fits, label, number, prose
from studies.report.scoreboard import MARKS, MEANINGS, Scoreboard

if TYPE_CHECKING:
    from studies.parts.record import StudyRecord


import re
from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path

# Drawings of tens of thousands of points are vectors of megabytes; up to here the sharper form is worth its size.
LARGEST_SVG = 160_000
POINT = 96.0 / 72.0  # CSS pixels


@dataclass(frozen=True)
class Picture:
    """An image source and its size in CSS pixels."""

    uri: str
    width: int
    height: int


def picture(folder: Path, name: str) -> Picture:
    """``name.svg`` of ``folder``, or ``name.png`` when the SVG is large and the PNG smaller; ValueError for a foreign SVG."""
    svg, png = (folder / f"{name}.{kind}" for kind in ("svg", "png"))
    content = svg.read_bytes()
    head = content[:2000].decode(errors="replace")
    size = [re.search(rf'<svg[^>]*\s{side}="([\d.]+)pt"', head) for side in ("width", "height")]
    if size[0] is None or size[1] is None:
        raise ValueError(f"{svg}: no width and height in points")
    width, height = (round(float(found[1]) * POINT) for found in size if found is not None)
    kind = "svg+xml"
    if len(content) > LARGEST_SVG and png.stat().st_size < len(content):
        content, kind = png.read_bytes(), "png"
    return Picture(f"data:image/{kind};base64,{b64encode(content).decode()}", width, height)


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
