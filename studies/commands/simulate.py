"""Output of `gainsmith simulate`: certified levels beside what random and worst trajectories show."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

from analysis.simulation.amplification import Amplification, amplification
from estimators.schedule import GainSchedule, read_content
from studies.commands.certify import shipped
from studies.commands.simulate_figure import simulation_figures
from studies.commands.terminal import print_table, progress_bar
from studies.execution.files import ready_folder
from studies.plots.save import write_figures
from synthesis.certificate.claims import written

HEADINGS = ("claim", "certified", "mean", "largest", "worst found", "share", "unit", "verdict")
CAPTION = (
    "mean, largest: over random trajectories, each under the disturbance that is amplified most along it; "
    "worst found: with the worst place and a periodic trajectory, too; share: of the certified level"
)


def run_simulate(schedule: Path, runs: int, samples: int | None, seed: int, out: Path | None, as_json: bool) -> int:
    """Print the table and, with `out`, draw; 0 if every claim is proved and no run beats one, else 1."""
    content = read_content(shipped(schedule))
    with progress_bar() as progress:
        progress.add_task("proving and running", total=None)
        found = amplification(content, runs, samples, seed)
    drawn: list[Path] = []
    if out is not None:
        ready_folder(out)
        drawn = write_figures(simulation_figures(GainSchedule.from_content(content), found), out)
    if as_json:
        print(json.dumps([_row(one) for one in found], indent=1))
    else:
        title = f"{content['name']}: {runs} random trajectories of {len(found[0].trajectory) - 1} samples, seed {seed}"
        print_table(title, HEADINGS, [_cells(one) for one in found], left=(0, 6, 7), caption=CAPTION, width=200)
        for path in drawn:
            print(path)
    return 0 if all(one.proved and not one.beaten for one in found) else 1


def _cells(one: Amplification) -> Sequence[str]:
    numbers = ("" if math.isnan(x) else f"{x:.4g}" for x in (one.mean, one.largest, one.worst))
    return (one.claim, written(one.level), *numbers, f"{100.0 * one.share:.1f} %", one.unit, _verdict(one))


def _verdict(one: Amplification) -> str:
    if one.beaten:
        return "BEATEN by a run"
    return "proved" if one.proved else "NOT PROVED"


def _row(one: Amplification) -> dict[str, object]:
    mean, largest = (None if math.isnan(x) else x for x in (one.mean, one.largest))
    return {
        "claim": one.claim, "kind": one.kind, "certified": one.level, "unit": one.unit, "proved": one.proved,
        "beaten": one.beaten, "mean": mean, "largest": largest, "worst": one.worst, "share": one.share,
    }  # fmt: skip
