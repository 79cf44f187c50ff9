"""The report and the scoreboard picture as documents: nothing missing, nothing unescaped, every link leads somewhere."""

from __future__ import annotations

import json
import re
from collections import Counter
from html.parser import HTMLParser
from itertools import pairwise, product
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from studies.claim import ClaimVerdict
from studies.report.html.page import LARGEST_SVG, picture
from studies.report.html.text import alignments, brief, cell, label, number, prose
from studies.report.scoreboard import MARKS, MEANINGS, scoreboard
from studies.report.scoreboard_picture import scoreboard_svg
from studies.run import run_studies
from studies.study import QUICK
from tests.support.study_fakes.registry import REGISTRY

SVG = "{http://www.w3.org/2000/svg}"


class Elements(HTMLParser):
    """Start tags with their attributes, and the text that is shown."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self._styles = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._styles = tag == "style"

    def handle_endtag(self, tag: str) -> None:
        self._styles = False

    def handle_data(self, data: str) -> None:
        if not self._styles:
            self.text += data

    def named(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    run_studies(["alpha", "beta"], folder, QUICK, 2, REGISTRY)
    return folder


@pytest.fixture(scope="module")
def page(out: Path) -> Elements:
    return Elements((out / "report.html").read_text())


def test_every_claim_figure_table_and_failure_is_shown(page: Elements, out: Path) -> None:
    ids = {attributes.get("id") for _, attributes in page.tags}
    claims = json.loads((out / "claims.json").read_text())
    assert len(claims) == 7
    for claim in claims:
        assert f"claim-{claim['id']}" in ids
        assert page.text.count(claim["statement"]) == 2  # in the table of all claims, and where it is judged
    assert page.text.count('tags <b>& quotes" stay text') == 1
    assert "12 seeds & <more>." in page.text
    assert not page.named("b")
    assert len(page.named("img")) == 2 and len(page.named("table")) == 4
    assert "ZeroDivisionError: no number to divide by" in page.text
    assert "without a computed value: P2-lost" in page.text


def test_truth_values_are_words(page: Elements, out: Path) -> None:
    assert not re.search("true|false", page.text, re.IGNORECASE)
    document = (out / "report.html").read_text()
    assert document.count(">yes</td>") == 3 and document.count(">no</td>") == 1  # a claim, and a column of a table


def test_the_page_needs_nothing_else(page: Elements) -> None:
    assert not page.named("script")
    for tag, attributes in page.tags:
        for name in ("src", "href", "srcset", "data"):
            target = attributes.get(name)
            assert target is None or target.startswith(("data:", "#")), (tag, target)
        assert not [name for name in attributes if name.startswith("on")]


def test_links_lead_somewhere_and_names_are_unique(page: Elements) -> None:
    ids = [name for _, attributes in page.tags if (name := attributes.get("id"))]
    assert max(Counter(ids).values()) == 1
    known = set(ids)
    for attributes in page.named("a"):
        assert (attributes["href"] or "")[1:] in known
    for _, attributes in page.tags:
        assert set((attributes.get("aria-labelledby") or "").split()) <= known


def test_readers_who_cannot_see_it_are_told(page: Elements) -> None:
    assert page.named("html")[0]["lang"] == "en"
    assert all(len(attributes["alt"] or "") > 10 for attributes in page.named("img"))
    assert all(attributes.get("scope") in ("col", "row") for attributes in page.named("th"))
    assert len(page.named("caption")) == len(page.named("table"))
    assert len(page.named("figcaption")) == len(page.named("figure")) == 2
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_without_claims_there_is_no_scoreboard(tmp_path: Path) -> None:
    run_studies(["crash"], tmp_path, QUICK, 2, REGISTRY)
    shown = Elements((tmp_path / "report.html").read_text())
    ids = {attributes.get("id") for _, attributes in shown.tags}
    assert "Studies beyond the papers" in shown.text and not ids & {"scoreboard", "claims"}
    assert all((attributes["href"] or "")[1:] in ids for attributes in shown.named("a"))


def test_large_drawings_become_pixels_and_keep_their_size(out: Path) -> None:
    small, large = (picture(out / "alpha" / "figures", name) for name in ("sine", "cloud"))
    assert small.uri.startswith("data:image/svg+xml;base64,") and large.uri.startswith("data:image/png;base64,")
    assert (out / "alpha" / "figures" / "cloud.svg").stat().st_size > LARGEST_SVG
    assert large.width == pytest.approx(4.0 * 96, abs=2) and large.height == pytest.approx(3.0 * 96, abs=2)


@pytest.mark.parametrize("name", ["sine", "cloud"])
def test_figures_carry_no_date(out: Path, name: str) -> None:
    assert "<dc:date>" not in (out / "alpha" / "figures" / f"{name}.svg").read_text()


def claim(paper: str, index: int, verdict: ClaimVerdict) -> dict[str, Any]:
    return {"id": f"{paper}-{index} <&", "paper": paper, "verdict": str(verdict)}


def test_scoreboard_counts_by_paper_and_verdict() -> None:
    claims = [claim(paper, i, verdict) for paper in ("P5", "P1/P2", "P1") for i, verdict in enumerate(ClaimVerdict)]
    board = scoreboard([*claims, claim("P5", 9, ClaimVerdict.ERRATUM)], {"P1": "corner-estimation"})
    assert [(paper.paper, paper.name, len(paper.claims)) for paper in board.papers] == [
        ("P1", "corner-estimation", 12), ("P5", "", 7)
    ]  # fmt: skip
    assert board.total == 19 and board.count(ClaimVerdict.ERRATUM) == 4
    assert board.papers[1].count(ClaimVerdict.ERRATUM) == 2
    assert set(MARKS) == set(MEANINGS) == set(ClaimVerdict) and len(set(MARKS.values())) == len(ClaimVerdict)


@pytest.mark.parametrize("most", [0, 1, 69, 130])
def test_scoreboard_picture_has_a_square_for_each_claim_inside_its_frame(most: int) -> None:
    verdicts = list(ClaimVerdict)
    claims = [claim("P3" if i % 3 else "P1", i, verdicts[i % 6]) for i in range(most)]
    root = ElementTree.fromstring(scoreboard_svg(scoreboard(claims, {})))
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    frame, *squares = root.iter(f"{SVG}rect")
    assert float(frame.attrib["width"]) == width - 1
    assert len(squares) == most + len(ClaimVerdict)
    places = [(float(s.attrib["x"]), float(s.attrib["y"])) for s in squares]
    side = float(squares[0].attrib["width"])
    assert all(0 < x < width - side and 0 < y < height - side for x, y in places)
    assert not [1 for i, (a, b) in enumerate(product(places, places)) if a < b and overlap(a, b, side)]
    heading = {0: "beyond the papers", 1: "1 published claim, "}.get(most, f"{most} published claims, ")
    assert heading in "".join(root.itertext())


def overlap(a: tuple[float, float], b: tuple[float, float], side: float) -> bool:
    return abs(a[0] - b[0]) < side and abs(a[1] - b[1]) < side


@pytest.mark.parametrize(
    ("value", "shown"),
    [(None, "–"), (True, "yes"), (3, "3"), (1234567, "1234567"), (1 / 3, "0.33333"), (1.5e9, "1.5e9"), (2e-9, "2e-9"),
     ("0.9960", "0.9960")],
)  # fmt: skip
def test_cells_read_well(value: Any, shown: str) -> None:
    assert cell(value) == shown


def test_values_and_texts() -> None:
    assert number(-327.143005949) == "-327.143"
    assert brief({"a": [1, 2.5], "b": {"c": None}}) == "a: [1, 2.5]; b: c: –"
    assert brief("x" * 200, 20) == "x" * 19 + " …"
    assert brief({"one": 1 / 3, "two": 2, "three": 3}, 22, 3) == "one: 0.333; two: 2 …"
    assert [label(key) for key in ("decay_rate_1_s", "omega=40", "largest_N", "_N")] == [
        "decay rate [1/s]", "omega=40", "largest [N]", " N"
    ]  # fmt: skip
    assert prose("<a> `b<c` d") == "&lt;a&gt; <code>b&lt;c</code> d"
    assert prose("one ` alone") == "one ` alone"
    assert alignments(("a", "b", "c"), [("x", 1, "1.5 ± 0.2"), ("y", None, "< 3")]) == ["text", "number", "number"]
