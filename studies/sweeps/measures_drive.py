"""The error of the velocity estimate on a drive, for all designs of a batch at once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from estimators.arrays import FloatArray
from studies.sweeps.drive_sources import DriveSource, LoggedDrive, TruthDrive
from studies.sweeps.measures import MeasureSpec
from studies.sweeps.observer import Batch, Observer
from synthesis.errors import SpecError

MODEL_STATES = ("bristle_deflection", "relative_velocity")


class EstimatorNrms(MeasureSpec):
    """NRMS in % of V_x from four longitudinal corner observers on a drive (P1 (46)).

    The drive is a `manoeuvre` of the truth vehicles (shipped, by name, or a file), with the sensor errors of `seed` and cut
    after `seconds`; or a `drive` file and `logs` as `gainsmith run` takes them, with a reference `vx`.

    The observers believe the constants of the design, the drive stays as it was measured: the question is what a wrong tire or
    radius costs. A perturbed `effective_radius` also scales the wheel signals; forces stay. Missing samples are treated as by
    the runtime observer; an estimate that grows beyond all bounds counts as infinite.
    """

    id: Literal["estimator_nrms"]
    unit: ClassVar[str] = "%"
    manoeuvre: str | None = None
    seed: int = Field(default=0, ge=0)
    seconds: float | None = Field(default=None, ge=0.1)
    drive: str | None = None
    logs: Annotated[list[str], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        if (self.manoeuvre is None) == (self.drive is None) or (self.drive is None) != (self.logs is None):
            raise ValueError("give either manoeuvre, or drive with logs")
        if self.drive is not None and {"seed", "seconds"} & self.model_fields_set:
            raise ValueError("seed and seconds belong to a manoeuvre; a drive is taken as it was logged")
        return self

    def beside(self, folder: Path) -> EstimatorNrms:
        """File names relative to the sweep file."""
        if self.drive is not None and self.logs is not None:
            files = {"drive": str(folder / self.drive), "logs": [str(folder / name) for name in self.logs]}
            return self.model_copy(update=files)
        own = str(self.manoeuvre).endswith(".toml")
        return self.model_copy(update={"manoeuvre": str(folder / str(self.manoeuvre))}) if own else self

    @property
    def title(self) -> str:
        """With the drive."""
        return f"estimator_nrms {Path(self.drive or str(self.manoeuvre)).stem}"

    @cached_property
    def source(self) -> DriveSource:
        """The drive. Raises SpecError or LogError for what cannot be read, or has no reference."""
        if self.drive is not None and self.logs is not None:
            logged = LoggedDrive(Path(self.drive), tuple(Path(name) for name in self.logs))
            logged.recorded  # noqa: B018  what is wrong with the files is said at once
            return logged
        from studies.truth import load_manoeuvre

        found = load_manoeuvre(str(self.manoeuvre))
        if self.seconds is not None:
            found = found.model_copy(update={"duration": min(found.duration, self.seconds)})
        return TruthDrive(found, self.seed, Path(str(self.manoeuvre)).parent)

    def definition(self) -> Mapping[str, Any]:
        """The drive."""
        return {"id": self.id, **self.source.definition}

    def prepare(self) -> None:
        """Drive or read once."""
        self.source.recorded  # noqa: B018

    def values(self, batch: Batch) -> FloatArray:
        """One number a design."""
        from studies.sweeps.drive_replay import nrms

        return nrms(self.source.recorded, batch)

    def check(self, observer: Observer) -> None:
        """Longitudinal corner observers with the sample time of the drive."""
        plant, model = observer.plant, observer.plant.model
        title, inputs = (observer.name, 1) if model is None else (model.name, len(model.inputs))
        sizes = (inputs, len(plant.outputs), len(plant.box))
        if tuple(s.name for s in plant.states) != MODEL_STATES or sizes != (1, 1, 1) or "lateral" in title:
            raise SpecError(f"subject '{observer.name}': estimator_nrms is for longitudinal corner observers")
        if abs(self.source.sample_time - observer.sample_time) > 1e-9:
            raise SpecError(
                f"subject '{observer.name}': its sample time is {observer.sample_time:g} s, that of the drive of "
                f"estimator_nrms is {self.source.sample_time:g} s; they must be the same"
            )


DRIVE: Mapping[str, type[MeasureSpec]] = {"estimator_nrms": EstimatorNrms}
