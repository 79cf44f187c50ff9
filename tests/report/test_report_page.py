"""The report in headless Chromium: wide, on a phone, in the dark and on paper."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from studies.run import run_studies
from studies.study import QUICK
from tests.support.browser import Page, find_chromium
from tests.support.study_fakes.registry import REGISTRY

HERE = Path(__file__).parent
WIDTHS = (390, 1280)

PICTURES = "[...document.images].map(i => i.naturalWidth)"
# Not window.innerWidth: a telephone zooms out until what hangs over is inside.
BREADTH = "document.documentElement.scrollWidth"
CONTRAST = (HERE / "contrast.js").read_text()


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    program = find_chromium()
    if program is None:
        missing = "Chromium is not installed (Debian: apt-get install chromium)"
        if os.environ.get("GAINSMITH_CHROMIUM") == "required":
            pytest.fail(missing)
        pytest.skip(missing)
    opened = Page(program, tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    run_studies(["alpha", "beta", "crash"], out, QUICK, 2, REGISTRY)
    return out / "report.html"


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", WIDTHS)
def test_it_reads_without_complaint(page: Page, report: Path, tmp_path: Path, width: int, dark: bool) -> None:
    page.show(report, width, dark=dark)
    assert page.complaints() == []
    assert len(page.evaluate(PICTURES)) == 2 and all(page.evaluate(PICTURES))
    assert page.evaluate(BREADTH) <= width
    assert page.evaluate(CONTRAST) == []
    page.screenshot(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 50_000


def test_wide_tables_scroll_in_their_own_box(page: Page, report: Path) -> None:
    page.show(report, 390)
    boxes = page.evaluate("[...document.querySelectorAll('.scroll')].map(b => b.scrollWidth - b.clientWidth)")
    assert max(boxes) > 100
    assert page.evaluate("[...document.querySelectorAll('.scroll')].every(b => b.tabIndex === 0)")
    assert page.evaluate("[...document.querySelectorAll('caption span')].every(s => s.offsetWidth < 390)")


def test_light_and_dark_differ_and_paper_is_light(page: Page, report: Path, tmp_path: Path) -> None:
    background = "getComputedStyle(document.body).backgroundColor"
    page.show(report, 1280)
    light = page.evaluate(background)
    page.show(report, 1280, dark=True)
    assert page.evaluate(background) != light
    page.show(report, 1280, dark=True, media="print")
    assert page.evaluate(background) == "rgb(255, 255, 255)"
    assert page.evaluate(CONTRAST) == []
    page.pdf(tmp_path / "page.pdf", dark=True)
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")


def test_scoreboard_picture_draws(page: Page, report: Path) -> None:
    page.show(report.with_name("scoreboard.svg"), 1280)
    assert page.complaints() == []
    inside = "[...document.querySelectorAll('text')].every(t => t.getBBox().x + t.getBBox().width < 880)"
    assert page.evaluate("document.documentElement.nodeName") == "svg" and page.evaluate(inside)


@pytest.mark.parametrize(
    ("body", "flaw"),
    [
        ("<script>console.error('no')</script>", "complaint"),
        ("<img src='https://example.org/a.png'>", "complaint"),
        ("<img src='data:image/png;base64,AAAA'>", "picture"),
        ("<div style='width: 500px'>wide</div>", "overhang"),
        ("<p style='color: #aaa; background: #fff'>pale</p>", "contrast"),
    ],
)
def test_the_checks_find_what_they_look_for(page: Page, tmp_path: Path, body: str, flaw: str) -> None:
    path = tmp_path / "bad.html"
    head = "<!doctype html><meta name=viewport content='width=device-width'><link rel=icon href='data:,'><body>"
    path.write_text(head + body)
    page.show(path, 390)
    found = {
        "complaint": bool(page.complaints()),
        "picture": not all(page.evaluate(PICTURES)),
        "overhang": page.evaluate(BREADTH) > 390,
        "contrast": page.evaluate(CONTRAST) != [],
    }
    assert found[flaw]
