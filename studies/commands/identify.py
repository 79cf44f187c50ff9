"""Output of `gainsmith identify`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from studies.commands.terminal import print_table, progress_bar
from studies.execution.files import check_folder
from studies.identify.identify import identify_drive
from studies.identify.result import HEADER, content, rows, warnings, write_identification


def run_identify(logs: list[Path], drive: Path, out: Path, as_json: bool, no_check: bool = False) -> int:
    """Identify the car from the log, write the files, print the table; 0 when done, warnings to standard error."""
    check_folder(out)
    with progress_bar() as progress:
        task = progress.add_task("identifying", total=1.0)
        found = identify_drive(
            logs, drive, check=not no_check, progress=lambda done: progress.update(task, completed=0.95 * done)
        )
        write_identification(found, out)
        progress.update(task, completed=1.0)
    if as_json:
        print(json.dumps(content(found), indent=1, allow_nan=False))
        return 0
    caption = f"velocity reference: {found.velocity_reference}"
    print_table(f"{found.drive.name}: identified", HEADER, rows(found), caption=caption)
    for line in warnings(found):
        print(f"warning: {line}", file=sys.stderr)
    print(f"written to {out}")
    return 0
