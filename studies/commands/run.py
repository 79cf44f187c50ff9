"""Output of `gainsmith run`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from studies.commands.progress import progress_bar
from studies.drives.run import run_drive
from studies.drives.summary import HEADER, remarks, summary_rows


def run_log(logs: list[Path], drive: Path, out: Path, as_json: bool) -> int:
    """Replay the log and print the metrics beside the baselines; 0 when done."""
    with progress_bar() as progress:
        task = progress.add_task("replaying", total=1.0)
        result = run_drive(logs, drive, out, progress=lambda done: progress.update(task, completed=done))
    if as_json:
        print(json.dumps(result.metrics, indent=1))
        return 0
    table = Table(title=f"{result.metrics.get('drive', drive.stem)}: against the reference")
    for i, heading in enumerate(HEADER):
        table.add_column(heading, justify="left" if i == 0 else "right")
    for row in summary_rows(result):
        table.add_row(*row)
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    for line in remarks(result):
        print(line)
    print(f"written to {out}")
    return 0
