"""The folder of a sweep: a manifest, chunks renamed into place, and a lock. Whatever is killed, what is there is whole.

    manifest.json  what was asked (definition), around which values (nominal), and what made it (versions)
    rows/SUBJECT/0000/0000012.parquet       one row a design
    envelopes/SUBJECT/0000/0000012.parquet  worst and best over the designs at each grid point; written before its rows
    summary.json, summary.md                the statistics; there once the sweep is complete

Nothing in it depends on time, machine load, or the number and order of workers: one sweep gives one set of bytes.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from analysis.sensitivity.designs import Design
from studies.execution.files import discard_unfinished, json_bytes, only_run, write_bytes
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Observer
from studies.sweeps.plant import Grid
from studies.sweeps.sweep import Chunk, Sweep
from studies.sweeps.tables import PLACE, ChunkResult, columns_of, versions
from synthesis.errors import SpecError

MAGIC = b"PAR1"
MANIFEST, SUMMARY = "manifest.json", "summary.json"
HELD = 1 << 22  # numbers kept in memory so that small sweeps are read once; larger ones are read anew for every pass


class SweepFolder:
    """Where one sweep is stored; to be used inside `locked_folder`."""

    def __init__(self, path: Path, sweep: Sweep) -> None:
        self.path, self.sweep = path, sweep

    def begin(self, resume: bool) -> None:
        """Write the manifest, or with `resume` check it against this sweep. Raises SpecError that names the difference."""
        manifest, file = self.manifest(), self.path / MANIFEST
        if not file.exists():
            if (self.path / "rows").exists():
                raise SpecError(f"{self.path}: has chunks but no {MANIFEST}; give an empty folder")
            write_bytes(file, json_bytes(manifest), sync=True)
            return
        if not resume:
            raise SpecError(f"{self.path}: holds a sweep already; continue it with --resume or give another --out")
        try:
            old = dict(json.loads(file.read_bytes()))
        except (ValueError, TypeError, RecursionError):
            raise SpecError(f"{file}: is no manifest of a sweep; give another --out") from None
        for part, remedy in (
            ("definition", "the sweep was changed"), ("nominal", "constants or gains were changed"),
            ("versions", "it was made with other code"),
        ):  # fmt: skip
            found = differences(old.get(part), manifest[part])
            if found:
                raise SpecError(f"{self.path}: cannot be resumed, {remedy}: {found[0]}; give another --out")
        discard_unfinished(self.path)

    def manifest(self) -> dict[str, Any]:
        """What is asked, around what, and with what."""
        return {
            "definition": self.sweep.definition, "sha256": self.sweep.digest, "nominal": self.sweep.nominal,
            "versions": versions(),
            "designs": {s.name: self.sweep.designs(s) for s in self.sweep.observers}, "chunks": self.sweep.chunk_count(),
        }  # fmt: skip

    def rows(self, chunk: Chunk) -> Path:
        """The file of a chunk's designs."""
        return self._file("rows", chunk)

    def envelope(self, chunk: Chunk) -> Path:
        """The file of a chunk's envelope."""
        return self._file("envelopes", chunk)

    def _file(self, kind: str, chunk: Chunk) -> Path:
        observer = self.sweep.observers[chunk.observer].name
        return self.path / kind / observer / f"{chunk.number // 1000:04d}" / f"{chunk.number:07d}.parquet"

    def has(self, chunk: Chunk) -> bool:
        """Whether both files of a chunk are there and whole."""
        return _ends_well(self.rows(chunk)) and _ends_well(self.envelope(chunk))

    def keep(self, done: ChunkResult) -> None:
        """Store a chunk; its rows last, for they say that it is there."""
        odd = differences(versions(), done.made_with)
        if odd:
            raise SpecError(f"a worker would give other bytes than this machine: {odd[0]}; install the same everywhere")
        for file, data in ((self.envelope(done.chunk), done.envelope), (self.rows(done.chunk), done.rows)):
            file.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(file, data, sync=data is done.rows)

    def of(self, observer: int) -> list[Chunk]:
        """The chunks of one observer, in order."""
        return [chunk for chunk in self.sweep.chunks() if chunk.observer == observer]


def differences(old: Any, new: Any, place: str = "") -> list[str]:
    """Every difference as 'place was old, is now new'; empty if there is none."""
    if isinstance(old, dict) and isinstance(new, dict):
        found = []
        for key in dict.fromkeys([*old, *new]):
            where = f"{place}.{key}" if place else str(key)
            if key not in new:
                found.append(f"{where} was {_short(old[key])}, is now missing")
            elif key not in old:
                found.append(f"{where} is new: {_short(new[key])}")
            else:
                found += differences(old[key], new[key], where)
        return found
    if isinstance(old, list | tuple) and isinstance(new, list | tuple):
        if len(old) != len(new):
            return [f"{place} had {len(old)} entries, has now {len(new)}"]
        return [d for i, (a, b) in enumerate(zip(old, new, strict=True)) for d in differences(a, b, f"{place}[{i}]")]
    return [] if old == new else [f"{place} was {_short(old)}, is now {_short(new)}"]


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


@contextmanager
def locked_folder(path: Path, sweep: Sweep) -> Iterator[SweepFolder]:
    """The folder, made if it is missing, for one process alone. Raises SpecError if another one holds it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise SpecError(f"{path}: is not a folder; give another --out") from None
    with only_run(path, "another sweep is writing to this folder"):
        yield SweepFolder(path, sweep)


def _ends_well(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            file.seek(-len(MAGIC), os.SEEK_END)
            return file.read() == MAGIC
    except OSError:
        return False


class Rows:
    """Columns by name; memory does not grow with the number of designs."""

    def __init__(self, folder: SweepFolder, observer: int) -> None:
        sweep = folder.sweep
        self.observer: Observer = sweep.observers[observer]
        self.grid: Grid = sweep.grid(self.observer)
        self.ranges = [v.name for v in sweep.ranges[self.observer.name]]
        self.measures: list[Measure] = list(sweep.measures)
        self.stages: list[Design] = list(sweep.stages)
        self._chunks = [(self.stages[c.stage], folder.rows(c), c.design) for c in folder.of(observer)]
        values = [m.name for m in self.measures]
        self._numbers = [*self.ranges, *values, *(name + PLACE for name in values)]
        names = ["outcome", *self._numbers]
        small = sweep.designs(self.observer) * len(names) <= HELD
        self._held = [columns_of(path, names) for _, path, _ in self._chunks] if small else None

    def columns(self, names: Sequence[str], random: bool = False) -> Iterator[tuple[Design, int, dict[str, Any]]]:
        """Stage, index of the first design, and the named columns of every chunk; `random`: of those that fill the box evenly."""
        for i, (stage, path, design) in enumerate(self._chunks):
            if not random or stage.random:
                yield stage, design, columns_of(path, names) if self._held is None else self._held[i]

    def all_columns(self) -> Iterator[tuple[Design, int, dict[str, Any]]]:
        """Parameters, values and places of every chunk."""
        return self.columns(self._numbers)

    def place(self, columns: dict[str, Any], row: int, measure: Measure) -> dict[str, float]:
        """Parameters and grid point of one row."""
        at = {name: float(columns[name][row]) for name in self.ranges}
        return at | self.grid.place(int(columns[measure.name + PLACE][row]))
