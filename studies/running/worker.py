"""One part, or what parts need, in a process of its own: computed, stored, and what became of it told to the parent."""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from multiprocessing.process import parent_process
from pathlib import Path
from threading import Thread

from studies.plots.draw import look
from studies.registry import Registry
from studies.running.fingerprint import SOURCE_ROOT
from studies.running.prepared import prepare, prepared_root
from studies.running.store import part_folder, write_part
from studies.study import Part, Scope


@dataclass(frozen=True)
class Job:
    """A part to compute: ``study`` and ``part`` are names, so that a fresh interpreter can find it, too.

    With ``preparation``, that one of the part's needs is computed instead; ``waits_for`` are preparations of this run.
    """

    study: str
    part: str
    cost: float
    scope: Scope
    fingerprint: str
    out: Path
    preparation: str = ""
    waits_for: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """For the progress line."""
        return self.preparation or f"{self.study}/{self.part}"


@dataclass(frozen=True)
class Told:
    """The worker's last word: ``error`` is empty when the part is stored; ``errno`` is set when it could not be written."""

    error: str = ""
    errno: int | None = None
    path: str = ""


def work(job: Job, registry: Registry, parent: Connection) -> None:
    """Compute and store the part of ``job``; whatever it raises ends this process alone, with one line to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what an interrupt means
    Thread(target=_end_with_parent, daemon=True).start()
    computed = bool(job.preparation)  # a preparation writes while it computes
    try:
        part = find_part(registry.load(job.study).parts, job.part)
        if job.preparation:
            need = next(need for need in part.needs if need.name == job.preparation)
            prepare(need, job.out, job.scope, job.fingerprint)
        else:
            with look():
                result = part.run(replace(job.scope, prepared=prepared_root(job.out)))
                computed = True
                write_part(part_folder(job.out, job.study, job.part), result, job.fingerprint)
    except BaseException as error:
        if computed and isinstance(error, OSError):
            parent.send(Told(error.strerror or str(error), error.errno, str(error.filename or job.out)))
        else:
            parent.send(Told(one_line(error)))
        sys.exit(1)
    parent.send(Told())


def find_part(parts: Sequence[Part], name: str) -> Part:
    """The part called ``name``."""
    return next(part for part in parts if part.name == name)


def one_line(error: BaseException) -> str:
    """Class, message and the innermost place in the project's own sources."""
    text = " ".join(str(error).split())
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).is_relative_to(SOURCE_ROOT) and "site-packages" not in frame.filename
    ]
    place = f" ({Path(frames[-1].filename).relative_to(SOURCE_ROOT)}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {text}{place}" if text else f"{type(error).__name__}{place}"


def _end_with_parent() -> None:
    """A worker without parent would compute for nobody; the sentinel is ready as soon as the parent is gone."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
