"""Where the pages of `--report` go."""

from __future__ import annotations

from pathlib import Path

from studies.execution.files import write_bytes


def write_page(path: Path, page: str) -> None:
    """The page, whole or not at all; its folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, page.encode())
