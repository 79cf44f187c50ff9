"""One look for every progress bar and table."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Sequence

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table


def progress_bar(threaded: bool = True) -> Progress:
    """A transient bar on the error stream, silent when that is no terminal.

    Without a thread it is drawn at every ``update(refresh=True)``.
    """
    return Progress(
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(),
        console=Console(stderr=True), disable=not sys.stderr.isatty(), transient=True, auto_refresh=threaded,
    )  # fmt: skip


def print_table(
    title: str,
    headings: Iterable[str],
    rows: Iterable[Sequence[str]],
    *,
    left: Collection[int] = (0,),
    caption: str | None = None,
    no_wrap: bool = False,
    width: int = 120,
) -> None:
    """Columns ``left`` are aligned left, others right; ``width`` holds where the output is no terminal."""
    table = Table(title=title, caption=caption)
    for i, heading in enumerate(headings):
        table.add_column(heading, justify="left" if i in left else "right", no_wrap=no_wrap)
    for row in rows:
        table.add_row(*row)
    # Cells are data: "[m/s]" is a unit and no style.
    Console(width=None if sys.stdout.isatty() else width, markup=False, emoji=False, highlight=False).print(table)
