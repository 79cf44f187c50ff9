"""Output of `gainsmith sweep`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from rich.console import Console

from studies.commands.pages import write_page
from studies.commands.terminal import print_table, progress_bar
from studies.execution.cluster import Cluster
from studies.execution.files import write_bytes
from studies.execution.processes import Executor
from studies.sweeps.baseline import Baseline, of_sweep, read_baseline, write_baseline
from studies.sweeps.engine import SweepResult, default_executor
from studies.sweeps.engine import run_sweep as run
from studies.sweeps.gate import HEADINGS, Comparison, comparable, compare, loss_text
from studies.sweeps.plots import plot_sweep
from studies.sweeps.reports import junit as junit_xml
from studies.sweeps.reports import markdown
from studies.sweeps.spec import load_sweep
from studies.sweeps.summary import number
from synthesis.errors import SpecError

DONE, SHRUNK, REFUSED = 0, 1, 2
WIDTH = 200  # of tables, where the output is no terminal


def run_sweep(
    spec: str,
    workers: int | None,
    scheduler: str | None,
    quick: bool,
    resume: bool,
    out: Path | None,
    baseline: Path | None,
    update_baseline: bool,
    junit: Path | None,
    summary: Path | None,
    as_json: bool,
    report: Path | None = None,
) -> int:
    """Run a sweep, hold it against a baseline; 0 good, 1 something shrank, 2 bad input or a measure that is not a number."""
    if update_baseline and baseline is None:
        raise SpecError("--update-baseline: say which file with --baseline FILE")
    executor = _executor(workers, scheduler)
    sweep = load_sweep(spec, quick)
    before = read_baseline(baseline) if baseline is not None and not update_baseline else None
    if before is not None:
        comparable(sweep, before)
    folder = out or Path("out") / "sweep" / (sweep.name if sweep.form == "full" else f"{sweep.name}-{sweep.form}")
    with progress_bar(threaded=False) as bar:  # its thread must not be there when workers are forked
        task = bar.add_task(f"sweeping {sweep.name}", total=None)

        def advance(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, refresh=True)

        result = run(sweep, folder, executor, resume, advance)
        compared = compare(sweep, result.summary, before) if before is not None else None
        bar.update(task, description="drawing", refresh=True)
        pictures = _draw(result, before, compared)
        if report is not None:
            from studies.report.sweep import sweep_page

            write_page(report, sweep_page(result, before, str(baseline), compared))
    write_bytes(folder / "report.md", markdown(result.summary, compared, pictures).encode())
    reports = (junit_xml(sweep.name, result.summary, compared), markdown(result.summary, compared).encode())
    for path, data in zip((junit, summary), reports, strict=True):
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(path, data)
    if as_json:
        print(json.dumps(_content(result, compared), indent=1, allow_nan=False))
    else:
        _print(result, compared, folder)
    for kind, words in (
        ("designs without a number", "designs have a measure that is not a number"),
        ("invalid designs", f"of {result.count('designs')} designs are invalid"),
    ):
        if result.count(kind):
            first = f" ({result.first_reason})" if result.first_reason else ""
            listed = f"they are listed in {folder / 'rows'}"
            print(f"gainsmith: {result.count(kind)} {words}{first}; {listed}", file=sys.stderr)
            if kind == "designs without a number":
                return REFUSED
    if update_baseline and baseline is not None:
        write_baseline(baseline, of_sweep(sweep, result.summary))
        print(f"baseline written to {baseline}", file=sys.stderr)
    return SHRUNK if compared is not None and not all(j.good for j in compared) else DONE


def _executor(workers: int | None, scheduler: str | None) -> Executor:
    if scheduler is not None:
        if workers is not None:
            raise SpecError("--workers and --scheduler exclude each other: a cluster has the workers that it has")
        cluster = Cluster(scheduler)
        cluster.require()  # before anything is read or written
        return cluster
    if workers is not None and workers < 1:
        raise SpecError(f"--workers {workers}: give at least 1")
    return default_executor(workers)


def _draw(result: SweepResult, before: Baseline | None, compared: list[Comparison] | None) -> list[str]:
    """All pictures; of the quick form the comparison, and observers that something shrank of. Returns the SVG files' names."""
    folder = result.folder.path
    shrunk = {j.before.observer for j in compared or () if not j.good}
    if result.sweep.form != "full" and before is None:
        return []
    drawn = plot_sweep(result, folder / "pictures", before, None if result.sweep.form == "full" else shrunk)
    return [str(path.relative_to(folder)) for path in drawn if path.suffix == ".svg"]


def _print(result: SweepResult, compared: list[Comparison] | None, folder: Path) -> None:
    rows = []
    for observer in result.sweep.observers:
        for measure in result.sweep.measures:
            found = [
                result.summary.of(observer.name, measure.name, name)
                for name in ("nominal", "median", "quantile 95 %", "quantile 99 %", "worst")
            ]
            cells = ["" if f is None else number(f.value) for f in found]
            rows.append((observer.name, measure.name, *cells, measure.unit, found[-1].where() if found[-1] else ""))
    title = f"Sweep {result.sweep.name}: {result.count('designs')} designs"
    headings = ("subject", "measure", "nominal", "median", "95 %", "99 %", "worst", "unit", "at")
    print_table(title, headings, rows, left=(0, 1, 7, 8), width=WIDTH)
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    for note in result.summary.notes:
        console.print(note)
    if compared is not None:
        bad = [j.cells for j in compared if not j.good]
        if bad:
            title = f"{len(bad)} of {len(compared)} statistics shrank beyond their tolerance"
            print_table(title, HEADINGS, bad, left=(0, 1, 2, 6, 7), width=WIDTH)
        else:
            console.print(f"nothing shrank: {len(compared)} statistics within their tolerance of the baseline")
    print(f"written to {folder}")


def _content(result: SweepResult, compared: list[Comparison] | None) -> dict[str, Any]:
    content: dict[str, Any] = result.summary.content() | {"chunks_computed": result.computed}
    if compared is not None:
        content["baseline"] = [
            {"subject": j.before.observer, "measure": j.before.measure, "figure": j.before.name, "state": j.state,
             "from": number(j.before.value, 8), "to": None if j.after is None else number(j.after.value, 8),
             "loss": loss_text(j.loss), "at": dict(j.after.at) if j.after else {}, "cause": j.cause}
            for j in compared
        ]  # fmt: skip
    return content
