"""A whole run: what is stored is kept, the rest is computed, then results, claims and the report are written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from estimators.display import Display
from studies.execution.files import discard_unfinished, only_run, ready_folder, write_bytes, write_json
from studies.execution.fingerprint import Sources
from studies.execution.processes import Processes
from studies.parts.job import Job, compute
from studies.parts.marks import Marks
from studies.parts.record import StudyRecord, all_claims, check_parts, record_study
from studies.parts.results import check_replaceable, read_result, write_study
from studies.parts.store import discard_prepared, is_prepared, part_folder, read_part
from studies.registry import Registry
from studies.study import Scope, Study

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Outcome:
    """What became of a part: stored (was there already), computed, or failed with a ``message``."""

    study: str
    part: str
    state: str
    seconds: float = 0.0
    message: str = ""


@dataclass(frozen=True, repr=False)
class RunSummary(Display):
    """What a run did: an outcome for each part, the studies that the report shows, and the files."""

    outcomes: tuple[Outcome, ...]
    records: tuple[StudyRecord, ...]
    paths: tuple[Path, ...]

    @property
    def failures(self) -> list[tuple[str, str, str]]:
        """(study, part, message) of everything that is not there."""
        return [(r.id, part.name, part.failure) for r in self.records for part in r.parts if part.failure]

    @property
    def missing_claims(self) -> list[str]:
        """Published claims without a computed value."""
        return [claim for record in self.records for claim in record.missing_claims]

    @property
    def good(self) -> bool:
        """Whether every part and every published claim is there."""
        return not self.failures and not self.missing_claims


def run_studies(
    ids: Sequence[str],
    out: Path,
    scope: Scope,
    workers: int,
    registry: Registry,
    progress: Progress = lambda _done, _text: None,
    sources: Sources | None = None,
) -> RunSummary:
    """Run the studies ``ids`` into ``out``; ``progress`` hears the share done and what is running.

    Parts with the fingerprint of ``sources`` (default: the packages) and ``scope`` are not computed again. The report
    also shows studies of earlier runs into ``out`` whose fingerprint is the same. Raises SpecError for unknown
    studies and for a folder in use or that cannot be, OSError when nothing more can be written.

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     print(run_studies([], Path(folder), Scope(quick=True), 1, Registry({})).failures)
    []
    """
    studies = {name: registry.load(name) for name in ids}
    check_parts(list(studies.values()))
    marks = Marks(registry, scope, sources)
    ready_folder(out)
    with only_run(out):
        for name in studies:
            check_replaceable(out / name)
        discard_unfinished(out)
        outcomes = _compute(list(studies.values()), out, marks, workers, progress)
        progress(1.0, "writing the report")
        failed = {(o.study, o.part): o.message for o in outcomes if o.state == "failed"}
        if not failed:
            discard_prepared(out)
        shown = _with_earlier(studies, out, marks)
        records = [record_study(study, registry, out, marks, failed) for study in shown]
        return RunSummary(tuple(outcomes), tuple(records), tuple(_write(records, set(studies), out)))


def _compute(studies: Sequence[Study], out: Path, marks: Marks, workers: int, progress: Progress) -> list[Outcome]:
    """An outcome for every part. A preparation that fails fails every part that needs it, and no other."""
    outcomes: list[Outcome] = []
    jobs: list[Job] = []
    first: dict[str, Job] = {}  # one for each preparation that is not there yet, whoever needs it
    for study in studies:
        for part in study.chosen(marks.scope):
            job = Job(study.id, part.name, part.cost, marks.scope, marks.part(part), out)
            if read_part(part_folder(out, study.id, part.name), job.fingerprint) is not None:
                outcomes.append(Outcome(study.id, part.name, "stored"))
                continue
            missing = [need for need in part.needs if not is_prepared(out, need.name, marks.preparation(need))]
            for need in missing:
                first[need.name] = replace(
                    job, cost=need.cost, fingerprint=marks.preparation(need), preparation=need.name
                )
            jobs.append(replace(job, waits_for=tuple(need.name for need in missing)))
    pending = sorted([*first.values(), *jobs], key=lambda job: (bool(job.preparation), job.cost))
    total, done = sum(job.cost for job in pending) or 1.0, 0.0
    ended: dict[str, str] = {}  # preparations, and what went wrong with them

    def ready() -> Iterator[Job | None]:
        """Preparations first, then the longest part; None while all that are left wait for a preparation."""
        while pending:
            job = next((job for job in reversed(pending) if ended.keys() >= set(job.waits_for)), None)
            if job is not None:
                pending.remove(job)
                broken = next((name for name in job.waits_for if ended[name]), None)
                if broken is not None:
                    outcomes.append(Outcome(job.study, job.part, "failed", message=f"{broken}: {ended[broken]}"))
                    continue
            yield job

    def watch(running: list[Job]) -> None:
        progress(done / total, ", ".join(job.label for job in running))

    pool = Processes(workers, once=True, watch=watch)
    with closing(pool.run(compute, marks.registry, ready())) as results:
        for finished in results:
            job, message = finished.task, finished.death or finished.value
            done += job.cost
            if job.preparation:
                ended[job.preparation] = message
            else:
                state = "failed" if message else "computed"
                outcomes.append(Outcome(job.study, job.part, state, finished.seconds, message))
    return outcomes


def _with_earlier(studies: dict[str, Study], out: Path, marks: Marks) -> Iterator[Study]:
    """The chosen studies and those that earlier runs left with the same fingerprint, in the registry's order."""
    for name in marks.registry.modules:
        if name in studies:
            yield studies[name]
        elif (result := read_result(out / name)) is not None and result.get("fingerprint") == marks.study(name):
            yield marks.registry.load(name)


def _write(records: Sequence[StudyRecord], chosen: set[str], out: Path) -> list[Path]:
    from studies.report.html.page import report_page
    from studies.report.scoreboard import scoreboard
    from studies.report.scoreboard_picture import scoreboard_svg

    claims = all_claims(records)
    for record in records:
        if record.id in chosen:
            write_study(record, out)
    write_json(out / "claims.json", claims)
    board = scoreboard(claims, {record.paper: record.id for record in records if record.paper})
    texts = {out / "scoreboard.svg": scoreboard_svg(board), out / "report.html": report_page(records, claims, board)}
    for path, text in texts.items():
        write_bytes(path, text.encode())
    return [out / "claims.json", *texts]
