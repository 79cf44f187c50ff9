"""Files that are there whole or not at all: written beside their place, then renamed over it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

UNFINISHED = ".unfinished-"  # how the names of files begin that a killed process may leave behind; nothing reads them


@contextmanager
def whole_file(path: Path, sync: bool = False) -> Iterator[Path]:
    """A new, empty file beside `path` to write to; renamed to `path` on success, removed on failure.

    Whoever reads `path` finds the old file or the new one, also when the process is killed. `sync`: it is there after a power
    cut, too. Raises OSError where the folder is absent, full or not writable.
    """
    beside = path.with_name(f"{UNFINISHED}{os.getpid()}-{os.urandom(6).hex()}{path.suffix}")
    try:
        with beside.open("xb"):  # fails rather than writes to what is there
            pass
        yield beside
        if sync:
            with beside.open("rb") as file:
                os.fsync(file.fileno())
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    if sync:
        _sync_folder(path.parent)


def write_bytes(path: Path, data: bytes, sync: bool = False) -> None:
    """A whole file with this content; see `whole_file`."""
    with whole_file(path, sync) as beside:
        beside.write_bytes(data)


def _sync_folder(folder: Path) -> None:
    """Makes the rename itself survive a power cut, where the platform lets a folder be opened."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
