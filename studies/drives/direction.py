"""The way of a car whose wheel speeds have no sign: the gear in the log, and what may be compared where it says nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydantic import Field

from estimators.arrays import FloatArray
from estimators.errors import unknown
from estimators.pipeline.direction import FASTEST
from estimators.vehicle import VehicleParameters
from studies.drives.columns import LogFile
from studies.drives.quantities import CORNERS
from synthesis.toml_file import StrictTable


class Gear(StrictTable):
    """The column that tells forward from backward: readings that mean reverse, and those that mean forward.

    ``forward``: every positive reading that is not in ``backward``, if it is left out. Anything else (neutral, park, a cell
    without a number) says nothing.
    """

    column: str = Field(min_length=1, examples=["gear"])
    log: str | None = None
    backward: list[float] = Field(default=[-1.0], min_length=1, examples=[[-1.0]])
    forward: list[float] | None = Field(default=None, examples=[[1.0, 2.0, 3.0]])

    def ways(self, reading: FloatArray) -> FloatArray:
        """1 forward, -1 backward, 0 neither (n,)."""
        backward = np.isin(reading, self.backward)
        forward = (reading > 0.0 if self.forward is None else np.isin(reading, self.forward)) & ~backward
        return forward.astype(np.float64) - backward


def check_direction(gear: Gear | None, unsigned: bool, logs: Sequence[LogFile]) -> None:
    """A gear belongs to wheel speeds without a sign, and says which log holds it."""
    if gear is None:
        return
    names = [log.name for log in logs]
    if not unsigned:
        raise ValueError(
            "direction: belongs to wheel speeds without a sign; add unsigned_wheels = true, or leave it out"
        )
    if gear.log is None and len(names) > 1:
        raise ValueError(f"direction.log: missing; say which log holds column '{gear.column}': {', '.join(names)}")
    if gear.log is not None and gear.log not in names:
        raise ValueError(f"direction.log: {unknown('log', gear.log, names)}")


def signed_wheels(signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Wheel speeds without a sign as the ``direction`` among the signals has them; a size alone where it says nothing."""
    way = np.where(signals["direction"] == -1.0, -1.0, 1.0) if "direction" in signals else 1.0
    return {name: way * np.abs(signals[name]) for name in _WHEELS}


def of_known_way(signals: Mapping[str, FloatArray], car: VehicleParameters) -> dict[str, FloatArray]:
    """The signals without the wheel speeds of which nothing tells the sign: slower than any reverse gear, no ``direction``."""
    speed = np.stack([signals[name] for name in _WHEELS], axis=-1)
    known = np.abs(speed * car.radius).max(axis=-1) > FASTEST
    if "direction" in signals:
        known |= np.abs(signals["direction"]) == 1.0
    return {**signals, **{name: np.where(known, signals[name], np.nan) for name in _WHEELS}}


_WHEELS = tuple(f"wheel_speed_{corner}" for corner in CORNERS)
