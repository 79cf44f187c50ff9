"""The corner observers that a drive file can ask for."""

from __future__ import annotations

from pathlib import Path

from estimators import EstimatorError, GainSchedule
from estimators.pipeline import KalmanCorners, ScheduledCorners, SwitchedCorners
from estimators.pipeline.corner_kinds import CornerKind
from studies.drives.drive_file import DriveFile
from studies.drives.schedules import load_tire
from synthesis.errors import SpecError


def corner_observer(drive: DriveFile, folder: Path, schedule: GainSchedule) -> CornerKind:
    """What ``estimators.corner_velocity`` of the drive file asks for; ``folder`` is that of the drive file.

    ``lpv``: P1 (24). ``gain-switched``: the schedule up to 15 % of slip, P3's gain of high slip beyond it, P3 (19), Example 2.
    ``kalman-three-state``, ``kalman-two-state``: P2 (19)-(23) with the covariances switched by P2 (29) and |dw/dt|.

    Raises SpecError, one line, when the schedule cannot serve it.
    """
    kind = drive.estimators.corner_velocity
    try:
        if kind == "gain-switched":
            return SwitchedCorners(schedule)
        if kind == "lpv":
            return ScheduledCorners(schedule)
        tire = load_tire(drive.schedules.longitudinal, folder)
        return KalmanCorners(tire, schedule.sample_time, states=3 if kind == "kalman-three-state" else 2)
    except EstimatorError as error:
        raise SpecError(f"estimators.corner_velocity = '{kind}': {error}") from error
