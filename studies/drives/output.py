"""Files that are there whole or not at all: written beside their place, then renamed."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from estimators.arrays import AnyArray
from studies.errors import LogError
from studies.plots import Figure
from studies.plots.save import save_as


def check_folder(out: Path) -> None:
    """As :func:`ready_folder`, before there is anything to write: nothing is created.

    Raises LogError when ``out`` or a folder above it is a file or cannot be written.
    """
    there = next(path for path in (out.absolute(), *out.absolute().parents) if path.exists())
    if not there.is_dir():
        raise LogError(f"{out}: cannot be a folder for results ({there.name} is a file); give another --out")
    if not os.access(there, os.W_OK):
        raise LogError(f"{out}: cannot be written; give another --out")


def ready_folder(out: Path) -> None:
    """Create ``out`` if needed; LogError when it is a file or cannot be written."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LogError(f"{out}: cannot be a folder for results ({error.strerror}); give another --out") from error
    if not os.access(out, os.W_OK):
        raise LogError(f"{out}: cannot be written; give another --out")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A name beside ``path`` to write to; renamed to ``path`` on success, removed on failure."""
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    beside = Path(name)
    try:
        yield beside
        beside.chmod(0o644)  # mkstemp makes private files
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Strict JSON (no NaN), two spaces a level."""
    with whole_file(path) as beside:
        beside.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_csv(path: Path, columns: Mapping[str, AnyArray]) -> None:
    """One column a name, six decimals; what is missing is an empty cell."""
    frame = pl.DataFrame({name: np.ascontiguousarray(value) for name, value in columns.items()}, nan_to_null=True)
    with whole_file(path) as beside:
        frame.write_csv(beside, float_scientific=False, float_precision=6)


def write_figures(
    figures: Sequence[Figure], out: Path, progress: Callable[[float], None] = lambda _done: None
) -> list[Path]:
    """Each figure as SVG and PNG under its name; ``progress`` hears the share done."""
    paths = []
    for k, figure in enumerate(figures):
        svg, png = (out / f"{figure.name}{suffix}" for suffix in (".svg", ".png"))
        with whole_file(svg) as first, whole_file(png) as second:
            save_as(figure, first, second)
        paths += [svg, png]
        progress((k + 1) / len(figures))
    return paths
