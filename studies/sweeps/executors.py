"""Who computes the chunks: this process, forked ones on this machine, or a Dask cluster. The bytes are the same."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from multiprocessing import get_context
from typing import Protocol

from studies.sweeps.sweep import Chunk, Sweep
from studies.sweeps.tables import Done, compute
from synthesis.errors import SpecError

IN_FLIGHT = 3  # chunks a worker has waiting: results are never held in numbers
WATCH = 0.5  # s between two looks for the parent


class Executor(Protocol):
    """Computes chunks in any order; an iterator, so that memory stays bounded."""

    def run(self, sweep: Sweep, chunks: Iterable[Chunk]) -> Generator[Done, None, None]:
        """The finished chunks as they come."""
        ...


class Serial:
    """In this process."""

    def run(self, sweep: Sweep, chunks: Iterable[Chunk]) -> Generator[Done, None, None]:
        """In order."""
        return (compute(sweep, chunk) for chunk in chunks)


class Processes:
    """Processes of this machine, one thread of linear algebra each.

    A process without threads is forked, which saves every worker two seconds of imports; anything else starts fresh
    interpreters. Workers end by themselves when their parent is gone.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def run(self, sweep: Sweep, chunks: Iterable[Chunk]) -> Generator[Done, None, None]:
        """In the order in which they are finished. Raises SpecError if a worker dies.

        The workers are started before this returns, so that they are forked before a progress bar starts its thread.
        """
        forks = sys.platform == "linux" and threading.active_count() == 1
        context = get_context("fork" if forks else "spawn")
        pool = ProcessPoolExecutor(self.workers, context, _begin, (sweep, os.getpid()))
        left = iter(chunks)
        waiting = {pool.submit(_work, chunk) for chunk in islice(left, self.workers * IN_FLIGHT)}
        return _drain(pool, waiting, left)


def _drain(pool: ProcessPoolExecutor, waiting: set[Future[Done]], left: Iterator[Chunk]) -> Generator[Done, None, None]:
    try:
        while waiting:
            finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            waiting |= {pool.submit(_work, chunk) for chunk in islice(left, len(finished))}
            for future in finished:
                yield future.result()
    except BrokenProcessPool:
        raise SpecError(
            "a worker process was killed (out of memory?); finished chunks are kept: use fewer --workers or a smaller "
            "chunk, and continue with --resume"
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


_held: list[Sweep] = []  # the sweep of this worker process


def _begin(sweep: Sweep, parent: int) -> None:
    _held[:] = [sweep]
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """A pool's worker waits on a pipe that it holds open itself, so a killed parent would leave it behind for ever."""
    pause = threading.Event()
    while os.getppid() == parent:
        pause.wait(WATCH)
    os._exit(1)


def _work(chunk: Chunk) -> Done:
    return compute(_held[0], chunk)
