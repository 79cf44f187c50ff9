"""Run a sweep into a folder, from the start or from where it was left."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from estimators.display import displayed
from studies.execution.files import json_bytes, write_bytes
from studies.execution.processes import Executor, Processes, Serial, available_cores
from studies.sweeps.reports import markdown
from studies.sweeps.store import SUMMARY, SweepFolder, locked_folder
from studies.sweeps.summary import Summary, read_summary, summarise
from studies.sweeps.sweep import Chunk, Sweep
from studies.sweeps.tables import compute
from synthesis.errors import SpecError

Progress = Callable[[int, int], None]


@displayed({"seconds": "s"})
@dataclass(frozen=True, repr=False)
class SweepResult:
    """A complete sweep: its folder, its statistics, the chunks computed by this run, and the seconds that their measures took."""

    sweep: Sweep
    folder: SweepFolder
    summary: Summary
    computed: int
    seconds: float
    first_reason: str

    def count(self, name: str) -> int:
        """Designs over all observers: 'designs', 'invalid designs', 'designs without a number'."""
        return int(sum(f.value for f in self.summary.statistics if f.kind == "count" and f.name == name))


def run_sweep(
    sweep: Sweep, out: Path, executor: Executor | None = None, resume: bool = False, progress: Progress | None = None
) -> SweepResult:
    """Compute what is missing, then the statistics.

    Raises SpecError for a folder in use or of another sweep, OSError if the disk is full.

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     result = run_sweep(load_sweep("gain-box", quick=True), Path(folder) / "out", Serial())
    ...     print(result.count("invalid designs"))
    0
    """
    with locked_folder(out, sweep) as folder:
        folder.begin(resume)
        computed, seconds, reason = _fill(folder, executor or default_executor(), progress)
        summary_file = out / SUMMARY
        if computed or not summary_file.exists():
            summary = summarise(folder)
            write_bytes(out / "summary.md", markdown(summary).encode(), sync=True)
            write_bytes(summary_file, json_bytes(summary.content()), sync=True)
        return SweepResult(sweep, folder, read_summary(summary_file), computed, seconds, reason)


def default_executor(workers: int | None = None) -> Executor:
    """As many processes as there are cores, or as asked; one computes in this process."""
    count = workers or available_cores()
    return Serial() if count == 1 else Processes(count)


def _fill(folder: SweepFolder, executor: Executor, progress: Progress | None) -> tuple[int, float, str]:
    """Chunks computed, seconds in their measures, and the first reason why a design has no value."""
    total, there, done, seconds, reason = folder.sweep.chunk_count(), 0, 0, 0.0, ""

    def missing() -> Iterator[Chunk]:
        nonlocal there
        for chunk in folder.sweep.chunks():
            if folder.has(chunk):
                there += 1
            else:
                yield chunk

    left = missing()
    first = next(left, None)
    if first is None:
        return 0, 0.0, ""
    for measure in folder.sweep.measures:
        measure.prepare()
    with closing(executor.run(compute, folder.sweep, chain([first], left))) as results:
        for finished in results:
            if finished.death:
                raise SpecError(
                    "a worker process was killed (out of memory?); finished chunks are kept: use fewer --workers or a "
                    "smaller chunk, and continue with --resume"
                )
            result = finished.value
            folder.keep(result)
            done, seconds, reason = done + 1, seconds + result.seconds, reason or result.first_reason
            if progress is not None:
                progress(done + there, total)
    return done, seconds, reason
