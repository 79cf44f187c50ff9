"""The report of schedules as one page: what is proved, where it is tightest, the curve of each gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from estimators.schedule.constraints import constraint_words
from estimators.schedule.gain_signals import gain_signals
from studies.plots import Figure
from studies.plots.save import save_figure
from studies.report.frozen_levels import FrozenLevel, frozen_levels
from studies.report.html.page import filled
from studies.report.pictures import Picture, picture
from studies.report.schedule_figures import gain_figure, levels_figure
from studies.schedules import ScheduleRun
from studies.sentence import shown

SHARE = 300_000  # bytes of a drawing


@dataclass(frozen=True)
class Drawn:
    """A picture with what stands below it, and what it shows for those who cannot see it."""

    figure: Figure
    picture: Picture


@dataclass(frozen=True)
class Shown:
    """A schedule with rows for its claims (claim, proved, level, tightest at, there, left [%]) and its drawings."""

    run: ScheduleRun
    box: str
    proved: int
    rows: tuple[tuple[str | float, ...], ...] = ()
    tightest: FrozenLevel | None = None
    drawings: tuple[Drawn, ...] = ()
    gains: tuple[tuple[float, ...], ...] = ()
    columns: tuple[str, ...] = field(default=())

    @property
    def sentence(self) -> str:
        """What was found, for the first page."""
        if not self.run.content:
            return self.run.message
        total = len(self.run.proofs)
        count = f"All {total} claims are" if self.proved == total else f"{self.proved} of {total} claims are"
        return f"{count} proved for every {self.box}."

    @property
    def advice(self) -> str:
        """Where more margin would have to come from."""
        if self.tightest is None:
            return ""
        left = shown(100.0 * self.tightest.slack, 2)
        return f"Tightest is '{words(self.tightest.claim)}' at {place(self.run.content, self.tightest)}, with {left} % left."


def schedules_page(runs: Sequence[ScheduleRun]) -> str:
    """The page of `gainsmith schedules --report`."""
    with TemporaryDirectory() as folder:
        return filled("schedules.html.jinja", schedules=[_shown(run, Path(folder)) for run in runs])


def _shown(run: ScheduleRun, folder: Path) -> Shown:
    if not run.content:
        return Shown(run, "", 0)
    content = run.content
    levels = frozen_levels(content)
    by_claim = {level.claim: level for level in levels}
    rows = tuple(_row(content, by_claim.get(proof.claim), proof) for proof in run.proofs)
    finite = [level for level in levels if abs(level.slack) < float("inf")]
    tightest = min(finite, key=lambda level: level.slack, default=None)
    columns, gains = _table(content)
    figures = [gain_figure(content, run.published)]
    if len(content["scheduling"]) == 1:
        figures.append(levels_figure(content, levels))
    for figure in figures:
        save_figure(figure, folder)
    drawings = tuple(Drawn(figure, picture(folder, figure.name, SHARE)) for figure in figures)
    proved = sum(proof.proved for proof in run.proofs)
    return Shown(run, _box(content), proved, rows, tightest, drawings, gains, columns)


def _row(content: Any, level: FrozenLevel | None, proof: Any) -> tuple[str | float, ...]:
    state = "proved" if proof.proved else "refuted" if proof.refuted else "not proved"
    name = f"{words(proof.claim)} [{proof.unit}]"
    if level is None or not proof.proved:
        return name, state, shown(proof.level), proof.place, "", ""
    there = level.values[level.tightest]
    return name, state, shown(proof.level), place(content, level), shown(float(there)), shown(100.0 * level.slack, 2)


def _box(content: Any) -> str:
    ranges = [
        f"{words(p['name'])} from {shown(p['min'])} to {shown(p['max'])}{_unit(p['unit'])} and "
        + (
            "any jump of it"
            if p["rate_min"] is None
            else f"its rates from {shown(p['rate_min'])} to {shown(p['rate_max'])} {_rate(p['unit'])}"
        )
        for p in content["scheduling"]
    ]
    if "constraints" in content:
        ranges += [
            constraint_words(entry["coefficients"], entry["max"], entry["unit"])
            for entry in content["constraints"]["inequalities"]
        ]
    return ", ".join(ranges) or "time"


def _unit(unit: str) -> str:
    """Behind a number; a pure number has none."""
    return "" if unit == "1" else f" {unit}"


def _rate(unit: str) -> str:
    return f"{unit}²" if unit.endswith("/s") else f"{unit}/s"


def _table(content: Any) -> tuple[tuple[str, ...], tuple[tuple[float, ...], ...]]:
    """The deployed table of one parameter: its breakpoints and all gains."""
    if len(content["scheduling"]) != 1:
        return (), ()
    parameter, (above, beside) = content["scheduling"][0], gain_signals(content)
    columns = [f"{words(parameter['name'])} [{parameter['unit']}]"]
    columns += [f"{words(row['name'])} by {words(column['name'])}" for row in above for column in beside]
    rows = zip(parameter["breakpoints"], content["gain"]["table"], strict=True)
    return tuple(columns), tuple((at, *(gain for row in table for gain in row)) for at, table in rows)


def place(content: Any, level: FrozenLevel) -> str:
    """Where a claim is tightest: every parameter with its unit."""
    point = level.points[level.tightest]
    named = zip(content["scheduling"], point, strict=True)
    return ", ".join(f"{words(p['name'])} = {shown(float(value))}{_unit(p['unit'])}" for p, value in named)


def words(name: str) -> str:
    """A name as a reader writes it."""
    return name.replace("_", " ").replace(" -> ", " → ")
