"""Output of `gainsmith run`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from studies.drives.run import run_drive, summary_rows


def run_log(logs: list[Path], drive: Path, out: Path, as_json: bool) -> int:
    """Replay the log and print the metrics beside the baselines; 0 when done."""
    result = run_drive(logs, drive, out)
    if as_json:
        print(json.dumps(result.metrics, indent=1))
        return 0
    rows = summary_rows(result)
    table = Table(title=f"{drive.stem}: estimates against the reference")
    for i, heading in enumerate(rows[0]):
        table.add_column(heading, justify="left" if i == 0 else "right")
    for row in rows[1:]:
        table.add_row(*row)
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    print(f"written to {out}")
    return 0
