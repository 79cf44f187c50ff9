"""Computing the parts that are not stored: what they need first, then they."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from studies.registry import Registry
from studies.running.pool import Outcome, run_jobs
from studies.running.prepared import is_prepared
from studies.running.store import part_folder, read_part
from studies.running.worker import Job
from studies.study import Scope, Study

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Pool:
    """The worker processes, and who hears the share done and what is running."""

    registry: Registry
    workers: int
    progress: Progress

    def outcomes(self, jobs: Sequence[Job]) -> Iterator[Outcome]:
        """Run ``jobs``."""
        total, done = sum(job.cost for job in jobs) or 1.0, 0.0

        def tick(running: list[Job]) -> None:
            self.progress(done / total, ", ".join(job.label for job in running))

        with closing(run_jobs(jobs, self.registry, self.workers, tick)) as finished:
            for outcome in finished:
                done += outcome.job.cost
                yield outcome


def compute_parts(studies: Sequence[Study], out: Path, scope: Scope, mark: str, pool: Pool) -> list[Outcome]:
    """An outcome for every part: stored with fingerprint ``mark`` already, computed, or failed.

    A preparation that fails fails every part that needs it, and no other.
    """
    stored: list[Outcome] = []
    jobs: list[Job] = []
    first: dict[str, Job] = {}  # one for each preparation that is not there yet, whoever needs it
    for study in studies:
        for part in study.chosen(scope):
            job = Job(study.id, part.name, part.cost, scope, mark, out)
            if read_part(part_folder(out, study.id, part.name), mark) is not None:
                stored.append(Outcome(job, "stored"))
                continue
            missing = [need for need in part.needs if not is_prepared(out, need.name, mark)]
            first |= {need.name: replace(job, cost=need.cost, preparation=need.name) for need in missing}
            jobs.append(replace(job, waits_for=tuple(need.name for need in missing)))
    return stored + [o for o in pool.outcomes([*first.values(), *jobs]) if not o.job.preparation]
