"""The shipped manoeuvres on truth vehicles, integrated once and shared by all trials of a run.

A step costs the same for one run as for all of them, so that all manoeuvres on one kind of tire are one batch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from studies.study import Part, PartResult, Preparation, Scope
from studies.truth import Manoeuvre, Truth, load_manoeuvre, shipped_manoeuvres, simulate_manoeuvres
from studies.truth.record import read_truth, write_truth
from synthesis.errors import SpecError

LUGRE, MAGIC_FORMULA = "lugre", "magic-formula"
QUICK_SECONDS = 12.0  # of each manoeuvre, from its start, when quick


def _manoeuvres(names: Iterable[str], tire: str, scope: Scope, seconds: float = math.inf) -> list[Manoeuvre]:
    limit = min(seconds, QUICK_SECONDS) if scope.quick else math.inf
    loaded = (load_manoeuvre(name).with_tire(tire) for name in names)
    return [m.model_copy(update={"duration": min(m.duration, limit)}) for m in loaded]


def _drive_all(tire: str, scope: Scope, folder: Path) -> None:
    write_truth(simulate_manoeuvres(_manoeuvres(shipped_manoeuvres(), tire, scope)), folder)


SIMULATIONS = {t: Preparation(f"{t}-tires", partial(_drive_all, t), cost=40.0) for t in (LUGRE, MAGIC_FORMULA)}
"""Every shipped manoeuvre on one kind of tire."""


def trial_part(
    name: str, title: str, run: Callable[..., PartResult], cost: float, tire: str = LUGRE, quick: bool = False
) -> Part:
    """A part that runs estimators on shipped manoeuvres: ``run(scope, tire=tire)``; ``quick``: in quick runs, too."""
    return Part(name, title, partial(run, tire=tire), cost, (SIMULATIONS[tire],), quick)


def simulated_truth(names: tuple[str, ...], tire: str, scope: Scope, seconds: float = QUICK_SECONDS) -> Truth:
    """The truth of the named manoeuvres on ``tire``: read in a run of studies, integrated elsewhere.

    When quick, the first ``seconds`` of each. Raises SpecError for unknown names and where the run did not prepare it.
    """
    if scope.prepared is None:
        return simulate_manoeuvres(_manoeuvres(names, tire, scope, seconds))
    folder = scope.prepared / SIMULATIONS[tire].name
    if not folder.is_dir():
        raise SpecError(f"the part does not name its need '{SIMULATIONS[tire].name}': make it with `trial_part`")
    truth = read_truth(folder, [m.truth_vehicle() for m in _manoeuvres(shipped_manoeuvres(), tire, scope)])
    chosen = truth.only([truth.names.index(name) for name in names])
    return chosen.until(seconds) if scope.quick else chosen
