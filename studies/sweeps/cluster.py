"""Chunks on a Dask cluster by the address of its scheduler."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Generator, Iterable
from itertools import islice
from typing import Any

from studies.sweeps.executors import IN_FLIGHT
from studies.sweeps.sweep import Chunk, Sweep
from studies.sweeps.tables import Done, compute
from synthesis.errors import SpecError

ANSWER = 4.0  # s that a scheduler has to answer
OTHERS = (TypeError, LookupError, EOFError, MemoryError, struct.error)  # what comes of reading what a stranger says
RETRIES = 3  # times that a chunk is given to another worker after one was lost with it


class Cluster:
    """Workers of a Dask scheduler; they need the same gainsmith installed, and no shared folder.

    A worker that is lost gives its chunks to the others. Raises SpecError for an address that does not answer or has no workers.
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

    def run(self, sweep: Sweep, chunks: Iterable[Chunk]) -> Generator[Done, None, None]:
        """In the order in which they are finished."""
        self.require()
        from distributed import Client, as_completed
        from distributed.scheduler import KilledWorker

        with _quiet():
            client = _client(Client, self.address)
            try:
                yield from self._run(client, as_completed, KilledWorker, sweep, chunks)
            finally:
                client.close(timeout=ANSWER)

    def _run(
        self, client: Any, as_completed: Any, killed: type[Exception], sweep: Sweep, chunks: Iterable[Chunk]
    ) -> Generator[Done, None, None]:
        threads = sum(client.nthreads().values())
        if not threads:
            raise SpecError(f"--scheduler {self.address}: has no workers; start some with dask worker {self.address}")
        shared = client.submit(_same, sweep, pure=False)  # sent once; made again from its recipe if its worker is lost
        left = iter(chunks)
        running = as_completed(
            [
                client.submit(compute, shared, chunk, pure=False, retries=RETRIES)
                for chunk in islice(left, threads * IN_FLIGHT)
            ],
            loop=client.loop,
        )
        for future in running:
            try:
                done: Done = future.result()
            except killed as error:
                raise SpecError(
                    f"--scheduler {self.address}: {error}; finished chunks are kept, use --resume"
                ) from None
            future.release()
            yield done
            for chunk in islice(left, 1):
                running.add(client.submit(compute, shared, chunk, pure=False, retries=RETRIES))


async def _answers(address: str) -> None:
    from distributed.comm.core import connect

    untyped: Any = connect
    comm = await asyncio.wait_for(untyped(address, timeout=ANSWER), ANSWER)
    await comm.close()


def _client(kind: Any, address: str) -> Any:
    return kind(address, timeout=ANSWER, set_as_default=False)


def _same(sweep: Sweep) -> Sweep:
    return sweep


class _quiet:  # noqa: N801  a context manager reads as a verb
    """Dask logs every lost connection with a traceback; what matters is said in one line."""

    def __enter__(self) -> None:
        import logging

        self.logger = logging.getLogger("distributed")
        self.level = self.logger.level
        self.logger.setLevel(logging.CRITICAL + 1)

    def __exit__(self, *_: object) -> None:
        self.logger.setLevel(self.level)
