"""The report of a replayed drive as one page: estimates beside references, errors, flags, and what was wrong with the log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from studies.drives.flag_plot import flag_figure
from studies.drives.plots import figures
from studies.drives.raised import Raised, raised
from studies.drives.run import RunResult
from studies.plots import Figure
from studies.report.drive_errors import COVERED, LEAST_COVERED, WORDS, coverage, error_table, kind_of, statements
from studies.report.drive_log import agreeing, complaints, flag_table, log_tables
from studies.report.html.page import filled
from studies.report.tiles import drawn, tiled
from studies.sentence import shown

NARROW = 6.4  # inches
SHARE = 120_000  # bytes of one drawing: a drive has about twenty
FIRST = ("velocity", "lateral")  # figures that are open; those of every wheel and axle fold
MOST_SAID = 6  # flags on the first page


def drive_page(result: RunResult) -> str:
    """The page of `gainsmith run --report`."""
    data, metrics = result.data, result.metrics
    said, covered, flags = statements(metrics), coverage(data), raised(data)
    honest, proud = _deviations(covered)
    pipeline = metrics["pipeline"]
    independent = [one for one in said if not one.circular]
    with TemporaryDirectory() as folder:
        lead = f"{data.drive.name}: "
        groups = [
            tiled(f, Path(folder), _capital(f.caption.removeprefix(lead)), share=SHARE)
            for f in figures(data)
            if f.name != "flags"
        ]
        ribbons = flag_figure(data.drive.name, flags)
        shown_flags = (
            None
            if ribbons is None
            else drawn([_narrow(ribbons)], "flags", _capital(ribbons.caption.removeprefix(lead)), Path(folder), SHARE)
        )
    return filled(
        "drive.html.jinja",
        metrics=metrics, drive=data.drive, said=said, first=[g for g in groups if g.name in FIRST],
        more=[g for g in groups if g.name not in FIRST], ribbons=shown_flags, rules=pipeline.get("rules", {}),
        estimators=pipeline.get("estimators", {}),
        holds=[*(one.sentence for one in independent if one.holds), *honest, *filter(None, [agreeing(metrics["log"])])],
        broken=[*(one.sentence for one in independent if not one.holds), *proud, *complaints(metrics["log"]), *_alarms(flags)],
        know=[*_circular(metrics["pipeline"].get("notes", {})), *_assumed(result)],
        errors=error_table(metrics, covered), flags=flag_table(flags), log=log_tables(metrics["log"]),
    )  # fmt: skip


def _narrow(ribbons: Figure) -> Figure:
    """For a page: letters stay readable on a telephone."""
    return replace(ribbons, size=(NARROW, ribbons.size[1]), title="")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _deviations(covered: dict[str, float]) -> tuple[list[str], list[str]]:
    """Kinds whose stated deviations cover their errors, and kinds that are surer than they should be."""
    good: list[str] = []
    bad: list[str] = []
    for kind in dict.fromkeys(map(kind_of, covered)):
        least = min(share for name, share in covered.items() if kind_of(name) == kind)
        text = f"{WORDS[kind]}: {shown(least, 3)} % of the errors lie within two stated standard deviations"
        if least >= LEAST_COVERED:
            good.append(f"{text}.")
        else:
            bad.append(
                f"{text}, of normal errors {shown(COVERED, 3)} % would: the estimate is surer than it should be."
            )
    return good, bad


def _alarms(flags: Sequence[Raised]) -> list[str]:
    """The flags that say that something is wrong, those that stay longest first."""
    wrong = sorted((one for one in flags if not one.usual), key=lambda one: -one.share)
    return [
        f"{one.owner}: {one.name} in {shown(one.share, 2)} % of the samples; {one.meaning}."
        for one in wrong[:MOST_SAID]
    ]


def _circular(notes: dict[str, str]) -> list[str]:
    return [f"{WORDS.get(name, name)}: {text}." for name, text in notes.items()]


def _assumed(result: RunResult) -> list[str]:
    pipeline = result.metrics["pipeline"]
    texts = dict.fromkeys([*result.metrics["assumptions"], *pipeline.get("assumptions", [])])
    return [f"Assumed: {text}." for text in texts]
