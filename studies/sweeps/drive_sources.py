"""Where a drive comes from that the designs of a sweep are replayed on: log files, or a manoeuvre of the truth vehicles.

Both are read or driven once, where the sweep is started, and travel with it: workers need no files and have the same numbers.
"""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from studies.sweeps.sweep import canonical

if TYPE_CHECKING:
    from studies.sweeps.drive_replay import Recorded
    from studies.truth import Manoeuvre


class DriveSource(ABC):
    """A drive that is there when it is asked for: `recorded` is made once, kept, and sent along."""

    @property
    @abstractmethod
    def recorded(self) -> Recorded:
        """The signals. Raises SpecError or LogError, one line, for what cannot be read or driven."""

    @property
    @abstractmethod
    def definition(self) -> Mapping[str, Any]:
        """What makes two drives the same."""

    @property
    def sample_time(self) -> float:
        """s, of the signals."""
        return self.recorded.sample_time

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "recorded": self.recorded}


@dataclass(frozen=True, eq=False)
class LoggedDrive(DriveSource):
    """A drive file and its logs, as `gainsmith run` takes them."""

    drive: Path
    logs: tuple[Path, ...]

    @cached_property
    def recorded(self) -> Recorded:
        """What is read; refused without a reference of V_x."""
        from studies.sweeps.drive_replay import read_recorded  # reading logs takes imports that other sweeps need not

        return read_recorded(self.drive, self.logs)

    @cached_property
    def definition(self) -> Mapping[str, Any]:
        """Name of the drive file, and a digest of it and of the logs."""
        files = [self.drive]
        for path in self.logs:
            files += sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]
        digest = hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
        return {"drive": self.drive.name, "sha256": digest}


@dataclass(frozen=True, eq=False)
class TruthDrive(DriveSource):
    """A manoeuvre of the truth vehicles, measured by the experiments' sensors with the errors of one seed.

    The same as `studies.truth.write_drive` and `gainsmith run` on what it writes: the estimators know the true car.
    """

    manoeuvre: Manoeuvre
    seed: int
    folder: Path  # of the manoeuvre file, for a vehicle beside it
    sample_time: float = 0.005

    @cached_property
    def recorded(self) -> Recorded:
        """Takes about a second for every second of the manoeuvre. Raises SpecError for a car that cannot drive it."""
        from studies.sweeps.drive_replay import read_recorded
        from studies.trials.sensors import TEST_CAR
        from studies.truth import draw, simulate_manoeuvres, write_drive

        truth = simulate_manoeuvres([self.manoeuvre], [self.manoeuvre.truth_vehicle(self.folder)])
        measured = draw(truth, TEST_CAR, [self.seed], self.sample_time)
        with TemporaryDirectory() as folder:
            log, file = write_drive(Path(folder), measured)
            return read_recorded(file, (log,))

    @cached_property
    def definition(self) -> Mapping[str, Any]:
        """Name, length and seed, and a digest of manoeuvre, car and sensors: what was asked, not what the simulation made."""
        from studies.trials.sensors import TEST_CAR

        car = asdict(self.manoeuvre.truth_vehicle(self.folder))
        parts = [self.manoeuvre.model_dump(mode="json"), car, asdict(TEST_CAR)]
        asked = {"manoeuvre": self.manoeuvre.name, "seconds": self.manoeuvre.duration, "seed": self.seed}
        return {**asked, "sha256": hashlib.sha256(canonical(parts)).hexdigest()}
