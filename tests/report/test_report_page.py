"""The report in headless Chromium: wide, on a phone, in the dark and on paper."""

from __future__ import annotations

from pathlib import Path

import pytest

from estimators.schedule import SHIPPED, read_content
from studies.report.frozen_levels import frozen_levels
from studies.report.schedules import schedules_page
from studies.run import run_studies
from studies.schedules import ScheduleRun
from studies.study import QUICK
from synthesis.certificate.proof import Proof
from tests.support.browser import Page
from tests.support.study_fakes.registry import REGISTRY

HERE = Path(__file__).parent
WIDTHS = (390, 1280)

PICTURES = "[...document.images].map(i => i.naturalWidth)"
# Not window.innerWidth: a telephone zooms out until what hangs over is inside.
BREADTH = "document.documentElement.scrollWidth"
CONTRAST = (HERE / "contrast.js").read_text()
UNFOLD = "document.querySelectorAll('details').forEach(d => { d.open = true })"
SEEN = "(r => r.top >= 0 && r.bottom <= innerHeight)(document.querySelector('nav a').getBoundingClientRect())"


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
    page.evaluate(UNFOLD)
    assert page.evaluate(BREADTH) <= width
    assert page.evaluate(CONTRAST) == []
    page.screenshot(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 50_000


def test_wide_tables_scroll_in_their_own_box(page: Page, report: Path) -> None:
    page.show(report, 390)
    page.evaluate(UNFOLD)
    boxes = page.evaluate("[...document.querySelectorAll('.scroll')].map(b => b.scrollWidth - b.clientWidth)")
    assert max(boxes) > 100
    assert page.evaluate("[...document.querySelectorAll('.scroll')].every(b => b.tabIndex === 0)")
    assert page.evaluate("[...document.querySelectorAll('caption span')].every(s => s.offsetWidth < 390)")


@pytest.mark.parametrize("width", WIDTHS)
def test_the_contents_stay_in_view(page: Page, report: Path, width: int) -> None:
    page.show(report, width)
    for place in ("0", "document.body.scrollHeight / 2", "document.body.scrollHeight"):
        page.evaluate(f"scrollTo(0, {place})")
        assert page.evaluate(SEEN), place
    page.evaluate("document.querySelector('nav').style.position = 'static'; scrollTo(0, document.body.scrollHeight)")
    assert not page.evaluate(SEEN)  # the check sees a list that scrolls away


def test_a_search_finds_formulas_and_what_is_folded_and_leads_there(page: Page, report: Path) -> None:
    page.show(report, 1280)
    ask = "(() => {{ const f = document.querySelector('input[type=search]'); f.value = {!r}; f.dispatchEvent(new Event('input'));"
    ask += "return [...document.querySelectorAll('.search ol a')].map(a => a.getAttribute('href')) }})()"
    assert page.evaluate(ask.format("sigma2 ROOT")) == ["#claim-P1-root"]
    assert "#alpha-figure-sine" in page.evaluate(ask.format("sine over time"))
    assert page.evaluate(ask.format("no such word")) == []
    page.evaluate(ask.format("sine over time"))
    page.evaluate("document.querySelector('.search ol a').click()")
    assert page.evaluate("document.getElementById('alpha-figure-sine').getBoundingClientRect().height") > 100
    assert page.complaints() == []


def test_folded_claims_open_for_a_link_and_on_paper(page: Page, report: Path) -> None:
    page.show(report, 1280)
    card = "document.getElementById('claim-P1-root')"
    assert not page.evaluate(f"{card}.open")
    page.evaluate("location.hash = '#claim-P1-root'")
    assert page.evaluate(f"new Promise(done => setTimeout(() => done({card}.open), 50))")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate("[...document.querySelectorAll('details')].every(d => d.open)")


def test_no_other_script_runs(page: Page, report: Path, tmp_path: Path) -> None:
    altered = tmp_path / "report.html"
    altered.write_text(report.read_text().replace("</main>", "<script>window.ran = 1</script></main>"))
    page.show(altered, 1280)
    assert page.evaluate("window.ran === undefined") and any(
        "Content Security Policy" in text for text in page.complaints()
    )


def test_the_page_of_a_schedule_looks_like_the_report(page: Page, tmp_path: Path) -> None:
    content = read_content(SHIPPED / "resilient-velocity-lateral.json")
    proofs = tuple(Proof(level.claim, level.kind, level.level, level.unit, True) for level in frozen_levels(content))
    path = tmp_path / "schedules.html"
    path.write_text(schedules_page([ScheduleRun("resilient-velocity-lateral", "same", 1.0, "", content, proofs)]))
    for width, dark in ((390, True), (1280, False)):
        page.show(path, width, dark=dark)
        page.evaluate(UNFOLD)
        assert page.complaints() == [] and page.evaluate(CONTRAST) == [] and page.evaluate(BREADTH) <= width
        assert page.evaluate(SEEN) and all(page.evaluate(PICTURES))


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
