"""One run at a time in a folder."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from synthesis.errors import SpecError

NAME = ".lock"


@contextmanager
def only_run(folder: Path, busy: str = "another run writes here (process {holder})") -> Iterator[None]:
    """Hold ``folder`` for this process; SpecError with the sentence ``busy`` when another process holds it.

    A record lock belongs to the process: the system takes it back however the process ends, and forked workers do not
    inherit it.
    """
    with (folder / NAME).open("a+", encoding="ascii") as file:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            file.seek(0)
            words = busy.format(holder=file.read().strip() or "unknown")
            raise SpecError(f"{folder}: {words}; wait for it or give another --out") from error
        file.seek(0)
        file.truncate()
        file.write(str(os.getpid()))
        file.flush()
        yield
