"""Tasks on a Dask cluster by the address of its scheduler."""

from __future__ import annotations

import asyncio
import concurrent.futures
import logging
import struct
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from typing import Any, NoReturn

from estimators.display import Display
from studies.execution.processes import Finished, Function
from synthesis.errors import SpecError

ANSWER = 4.0  # s that a scheduler has to answer
OTHERS = (TypeError, LookupError, EOFError, MemoryError, struct.error)  # what comes of reading what a stranger says
RETRIES = 3  # times that a task is given to another worker after one was lost with it
IN_FLIGHT = 3  # tasks a thread has waiting: results are never held in numbers
LOOK, PATIENCE = 5.0, 12  # s between two looks at a cluster that finishes nothing; looks without any worker
CANCELLED = (
    asyncio.CancelledError,
    concurrent.futures.CancelledError,
)  # what Dask's tasks raise without their scheduler


class Cluster(Display):
    """Workers of a Dask scheduler; they need the same gainsmith installed, and no shared folder.

    A worker that is lost gives its tasks to the others. Raises SpecError for an address that does not answer or has no workers.

    >>> Cluster("tcp://127.0.0.1:8786").address  # asked only when a sweep runs
    'tcp://127.0.0.1:8786'
    """

    def __init__(self, address: str) -> None:
        self.address = address

    def require(self) -> None:
        """Raises SpecError unless a scheduler answers."""
        try:
            import distributed  # noqa: F401
        except ImportError:
            raise SpecError("--scheduler needs Dask: pip install 'gainsmith[cluster]'") from None
        try:
            # the client itself waits for ever on a port that accepts and says nothing
            asyncio.run(_answers(self.address))
        except (OSError, TimeoutError, ValueError) as error:
            reason = f"; {str(error).splitlines()[0]}" if str(error) else ""
            raise SpecError(f"--scheduler {self.address}: no answer within {ANSWER:g} s{reason}") from None
        except OTHERS:
            raise SpecError(f"--scheduler {self.address}: something answers there that is no Dask scheduler") from None

    def run(self, function: Function, shared: Any, tasks: Iterable[Any]) -> Generator[Finished, None, None]:
        """In the order in which they are finished. Raises SpecError when the scheduler or all its workers are lost."""
        self.require()
        from distributed import Client

        untyped: Any = Client
        with _quiet():
            try:
                client = untyped(self.address, timeout=ANSWER, set_as_default=False)
            except OSError:
                self._lost("the scheduler was lost")
            client.loop.asyncio_loop.set_exception_handler(lambda *_: None)  # the same of tasks that nobody waits for
            try:
                yield from self._finished(client, function, shared, iter(tasks))
            finally:
                with suppress(Exception):  # of a lost scheduler nobody can take leave
                    client.close(timeout=ANSWER)

    def _finished(self, client: Any, function: Function, shared: Any, left: Iterator[Any]) -> Iterator[Finished]:
        from distributed.comm.core import CommClosedError
        from distributed.scheduler import KilledWorker

        try:
            threads = sum(client.nthreads().values())
            if not threads:
                self._lost(f"has no workers; start some with dask worker {self.address}", resume=False)
            sent = client.submit(_same, shared, pure=False)  # once; made again if its worker is lost

            def submit(tasks: Iterable[Any]) -> set[Any]:
                return {client.submit(_answer, function, sent, t, pure=False, retries=RETRIES) for t in tasks}

            running, silent = submit(islice(left, threads * IN_FLIGHT)), 0
            while running:
                answers = self._answers(client, running)
                running -= answers.keys()
                running |= submit(islice(left, len(answers)))
                yield from (Finished(task, value) for task, value in answers.values())
                silent = 0 if answers or self._workers(client) else silent + 1
                if silent == PATIENCE:
                    self._lost(f"no worker for {PATIENCE * LOOK:.0f} s")
        except KilledWorker:
            self._lost("workers died one after another on the same task (out of memory?)")
        except (*CANCELLED, CommClosedError):
            self._lost("the scheduler was lost")
        except Exception:
            if client.status != "running":
                self._lost("the scheduler was lost")
            raise

    def _answers(self, client: Any, running: set[Any]) -> dict[Any, tuple[Any, Any]]:
        """What is finished, after a while at most. A result that was lost with its worker is computed again."""
        from distributed import wait

        untyped: Any = wait
        answers: dict[Any, tuple[Any, Any]] = {}
        with client.as_current():
            try:
                for future in untyped(running, timeout=LOOK, return_when="FIRST_COMPLETED").done:
                    answers[future] = future.result(timeout=LOOK)
            except TimeoutError:
                for future in running:
                    if future.status == "error":  # the function's own time-out
                        raise
        return answers

    def _workers(self, client: Any) -> bool:
        """Whether there are some; a cluster may shrink to nothing for a while, and grow again."""
        with suppress(TimeoutError):
            return bool(client.sync(client.scheduler.ncores, callback_timeout=LOOK))
        return False

    def _lost(self, what: str, resume: bool = True) -> NoReturn:
        kept = "; finished chunks are kept, go on with --resume" if resume else ""
        raise SpecError(f"--scheduler {self.address}: {what}{kept}") from None


async def _answers(address: str) -> None:
    from distributed.comm.core import connect

    untyped: Any = connect
    comm = await asyncio.wait_for(untyped(address, timeout=ANSWER), ANSWER)
    await comm.close()


def _same(shared: Any) -> Any:
    return shared


def _answer(function: Function, shared: Any, task: Any) -> Any:
    return task, function(shared, task)


@contextmanager
def _quiet() -> Iterator[None]:
    """Dask logs every lost connection with a traceback; what matters is said in one line."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == "distributed"]
    loggers = [logging.getLogger(name) for name in names]  # several have a level of their own
    before = [(logger, logger.level) for logger in loggers]
    for logger, _ in before:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in before:
            logger.setLevel(level)
