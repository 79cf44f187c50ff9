"""Folders that are there whole or not at all: filled beside their place, then renamed."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

BESIDE = ".unfinished-"


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A folder beside ``path`` to fill; takes the place of ``path`` on success, removed on failure.

    Killed between the two renames, the old folder is gone and the new one still has its temporary name: absent, not half.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=BESIDE, dir=path.parent))
    try:
        filled = beside / "new"
        filled.mkdir()
        yield filled
        if path.exists():
            path.rename(beside / "old")
        filled.rename(path)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def sweep(folder: Path) -> None:
    """Remove what killed runs left unfinished in ``folder``."""
    for left in folder.glob(f"{BESIDE}*"):
        shutil.rmtree(left, ignore_errors=True)
