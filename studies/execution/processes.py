"""Who computes: this process, or worker processes of this machine (a Dask cluster: `studies.execution.cluster`)."""

from __future__ import annotations

import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import chain, count
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import parent_process
from threading import Thread, active_count
from time import perf_counter
from typing import Any, Protocol, TypeVar
from warnings import catch_warnings, simplefilter

from estimators.display import Display
from synthesis.errors import SpecError

TICK = 0.2  # s between two looks at the progress bar
ENDING = (signal.SIGINT, signal.SIGTERM)
Function = Callable[[Any, Any], Any]
Task = TypeVar("Task")
Value = TypeVar("Value")


@dataclass(frozen=True)
class Finished:
    """A task with the ``value`` that the function returned, or with how its process died."""

    task: Any
    value: Any = None
    seconds: float = 0.0
    death: str = ""


class Executor(Protocol):
    """Computes function(shared, task) for tasks in any order; an iterator, so that memory stays bounded."""

    def run(self, function: Function, shared: Any, tasks: Iterable[Any]) -> Generator[Finished, None, None]:
        """The finished tasks as they come. Raises what the function raises."""
        ...


class Serial(Display):
    """In this process.

    >>> [done.value for done in Serial().run(lambda shared, task: shared + task, 10, [1, 2])]
    [11, 12]
    """

    def run(self, function: Function, shared: Any, tasks: Iterable[Any]) -> Generator[Finished, None, None]:
        """In order."""
        return (Finished(task, function(shared, task)) for task in tasks)


class Processes(Display):
    """Processes of this machine: forked where that is safe, else fresh interpreters. They end when their parent is gone.

    A worker has up to ``ahead`` tasks at once, so that it need not wait; results are never held in numbers. With ``once``
    every task has a process of its own, so that a crash or its memory stays with it. ``watch`` is shown the tasks under way
    several times a second.

    >>> def double(shared, task):
    ...     return 2 * task
    >>> sorted(done.value for done in Processes(2).run(double, None, [1, 2]))
    [2, 4]
    """

    def __init__(
        self, workers: int, ahead: int = 3, once: bool = False, watch: Callable[[list[Any]], None] = lambda _: None
    ) -> None:
        self.workers, self.ahead, self.once, self.watch = workers, 1 if once else ahead, once, watch

    def run(self, function: Function, shared: Any, tasks: Iterable[Any]) -> Generator[Finished, None, None]:
        """In the order in which they are finished.

        The workers are started before this returns, so that they are forked before a progress bar starts its thread. ``tasks``
        is asked whenever a worker is free and may answer None: nothing yet, ask again once a task is finished. Leaving
        early ends the workers.
        """
        results = _Pool(self, function, shared, iter(tasks)).results()
        next(results)  # from here on it ends its workers when it is closed
        return results


def in_order(function: Callable[[Task], Value], tasks: Sequence[Task], workers: int) -> Iterator[Value]:
    """function(task) of all tasks, in their order; the work is under way when this returns. SpecError if a process dies."""
    if min(workers, len(tasks)) < 2:
        return map(function, tasks)
    return _sorted(Processes(workers, ahead=1).run(_numbered, function, enumerate(tasks)))


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Worker:
    """A process with the tasks that it was given and has not answered."""

    def __init__(self, function: Function, shared: Any, once: bool) -> None:
        # A fork saves every worker seconds of imports; it is safe on Linux in a process of one thread.
        context: Any = get_context("fork" if sys.platform == "linux" and active_count() == 1 else "spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(function, shared, once, theirs))
        with catch_warnings():  # libraries keep idle threads of their own, which a fork does not disturb
            simplefilter("ignore", DeprecationWarning)
            self.process.start()
        theirs.close()  # its end must be the only one: then a dead worker is an end of file
        self.tasks: deque[tuple[Any, float]] = deque()

    def give(self, task: Any) -> None:
        """One more task."""
        self.tasks.append((task, perf_counter()))
        with suppress(BrokenPipeError):  # it is dead, which `answer` will find
            self.pipe.send(task)

    def answer(self) -> Finished:
        """Of the oldest task."""
        task, start = self.tasks.popleft()
        try:
            good, value = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            return Finished(task, None, perf_counter() - start, _death(self.process.exitcode))
        if not good:
            raise value
        return Finished(task, value, perf_counter() - start)


class _Pool:
    def __init__(self, settings: Processes, function: Function, shared: Any, left: Iterator[Any]) -> None:
        self.settings, self.function, self.shared, self.left = settings, function, shared, left
        self.workers: list[_Worker] = []

    def hand_out(self) -> None:
        """Give tasks as long as there is room and there are some."""
        while len(self.workers) < self.settings.workers or len(self._idlest().tasks) < self.settings.ahead:
            task = next(self.left, None)
            if task is None:
                return
            if len(self.workers) < self.settings.workers and (not self.workers or self._idlest().tasks):
                with _signals_held():  # or a worker is lost between its fork and this list, and nobody ends it
                    self.workers.append(_Worker(self.function, self.shared, self.settings.once))
            self._idlest().give(task)

    def _idlest(self) -> _Worker:
        return min(self.workers, key=lambda worker: len(worker.tasks))

    def results(self) -> Generator[Finished, None, None]:
        try:
            self.hand_out()
            yield Finished(None)
            while busy := {worker.pipe: worker for worker in self.workers if worker.tasks}:
                self.settings.watch([worker.tasks[0][0] for worker in busy.values()])
                for pipe in wait(list(busy), TICK):
                    worker = busy[pipe]
                    finished = worker.answer()
                    if self.settings.once or finished.death:
                        self._dismiss(worker)
                    yield finished
                self.hand_out()
        finally:
            with _signals_held():
                for worker in self.workers:
                    worker.process.kill()
                    worker.process.join()

    def _dismiss(self, worker: _Worker) -> None:
        worker.pipe.close()
        worker.process.join()
        self.workers.remove(worker)
        self.left = chain([task for task, _ in worker.tasks], self.left)


@contextmanager
def _signals_held() -> Iterator[None]:
    """A request to end waits until this is over."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(function: Function, shared: Any, once: bool, parent: Connection) -> None:
    """A worker's life: function(shared, task) for each task, until it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what an interrupt means
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a fork would have the parent's
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            task = parent.recv()
        except EOFError:
            return
        try:
            answer = True, function(shared, task)
        except Exception as error:
            answer = False, error
        parent.send(answer)
        if once:
            return


def _end_with_parent() -> None:
    """A worker without parent would compute for nobody; the sentinel is ready as soon as the parent is gone."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _death(code: int | None) -> str:
    if code is not None and code < 0:
        return f"its process was ended by {signal.Signals(-code).name}; is there enough memory?"
    return f"its process ended with code {code} and no word"


def _numbered(function: Callable[[Any], Any], task: tuple[int, Any]) -> Any:
    return function(task[1])


def _sorted(results: Iterator[Finished]) -> Iterator[Any]:
    early: dict[int, Any] = {}
    for number in count():
        while number not in early:
            finished = next(results, None)
            if finished is None:
                return
            if finished.death:
                raise SpecError(f"a worker did not finish: {finished.death}")
            early[finished.task[0]] = finished.value
        yield early.pop(number)
