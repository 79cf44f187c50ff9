"""Sweeps as TOML files: shipped by name, or your own by path."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from analysis.sensitivity.designs import Corners, Design, FullGrid, LatinHypercube, OneAtATimeDesign, Saltelli, Sobol
from analysis.sensitivity.worst import WorstCaseSearch
from estimators.errors import unknown
from studies.sweeps.measures import FAST, MeasureSpec
from studies.sweeps.measures_costly import COSTLY
from studies.sweeps.measures_drive import DRIVE
from studies.sweeps.observer_spec import ObserverSpec
from studies.sweeps.ranges import RangeSpec
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError
from synthesis.toml_file import StrictTable, read_kind, read_table, read_toml

MEASURES: dict[str, type[MeasureSpec]] = {**FAST, **COSTLY, **DRIVE}
DESIGNS: dict[str, type[Design]] = {
    kind.model_fields["kind"].default: kind
    for kind in (OneAtATimeDesign, FullGrid, Corners, LatinHypercube, Sobol, Saltelli, WorstCaseSearch)
}


class GridSpec(StrictTable):
    """`points` of every scheduling parameter, over the whole range or over a narrower one by name."""

    points: int = Field(default=141, ge=2)
    range: dict[str, Annotated[tuple[float, float], Field(strict=False)]] = Field(default_factory=dict)


class GateSpec(StrictTable):
    """By how much of its distance to worthlessness a statistic may fall behind the baseline; `measures` by measure name."""

    tolerance: float = Field(default=0.01, ge=0)
    measures: dict[str, float] = Field(default_factory=dict)


class Quick(StrictTable):
    """What `--quick` replaces: fewer grid points and smaller designs."""

    points: int = Field(default=29, ge=2)
    designs: list[Any] = Field(min_length=1)


class SweepSpec(StrictTable):
    """A whole file; [[subjects]], [[measures]] and [[designs]] are read one by one so that errors name them."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9-]*$")
    description: str
    subjects: list[Any] = Field(min_length=1)
    measures: list[Any] = Field(min_length=1)
    designs: list[Any] = Field(min_length=1)
    vary: dict[str, Any] = Field(default_factory=dict)
    grid: GridSpec = GridSpec()
    gate: GateSpec = GateSpec()
    quick: Quick | None = None
    chunk: int = Field(default=1000, ge=1)


def shipped_sweeps() -> dict[str, Path]:
    """The sweeps that come with the package, by name."""
    folder = Path(str(resources.files("studies") / "sweeps" / "specs"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_sweep(name: str | Path, quick: bool = False) -> Sweep:
    """A shipped sweep by name or one of your own by path. Raises SpecError, one line: file, place, what would be right."""
    path = Path(name)
    if path.suffix != ".toml":
        known = shipped_sweeps()
        if str(name) not in known:
            raise SpecError(unknown("sweep", str(name), known) + "; a file of your own ends with .toml")
        path = known[str(name)]
    data = read_toml(path, "no such sweep file")
    try:
        return build_sweep(data, path.parent, quick)
    except SpecError as error:
        raise SpecError(f"{path.name}: {error}") from None


def build_sweep(data: dict[str, Any], folder: Path, quick: bool = False) -> Sweep:
    """A sweep from the content of a file; other files are looked for in `folder`."""
    spec = read_table(SweepSpec, data, "sweep")
    if quick and spec.quick is None:
        raise SpecError("has no [quick] table; give it points and designs, or leave out --quick")
    small = spec.quick if quick else None
    tables = [read_table(ObserverSpec, _named(entry), f"subjects[{i}]") for i, entry in enumerate(spec.subjects)]
    observers = [table.build(folder) for table in tables]
    common = _vary(spec.vary, "vary")
    vary = {o.name: common if t.vary is None else t.vary for o, t in zip(observers, tables, strict=True)}
    measures = [read_kind(MEASURES, "id", entry, f"measures[{i}]") for i, entry in enumerate(spec.measures)]
    designs = small.designs if small else spec.designs
    return Sweep(
        name=spec.name, observers=observers, measures=[measure.beside(folder).build() for measure in measures],
        stages=[read_kind(DESIGNS, "kind", entry, f"designs[{i}]") for i, entry in enumerate(designs)], vary=vary,
        points=small.points if small else spec.grid.points, bounds=spec.grid.range, chunk=spec.chunk,
        tolerance=spec.gate.tolerance, tolerances=spec.gate.measures, form="quick" if small else "full",
    )  # fmt: skip


def _named(entry: Any) -> Any:
    if isinstance(entry, dict) and isinstance(entry.get("vary"), dict):
        return {**entry, "vary": _vary(entry["vary"], "subjects.vary")}
    return entry


def _vary(table: dict[str, Any], where: str) -> dict[str, RangeSpec]:
    return {name: read_table(RangeSpec, entry, f"{where}.{name}") for name, entry in table.items()}
