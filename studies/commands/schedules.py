"""Output of `gainsmith schedules`, and its figures."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from estimators.schedule.gain_signals import gain_signals
from studies.commands.pages import write_page
from studies.commands.terminal import print_table, progress_bar
from studies.drives.quantities import to_si
from studies.plots.save import save_figure
from studies.preflight import check_before_design
from studies.report.schedule_figures import gain_figure
from studies.schedules import ScheduleRun, regenerate
from studies.spec import Variant, load_spec, shipped_specs
from synthesis.design.norms import CLAIMED
from synthesis.errors import SpecError

HEADINGS = (
    "schedule", "update", "points", "gain of", "deployed", "published", "channel", "gain", "decay", "drops", "state", "s",
)  # fmt: skip
CAPTION = (
    "gain of a channel: that of the update, lower bound .. proved for the deployed table at any admissible rate; decay of the "
    "update [1/s] and drop probability: proved"
)
LEFT = ("schedule", "update", "gain of", "channel", "state")
CHANNEL = "update: gain ", "update: "  # begin the claims about channels
OF_CHANNELS = tuple(f"sampled {kind}" for kind in CLAIMED.values())
LONGEST_CHANNEL = 44
MOST_GAINS = 8  # in the table of a terminal


def run_schedules(
    specs: list[str],
    out: Path | None,
    check: bool,
    figures: Path | None,
    report: Path | None,
    as_json: bool,
    radius: str | None = None,
    sample_time: str | None = None,
) -> int:
    """Regenerate (or check) schedules, print a table; 0 good, 1 drift or refused design."""
    variant = Variant(_quantity("--radius", radius, "m"), _quantity("--sample-time", sample_time, "s"))
    names = specs or list(shipped_specs())
    for name in names:
        spec, place = load_spec(name)  # bad input is refused before anything is designed or written
        check_before_design(spec, spec.plant(place).model)
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
                save_figure(gain_figure(run.content, run.published, _title(run)), figures)
    if report is not None:
        from studies.report.schedules import schedules_page

        write_page(report, schedules_page(runs))
    if as_json:
        print(json.dumps([_row(run) for run in runs], indent=1))
    else:
        shown = [
            i for i, heading in enumerate(HEADINGS) if heading != "published" or any(run.published for run in runs)
        ]
        names, rows = [HEADINGS[i] for i in shown], [_cells(run) for run in runs]
        left = [k for k, name in enumerate(names) if name in LEFT]
        cells = [[row[i] for i in shown] for row in rows]
        print_table("Gain schedules", names, cells, left=left, caption=CAPTION, no_wrap=True, width=200)
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


def _title(run: ScheduleRun) -> str:
    decay = next(p.level for p in run.proofs if p.kind in ("internal update", "sampled error"))
    return f"{run.name}: update decays at {decay:g} 1/s, proved over the whole range and rate box"


def _cells(run: ScheduleRun) -> tuple[str, ...]:
    if not run.content:
        return (run.name, *[""] * 9, run.state, f"{run.seconds:.1f}")
    table = np.array(run.content["gain"]["table"])
    (above, beside), axes = gain_signals(run.content), tuple(range(table.ndim - 2))
    low, high = table.min(axis=axes), table.max(axis=axes)
    places = list(np.ndindex(*low.shape))
    letter = "y" if run.content["update"].get("measured", "outputs") == "outputs" else "x"
    own, several = run.content["update"].get("order", 0), len(beside) > 1
    weighed = [f"law_state_{j + 1}" if j < own else f"{letter}{j + 1 - own}" for j in range(len(beside))]
    names = [above[i]["name"] + (f" from {weighed[j]}" if several else "") for i, j in places]
    ranges = [f"{low[place]:.4g}..{high[place]:.4g}" for place in places]
    bands = [f"{a:g}..{b:g}" for a, b in run.published or ()]
    channels = [
        (_short(p.claim.removeprefix(CHANNEL[0]).removeprefix(CHANNEL[1])), p.level)
        for p in run.proofs
        if p.kind in OF_CHANNELS
    ]
    gains = [f"{least:.4g}..{level:.4g}" for least, (_, level) in zip(run.least, channels, strict=False)]
    proved = {p.kind: p.level for p in run.proofs}
    decay = proved.get("internal update", proved.get("sampled error", np.nan))
    drops = proved.get("drop probability")
    columns = (names, ranges, bands, [name for name, _ in channels], gains)
    return (
        run.name, run.content["update"]["kind"], "x".join(map(str, table.shape[:-2])),
        *("\n".join(column[:MOST_GAINS]) for column in columns),
        f"{decay:g}", f"{drops:g}" if drops else "none", run.state, f"{run.seconds:.1f}",
    )  # fmt: skip


def _short(channel: str) -> str:
    """Of many disturbances, and of many signals behind the arrow, the first; `--json` and `certify` have all."""
    if len(channel) <= LONGEST_CHANNEL:
        return channel
    sides = (side.partition(" + ") for side in channel.split(" -> "))
    return " -> ".join(f"{first} + .." if rest else first for first, _, rest in sides)


def _row(run: ScheduleRun) -> dict[str, Any]:
    table = np.array(run.content["gain"]["table"]) if run.content else np.empty((1, 0, 0))
    gains = table.reshape(-1, table.shape[-2] * table.shape[-1]).T
    return {
        "name": run.name, "state": run.state, "good": run.good, "message": run.message, "gains_moved": run.moved,
        "seconds": run.seconds, "gain_range": [[float(g.min()), float(g.max())] for g in gains],
        "published_range": run.published, "lower_bounds": run.least,
        "proofs": [{"claim": p.claim, "level": p.level, "unit": p.unit, "proved": p.proved} for p in run.proofs],
    }  # fmt: skip
