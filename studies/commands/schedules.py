"""Output of `gainsmith schedules`, and its figures."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from estimators.schedule import GainSchedule
from studies.commands.terminal import print_table, progress_bar
from studies.drives.quantities import to_si
from studies.plots import Axis, Figure, Line, Mark, Panel, Shade
from studies.plots.colours import DEPLOYED, PRINTED_BAND
from studies.plots.save import save_figure
from studies.schedules import ScheduleRun, regenerate
from studies.spec import Variant, load_spec, shipped_specs
from synthesis.errors import SpecError

HEADINGS = (
    "schedule", "update", "points", "first gain", "published", "second gain", "published", "friction", "noise",
    "decay", "drops", "state", "s",
)  # fmt: skip
CAPTION = (
    "friction, noise: gain of the update to the velocity error, lower bound .. proved for the deployed table at any "
    "admissible rate; decay of the update [1/s] and drop probability: proved"
)


def gain_figure(run: ScheduleRun) -> Figure:
    """Every gain as it is deployed (points and straight lines), the published range shaded behind it."""
    parameter = run.content["scheduling"][0]
    breakpoints = np.array(parameter["breakpoints"])
    table = np.array(run.content["gain"]["table"])[..., 0]
    units = GainSchedule.from_content(run.content).gain_units
    symbol = "$L$" if run.content["update"]["kind"] == "held" else "$K$"
    panels = []
    for i, gains in enumerate(table.T):
        marks: list[Mark] = [Line(breakpoints, gains, "deployed, proved", DEPLOYED, marker="o")]
        if run.published is not None:
            low, high = run.published[i]
            marks.insert(0, Shade(low, high, "y", f"published range {low:g} to {high:g}", PRINTED_BAND))
        x = Axis(f"{parameter['name'].replace('_', ' ')} [{parameter['unit']}]", breakpoints[0], breakpoints[-1])
        panels.append(Panel(marks, x, Axis(f"{symbol}$_{i + 1}$ [{units[i][0]}]", low=0.0), legend="best"))
    decay = next(p.level for p in run.proofs if p.kind in ("internal update", "sampled error"))
    title = f"{run.name}: update decays at {decay:g} 1/s, proved over the whole range and rate box"
    return Figure(
        run.name,
        title,
        "Each gain as straight lines between its breakpoints, over the published range.",
        panels,
        size=(4.4 * len(panels), 3.4), title=title,
    )  # fmt: skip


def run_schedules(
    specs: list[str],
    out: Path | None,
    check: bool,
    figures: Path | None,
    as_json: bool,
    radius: str | None = None,
    sample_time: str | None = None,
) -> int:
    """Regenerate (or check) schedules, print a table; 0 good, 1 drift or refused design."""
    variant = Variant(_quantity("--radius", radius, "m"), _quantity("--sample-time", sample_time, "s"))
    names = specs or list(shipped_specs())
    for name in names:
        load_spec(name)  # bad input is refused before anything is designed or written
    folder = out or Path("schedules")
    pending = regenerate(names, folder, check, variant)
    runs: list[ScheduleRun] = []
    with progress_bar() as progress:
        task = progress.add_task("designing and proving", total=len(names))
        for run in pending:
            runs.append(run)
            progress.advance(task)
    if figures is not None:
        figures.mkdir(parents=True, exist_ok=True)
        for run in runs:
            if run.content:
                save_figure(gain_figure(run), figures)
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


def _quantity(option: str, text: str | None, unit: str) -> float | None:
    """What an option says in SI. Raises SpecError for what is no positive quantity."""
    if text is None:
        return None
    try:
        value = to_si(text, unit)
    except ValueError as error:
        raise SpecError(f"{option}: {error}") from error
    if not 0.0 < value < math.inf:
        raise SpecError(f"{option}: '{text}' is out of range; it must be finite and above 0 {unit}")
    return value


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
