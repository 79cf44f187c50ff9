"""The report of a sweep as one page: the gate, what was asked, and of each observer quantiles, worst points, tornado, shares."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from studies.report.html.page import filled
from studies.report.sweep_figures import index_figure
from studies.report.sweep_tables import (
    NOTHING,
    asked_tables,
    gate_table,
    index_table,
    percent,
    quantile_table,
    unit_of,
    worst_table,
)
from studies.report.tiles import Tiles, drawn, tiled
from studies.sentence import shown
from studies.study import Table
from studies.sweeps.baseline import Baseline
from studies.sweeps.engine import SweepResult
from studies.sweeps.gate import GREW, MOVED, Comparison
from studies.sweeps.labels import words
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Observer
from studies.sweeps.plots import map_figure, scatter_figure, worst_map
from studies.sweeps.store import Rows
from studies.sweeps.summary import Statistic
from studies.sweeps.tornado import tornado, tornado_figure

SHARE = 60_000  # bytes of one drawing: five observers have eighty
MOST_SAID = 12  # of what is broken, on the first page; the table has all


@dataclass(frozen=True)
class Part:
    """What the page shows of one observer; ``open`` drawings are seen at once, ``more`` fold."""

    observer: Observer
    lead: str
    quantiles: Table
    worst: Table
    indices: Table
    open: tuple[Tiles, ...]
    more: tuple[Tiles, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Gate:
    """The verdict in one sentence, what holds and what is broken."""

    verdict: str
    holds: tuple[str, ...]
    broken: tuple[str, ...]
    table: Table | None


def sweep_page(
    result: SweepResult, baseline: Baseline | None, place: str, compared: Sequence[Comparison] | None
) -> str:
    """The page of `gainsmith sweep --report`; ``place`` is the file of the baseline that ``compared`` was made with."""
    with TemporaryDirectory() as folder:
        parts = [_part(result, k, Path(folder)) for k in range(len(result.sweep.observers))]
    return filled(
        "sweep.html.jinja", sweep=result.sweep, parts=parts, asked=asked_tables(result.sweep), lead=_asked(result),
        gate=gate_of(result, baseline, place, compared), tight=list(tightest(result)),
    )  # fmt: skip


def gate_of(result: SweepResult, baseline: Baseline | None, place: str, compared: Sequence[Comparison] | None) -> Gate:
    """What the comparison says; without a baseline nothing is compared, and designs without a number are still named."""
    missing = result.count("designs without a number")
    numberless = (f"{missing} designs have a measure that is not a number.",) if missing else ()
    if compared is None or baseline is None:
        verdict = "Nothing is compared: no baseline was given. Make one with --baseline FILE --update-baseline."
        return Gate(verdict, (), numberless, None)
    bad = [one for one in compared if not one.good]
    made = ", ".join(f"{name} {number}" for name, number in baseline.made_with.items())
    against = f"against the baseline {place} (made with {made})"
    states = Counter(one.state for one in compared)
    verdict = (
        f"Broken: {len(bad)} of {len(compared)} statistics shrank beyond their tolerance {against}."
        if bad
        else f"Holds: none of {len(compared)} statistics shrank beyond its tolerance {against}."
    )
    verdict += f" {states[GREW]} got better, {states[MOVED]} Sobol indices moved beyond their confidence."
    broken = [_broken(one) for one in sorted(bad, key=lambda one: -one.loss)]
    if len(broken) > MOST_SAID:
        broken[MOST_SAID:] = [f"And {len(bad) - MOST_SAID} more, in the table of the gate."]
    return Gate(verdict, tuple(_holding(result, compared)), (*broken, *numberless), gate_table(compared))


def _broken(one: Comparison) -> str:
    """What shrank, by how much, and what did it; the place stands in the table."""
    before, after = one.before, one.after
    head = f"{before.observer}, {words(before.measure) or 'designs'}, {before.name}: "
    if after is None:
        return f"{head}{shown(before.value, 5)} is not made any more."
    unit = "" if before.unit == "1" else f" {before.unit}"
    lost = (
        f", a loss of {percent(one.loss)} % where {shown(100.0 * one.tolerance, 3)} % is tolerated"
        if before.kind == "value"
        else ""
    )
    cause = f"; {one.cause.replace('->', 'to')}" if one.cause else ""
    return f"{head}{shown(before.value, 5)} → {shown(after.value, 5)}{unit}{lost}{cause}."


def _holding(result: SweepResult, compared: Sequence[Comparison]) -> Iterator[str]:
    """One sentence a measure: how many statistics are within the tolerance, and which is nearest to it."""
    for measure in result.sweep.measures:
        own = [one for one in compared if one.before.measure == measure.name and one.before.kind == "value"]
        good = [one for one in own if one.good]
        if not good:
            continue
        text = f"{words(measure.name)}: {len(good)} of {len(own)} statistics within {shown(100.0 * good[0].tolerance, 3)} %"
        worst = max(good, key=lambda one: one.loss)
        if worst.loss > 1e-5:
            text += f"; largest loss {percent(worst.loss)} % ({worst.before.observer}, {worst.before.name})"
        yield f"{text}."


def tightest(result: SweepResult) -> Iterator[str]:
    """One sentence a measure: which observer loses most, where, and by which parameter."""
    for measure in result.sweep.measures:
        found = []
        for observer in result.sweep.observers:
            nominal, worst = (result.summary.of(observer.name, measure.name, name) for name in ("nominal", "worst"))
            if nominal is not None and worst is not None:
                found.append((measure.loss(nominal.value, worst.value), nominal, worst))
        if found:
            loss, nominal, worst = max(found, key=lambda each: each[0])
            if loss < NOTHING:
                yield f"{words(measure.name)}: no design loses anything."
                continue
            unit = unit_of(measure)
            ends = f"from {shown(nominal.value)}{unit} to {shown(worst.value)}{unit}"
            yield (
                f"{words(measure.name)}: {worst.observer} goes {ends} at its worst design and "
                f"loses {percent(loss)} % of its distance to {shown(measure.limit)}{_leading(result, measure, worst)}."
            )


def _leading(result: SweepResult, measure: Measure, worst: Statistic) -> str:
    lead = "total index "
    totals = [
        s for s in result.summary.statistics if s.key[:2] == (worst.observer, measure.name) and s.name.startswith(lead)
    ]
    if not totals:
        return ""
    most = max(totals, key=lambda s: s.value)
    return f"; most of it by {words(most.name.removeprefix(lead))} (total index {shown(most.value, 2)})"


def _asked(result: SweepResult) -> str:
    sweep = result.sweep
    first = sweep.observers[0]
    grid = ", ".join(
        f"{sweep.points} values of {words(p.name)} from {shown(low)} to {shown(high)} {p.unit}"
        for p in first.plant.box
        for low, high in (sweep.bounds.get(p.name, (p.minimum, p.maximum)),)
    )
    each = " each" if len(sweep.observers) > 1 else ""
    return f"{_counted(len(sweep.observers), 'observer')}, {shown(sweep.designs(first))} designs{each}, at {grid or 'one place'}."


def _part(result: SweepResult, index: int, folder: Path) -> Part:
    sweep, summary, observer = result.sweep, result.summary, result.sweep.observers[index]
    rows = Rows(result.folder, index)
    bars = {m.name: tornado(rows, m) for m in rows.measures}
    d = len(rows.ranges)
    seen, more = [], []
    if any(bars.values()):
        caption = "One parameter at a time through its range, the others nominal; every measure at its worst place of the grid."
        seen.append(tiled(tornado_figure(rows, bars), folder, caption, 1.1 + 0.4 * d, SHARE))
    shares = index_figure(sweep, summary, observer)
    if shares is not None:
        caption = (
            "Sobol indices: the share of the variance that a parameter has alone, and with all that it takes part in."
        )
        seen.append(tiled(shares, folder, caption, 1.1 + 0.4 * d, SHARE))
    maps = [(m, found) for m in rows.measures if (found := worst_map(result.folder, rows, index, m)) is not None]
    if maps:
        figures = [map_figure(result, rows, [each]) for each in maps]
        apart = [
            replace(f, name=f"{f.name}-{k}", title="", columns=2, size=(4.4, f.size[1] + 0.4))
            for k, f in enumerate(figures)
        ]
        caption = "Nominal, worst and best design over the grid; below, where in its range the worst design has each parameter."
        more.append(drawn(apart, f"{observer.name}-map", caption, folder, SHARE))
    scatter = scatter_figure(result, rows, bars) if d > 1 else None
    if scatter is not None:
        caption = "Random designs over the two parameters that matter most to each measure; dark is worse."
        more.append(tiled(scatter, folder, caption, share=SHARE))
    return Part(
        observer, _counts(result, observer), quantile_table(sweep, summary, observer), worst_table(sweep, summary, observer),
        index_table(sweep, summary, observer), tuple(seen), tuple(more),
        tuple(note.removeprefix(f"{observer.name}, ") for note in summary.notes if note.startswith(f"{observer.name}, ")),
    )  # fmt: skip


def _counts(result: SweepResult, observer: Observer) -> str:
    own = [s for s in result.summary.statistics if s.observer == observer.name and s.kind == "count"]
    counts = ", ".join(f"{shown(int(s.value))} {s.name}" for s in own if s.value or s.name == "designs")
    update = "correction held over a sample" if observer.update == "held" else "one correction a sample"
    return f"{counts} of {observer.origin}; {update}, sample time {shown(1e3 * observer.sample_time)} ms."


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
