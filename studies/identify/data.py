"""The signals of one drive as the identification needs them, from the same reader and the same formulas as a replay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.vehicle import GRAVITY
from studies.drives.drive_file import DriveFile
from studies.drives.log import DriveLog
from studies.drives.prepare import CornerInputs, corner_inputs_of
from studies.drives.quantities import CORNERS
from studies.errors import IdentifyError
from studies.identify.prefilter import Prefilter
from studies.identify.settings import IdentifySettings


@dataclass(frozen=True)
class DriveSignals:
    """n samples, corners fl, fr, rl, rr, SI. ``torque`` is None unless all four are measured.

    ``vx``, ``vy`` are the reference velocities at the centre of gravity; ``has_vy`` says whether ``vy`` was measured (it is 0
    otherwise). ``bad`` (n, 4) marks what no fit may use: slower than the least speed, held, nearly lifted.
    """

    drive: DriveFile
    inputs: CornerInputs
    filter: Prefilter
    vx: FloatArray
    vy: FloatArray
    has_vy: bool
    ay: FloatArray | None
    yaw_rate: FloatArray | None
    torque: FloatArray | None
    bad: BoolArray

    @property
    def step(self) -> float:
        """Sample time, s."""
        return self.drive.sample_time

    @property
    def along(self) -> FloatArray:
        """Reference velocity of the wheel centres along the tire, (n, 4), m/s: P1 (33) inverted, with lever arms."""
        x, y, sine, cosine = self.inputs.x, self.inputs.y, np.sin(self.inputs.steer), np.cos(self.inputs.steer)
        r = self.inputs.yaw_rate[:, None]
        return np.asarray((self.vx[:, None] - r * y) * cosine + (self.vy[:, None] + r * x) * sine)

    @property
    def load(self) -> FloatArray:
        """Vertical loads (n, 4), N, never below the least one of a wheel on the ground."""
        return np.maximum(self.inputs.vertical_load, 0.05 * self.drive.vehicle.mass * GRAVITY / 4)


def drive_signals(log: DriveLog, drive: DriveFile, settings: IdentifySettings) -> DriveSignals:
    """Raises IdentifyError: no velocity reference, a signal that is missing throughout, standstill, too short."""
    if "vx" not in log.reference:
        raise IdentifyError(
            f"drive '{drive.name}': reference.vx is missing, and slip cannot be formed without a measured velocity; add "
            'vx = { column = "...", unit = "m/s" } under [reference]'
        )
    inputs = corner_inputs_of(log, drive)
    vx = log.reference["vx"]
    measured = log.reference.get("vy", log.signals.get("vy"))
    vy = np.zeros_like(log.time) if measured is None else measured
    ay, yaw_rate = log.signals.get("ay"), log.signals.get("yaw_rate")
    names = [f"torque_{corner}" for corner in CORNERS]
    torque = np.stack([log.signals[n] for n in names], axis=-1) if all(n in log.signals for n in names) else None
    needed = [vx, vy, *inputs.wheel_speed.T, inputs.ax, inputs.yaw_rate, *inputs.steer.T]
    needed += [v for v in (ay, *(torque.T if torque is not None else ())) if v is not None]
    known = np.all(np.isfinite(np.stack(needed, axis=-1)), axis=-1)
    if not known.any():
        raise IdentifyError(f"drive '{drive.name}': no instant has all signals and the reference vx; check the columns")
    prefilter = Prefilter(known, drive.sample_time, settings.filter_lag, settings.settling)
    held = np.abs(inputs.wheel_speed) < settings.stopped_below
    light = inputs.vertical_load < settings.least_load * drive.vehicle.mass * GRAVITY / 4
    slow = ~(np.abs(vx) >= settings.least_speed)
    signals = DriveSignals(
        drive, inputs, prefilter, vx, vy, measured is not None, ay, yaw_rate, torque,
        held | light | slow[:, None] | ~known[:, None],
    )  # fmt: skip
    _refuse_short(signals, slow | ~known, settings)
    return signals


def _refuse_short(signals: DriveSignals, slow: BoolArray, settings: IdentifySettings) -> None:
    place, step = f"drive '{signals.drive.name}'", signals.step
    fastest = float(np.nanmax(np.abs(signals.vx)))
    if fastest < settings.least_speed:
        raise IdentifyError(
            f"{place}: standstill (|vx| at most {fastest:.2g} m/s, needed {settings.least_speed:g} m/s); give a log of driving"
        )
    usable = step * int(np.count_nonzero(signals.filter.settled(slow)))
    if usable < settings.least_seconds:
        raise IdentifyError(
            f"{place}: {usable:.2g} s above {settings.least_speed:g} m/s without gaps (after {signals.filter.memory * step:g} s "
            f"of filter start), needed {settings.least_seconds:g} s; give a longer log"
        )
