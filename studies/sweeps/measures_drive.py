"""The error of the velocity estimate on a recorded drive, for all designs of a batch at once."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from studies.sweeps.measure import Measure
from studies.sweeps.measures import MeasureSpec
from studies.sweeps.subject import Batch, Subject
from synthesis.errors import SpecError
from synthesis.polynomials.matrix import FloatArray

MODEL_STATES = ("bristle_deflection", "relative_velocity")


class EstimatorNrms(MeasureSpec):
    """NRMS in % of V_x from four longitudinal corner observers on a drive (P1 (46)), whose log has a reference `vx`.

    The observers know the perturbed constants, the drive is what was recorded: the question is what a wrong tire or radius
    costs. A perturbed `effective_radius` also scales the wheel signals; forces stay as they were measured. Samples without force
    or outside the range of the schedule coast, as at run time; the runtime's other fault checks are left out.
    """

    id: Literal["estimator_nrms"]
    drive: str
    logs: Annotated[list[str], Field(min_length=1)]

    def beside(self, folder: Path) -> EstimatorNrms:
        """File names relative to the sweep file."""
        return self.model_copy(
            update={"drive": str(folder / self.drive), "logs": [str(folder / name) for name in self.logs]}
        )

    def build(self) -> Measure:
        """The measure. Raises SpecError for files that cannot be read, or without reference."""
        files = (self.drive, *self.logs)
        _recorded_sample_time(files)
        digest = hashlib.sha256(b"".join(Path(name).read_bytes() for name in files)).hexdigest()
        key = {"id": self.id, "drive": Path(self.drive).name, "sha256": digest}
        name = self.name or f"estimator_nrms {Path(self.drive).stem}"
        return Measure(
            name, "%", "smaller", partial(_nrms, files), definition=key, check=partial(_fits, files), heavy=True
        )


def _fits(files: tuple[str, ...], subject: Subject) -> None:
    states = tuple(s.name for s in subject.plant.states)
    if states != MODEL_STATES or len(subject.plant.box) != 1 or "lateral" in subject.name:
        raise SpecError(f"subject '{subject.name}': estimator_nrms is for longitudinal corner observers")
    if abs(_recorded_sample_time(files) - subject.sample_time) > 1e-9:
        raise SpecError(
            f"subject '{subject.name}': its sample time is {subject.sample_time:g} s, that of {files[0]} is not"
        )


def _recorded_sample_time(files: tuple[str, ...]) -> float:
    from studies.sweeps.drive_replay import recorded  # reading logs takes imports that other sweeps need not wait for

    return recorded(*files).sample_time


def _nrms(files: tuple[str, ...], batch: Batch) -> FloatArray:
    from studies.sweeps.drive_replay import nrms

    return nrms(files, batch)


DRIVE: Mapping[str, type[MeasureSpec]] = {"estimator_nrms": EstimatorNrms}
