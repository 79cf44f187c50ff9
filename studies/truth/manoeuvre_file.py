"""Reading manoeuvre files: shipped ones by name, others by path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from estimators.errors import unknown
from studies.drives.validation import read_toml
from studies.truth.manoeuvre import Manoeuvre
from studies.truth.monte_carlo import simulate_in_processes
from studies.truth.record import Truth
from studies.truth.simulate import EVERYTHING, RECORD_TIME, STEP, simulate
from studies.truth.vehicle import TruthVehicle
from synthesis.errors import SpecError


def shipped_manoeuvres(paper: str = "") -> dict[str, Path]:
    """The manoeuvre files that come with the package, by name; those of one paper (``"P1"``) if asked."""
    folder = Path(str(resources.files("studies") / "manoeuvres"))
    return {path.stem: path for path in sorted(folder.glob(f"{paper.lower()}*.toml"))}


def load_manoeuvre(name: str | Path) -> Manoeuvre:
    """A shipped manoeuvre by name, or one of your own by its path (ends with .toml).

    Raises SpecError, one line: file, key, what is wrong, what would be right.
    """
    path = Path(name)
    if path.suffix != ".toml":
        known = shipped_manoeuvres()
        if str(name) not in known:
            raise SpecError(unknown("manoeuvre", str(name), known) + "; a file of your own ends with .toml")
        path = known[str(name)]
    return read_toml(path, Manoeuvre, "manoeuvre")


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
