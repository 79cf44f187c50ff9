"""Reading manoeuvre files: shipped ones by name, others by path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from studies.truth.manoeuvre import Manoeuvre
from studies.truth.monte_carlo import simulate_in_processes
from studies.truth.record import Truth
from studies.truth.simulate import EVERYTHING, RECORD_TIME, STEP, simulate
from studies.truth.vehicle import TruthVehicle
from synthesis.toml_file import find_toml, load_toml, shipped_files


def shipped_manoeuvres(paper: str = "") -> dict[str, Path]:
    """The manoeuvre files that come with the package, by name; those of one paper (``"P1"``) if asked."""
    found = shipped_files("studies", "manoeuvres")
    return {name: path for name, path in found.items() if name.startswith(paper.lower())}


def load_manoeuvre(name: str | Path) -> Manoeuvre:
    """A shipped manoeuvre by name, or one of your own by its path (ends with .toml).

    Raises SpecError, one line: file, key, what is wrong, what would be right.
    """
    return load_toml(find_toml(name, shipped_manoeuvres(), "manoeuvre"), Manoeuvre, "manoeuvre")


def drive(
    manoeuvres: Sequence[Manoeuvre],
    vehicles: Sequence[TruthVehicle] | None = None,
    *,
    step: float = STEP,
    record_time: float = RECORD_TIME,
    record: Sequence[str] = EVERYTHING,
    progress: Callable[[float], None] | None = None,
    workers: int = 1,
) -> Truth:
    """Drive every manoeuvre of the batch, with its own vehicle or `vehicles[b]`, in ``workers`` processes; see `simulate`.

    ``progress`` is told by the only process; with several it is not called.
    """
    courses = {id(m): m.course() for m in manoeuvres}
    if vehicles is None:
        own = {id(m): m.truth_vehicle() for m in manoeuvres}
        vehicles = [own[id(m)] for m in manoeuvres]
    batch = [courses[id(m)] for m in manoeuvres]
    options: dict[str, Any] = {"step": step, "record_time": record_time, "record": record}
    if workers > 1:
        return simulate_in_processes(batch, vehicles, workers, **options)
    return simulate(batch, vehicles, progress=progress, **options)
