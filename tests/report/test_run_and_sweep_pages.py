"""The pages of `gainsmith run --report` and `gainsmith sweep --report`: what they say, and how they look."""

from __future__ import annotations

from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimators import Flag
from estimators.pipeline import Check
from studies.cli import main
from studies.drives.evaluation import evaluate
from studies.drives.plots import velocity
from studies.drives.raised import CHECKS, FLAGS, Raised
from studies.drives.run import RunResult, replay_drive
from studies.execution.processes import Serial
from studies.plots import Axis, Band, Figure, Line, Panel
from studies.report.drive import drive_page
from studies.report.drive_errors import coverage, statements
from studies.report.drive_log import complaints
from studies.report.sweep import gate_of, sweep_page
from studies.report.tiles import apart
from studies.sweeps.baseline import Baseline, of_sweep
from studies.sweeps.engine import SweepResult, run_sweep
from studies.sweeps.gate import compare
from tests.support.browser import Page
from tests.support.sweep_cases import NOISE, sweep
from tests.support.synthetic_drive import DRIVE, columns, write_drive, write_log

SPEC = """
name = "mine"
description = "for tests"
measures = [{ id = "critical_drop_probability" }]
designs = [{ kind = "one at a time", levels = 2 }]
grid.points = 2
vary.kappa.relative = 0.2

[[subjects]]
schedule = "corner-estimation-longitudinal"
parameters = "corner-estimation"
"""
CONTRAST = (Path(__file__).parent / "contrast.js").read_text()


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    folder = tmp_path_factory.mktemp("drive")
    table = columns(duration=1.0)
    table["v"] = table["v"] + 0.5  # the reference is another one than the wheels say
    data = replay_drive([write_log(folder / "log.csv", table)], write_drive(folder, DRIVE))
    return RunResult(evaluate(data), (), data)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    return run_sweep(sweep(measures=[NOISE]), tmp_path_factory.mktemp("sweep"), Serial())


@pytest.fixture(scope="module")
def pages(drive: RunResult, swept: SweepResult, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    before = of_sweep(swept.sweep, swept.summary)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "studies.report.drive.figures", lambda data: [velocity(data)]
        )  # one instead of seven: drawing takes long
        made = {"drive": drive_page(drive)}
    made |= {
        "sweep": sweep_page(swept, before, "ci.toml", compare(swept.sweep, swept.summary, before)),
    }
    folder = tmp_path_factory.mktemp("pages")
    for name, text in made.items():
        (folder / f"{name}.html").write_text(text)
    return {name: folder / f"{name}.html" for name in made}


def test_the_page_of_a_drive_says_what_holds_and_what_does_not(pages: dict[str, Path], drive: RunResult) -> None:
    text = unescape(pages["drive"].read_text())
    rms = drive.metrics["velocity"]["pipeline"]["rms"]
    assert f"off by {rms:.3g} m/s RMS" in text and "What holds" in text and "estimates.csv" in text
    for heading in ("RMS error", "within ±2σ [%]", "duplicates", "what it means", "comparison"):
        assert f">{heading}</th>" in text, heading
    assert text.count("<img ") == 3 and len(text) < 3_000_000


def test_every_flag_and_check_has_a_meaning() -> None:
    assert set(FLAGS) == set(Flag) - {Flag.NONE} and set(CHECKS) == set(Check) - {Check.NONE}


def test_coverage_is_the_share_of_errors_within_two_deviations(drive: RunResult) -> None:
    """An error of 0.1 m/s where 0.06 m/s is stated, of 0.15 m/s in every fourth sample."""
    assert drive.data.chain is not None
    n = drive.data.log.time.size
    error = np.where(np.arange(n) % 4 == 0, 0.15, 0.1)
    truth = drive.data.log.reference["vx"]
    chain = replace(drive.data.chain, vx=truth + error, vx_deviation=np.full(n, 0.06))
    assert coverage(replace(drive.data, chain=chain))["vx"] == pytest.approx(100.0 * np.mean(np.arange(n) % 4 != 0))
    silent = replace(chain, vx_deviation=np.full(n, np.nan))
    assert "vx" not in coverage(replace(drive.data, chain=silent))


@pytest.mark.parametrize(("pipeline", "holds"), [(0.1, True), (0.3, False)])
def test_a_quantity_holds_where_no_baseline_is_nearer(pipeline: float, holds: bool) -> None:
    def entry(rms: float) -> dict[str, Any]:
        return {
            "samples": 5,
            "unit": "m/s",
            "rms": rms,
            "max_error": 2 * rms,
            "nrms_percent": 1.0,
            "reference_peak": 9.0,
        }

    velocity = {"pipeline": entry(pipeline), "mean_wheel_speed": entry(0.2), "corner_observers": entry(0.01)}
    (said,) = statements({"velocity": velocity, "pipeline": {}})
    assert said.holds is holds and f"off by {pipeline} m/s RMS, {2 * pipeline} m/s at most" in said.sentence
    assert ("not nearer than mean wheel speed (0.2 m/s)" in said.sentence) is not holds


def test_what_was_wrong_with_a_log_is_said() -> None:
    log = {
        "file": "a.csv",
        "duplicates": 1,
        "out_of_order": 0,
        "gaps": 2,
        "largest_gap_s": 0.07,
        "allowed_gap_s": 0.05,
        "not_finite": {},
    }
    row = {"comparison": "yaw rate over x", "slope": -1.0, "quality": 0.99, "verdict": "contradicts"}
    grid = {"samples": 200, "missing_samples": {"yaw_rate": 50}}
    found = complaints({"logs": {"A": log}, "grid": grid, "frames": [row]})
    assert found == [
        "a.csv: 1 duplicate time stamp merged.", "a.csv: 2 gaps longer than 50 ms, the longest 70 ms.",
        "yaw rate is missing at 25 % of the samples.", "yaw rate over x is −1 and should be 1: contradicts.",
    ]  # fmt: skip
    whole = log | {"duplicates": 0, "gaps": 0}
    assert complaints({"logs": {"A": whole}, "grid": grid | {"missing_samples": {}}, "frames": []}) == []


