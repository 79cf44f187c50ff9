"""Regenerate gain schedules from their specifications: design, table, proof, file, and drift against what is there."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from os import cpu_count
from pathlib import Path
from threading import active_count
from time import perf_counter
from typing import Any

import numpy as np

from analysis.dropout_schedule import frozen_critical_probability
from estimators.errors import ScheduleError
from estimators.schedule import GainSchedule, read_content
from studies.spec import load_spec
from synthesis.deploy import deploy
from synthesis.errors import GainsmithError
from synthesis.export import export, schedule_content
from synthesis.hinf_observer import design_observer
from synthesis.models.parameter_set import ParameterSet
from synthesis.verify import Proof, prove

# Solvers and linear algebra differ between machines; a drift below this share of the largest gain is not a change.
DRIFT_TOLERANCE = 1e-3


@dataclass(frozen=True)
class ScheduleRun:
    """One specification, done: `state` is written, unchanged, same (--check), drift, missing or failed."""

    name: str
    state: str
    seconds: float
    message: str = ""
    content: dict[str, Any] = field(default_factory=dict)
    proofs: tuple[Proof, ...] = ()
    published: tuple[tuple[float, float], ...] | None = None
    drift: float | None = None

    @property
    def good(self) -> bool:
        """Whether there is nothing to complain about."""
        return self.state in ("written", "unchanged", "same")


def regenerate(names: Iterable[str], out: Path, check: bool = False) -> Iterator[ScheduleRun]:
    """Run the specifications on as many processes as there are cores; order as given.

    The work is under way when this returns. A process without threads is forked, which saves every worker two seconds
    of imports; anything else starts fresh interpreters.
    """
    work = [(name, out, check) for name in names]
    workers = min(len(work), cpu_count() or 1)
    if workers < 2:
        return map(_run, work)
    forks = sys.platform == "linux" and active_count() == 1
    pool = ProcessPoolExecutor(workers, mp_context=get_context("fork" if forks else "spawn"))
    results = pool.map(_run, work)
    pool.shutdown(wait=False)
    return results


def _run(item: tuple[str, Path, bool]) -> ScheduleRun:
    name, out, check = item
    start = perf_counter()
    try:
        return run_spec(name, out, check)
    except (GainsmithError, ScheduleError) as error:
        return ScheduleRun(Path(name).stem, "failed", perf_counter() - start, str(error))


def run_spec(name: str, out: Path, check: bool = False) -> ScheduleRun:
    """Design, deploy, prove and write one schedule (or compare it, with `check`).

    An existing file is left alone when it still certifies, comes from the same specification and differs by less than
    DRIFT_TOLERANCE: regenerating on another machine then changes nothing. Raises GainsmithError.
    """
    start = perf_counter()
    spec, folder = load_spec(name)
    parameters = spec.parameter_set(folder)
    gains = design_observer(spec.build_model(parameters), spec.observer_design())
    deployment = deploy(gains, spec.deploy_settings())
    content = schedule_content(deployment, spec.name, spec.description, spec.resolved(parameters))
    content["guarantee"]["drop_tolerance"] = drop_tolerance(content)
    path = out / f"{spec.name}.json"
    published = _published_range(parameters, spec.model.id)
    state, message, drift = compare(path, content)
    if state == "same":
        proofs = tuple(prove(read_content(path), str(path)))
    elif check:
        return ScheduleRun(spec.name, state, perf_counter() - start, message, content, (), published, drift)
    else:
        out.mkdir(parents=True, exist_ok=True)
        proofs = tuple(export(path, content))
        state, message = "written", ""
    state = "unchanged" if state == "same" and not check else state
    return ScheduleRun(spec.name, state, perf_counter() - start, message, content, proofs, published, drift)


def drop_tolerance(content: dict[str, Any]) -> dict[str, Any]:
    """How many measurements may be lost at random: two numbers that answer different questions (P3 section 6).

    `frozen`: exact at every constant parameter, taken at the worst. `proved`: also while the parameter moves within its
    rate, an exact claim of the certificate. Between the two lies what `analysis.mean_square_schedule` certifies in floating
    point, which takes minutes for slow observers and is left to a study.
    """
    frozen = frozen_critical_probability(GainSchedule.from_content(content))
    return {
        "frozen_critical_probability": frozen.smallest,
        "frozen_place": {"parameter": frozen.parameter, "value": frozen.place, "unit": frozen.unit},
        "proved_probability": content["guarantee"]["claims"].get("drop probability"),
    }


def compare(path: Path, content: dict[str, Any]) -> tuple[str, str, float | None]:
    """How the file at `path` stands to freshly made content: (same | drift | missing, why, size of the drift)."""
    if not path.exists():
        return "missing", f"{path} does not exist", None
    try:
        old = read_content(path)
        failed = [proof for proof in prove(old, str(path)) if not proof.proved]
    except ScheduleError as error:
        return "drift", str(error), None
    if failed:
        return "drift", f"{path}: '{failed[0].claim}' is not proved at {failed[0].place}", None
    if old["provenance"]["spec_sha256"] != content["provenance"]["spec_sha256"]:
        return "drift", f"{path} was made from another specification or other parameter values", None
    if old["scheduling"] != content["scheduling"]:
        return "drift", f"{path} has other breakpoints or another box", None
    before, after = np.array(old["gain"]["table"]), np.array(content["gain"]["table"])
    drift = float((np.abs(after - before).max(axis=0) / np.abs(before).max(axis=0)).max())
    for claim, level in content["guarantee"]["claims"].items():
        was = old["guarantee"]["claims"].get(claim)
        drift = max(drift, np.inf if was is None else abs(level / was - 1.0))
    if drift > DRIFT_TOLERANCE:
        return "drift", f"{path}: gains or guarantee moved by {drift:.1e} (tolerance {DRIFT_TOLERANCE:g})", drift
    return "same", "", drift


def _published_range(parameters: ParameterSet, model: str) -> tuple[tuple[float, float], ...] | None:
    tire = parameters.tire.get(model.removeprefix("corner-velocity-"))
    return None if tire is None or tire.published is None else tire.published.gain_range
