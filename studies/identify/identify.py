"""Identify a car's corner models from one drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from estimators.display import Display
from studies.drives.drive_file import DriveFile, read_drive
from studies.drives.frames import read_checked
from studies.drives.log import DriveLog
from studies.drives.replay import Progress
from studies.identify.data import DriveSignals, drive_signals
from studies.identify.estimate import Estimate
from studies.identify.inertia import fit_inertia
from studies.identify.lateral import LateralSlip
from studies.identify.longitudinal import LongitudinalSlip, wheel_force
from studies.identify.mounting import MountingFit, fit_mounting
from studies.identify.settings import IdentifySettings
from studies.identify.slip_limit import LimitedFit, fit_low_slip
from synthesis.models.parameter_set import ParameterSet, load_parameter_set

BASE = "corner-estimation"  # the parameter set whose values stand where a log says nothing


@dataclass(frozen=True, repr=False)
class Identification(Display):
    """What one drive says about the car: the fits, and why a direction has none (``absent``)."""

    drive: DriveFile
    base: ParameterSet
    logs: tuple[str, ...]
    data: DriveSignals
    settings: IdentifySettings
    fits: dict[str, LimitedFit]
    inertia: Estimate | None
    wheel_inertia: float
    absent: dict[str, str]
    mounting: MountingFit
    assumptions: tuple[str, ...] = ()

    @property
    def velocity_reference(self) -> str:
        """Which column the slip was formed with."""
        parts = []
        for name, table in (("vx", self.drive.reference), ("vy", {**self.drive.signals, **self.drive.reference})):
            if name in table:
                parts.append(f"{name}: column '{table[name].column}' of log '{self.drive.log_of(table[name])}'")
        return "; ".join(parts)


def identify_drive(
    logs: Sequence[Path],
    drive: Path,
    *,
    base: str = BASE,
    settings: IdentifySettings | None = None,
    check: bool = True,
    progress: Progress = lambda _done: None,
) -> Identification:
    """Fit wheel inertia, both tires and the mounting of the inertial unit to the ``logs`` that the ``drive`` file describes.

    Raises SpecError (drive file, base set), LogError (logs; signals that contradict one another, unless ``check`` is False here
    or in the drive file), IdentifyError (no reference, standstill, too short), one line.

    >>> found = identify_drive([Path("log.csv")], Path("drive.toml"))  # doctest: +SKIP
    >>> found.wheel_inertia, sorted(found.fits)  # doctest: +SKIP
    """
    description, prior = read_drive(drive), load_parameter_set(base)
    log, assumed = read_checked(logs, description, check)
    names = tuple(str(entry["file"]) for entry in log.report["logs"].values())
    found = identify_log(log, description, prior, names, settings=settings, progress=progress)
    return replace(found, assumptions=assumed)


def identify_log(
    log: DriveLog,
    drive: DriveFile,
    base: ParameterSet,
    names: tuple[str, ...],
    *,
    settings: IdentifySettings | None = None,
    progress: Progress = lambda _done: None,
) -> Identification:
    """As :func:`identify_drive`, of a log that was read."""
    chosen = settings or IdentifySettings()
    data = drive_signals(log, drive, chosen)
    prior = drive.vehicle.wheel_inertia or base.vehicle["wheel_inertia"].value
    spin = fit_inertia(data, prior, chosen)
    inertia = spin.value("wheel_inertia") if spin is not None and spin.excited["wheel_inertia"] else prior
    progress(0.1)
    fits: dict[str, LimitedFit] = {}
    absent: dict[str, str] = {}
    along = LongitudinalSlip(data, base.tire["longitudinal"], inertia, chosen, torque_delay(spin, chosen))
    correlation = data.filter.correlation
    fits["longitudinal"] = fit_low_slip(along, chosen, correlation, lambda done: progress(0.1 + 0.45 * done))
    needs = {
        "reference.vy": data.has_vy, "signals.ay": data.ay is not None, "signals.yaw_rate": data.yaw_rate is not None,
        f"lateral tire of {base.id}": "lateral" in base.tire,
    }  # fmt: skip
    missing = [name for name, there in needs.items() if not there]
    if missing:
        absent["lateral"] = f"not fitted: {', '.join(missing)} missing"
    else:
        force = np.nan_to_num(wheel_force(data, inertia), nan=0.0)
        across = LateralSlip(data, base.tire["lateral"], force, yaw_inertia_prior(drive), chosen)
        correlation = across.filter.correlation
        fits["lateral"] = fit_low_slip(across, chosen, correlation, lambda done: progress(0.55 + 0.35 * done))
    unit = fit_mounting(log, drive, chosen)
    if unit.absent:
        absent["mounting"] = unit.absent
    progress(1.0)
    return Identification(drive, base, names, data, chosen, fits, spin, inertia, absent, unit)


def torque_delay(spin: Estimate | None, settings: IdentifySettings) -> tuple[float, float]:
    """Of the torques against the wheel speeds, s, with its standard deviation: that of the car, and skewed sensor clocks."""
    if spin is None or not spin.samples:
        return 0.0, settings.torque_delay
    found = spin.value("torque_delay"), spin.deviation(torque_delay=1.0)
    return found[0], min(math.hypot(found[1], settings.clock_skew), settings.torque_delay)


def yaw_inertia_prior(drive: DriveFile) -> float:
    """Of the drive file if it has one, else m L_f L_r, kg m^2: a dynamic index of one, cars lie between 0.8 and 1.1."""
    car = drive.vehicle
    return car.yaw_inertia or car.mass * car.front_axle_distance * car.rear_axle_distance
