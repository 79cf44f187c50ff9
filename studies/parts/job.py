"""One part, or what parts need, computed and stored: what a worker process does."""

from __future__ import annotations

import traceback
from dataclasses import dataclass, replace
from pathlib import Path

from studies.execution.fingerprint import SOURCE_ROOT
from studies.parts.store import part_folder, prepare, prepared_root, write_part
from studies.registry import Registry
from studies.study import Scope


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


def compute(registry: Registry, job: Job) -> str:
    """Compute and store; why that failed in one line, or nothing. Raises OSError when it cannot be written."""
    writing = bool(job.preparation)  # a preparation writes while it computes
    try:
        part = next(part for part in registry.load(job.study).parts if part.name == job.part)
        if job.preparation:
            need = next(need for need in part.needs if need.name == job.preparation)
            prepare(need, job.out, job.scope, job.fingerprint)
        else:
            result = part.run(replace(job.scope, prepared=prepared_root(job.out)))
            writing = True
            write_part(part_folder(job.out, job.study, job.part), result, job.fingerprint)
    except BaseException as error:
        if writing and isinstance(error, OSError):
            raise
        return one_line(error)
    return ""


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
