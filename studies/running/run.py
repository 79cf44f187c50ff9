"""A whole run: what is stored is kept, the rest is computed, then results, claims and the report are written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from studies.drives.output import ready_folder, whole_file
from studies.registry import Registry
from studies.running.compute import Pool, Progress, compute_parts
from studies.running.fingerprint import fingerprint
from studies.running.lock import only_run
from studies.running.pool import Outcome
from studies.running.prepared import discard_prepared, sweep_prepared
from studies.running.record import StudyRecord, all_claims, check_parts, record_study
from studies.running.results import check_replaceable, read_result, write_claims, write_study
from studies.running.store import sweep_parts
from studies.running.whole_folder import sweep
from studies.study import Scope, Study


@dataclass(frozen=True)
class RunSummary:
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
    sources: Sequence[Path] | None = None,
) -> RunSummary:
    """Run the studies ``ids`` into ``out``; ``progress`` hears the share done and what is running.

    Parts with the fingerprint of ``sources`` (default: the packages) and ``scope`` are not computed again. The report
    also shows studies of earlier runs into ``out`` whose fingerprint is the same. Raises SpecError for unknown
    studies and for a folder in use, LogError or OSError when ``out`` cannot be written.
    """
    studies = {name: registry.load(name) for name in ids}
    check_parts(list(studies.values()))
    mark = fingerprint(scope, sources)
    ready_folder(out)
    with _naming(out), only_run(out):
        for name in studies:
            check_replaceable(out / name)
            sweep_parts(out, name)
        sweep_prepared(out)
        sweep(out)
        outcomes = compute_parts(list(studies.values()), out, scope, mark, Pool(registry, workers, progress))
        progress(1.0, "writing the report")
        shown = _with_earlier(studies, registry, out, mark)
        failed = {(o.study, o.part): o.message for o in outcomes if o.state == "failed"}
        if not failed:
            discard_prepared(out)
        records = [
            record_study(
                study, registry, out, scope, mark, {part: text for (name, part), text in failed.items() if name == key}
            )
            for key, study in shown.items()
        ]
        return RunSummary(tuple(outcomes), tuple(records), tuple(_write(records, set(studies), out)))


@contextmanager
def _naming(out: Path) -> Iterator[None]:
    """A full disk is reported without a name where the file is already open; then the folder says where."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror, error.filename or str(out)) from error


def _with_earlier(studies: dict[str, Study], registry: Registry, out: Path, mark: str) -> dict[str, Study]:
    """The chosen studies and those that earlier runs left with the same fingerprint, in the registry's order."""
    shown = {}
    for name in registry.modules:
        if name in studies:
            shown[name] = studies[name]
        elif (result := read_result(out / name)) is not None and result.get("fingerprint") == mark:
            shown[name] = registry.load(name)
    return shown


def _write(records: Sequence[StudyRecord], chosen: set[str], out: Path) -> list[Path]:
    from studies.report.html.page import report_page
    from studies.report.scoreboard import scoreboard
    from studies.report.scoreboard_picture import scoreboard_svg

    claims = all_claims(records)
    for record in records:
        if record.id in chosen:
            write_study(record, out)
    write_claims(out / "claims.json", claims)
    board = scoreboard(claims, {record.paper: record.id for record in records if record.paper})
    texts = {out / "scoreboard.svg": scoreboard_svg(board), out / "report.html": report_page(records, claims, board)}
    for path, text in texts.items():
        with whole_file(path) as beside:
            beside.write_text(text, encoding="utf-8")
    return [out / "claims.json", *texts]
