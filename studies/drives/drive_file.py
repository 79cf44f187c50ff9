"""The drive file: which columns of which logs are what, and the vehicle they were recorded on.

A drive file (TOML, ``gainsmith.drive/1``) maps log columns with units and signs to the signals of
:mod:`studies.drives.quantities`, several log files with their own clocks to one clock, and names the schedule that
the observers run with. Every quantity carries its unit; nothing is guessed from a column name.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from studies.drives.drive_checks import check_alignment, check_columns, check_estimators, check_logs, check_signals
from studies.drives.drive_tables import Column, Estimators, LogFile, Observer, Schedules, Vehicle
from studies.drives.quantities import Duration
from synthesis.toml_file import StrictTable, load_toml


class DriveFile(StrictTable):
    """A drive file that was read, checked and converted to SI."""

    schema_: Literal["gainsmith.drive/1"] = Field(alias="schema", examples=["gainsmith.drive/1"])
    name: str = Field(min_length=1, examples=["brake test"])
    source: str = ""
    sample_time: Duration = Field(examples=["5 ms"])
    vehicle: Vehicle
    schedules: Schedules
    observer: Observer = Observer()
    estimators: Estimators = Estimators()
    log: Annotated[list[LogFile], Field(min_length=1)]
    signals: dict[str, Column]
    reference: dict[str, Column] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _tables_agree(self) -> Self:
        check_logs(self.log)
        check_columns(self.signals, self.reference, self.log)
        check_alignment({**self.reference, **self.signals}, self.log)
        check_signals(self.signals, self.vehicle)
        check_estimators(self.estimators, self.signals, self.vehicle, self.schedules)
        return self

    def log_of(self, column: Column) -> str:
        """The name of the log that holds a column (the only one, if the file has one)."""
        return column.log if column.log is not None else self.log[0].name


def read_drive(path: Path) -> DriveFile:
    """Read and check a drive file. Raises SpecError, one line: file, key, what is wrong, what would be right."""
    return load_toml(path, DriveFile, "drive")
