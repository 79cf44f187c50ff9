"""Parts on worker processes: the longest first, one process for each, so that a crash or its memory stays with it."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from threading import active_count
from time import perf_counter
from warnings import catch_warnings, simplefilter

from studies.registry import Registry
from studies.running.worker import Job, Told, work

TICK = 0.2  # s between two looks at the progress bar


@dataclass(frozen=True)
class Outcome:
    """What became of a part: stored (was there already), computed, or failed with a ``message``."""

    job: Job
    state: str
    seconds: float = 0.0
    message: str = ""

    @property
    def study(self) -> str:
        """Id of the study."""
        return self.job.study

    @property
    def part(self) -> str:
        """Name of the part."""
        return self.job.part


@dataclass
class _Running:
    job: Job
    process: BaseProcess
    start: float


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def start_method() -> str:
    """Fork where it is safe (Linux, one thread): it saves every worker seconds of imports. Else fresh interpreters."""
    return "fork" if sys.platform == "linux" and active_count() == 1 else "spawn"


def run_jobs(
    jobs: Sequence[Job], registry: Registry, workers: int, tick: Callable[[list[Job]], None] = lambda _running: None
) -> Generator[Outcome, None, None]:
    """Run ``jobs``, at most ``workers`` at once; outcomes as they come, ``tick`` (running jobs) several times a second.

    Raises OSError when a result cannot be written: then no other could be either. Leaving early ends the workers.
    """
    context = get_context(start_method())
    pending = sorted(jobs, key=lambda job: (bool(job.preparation), job.cost))  # the last one that can is taken first
    ended: dict[str, str] = {}  # preparations, and what went wrong with them
    running: dict[Connection, _Running] = {}
    try:
        while pending or running:
            for job in [job for job in pending if any(ended.get(name) for name in job.waits_for)]:
                pending.remove(job)
                name = next(name for name in job.waits_for if ended.get(name))
                yield Outcome(job, "failed", message=f"{name}: {ended[name]}")
            for job in [job for job in reversed(pending) if ended.keys() >= set(job.waits_for)][
                : workers - len(running)
            ]:
                pending.remove(job)
                mine, theirs = context.Pipe(duplex=False)
                process = context.Process(target=work, args=(job, registry, theirs))  # type: ignore[attr-defined]
                with catch_warnings():  # libraries keep idle threads of their own, which a fork does not disturb
                    simplefilter("ignore", DeprecationWarning)
                    process.start()
                theirs.close()  # its end must be the only one: then a dead worker is an end of file
                running[mine] = _Running(job, process, perf_counter())
            tick([entry.job for entry in running.values()])
            ready = wait(list(running), timeout=TICK)
            for connection in [one for one in running if one in ready]:
                outcome = _outcome(running.pop(connection), connection)
                if outcome.job.preparation:
                    ended[outcome.job.preparation] = outcome.message
                yield outcome
    finally:
        for entry in running.values():
            entry.process.kill()
            entry.process.join()


def _outcome(entry: _Running, connection: Connection) -> Outcome:
    job = entry.job
    told: Told | None = None
    with connection, suppress(EOFError):
        told = connection.recv()
    entry.process.join()
    seconds = perf_counter() - entry.start
    if told is None:
        return Outcome(job, "failed", seconds, _death(entry.process.exitcode))
    if told.errno is not None:
        raise OSError(told.errno, told.error, told.path)
    return Outcome(job, "failed" if told.error else "computed", seconds, told.error)


def _death(code: int | None) -> str:
    if code is not None and code < 0:
        return f"its process was ended by {signal.Signals(-code).name}; is there enough memory?"
    return f"its process ended with code {code} and no word"
