"""What every part of a study must hand over: figures and tables that stand on their own, claims that can be stored."""

from __future__ import annotations

import json
import re
from typing import Any

from studies.claim import Claim, ClaimVerdict
from studies.plots import Figure, colours
from studies.plots.draw import draw
from studies.sentence import fill
from studies.study import Part, PartResult, Study


def check_study(study: Study) -> None:
    """Names are unique and fit for files, costs are positive."""
    names = [part.name for part in study.parts]
    assert len(names) == len(set(names)) and names
    assert all(re.fullmatch(r"[a-z0-9][a-z0-9-]*", name) for name in (study.id, *names))
    assert all(0.0 < part.cost <= 300.0 and part.title for part in study.parts)


def desk_parts(study: Study) -> list[Part]:
    """The parts that compute from models alone; drives of truth vehicles cost more and have tests of their own."""
    return [part for part in study.parts if part.cost <= 30.0 and not part.needs]


def check_result(result: PartResult) -> None:
    """Axes carry names and units, captions say something, rows fit their columns, claims are JSON."""
    for figure in result.figures:
        assert len(figure.caption) > 120 and len(figure.alternative) > 60, figure.name
        assert not nameless(figure), figure.name
        sheet = draw(figure)
        sheet.draw_without_rendering()
        for axis in sheet.axes:
            for label, wanted in ((axis.get_xlabel(), _bottom(axis)), (axis.get_ylabel(), _leftmost(axis))):
                if wanted or label:
                    assert label, f"{figure.name}: an axis has no name"
                    assert re.search(r"\[.+\]", label), f"{figure.name}: no unit in '{label}'"
    for table in result.tables:
        assert len(table.caption) > 60 and table.rows, table.name
        assert all(len(row) == len(table.columns) for row in table.rows), table.name
        json.dumps([list(row) for row in table.rows])
    for claim in result.claims:
        check_claim(claim)


def check_claim(claim: Claim) -> None:
    """It can be stored, and one sentence says what was found: filled in full, below 200 characters, no dump of values."""
    row = json.loads(json.dumps(claim.row(), allow_nan=False))
    assert row["reading"].endswith(".") and row["computed"] and row["verdict"] in set(ClaimVerdict)
    for template in (claim.published.found[row["verdict"]], claim.published.advice):
        fill(template, claim.finding.computed)  # raises for a field without a value
    check_sentence(row["found"])
    assert not row["advice"] or (row["advice"].endswith(".") and len(row["advice"]) < 200)


def check_sentence(text: str) -> None:
    """One sentence for readers: no keys, no brackets of dictionaries, no long digits, no truth values of a machine."""
    assert text.endswith(".") and 20 < len(text) < 200, text
    assert not re.search(r"[{}]|\w: [^;]*; \w+:|\bTrue\b|\bFalse\b|\bNone\b|\bnan\b|\d{8}|\d\.\d{8}|e[-+]\d\d", text), (
        text
    )


def nameless(figure: Figure) -> set[str]:
    """Colours of the marks of a figure that have no name in `studies.plots.colours`, greys and plain white and black apart."""
    named = {value for value in vars(colours).values() if isinstance(value, str)} | {"white", "black"}
    marks = [mark for row in figure.rows for panel in row if panel is not None for mark in panel.marks]
    used = [getattr(mark, key, "") for mark in marks for key in ("color", "edge")]
    flat = {c for entry in used for c in ([entry] if isinstance(entry, str) else entry)}
    return {c for c in flat - named if c and not re.fullmatch(r"0?\.\d+", c)}


def _bottom(axis: Any) -> bool:
    place = axis.get_subplotspec()
    words = any(re.search("[A-Za-z]{3}", label.get_text()) for label in axis.get_xticklabels())
    return place is not None and place.is_last_row() and not words  # categories name themselves


def _leftmost(axis: Any) -> bool:
    place = axis.get_subplotspec()
    return place is not None and place.is_first_col()
