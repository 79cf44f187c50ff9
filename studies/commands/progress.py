"""One look for every progress bar: on the error stream, silent when that is no terminal."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn


def progress_bar(threaded: bool = True) -> Progress:
    """A transient bar with percentage and elapsed time; without a thread it is drawn at every ``update(refresh=True)``."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        disable=not sys.stderr.isatty(),
        transient=True,
        auto_refresh=threaded,
    )
