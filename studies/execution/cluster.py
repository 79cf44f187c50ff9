"""Tasks on a Dask cluster by the address of its scheduler."""

from __future__ import annotations

import asyncio
import logging
import struct
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any

from estimators.display import Display
from studies.execution.processes import Finished, Function
from synthesis.errors import SpecError

ANSWER = 4.0  # s that a scheduler has to answer
OTHERS = (TypeError, LookupError, EOFError, MemoryError, struct.error)  # what comes of reading what a stranger says
RETRIES = 3  # times that a task is given to another worker after one was lost with it
IN_FLIGHT = 3  # tasks a thread has waiting: results are never held in numbers


class Cluster(Display):
    """Workers of a Dask scheduler; they need the same gainsmith installed, and no shared folder.

    A worker that is lost gives its tasks to the others. Raises SpecError for an address that does not answer or has no workers.
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
        """In the order in which they are finished."""
        self.require()
        from distributed import Client, as_completed
        from distributed.scheduler import KilledWorker

        untyped: Any = Client
        completed: Any = as_completed
        with _quiet():
            client = untyped(self.address, timeout=ANSWER, set_as_default=False)
            try:
                threads = sum(client.nthreads().values())
                if not threads:
                    remedy = f"start some with dask worker {self.address}"
                    raise SpecError(f"--scheduler {self.address}: has no workers; {remedy}")
                sent = client.submit(_same, shared, pure=False)  # once; made again if its worker is lost
                left = iter(tasks)

                def submit(task: Any) -> Any:
                    return client.submit(_answer, function, sent, task, pure=False, retries=RETRIES)

                running = completed([submit(t) for t in islice(left, threads * IN_FLIGHT)], loop=client.loop)
                for future in running:
                    task, value = future.result()
                    future.release()
                    yield Finished(task, value)
                    for more in islice(left, 1):
                        running.add(submit(more))
            except KilledWorker as error:
                kept = "finished chunks are kept, use --resume"
                raise SpecError(f"--scheduler {self.address}: {error}; {kept}") from None
            finally:
                client.close(timeout=ANSWER)


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
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)
