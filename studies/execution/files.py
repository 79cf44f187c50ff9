"""Files and folders that are there whole or not at all: written beside their place, then renamed; and a lock on a folder."""

from __future__ import annotations

import fcntl
import json
import math
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from estimators import whole_files
from estimators.arrays import AnyArray
from estimators.whole_files import UNFINISHED
from studies.claim import JsonValue
from synthesis.errors import SpecError

LOCK = ".lock"


def check_folder(out: Path) -> None:
    """Raises SpecError when ``out`` cannot be a folder for results: it or one above is a file or cannot be written."""
    there = next(path for path in (out.absolute(), *out.absolute().parents) if path.exists())
    if not there.is_dir():
        raise SpecError(f"{out}: cannot be a folder for results ({there.name} is a file); give another --out")
    if not os.access(there, os.W_OK):
        raise SpecError(f"{out}: cannot be written; give another --out")


def ready_folder(out: Path) -> None:
    """Create ``out`` if needed. Raises SpecError as :func:`check_folder`."""
    check_folder(out)
    out.mkdir(parents=True, exist_ok=True)


@contextmanager
def whole_file(path: Path, sync: bool = False) -> Iterator[Path]:
    """A name beside ``path`` to write to; renamed to ``path`` on success, removed on failure.

    ``sync``: it is there after a power cut, too. An OSError names ``path``, also where the full disk has no name.
    """
    with _named(path), whole_files.whole_file(path, sync) as beside:
        yield beside


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A folder beside ``path`` to fill; takes the place of ``path`` on success, removed on failure.

    Killed between the two renames, the old folder is gone and the new one still has its temporary name: absent, not half.
    """
    with _named(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        beside = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=path.parent))
        try:
            filled = beside / "new"
            filled.mkdir()
            yield filled
            if path.exists():
                path.rename(beside / "old")
            filled.rename(path)
        finally:
            shutil.rmtree(beside, ignore_errors=True)


def discard_unfinished(folder: Path) -> None:
    """Remove what killed runs left unfinished in ``folder`` and below it."""
    for left in list(folder.rglob(f"{UNFINISHED}*")):
        if left.is_dir():
            shutil.rmtree(left, ignore_errors=True)
        else:
            left.unlink(missing_ok=True)


def write_bytes(path: Path, data: bytes, sync: bool = False) -> None:
    """A whole file with this content."""
    with whole_file(path, sync) as beside:
        beside.write_bytes(data)


def plain(value: Any, where: str) -> JsonValue:
    """``value`` with numpy scalars, arrays, tuples and enumerations replaced by numbers, lists and texts.

    NaN becomes null and infinities the texts "inf" and "-inf", as JSON has none. Raises TypeError that names ``where``
    for anything else: a result that cannot be stored is a mistake of the study.
    """
    if value is None or (isinstance(value, str | bool | int) and not isinstance(value, Enum)):
        return value
    if isinstance(value, Enum):
        return plain(value.value, where)
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist(), where)
    if isinstance(value, float):
        if math.isnan(value):
            return None
        return value if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(entry, f"{where}.{key}") for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry, where) for entry in value]
    raise TypeError(f"{where} is a {type(value).__name__}; only numbers, texts, lists and dictionaries can be stored")


def json_bytes(content: Any, indent: int = 1) -> bytes:
    """Strict JSON (no NaN), a line end at the end."""
    return (json.dumps(content, indent=indent, allow_nan=False, ensure_ascii=False) + "\n").encode()


def write_json(path: Path, content: Any) -> None:
    """Strict JSON (no NaN), two spaces a level."""
    write_bytes(path, json_bytes(content, 2))


def write_csv(path: Path, columns: Mapping[str, AnyArray]) -> None:
    """One column a name, six decimals; what is missing is an empty cell."""
    import polars as pl

    frame = pl.DataFrame({name: np.ascontiguousarray(value) for name, value in columns.items()}, nan_to_null=True)
    with whole_file(path) as beside:
        frame.write_csv(beside, float_scientific=False, float_precision=6)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise


@contextmanager
def only_run(folder: Path, busy: str = "another run writes here (process {holder})") -> Iterator[None]:
    """Hold ``folder`` for this process; SpecError with the sentence ``busy`` when another process holds it.

    A record lock belongs to the process: the system takes it back however the process ends, and forked workers do not
    inherit it. The lock's file goes with the run; who opened one that was just removed opens the next.
    """
    lock = folder / LOCK
    while True:
        with lock.open("a+", encoding="ascii") as file:
            try:
                fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                file.seek(0)
                words = busy.format(holder=file.read().strip() or "unknown")
                raise SpecError(f"{folder}: {words}; wait for it or give another --out") from error
            if not (lock.exists() and os.path.samestat(os.fstat(file.fileno()), lock.stat())):
                continue
            try:
                file.seek(0)
                file.truncate()
                file.write(str(os.getpid()))
                file.flush()
                yield
            finally:
                lock.unlink(missing_ok=True)
            return
