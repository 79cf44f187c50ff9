"""Output of `gainsmith schedules`, and its figures."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from studies.commands.terminal import print_table, progress_bar
from studies.execution.files import write_bytes
from studies.plots.save import save_figure
from studies.report.schedule_figures import gain_figure
from studies.schedules import ScheduleRun, regenerate
from studies.spec import load_spec, shipped_specs

HEADINGS = (
    "schedule", "update", "points", "first gain", "published", "second gain", "published", "friction", "noise",
    "decay", "drops", "state", "s",
)  # fmt: skip
CAPTION = (
    "friction, noise: gain of the update to the velocity error, lower bound .. proved for the deployed table at any "
    "admissible rate; decay of the update [1/s] and drop probability: proved"
)


def run_schedules(
    specs: list[str], out: Path | None, check: bool, figures: Path | None, report: Path | None, as_json: bool
) -> int:
    """Regenerate (or check) schedules, print a table; 0 good, 1 drift or refused design."""
    names = specs or list(shipped_specs())
    for name in names:
        load_spec(name)  # bad input is refused before anything is designed or written
    folder = out or Path("schedules")
    pending = regenerate(names, folder, check)
    runs: list[ScheduleRun] = []
    with progress_bar() as progress:
        task = progress.add_task("designing and proving", total=len(names))
        for run in pending:
            runs.append(run)
            progress.advance(task)
    if figures is not None:
        figures.mkdir(parents=True, exist_ok=True)
        for run in runs:
            if run.content and len(run.content["scheduling"]) != 1:
                print(
                    f"{run.name}: gains of {len(run.content['scheduling'])} parameters are not drawn", file=sys.stderr
                )
            elif run.content:
                save_figure(gain_figure(run.content, run.published, _title(run)), figures)
    if report is not None:
        from studies.report.schedules import schedules_page

        report.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(report, schedules_page(runs).encode())
    if as_json:
        print(json.dumps([_row(run) for run in runs], indent=1))
    else:
        print_table(
            "Gain schedules", HEADINGS, map(_cells, runs), left=(0, 1, 11), caption=CAPTION, no_wrap=True, width=190
        )
        for run in runs:
            if run.message:
                print(f"{run.name}: {run.message}", file=sys.stderr)
    return 0 if all(run.good for run in runs) else 1


def _title(run: ScheduleRun) -> str:
    decay = next(p.level for p in run.proofs if p.kind in ("internal update", "sampled error"))
    return f"{run.name}: update decays at {decay:g} 1/s, proved over the whole range and rate box"


def _cells(run: ScheduleRun) -> tuple[str, ...]:
    if not run.content:
        return (run.name, *[""] * 10, run.state, f"{run.seconds:.1f}")
    gains = np.array(run.content["gain"]["table"])[..., 0]
    proved = {kind: [p.level for p in run.proofs if p.kind == kind] for kind in {p.kind for p in run.proofs}}
    bands = [f"{low:g}..{high:g}" for low, high in run.published or ((np.nan, np.nan),) * 2]
    levels = proved.get("sampled gain", [])
    channels = [f"{low:.4g}..{level:.4g}" for low, level in zip(run.least, levels, strict=False)] or ["", ""]
    decay = (proved.get("internal update") or proved.get("sampled error") or [np.nan])[0]
    drops = proved.get("drop probability")
    return (
        run.name, run.content["update"]["kind"], str(len(gains)),
        f"{gains[:, 0].min():.3f}..{gains[:, 0].max():.3f}", bands[0],
        f"{gains[:, 1].min():.1f}..{gains[:, 1].max():.1f}", bands[1],
        channels[0], channels[-1], f"{decay:g}", f"{drops[0]:g}" if drops else "none",
        run.state, f"{run.seconds:.1f}",
    )  # fmt: skip


def _row(run: ScheduleRun) -> dict[str, Any]:
    gains = np.array(run.content["gain"]["table"])[..., 0].T if run.content else np.empty((0, 0))
    return {
        "name": run.name, "state": run.state, "good": run.good, "message": run.message, "gains_moved": run.moved,
        "seconds": run.seconds, "gain_range": [[float(g.min()), float(g.max())] for g in gains],
        "published_range": run.published, "lower_bounds": run.least,
        "proofs": [{"claim": p.claim, "level": p.level, "unit": p.unit, "proved": p.proved} for p in run.proofs],
    }  # fmt: skip
