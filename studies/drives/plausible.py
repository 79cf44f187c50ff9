"""Is what a log says what a car can do? A unit of the right dimension but the wrong size shows here, before the run.

Compared is the 99 % quantile of the magnitude: single spikes are for the estimators to refuse, sample by sample. Wheel
speeds are also compared with a reference velocity: rpm declared for rad/s is R_e w / V_x = 0.105, the other way round 9.55.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.columns import Column
from studies.drives.drive_file import DriveFile
from studies.drives.quantities import CORNERS, SIGNALS, at_corners, factor_to
from studies.errors import LogError


class Limit(NamedTuple):
    """The largest magnitude in SI that a car reaches, and the units that are taken for one another, likeliest first."""

    largest: float
    units: tuple[str, ...]


ACCELERATION_UNITS = ("m/s^2", "g", "cm/s^2", "mm/s^2")
RATE_UNITS, ANGLE_UNITS = ("rad/s", "deg/s"), ("rad", "deg")
_ACCELERATION = Limit(50.0, ACCELERATION_UNITS)
_RATE = Limit(10.0, RATE_UNITS)
_STEER = Limit(1.3, ANGLE_UNITS)
WHEEL_UNITS = ("rad/s", "rpm", "deg/s", "turn/s", "m/s", "km/h")
LIMITS: dict[str, Limit] = {
    **dict.fromkeys(("ax", "ay", "az"), _ACCELERATION),
    **dict.fromkeys(("yaw_rate", "roll_rate", "pitch_rate"), _RATE),
    **dict.fromkeys(("steering", *(f"steer_{corner}" for corner in CORNERS)), _STEER),
    "hand_wheel": Limit(20.0, _STEER.units),
    **dict.fromkeys((f"wheel_speed_{corner}" for corner in CORNERS), Limit(400.0, WHEEL_UNITS)),
    **dict.fromkeys((f"torque_{corner}" for corner in CORNERS), Limit(50e3, ("N*m",))),
}
QUANTILE = 99.0
FAST = 5.0  # m/s of V_x above which wheels roll: a start or a stop says little about units
ROLLING = (0.7, 1.4)  # R_e w / V_x of all wheels, at the median of a drive
STEADY, STEADY_ROLLING = 0.05, (0.89, 1.12)
"""The same where the mean of the wheels keeps it to 5 % (quartiles): no slip, and km/h read as rad/s shows, 1.26 at 0.35 m."""
ONE_WHEEL = (0.4, 2.5)  # the same of one wheel among good ones, which may spin or slide for most of a drive
STANDING = 0.012
"""R_e w / V_x below which a wheel is locked or its sensor dead: a fault, not a unit (the smallest one is 0.0175)."""
ENOUGH = 20  # samples of a wheel that make a median


def check_plausible(
    drive: DriveFile, signals: Mapping[str, FloatArray], reference: Mapping[str, FloatArray], files: Mapping[str, str]
) -> None:
    """Refuse signals in SI (n,) that no car produces; ``files`` names the file of each log.

    Raises LogError, one line: file, column, unit, the largest value seen and the unit that would explain it.
    """
    for name, limit in LIMITS.items():
        if name in signals:
            _check_size(drive, files, name, signals[name], limit)
    if "vx" in reference:
        _check_rolling(drive, signals, reference["vx"], files)


def _check_size(drive: DriveFile, files: Mapping[str, str], name: str, value: FloatArray, limit: Limit) -> None:
    size = np.abs(value[np.isfinite(value)])
    high = float(np.percentile(size, QUANTILE)) if size.size else 0.0
    if high <= limit.largest:
        return
    column, si = drive.signals[name], SIGNALS[name]
    factor = partial(column.factor_of, si_unit=si, radius=drive.vehicle.radius_for(name))
    given = factor(column.unit)
    fitting = [f'unit = "{unit}"' for unit in limit.units if high * factor(unit) / given <= limit.largest]
    turns = ", as a steering wheel does (name it hand_wheel then)" if name == "steering" else ""
    raise LogError(
        f"{_place(drive, files, f'signals.{name}', column)} in {column.unit} reaches {size.max():.4g} {si}, and more than "
        f"{limit.largest:g} {si} too often to be spikes{turns}; {_remedy(fitting, column)}"
    )


def _check_rolling(
    drive: DriveFile, signals: Mapping[str, FloatArray], vx: FloatArray, files: Mapping[str, str]
) -> None:
    car = drive.vehicle
    radius = np.repeat([car.effective_radius_front, car.effective_radius_rear], 2)
    surface = at_corners(signals, "wheel_speed") * radius
    fast = np.isfinite(vx) & (vx > FAST)
    ratio = surface[fast] / vx[fast, None]
    turning = np.isfinite(ratio) & (np.abs(ratio) > STANDING)
    medians = (np.median(r[t]) if t.sum() >= ENOUGH else np.nan for r, t in zip(ratio.T, turning.T, strict=True))
    median = np.array(list(medians))
    known = np.isfinite(median)
    strange = known & ~((median >= ONE_WHEEL[0]) & (median <= ONE_WHEEL[1]))
    if strange.any() and not strange[known].all():
        wheel = int(np.flatnonzero(strange)[0])
        raise LogError(_odd_wheel(drive, files, wheel, float(median[wheel]), surface / radius))
    if known.any():
        whole = float(np.median(ratio[turning & known]))
        each = np.where(turning & known, ratio, np.nan)[(turning & known).any(axis=1)]
        low, high = np.percentile(np.nanmean(each, axis=1), (25.0, 75.0))
        rolling = STEADY_ROLLING if abs(high - low) < STEADY * abs(whole) else ROLLING
        if not rolling[0] <= whole <= rolling[1]:
            wheel = int(np.flatnonzero(known)[0])
            raise LogError(_odd_wheel(drive, files, wheel, whole, surface / radius, rolling))


def _odd_wheel(
    drive: DriveFile,
    files: Mapping[str, str],
    wheel: int,
    ratio: float,
    speed: FloatArray,
    whole: tuple[float, float] | None = None,
) -> str:
    """What is said of a wheel, or of the range ``whole`` in which the ratio of all wheels should be."""
    low, high = whole or ROLLING
    name = f"wheel_speed_{CORNERS[wheel]}"
    column, velocity = drive.signals[name], drive.reference["vx"]
    factor = partial(column.factor_of, si_unit="rad/s", radius=drive.vehicle.radius_for(name))
    given = factor(column.unit)
    fitting = [f'unit = "{unit}"' for unit in WHEEL_UNITS if low <= ratio * factor(unit) / given <= high]
    place = f"{_place(drive, files, f'signals.{name}', column)} in {column.unit}"
    if not fitting and whole:
        given = factor_to(velocity.unit, "m/s")
        units = ("m/s", "km/h", "mph")
        fitting = [
            f'unit = "{u}" for reference.vx' for u in units if low <= ratio * given / factor_to(u, "m/s") <= high
        ]
    if not fitting and low <= -ratio <= high:
        fitting = [f'sign = "{"positive" if column.sign == "negative" else "negative"}"']
    return (
        f"{place} reaches {float(np.nanmax(np.abs(speed[:, wheel]))):.4g} rad/s: R_e w / V_x is {ratio:.3g} "
        f"at the median{' of all wheels' if whole else ''} while reference.vx (column '{velocity.column}' in {velocity.unit}) "
        f"is above {FAST:g} m/s, a rolling wheel has {low:g} to {high:g}; "
        f"{_remedy(fitting, column, 'or effective_radius' if whole else '')}"
    )


def _place(drive: DriveFile, files: Mapping[str, str], key: str, column: Column) -> str:
    return f"{files[drive.log_of(column)]}: {key}: column '{column.column}'"


def _remedy(fitting: list[str], column: Column, more: str = "") -> str:
    """Which unit would explain it; without one, and with a factor that may be the culprit, what to look at."""
    if fitting and column.factor == 1.0:
        return f"likely {fitting[0]}: correct it in the drive file"
    words = ("correct its unit or factor", f"(now {column.factor:g})", more, "in the drive file")
    return " ".join(word for word in words if word)
