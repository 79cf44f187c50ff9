"""The error of the velocity estimate on a drive, for all designs of a batch at once."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from estimators.arrays import FloatArray
from studies.sweeps.measures import MeasureSpec
from studies.sweeps.observer import Batch, Observer
from studies.sweeps.sweep import canonical
from synthesis.errors import SpecError

if TYPE_CHECKING:
    from studies.sweeps.drive_replay import Recorded
    from studies.truth import Manoeuvre

TRUTH_TIME = 0.005  # s, sample time of a manoeuvre as it is measured
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
    def asked(self) -> Manoeuvre:
        """The manoeuvre, cut. Raises SpecError for what cannot be read."""
        from studies.truth import load_manoeuvre

        found = load_manoeuvre(str(self.manoeuvre))
        return found.model_copy(update={"duration": min(found.duration, self.seconds or np.inf)})

    @cached_property
    def recorded(self) -> Recorded:
        """The signals. Raises SpecError or LogError, one line, for what cannot be read or driven, or has no reference of V_x.

        A manoeuvre takes about a second for every second of it, and is the same as `studies.truth.write_drive` and
        `gainsmith run` on what it writes: the estimators know the true car.
        """
        from studies.sweeps.drive_replay import read_recorded  # reading logs takes imports that other sweeps need not

        if self.drive is not None:
            return read_recorded(Path(self.drive), [Path(name) for name in self.logs or ()])
        from studies.trials.estimation import TEST_CAR
        from studies.truth import draw, simulate_manoeuvres, write_drive

        truth = simulate_manoeuvres([self.asked], [self.asked.truth_vehicle(Path(str(self.manoeuvre)).parent)])
        with TemporaryDirectory() as folder:
            log, file = write_drive(Path(folder), draw(truth, TEST_CAR, [self.seed], TRUTH_TIME))
            return read_recorded(file, [log])

    def definition(self) -> Mapping[str, Any]:
        """Name of the drive, and a digest: of drive file and logs; or of manoeuvre, car and sensors, not of what they gave."""
        if self.drive is not None:
            _ = self.recorded  # what is wrong with the files is said at once
            files = [Path(self.drive)]
            for path in map(Path, self.logs or ()):
                files += sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]
            digest = hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
            return {"id": self.id, "drive": files[0].name, "sha256": digest}
        from studies.trials.estimation import TEST_CAR

        car = asdict(self.asked.truth_vehicle(Path(str(self.manoeuvre)).parent))
        digest = hashlib.sha256(canonical([self.asked.model_dump(mode="json"), car, asdict(TEST_CAR)])).hexdigest()
        asked = {"manoeuvre": self.asked.name, "seconds": self.asked.duration, "seed": self.seed}
        return {"id": self.id, **asked, "sha256": digest}

    def prepare(self) -> None:
        """Drive or read once, where the sweep is started: the signals travel with it, workers need no files."""
        _ = self.recorded

    def _values(self, batch: Batch) -> FloatArray:
        from studies.sweeps.drive_replay import nrms

        return nrms(self.recorded, batch)

    def check(self, observer: Observer) -> None:
        """Longitudinal corner observers with the sample time of the drive."""
        plant, model = observer.plant, observer.plant.model
        title, inputs = (observer.name, 1) if model is None else (model.name, len(model.inputs))
        sizes = (inputs, len(plant.outputs), len(plant.box))
        if tuple(s.name for s in plant.states) != MODEL_STATES or sizes != (1, 1, 1) or "lateral" in title:
            raise SpecError(f"subject '{observer.name}': estimator_nrms is for longitudinal corner observers")
        time = TRUTH_TIME if self.drive is None else self.recorded.sample_time
        if abs(time - observer.sample_time) > 1e-9:
            raise SpecError(
                f"subject '{observer.name}': its sample time is {observer.sample_time:g} s, that of the drive of "
                f"estimator_nrms is {time:g} s; they must be the same"
            )


DRIVE: Mapping[str, type[MeasureSpec]] = {"estimator_nrms": EstimatorNrms}
