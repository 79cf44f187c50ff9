"""Sweeps as TOML files: shipped by name, or your own by path; an observer is a schedule, or a catalogue model with a gain."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.sensitivity.designs import Corners, Design, FullGrid, LatinHypercube, OneAtATimeDesign, Saltelli, Sobol
from analysis.sensitivity.worst import WorstCaseSearch
from estimators.errors import EstimatorError, unknown
from estimators.schedule import SHIPPED, GainSchedule, read_content
from studies.spec import ScheduleSpec
from studies.sweeps.measures import FAST, MeasureSpec
from studies.sweeps.measures_costly import COSTLY
from studies.sweeps.measures_drive import DRIVE
from studies.sweeps.observer import Gains, Observer, model_observer
from studies.sweeps.plant import model_plant, polynomial_plant
from studies.sweeps.ranges import RangeSpec
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError
from synthesis.models.catalogue import CATALOGUE
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, Quantity, load_parameter_set
from synthesis.toml_file import StrictTable, read_kind, read_table, read_toml

MEASURES: dict[str, type[MeasureSpec]] = {**FAST, **COSTLY, **DRIVE}
DESIGNS: dict[str, type[Design]] = {
    kind.model_fields["kind"].default: kind
    for kind in (OneAtATimeDesign, FullGrid, Corners, LatinHypercube, Sobol, Saltelli, WorstCaseSearch)
}


class ObserverSpec(StrictTable):
    """`schedule` with or without today's `parameters`, or `model`, `parameters`, `gain` and `sample_time`.

    Files are looked for beside the sweep file. Without `parameters` a schedule is swept around the constants it was made with.
    `vary` replaces the sweep's own table for this observer.
    """

    name: str | None = Field(default=None, pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")
    schedule: str | None = None
    parameters: str | None = None
    model: str | None = None
    gain: list[list[float]] | None = None
    sample_time: float | None = Field(default=None, gt=0, lt=1)
    wheel_speed_maximum: float = Field(default=140.0, gt=0)
    wheel_speed_rate: float = Field(default=800.0, ge=0)
    vary: dict[str, RangeSpec] | None = None

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Self:
        rest = (self.model, self.gain, self.sample_time)
        if (self.schedule is None) == (self.model is None):
            raise ValueError("give either schedule, or model with parameters, gain and sample_time")
        if self.schedule is not None and any(part is not None for part in rest):
            raise ValueError("a schedule brings its own model, gain and sample_time")
        if self.model is not None and None in (self.parameters, self.gain, self.sample_time):
            raise ValueError("a model needs parameters, gain and sample_time")
        return self

    def build(self, folder: Path) -> Observer:
        """The observer. Raises SpecError that names the file and what is wrong with it."""
        return self._of_schedule(folder) if self.schedule is not None else self._of_model(folder)

    def _of_model(self, folder: Path) -> Observer:
        name, parameters = str(self.model), _parameters(str(self.parameters), folder)
        try:
            gain = np.asarray(self.gain, float)
        except ValueError:
            raise SpecError(f"subject '{name}': gain {self.gain} has rows of different lengths") from None
        if name not in CATALOGUE:
            raise SpecError(unknown("model", name, CATALOGUE))
        limits = {"wheel_speed_maximum": self.wheel_speed_maximum, "wheel_speed_rate": self.wheel_speed_rate}
        return model_observer(self.name or name, CATALOGUE[name](parameters, **limits), gain, self.sample_time or 0.0)

    def _of_schedule(self, folder: Path) -> Observer:
        content = schedule_content(str(self.schedule), folder)
        schedule = GainSchedule.from_content(content)
        name = content["model"]["id"]
        if name in CATALOGUE:
            given = None if self.parameters is None else _parameters(self.parameters, folder)
            plant = model_plant(catalogue_model(content, given))
        elif self.parameters is None:
            plant = polynomial_plant(schedule)
        else:
            raise SpecError(f"schedule '{self.schedule}': {unknown('model', name, CATALOGUE)}; leave out parameters")
        gains, origin = Gains(schedule.table, schedule.breakpoints), f"the schedule '{schedule.name}'"
        proved = {name: float(c["value"]) for name, c in content["model"]["constants"].items()}
        return Observer(
            self.name or schedule.name, plant, gains, schedule.sample_time, origin, designed_from(content), proved,
            schedule.observer_update,
        )  # fmt: skip


def schedule_content(name: str, folder: Path) -> dict[str, Any]:
    """The content of a shipped schedule by name, or of a file that ends with .json."""
    path = folder / name if name.endswith(".json") else SHIPPED / f"{name}.json"
    if not name.endswith(".json") and not path.is_file():
        raise SpecError(
            unknown("schedule", name, (p.stem for p in SHIPPED.glob("*.json"))) + "; a file ends with .json"
        )
    try:
        return read_content(path)
    except EstimatorError as error:
        raise SpecError(str(error)) from None


def catalogue_model(content: dict[str, Any], parameters: ParameterSet | None) -> LpvModel:
    """The symbolic model of a schedule over the box that the schedule was proved for."""
    model, (entry,) = content["model"], content["scheduling"]
    limits = {"wheel_speed_maximum": entry["max"], "wheel_speed_rate": entry["rate_max"]}
    found = CATALOGUE[model["id"]](parameters or _recorded(content), **limits)
    return found.with_range(entry["name"], entry["min"], entry["max"])


def _recorded(content: dict[str, Any]) -> ParameterSet:
    """The constants that a schedule of a corner model was made with, in the form of a parameter set."""
    direction = content["model"]["id"].removeprefix("corner-velocity-")
    constants = {name: Quantity.model_validate(c) for name, c in content["model"]["constants"].items()}
    vehicle = {"effective_radius": constants.pop("effective_radius")}
    tire: Any = {direction: {name: quantity.model_dump() for name, quantity in constants.items()}}
    return ParameterSet(id=content["name"], citation="the schedule file", vehicle=vehicle, tire=tire)


def designed_from(content: dict[str, Any]) -> ScheduleSpec | None:
    """The specification in a schedule's provenance, if it is one of ours."""
    spec = {k: v for k, v in content["provenance"].get("spec", {}).items() if k != "parameter_set"}
    return read_table(ScheduleSpec, spec, f"schedule '{content['name']}': provenance.spec") if spec else None


def _parameters(name: str, folder: Path) -> ParameterSet:
    return load_parameter_set(folder / name if name.endswith(".toml") else name)


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
    """The sweeps that come with the package, by name.

    >>> sorted(shipped_sweeps())
    ['drop-tolerance', 'gain-box', 'tire-vehicle']
    """
    folder = Path(str(resources.files("studies") / "sweeps" / "specs"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_sweep(name: str | Path, quick: bool = False) -> Sweep:
    """A shipped sweep by name or one of your own by path. Raises SpecError, one line: file, place, what would be right.

    >>> [observer.name for observer in load_sweep("gain-box", quick=True).observers]
    ['longitudinal', 'lateral']
    """
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
