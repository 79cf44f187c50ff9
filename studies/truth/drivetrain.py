"""From what the driver asks to the torque of each wheel: AWD, RWD or FWD, brakes, and assists that are off or poor.

The four wheels have motors of their own (the papers' car), or an open differential, which is the same: both wheels of an
axle get the same torque. Torques are at the wheels, N m; brakes count as what they could hold (Coulomb).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import unknown
from studies.truth.layout import column
from synthesis.errors import SpecError

FRONT_SHARES = {"AWD": 0.5, "FWD": 1.0, "RWD": 0.0}  # share of the drive torque that goes to the front axle


@dataclass(frozen=True)
class Assist:
    """Traction control or ABS, deliberately poor as in P2: no model, one threshold, slow hands.

    Above `limit` of slip the torque of that wheel falls by `release` a second (as a share of what is asked), below it
    comes back by `apply` a second; it never falls below `least`. `inactive_below` is in m/s.
    """

    limit: float = 0.25
    release: float = 8.0
    apply: float = 2.5
    least: float = 0.1
    inactive_below: float = 1.0

    def __post_init__(self) -> None:
        if not (0 < self.limit < 1 and self.release > 0 and self.apply > 0 and 0 <= self.least < 1):
            raise SpecError(f"assist: {self}: limit in (0, 1), release and apply above 0, least in [0, 1)")


@dataclass(frozen=True)
class Drivetrain:
    """Raises SpecError for a share outside [0, 1] or a limit that is not above zero."""

    layout: str = "AWD"
    maximum_torque: float = 6400.0  # N m, sum over the driven wheels: 1600 at each wheel of the papers' car
    maximum_power: float = 250e3  # W
    maximum_brake_torque: float = 9000.0  # N m, sum over all wheels
    front_brake_share: float = 0.65
    traction_control: Assist | None = None
    anti_lock: Assist | None = None

    def __post_init__(self) -> None:
        if self.layout not in FRONT_SHARES:
            raise SpecError(f"drivetrain: {unknown('layout', self.layout, FRONT_SHARES)}")
        for name in ("maximum_torque", "maximum_power", "maximum_brake_torque"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise SpecError(f"drivetrain.{name} = {getattr(self, name)!r}: must be finite and above 0")
        if not 0 <= self.front_brake_share <= 1:
            raise SpecError(f"drivetrain.front_brake_share = {self.front_brake_share!r}: must be in [0, 1]")


class Drivetrains:
    """The drivetrains of B vehicles; shares and limits as arrays."""

    def __init__(self, drivetrains: Sequence[Drivetrain]) -> None:
        front = np.array([FRONT_SHARES[d.layout] for d in drivetrains])
        brake = column(drivetrains, "front_brake_share")
        self.share: FloatArray = 0.5 * np.stack([front, front, 1 - front, 1 - front])
        self.brake_share: FloatArray = 0.5 * np.stack([brake, brake, 1 - brake, 1 - brake])
        self.maximum = column(drivetrains, "maximum_torque")
        self.power = column(drivetrains, "maximum_power")
        self.maximum_brake = column(drivetrains, "maximum_brake_torque")
        self.traction = _Assists([d.traction_control for d in drivetrains], 1.0)
        self.anti_lock = _Assists([d.anti_lock for d in drivetrains], -1.0)

    def available(self, wheel_speed: FloatArray) -> FloatArray:
        """Greatest drive torque (B,), N m, at the mean speed of the driven wheels (4, B), rad/s: flat, then hyperbola."""
        mean = np.absolute((wheel_speed * self.share).sum(axis=0))
        return np.asarray(np.minimum(self.maximum, self.power / np.maximum(mean, 1e-3)))

    def torques(
        self, drive: FloatArray, brake: FloatArray, slip: FloatArray, speed: FloatArray, spin: FloatArray, h: float
    ) -> tuple[FloatArray, FloatArray]:
        """Drive and brake torque of each wheel (4, B), N m.

        From the sums asked for (B,), slips (4, B), |v| (B,) m/s, wheel speeds (4, B) rad/s and the step, s. A spinning
        wheel gets its share of the greatest power at most.
        """
        power = self.power * self.share / np.maximum(np.absolute(spin), 1.0)
        power = np.minimum(power, self.maximum * self.share)
        driven = np.minimum(np.maximum(drive * self.share, -power), power)
        braked = np.minimum(np.maximum(brake, 0.0), self.maximum_brake) * self.brake_share
        return driven * self.traction.step(slip, speed, h), braked * self.anti_lock.step(slip, speed, h)

    def restart(self) -> None:
        """All assists at rest."""
        self.traction.restart()
        self.anti_lock.restart()


class _Assists:
    def __init__(self, assists: Sequence[Assist | None], sign: float) -> None:
        self.any, self.sign = any(a is not None for a in assists), sign
        self.on = np.array([a is not None for a in assists])
        some = [a or Assist() for a in assists]
        self.limit, self.release, self.apply, self.least, self.inactive_below = (
            column(some, name) for name in ("limit", "release", "apply", "least", "inactive_below")
        )
        self.restart()

    def restart(self) -> None:
        self.share: FloatArray = np.ones((4, self.on.size))

    def step(self, slip: FloatArray, speed: FloatArray, h: float) -> FloatArray | float:
        """Share of the asked torque that each wheel gets (4, B)."""
        if not self.any:
            return 1.0
        over = self.on & (self.sign * slip > self.limit) & (speed > self.inactive_below)
        moved = self.share + h * np.where(over, -self.release, self.apply)
        self.share = np.where(self.on, np.clip(moved, self.least, 1.0), 1.0)
        return self.share
