"""Every citation leads somewhere that is shipped: to a section, or an item of a section, of the notes.md of a paper."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("estimators", "synthesis", "analysis", "studies", "tests", "gainsmith")
PAPERS = {
    "P1": "corner_estimation", "P2": "longitudinal_speed", "P3": "resilient_velocity", "P4": "ekf_ukf_lateral",
    "P5": "smo_ekf_sideslip",
}  # fmt: skip
NOTES = re.compile(r"\b(P[1-5]) notes (\d+)(?:,? item (\d+))?")
AWAY = re.compile(
    r"\bP[1-5](?:'s)?,? (?:sheet|sections? \d)|\bsheet,? section|\bsection \d+ item|\(DESIGN\b(?![_),])|; DESIGN\b|\(DESIGN, c"
)


def texts() -> list[tuple[Path, str]]:
    found = [
        path
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {".py", ".pyi", ".toml", ".md", ".bib"} and path.name != Path(__file__).name
    ]
    return [(path, path.read_text("utf-8")) for path in [*found, ROOT / "README.md"]]


def sections(paper: str) -> dict[int, str]:
    """The sections of a paper's notes by number."""
    text = (ROOT / "studies" / "papers" / PAPERS[paper] / "notes.md").read_text("utf-8")
    parts = re.split(r"^## (\d+) ", text, flags=re.MULTILINE)
    return {int(number): part for number, part in zip(parts[1::2], parts[2::2], strict=True)}


def leads(paper: str, number: str, item: str) -> bool:
    section = sections(paper).get(int(number))
    return section is not None and (not item or re.search(rf"^{item}\. ", section, flags=re.MULTILINE) is not None)


@pytest.mark.parametrize("paper", PAPERS)
def test_notes_are_numbered_without_a_gap(paper: str) -> None:
    found = sections(paper)
    assert list(found) == list(range(1, len(found) + 1))
    assert len(found) >= 4 and all(len(text) > 60 for text in found.values())


def test_everything_cited_of_the_notes_is_there() -> None:
    cited = [(path, found) for path, text in texts() for found in NOTES.findall(" ".join(text.split()))]
    assert len(cited) > 60
    assert not [f"{path.relative_to(ROOT)}: {found}" for path, found in cited if not leads(*found)]
    assert not leads("P1", "99", "") and not leads("P1", "11", "99") and leads("P1", "11", "1")


def test_nothing_cites_what_is_not_shipped() -> None:
    wrong = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path, text in texts()
        for match in AWAY.finditer(" ".join(text.split()))
    ]
    assert not wrong


def test_the_pattern_finds_what_it_must() -> None:
    for text in (
        "P1 section 9",
        "P3 sheet, section 4",
        "section 11 item 6",
        "(DESIGN, conditioning)",
        "P1 sections 5 to 7",
    ):
        assert AWAY.search(text)
    for text in ("P1 section IV", "DESIGN_SPEED", "design(model, DESIGN)", "P1 notes 9", "P4 section IV-A"):
        assert not AWAY.search(text)
