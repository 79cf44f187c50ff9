"""Chunks as Parquet bytes: rows of designs, and the envelope over the grid; and what made them."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]

from studies.execution.fingerprint import Sources
from studies.sweeps.evaluate import Evaluated, evaluate_chunk
from studies.sweeps.sweep import Chunk, Sweep

WORDS = ("stage", "outcome", "reason", "measure")  # a dictionary of columns of numbers costs more than it saves
PLACE = " place"  # column of the grid point at which a measure is at its worst
ROOTS = ("studies.sweeps.engine", "studies.sweeps.spec")  # all that a measure of a sweep file may use
OTHERS = ("gainsmith", "numpy", "scipy", "sympy", "pyarrow")


@cache
def versions() -> dict[str, str]:
    """By name; `code` covers every module that a measure of a file may use, so that an edit is never taken for a repeat."""
    return {
        "code": Sources().fingerprint(None, ROOTS)[:16], "python": platform.python_version(),
        "machine": platform.machine(), **{name: version(name) for name in OTHERS},
    }  # fmt: skip


@dataclass(frozen=True)
class ChunkResult:
    """A finished chunk as it goes to the folder: bytes of its two files, and who made it."""

    chunk: Chunk
    rows: bytes
    envelope: bytes
    first_reason: str
    made_with: dict[str, str]
    seconds: float


def compute(sweep: Sweep, chunk: Chunk) -> ChunkResult:
    """Evaluate a chunk and encode it: what a worker does."""
    start = perf_counter()
    found = evaluate_chunk(sweep, chunk)
    seconds = perf_counter() - start
    names = [m.name for m in sweep.measures]
    return ChunkResult(
        chunk, encoded(row_table(found, chunk, sweep.stages[chunk.stage].kind, names)), encoded(envelope_table(found, chunk)),
        next((reason for reason in found.reason if reason), ""), versions(), seconds,
    )  # fmt: skip


def row_table(found: Evaluated, chunk: Chunk, kind: str, measures: Sequence[str]) -> Any:
    """One row a design: index, stage, parameters, for each measure its worst value and where, outcome and reason."""
    count = chunk.stop - chunk.start
    columns: dict[str, Any] = {
        "design": pa.array(np.arange(chunk.design, chunk.design + count)),
        "stage": pa.array([kind] * count).dictionary_encode(),
    }
    columns |= {name: pa.array(column) for name, column in found.columns.items()}
    for name in measures:
        columns[name] = pa.array(found.worst[name])
        columns[name + PLACE] = pa.array(found.place[name])
    columns["outcome"] = pa.array(found.outcome.tolist()).dictionary_encode()
    columns["reason"] = pa.array([reason or None for reason in found.reason], pa.string())
    return pa.table(columns)


def envelope_table(found: Evaluated, chunk: Chunk) -> Any:
    """One row a measure and grid point: worst and best value over the chunk's designs, and which design is worst."""
    names = list(found.envelopes)
    sizes = [len(e.worst) for e in found.envelopes.values()]
    return pa.table(
        {
            "measure": pa.array([n for n, size in zip(names, sizes, strict=True) for _ in range(size)], pa.string()),
            "place": pa.array([i for size in sizes for i in range(size)], pa.int32()),
            "worst": pa.array(_joined([e.worst for e in found.envelopes.values()])),
            "design": pa.array(_joined([e.row for e in found.envelopes.values()]).astype(np.int64) + chunk.design),
            "best": pa.array(_joined([e.best for e in found.envelopes.values()])),
        }
    )


def _joined(parts: list[Any]) -> Any:
    return np.concatenate(parts) if parts else np.empty(0)


def encoded(table: Any) -> bytes:
    """Parquet, the same bytes for the same table."""
    sink = pa.BufferOutputStream()
    repeated = [name for name in WORDS if name in table.column_names]
    pq.write_table(table, sink, compression="zstd", write_statistics=False, use_dictionary=repeated)
    return bytes(sink.getvalue())


def columns_of(path: Path, names: Sequence[str]) -> dict[str, Any]:
    """Some columns of a chunk as arrays; words as lists."""
    table = pq.read_table(path, columns=list(names), use_threads=False, memory_map=False)
    return {name: _plain(table.column(name)) for name in names}


def _plain(column: Any) -> Any:
    kind = column.type
    if pa.types.is_floating(kind) or pa.types.is_integer(kind):
        return np.asarray(column)
    return column.to_pylist()
