"""Output of `gainsmith study`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from studies.claim import ClaimVerdict
from studies.commands.terminal import print_table, progress_bar
from studies.execution.processes import available_cores
from studies.registry import SHIPPED, Registry
from studies.report.scoreboard import MARKS
from studies.run import RunSummary, run_studies
from studies.study import QUICK, Scope
from synthesis.errors import SpecError

DEFAULT_OUT = Path("out") / "studies"
CAPTION = "parts: computed now + kept from an earlier run; claims: " + ", ".join(
    f"{mark} {verdict}" for verdict, mark in MARKS.items()
)


def run_study(
    studies: list[str],
    every: bool,
    quick: bool,
    workers: int | None,
    seeds: int | None,
    out: Path | None,
    as_json: bool,
    registry: Registry = SHIPPED,
) -> int:
    """Run studies and write results and report; 0 when all is there, 1 when a part failed or a claim is missing.

    Raises SpecError for unknown studies and numbers out of range.
    """
    ids = _selected(studies, every, registry)
    scope = _scope(quick, seeds)
    count = available_cores() if workers is None else workers
    if count < 1:
        raise SpecError(f"--workers {count}: at least 1 is needed")
    folder = out or DEFAULT_OUT
    # Without a thread of its own the bar can be drawn between forks.
    with progress_bar(threaded=False) as bar:
        task = bar.add_task("starting", total=1.0)

        def progress(done: float, running: str) -> None:
            bar.update(task, completed=done, description=running[:60] or "waiting", refresh=True)

        summary = run_studies(ids, folder, scope, count, registry, progress)
    if as_json:
        print(json.dumps(_content(summary, folder), indent=1))
    else:
        headings = ("study", "parts", "failed", *MARKS.values(), "missing", "s")
        print_table("Studies", headings, _rows(summary), caption=CAPTION, no_wrap=True)
    for study, part, message in summary.failures:
        print(f"{study}/{part}: {message}", file=sys.stderr)
    if summary.missing_claims:
        print(f"claims without a computed value: {', '.join(summary.missing_claims)}", file=sys.stderr)
    if not as_json:
        print(f"written to {folder}; read {folder / 'report.html'}")
    return 0 if summary.good else 1


def _selected(studies: list[str], every: bool, registry: Registry) -> list[str]:
    for name in studies:
        registry.check(name)
    chosen = list(registry.modules) if every else list(dict.fromkeys(studies))
    if not chosen:
        raise SpecError(f"name a study or give --all; there are: {', '.join(registry.modules)}")
    return chosen


def _scope(quick: bool, seeds: int | None) -> Scope:
    usual = QUICK if quick else Scope()
    if seeds is None:
        return usual
    if seeds < 2:
        raise SpecError(f"--seeds {seeds}: at least 2 are needed for an interval")
    return Scope(quick=quick, seeds=seeds)


def _rows(summary: RunSummary) -> Iterator[tuple[str, ...]]:
    for record in summary.records:
        outcomes = [outcome for outcome in summary.outcomes if outcome.study == record.id]
        computed = sum(outcome.state == "computed" for outcome in outcomes)
        earlier = sum(part.stored is not None for part in record.parts) - computed
        verdicts = [claim["verdict"] for claim in record.claims]
        yield (
            record.id, f"{computed} + {earlier}", str(sum(bool(part.failure) for part in record.parts)),
            *(str(verdicts.count(verdict)) for verdict in MARKS), str(len(record.missing_claims)),
            f"{sum(outcome.seconds for outcome in outcomes):.1f}",
        )  # fmt: skip


def _content(summary: RunSummary, folder: Path) -> dict[str, Any]:
    return {
        "out": str(folder), "good": summary.good,
        "parts": [{"study": o.study, "part": o.part, "state": o.state, "seconds": o.seconds} for o in summary.outcomes],
        "failures": [{"study": s, "part": p, "message": text} for s, p, text in summary.failures],
        "missing_claims": summary.missing_claims,
        "verdicts": {
            str(verdict): sum(c["verdict"] == verdict for r in summary.records for c in r.claims)
            for verdict in ClaimVerdict
        },
        "files": [str(path) for path in summary.paths],
    }  # fmt: skip
