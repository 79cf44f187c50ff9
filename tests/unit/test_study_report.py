"""The report and the scoreboard picture as documents: nothing missing, nothing unescaped, every link leads somewhere."""

from __future__ import annotations

import json
import re
from base64 import b64decode, b64encode
from collections import Counter
from hashlib import sha256
from html.parser import HTMLParser
from io import BytesIO
from itertools import pairwise, product
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from studies.claim import ClaimVerdict
from studies.plots import Figure, Line, Panel
from studies.plots.save import save_figure
from studies.report.html.text import alignments, brief, cell, label, number, prose
from studies.report.pictures import LARGEST_SVG, picture, pictures
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
        self._styles = tag in ("style", "script")

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
    assert page.text.count('tags <b>& quotes" stay text') == 4  # overview, table, the claim's own line and its reading
    assert page.text.count("The root is 1.414 m: ") == 3 and page.text.count("Take the positive root, 1.41 m.") == 2
    assert "12 seeds & <more>." in page.text
    assert "tags <b>" not in (out / "report.html").read_text()
    assert len(page.named("img")) == 2 and len(page.named("table")) == 5
    assert "ZeroDivisionError: no number to divide by" in page.text
    assert "without a computed value: P2-lost" in page.text


def test_truth_values_are_words(page: Elements, out: Path) -> None:
    assert not re.search("true|false", page.text, re.IGNORECASE)
    document = (out / "report.html").read_text()
    assert document.count(">yes</td>") == 2 and document.count(">no</td>") == 1  # a column of a table


def test_the_page_needs_nothing_else(page: Elements) -> None:
    assert len(page.named("script")) == 1
    for tag, attributes in page.tags:
        for name in ("src", "href", "srcset", "data"):
            target = attributes.get(name)
            assert target is None or target.startswith(("data:", "#")), (tag, target)
        assert not [name for name in attributes if name.startswith("on")]


def test_only_the_one_script_may_run(out: Path, page: Elements) -> None:
    document = (out / "report.html").read_text()
    (text,) = re.findall(r"<script>(.*?)</script>", document, re.DOTALL)
    (policy,) = [m["content"] for m in page.named("meta") if m.get("http-equiv") == "Content-Security-Policy"]
    digest = b64encode(sha256(text.encode()).digest()).decode()
    assert policy is not None and f"script-src 'sha256-{digest}'" in policy and policy.startswith("default-src 'none'")
    assert "unsafe-eval" not in policy and "innerHTML" not in text and "fetch" not in text


def test_the_first_page_counts_what_papers_claim_and_what_is_derived(page: Elements, out: Path) -> None:
    claims = json.loads((out / "claims.json").read_text())
    assert [claim["claimed"] for claim in claims].count(True) == 6
    assert "6 published claims, recomputed" in page.text and "1 derived result beside them" in page.text
    ids = [attributes.get("id") for _, attributes in page.tags]
    order = [ids.index(name) for name in ("holds", "does-not", "differently", "scoreboard", "claims", "alpha")]
    assert order == sorted(order)


def test_all_but_the_sentences_folds(page: Elements) -> None:
    claims = [attributes for attributes in page.named("details") if attributes.get("class") == "claim"]
    assert len(claims) == 7 and not any("open" in attributes for attributes in claims)
    assert page.text.count("All numbers of this claim") == 7


def test_the_page_weighs_no_more_than_its_budget(out: Path) -> None:
    drawings = [(out / "alpha" / "figures", name) for name in ("sine", "cloud")]
    full, small = (pictures(drawings, budget) for budget in (10_000_000, 24_000))
    weigh = {name: len(made.uri) for (_, name), made in small.items()}
    assert all(made.uri.startswith("data:image/svg+xml") for (_, n), made in full.items() if n == "sine")
    assert all(made.uri.startswith("data:image/webp") for made in small.values())
    assert sum(weigh.values()) < 1.4 * 24_000 < sum(len(made.uri) for made in full.values())
    assert {n: (m.width, m.height) for (_, n), m in small.items()} == {
        n: (m.width, m.height) for (_, n), m in full.items()
    }


def test_few_colours_keep_paper_grid_and_the_thinnest_curve(tmp_path: Path) -> None:
    x = np.linspace(0.0, 1.0, 400)
    noise = np.random.default_rng(3).standard_normal((8, 400))
    curves = [Line(x, y, color=c) for y, c in zip(noise, ("#0b62a4", "#c1272d", "#1b7f5c", "#7b3294") * 2, strict=True)]
    rare = Line([0.0, 1.0], [6.0, 6.0], color="#e08214", width=1.5)
    save_figure(Figure("curves", "c", "a", Panel([*curves, rare], "x [m]", "y [m]")), tmp_path)
    (made,) = pictures([(tmp_path, "curves")], 90_000).values()
    shown = (
        np.asarray(Image.open(BytesIO(b64decode(made.uri.partition(",")[2]))).convert("RGB")).reshape(-1, 3).astype(int)
    )
    for wanted in ((255, 255, 255), (0x0B, 0x62, 0xA4), (0xC1, 0x27, 0x2D), (0xE0, 0x82, 0x14), (0xE0, 0xE0, 0xE0)):
        assert (np.abs(shown - wanted).max(axis=1) <= 16).sum() > 100, wanted
    assert (shown == 255).all(axis=1).mean() > 0.3  # the paper is white, not nearly


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
    published = sum(i % 6 != 5 for i in range(most))  # every sixth is derived
    heading = {0: "beyond the papers", 1: "1 published claim, "}.get(most, f"{published} published claims, ")
    assert heading in "".join(root.itertext())


def overlap(a: tuple[float, float], b: tuple[float, float], side: float) -> bool:
    return abs(a[0] - b[0]) < side and abs(a[1] - b[1]) < side


@pytest.mark.parametrize(
    ("value", "shown"),
    [(None, "–"), (True, "yes"), (-0.0, "0"), (3, "3"),
     (1234567, "1234567"), (1 / 3, "0.33333"), (1.5e9, "1.5e9"), (2e-9, "2e-9"),
     ("0.9960", "0.9960")],
)  # fmt: skip
def test_cells_read_well(value: Any, shown: str) -> None:
    assert cell(value) == shown


def test_values_and_texts() -> None:
    assert number(-327.143005949) == "-327.143"
    assert brief({"a": [1, 2.5], "b": {"c": None}, "d": [[1], [2]]}) == "a: 1, 2.5; b: c: –; d: [1, 2]"
    assert brief("x" * 200, 20) == "x" * 19 + " …"
    assert brief({"one": 1 / 3, "two": 2, "three": 3}, 22, 3) == "one: 0.333; two: 2 …"
    assert [label(key) for key in ("decay_rate_1_s", "omega=40", "largest_N", "_N")] == [
        "decay rate [1/s]", "omega=40", "largest [N]", " N"
    ]  # fmt: skip
    assert prose("<a> `b<c` d") == "&lt;a&gt; <code>b&lt;c</code> d"
    assert prose("one ` alone") == "one ` alone"
    assert alignments(("a", "b", "c"), [("x", 1, "1.5 ± 0.2"), ("y", None, "< 3")]) == ["text", "number", "number"]