def test_ribbons_begin_and_last_as_the_flag_does() -> None:
    on = np.zeros(2000, bool)
    on[[100, 101, 102, 104, 900, 901]] = True
    one = Raised("pipeline", "gated", "", False, np.arange(2000) * 0.01, on)
    start, length = one.intervals()  # a gap of one sample is too short to be seen
    np.testing.assert_allclose(start, [1.0, 9.0])
    np.testing.assert_allclose(length, [0.05, 0.02])
    assert (one.share, one.first) == (pytest.approx(0.3), pytest.approx(1.0)) and one.longest == pytest.approx(0.03)


def test_tiles_keep_curves_and_get_the_labels_of_shared_axes() -> None:
    curve, band = Line([0, 1], [0, 1], "curve"), Band([0, 1], [0, 0], [1, 1], "band")
    rows = [
        [Panel([curve], "", "v [m/s]", "left"), Panel([band], title="right")],
        [Panel([curve], "t [s]"), Panel([curve], "t [s]")],
    ]
    made = list(apart(Figure("f", "c", "a", rows, share_x="all", share_y="all")))
    assert [f.name for f in made] == ["f-0-0", "f-0-1", "f-1-0", "f-1-1"]
    top = made[1].panels
    assert isinstance(top, Panel) and isinstance(top.x, Axis) and isinstance(top.y, Axis)
    assert (top.x.label, top.y.label, list(top.marks)) == ("t [s]", "v [m/s]", [band])


def test_the_gate_comes_first_and_says_by_what_and_by_how_much(pages: dict[str, Path], swept: SweepResult) -> None:
    text = unescape(pages["sweep"].read_text())
    total = len(swept.summary.statistics)
    verdict = f"Holds: none of {total} statistics shrank beyond its tolerance against the baseline ci.toml"
    assert verdict in text and text.index(verdict) < text.index(">What was asked</h2>") and text.count("<img ") == 4
    worst = swept.summary.of("corner-estimation-longitudinal", "noise_norm", "worst")
    assert worst is not None and f">{worst.value:.5g}<" in text and f">{worst.at['sigma0']:.5g}<" in text
    index = swept.summary.of("corner-estimation-longitudinal", "noise_norm", "total index kappa")
    assert index is not None and f">{index.value:.4f} ± " in text


def halved(before: Baseline) -> Baseline:
    """A baseline whose worst value was half of today's."""
    statistics = tuple(replace(s, value=0.5 * s.value) if s.name == "worst" else s for s in before.summary.statistics)
    return replace(before, summary=replace(before.summary, statistics=statistics))


def test_a_broken_gate_names_the_statistic_and_no_baseline_judges_nothing(swept: SweepResult) -> None:
    before = halved(of_sweep(swept.sweep, swept.summary))
    gate = gate_of(swept, before, "ci.toml", compare(swept.sweep, swept.summary, before))
    assert gate.verdict.startswith(f"Broken: 1 of {len(swept.summary.statistics)} statistics shrank")
    (said,) = gate.broken
    assert "noise norm, worst" in said and "a loss of 100 % where 1 % is tolerated" in said
    none = gate_of(swept, None, "", None)
    assert none.verdict.startswith("Nothing is compared") and (none.holds, none.broken, none.table) == ((), (), None)


@pytest.mark.parametrize(("width", "dark"), [(390, True), (1280, False)])
@pytest.mark.parametrize("name", ["drive", "sweep"])
def test_they_wear_the_dress_of_the_other_reports(
    page: Page, pages: dict[str, Path], name: str, width: int, dark: bool
) -> None:
    page.show(pages[name], width, dark=dark)
    assert page.complaints() == [] and page.evaluate("document.documentElement.scrollWidth") <= width
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true })")
    assert page.evaluate(CONTRAST) == [] and page.evaluate("document.documentElement.scrollWidth") <= width
    assert all(page.evaluate("[...document.images].map(i => i.naturalWidth)"))
    narrow = page.evaluate(
        "[...document.querySelectorAll('.tiles:not(.single) img')].every(i => i.offsetWidth <= innerWidth)"
    )
    assert narrow and page.evaluate("document.querySelectorAll('.tiles img').length") > 2


def test_the_commands_write_the_page_where_they_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("studies.report.sweep.sweep_page", lambda *_given: "the page of the sweep")
    monkeypatch.setattr("studies.report.drive.drive_page", lambda _given: "the page of the drive")
    monkeypatch.setattr("studies.drives.run.figures", lambda _data: [])
    log, drive = write_log(tmp_path / "log.csv", columns(duration=0.5)), write_drive(tmp_path, DRIVE)
    given = [
        "run",
        str(log),
        "--drive",
        str(drive),
        "--out",
        str(tmp_path / "run"),
        "--report",
        str(tmp_path / "new" / "run.html"),
    ]
    assert main(given) == 0 and (tmp_path / "new" / "run.html").read_text() == "the page of the drive"
    assert main([*given, "--check"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    (tmp_path / "mine.toml").write_text(SPEC)
    given = ["sweep", str(tmp_path / "mine.toml"), "--workers", "1", "--out", str(tmp_path / "sweep")]
    assert main([*given, "--report", str(tmp_path / "sweep.html")]) == 0
    assert (tmp_path / "sweep.html").read_text() == "the page of the sweep"
