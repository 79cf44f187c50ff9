"""Forward or backward: the sign of wheel speeds whose sensors count teeth and do not know the way.

Given by the gear, or found from the accelerometer: wheels that gain speed while the car is pulled forward roll forward.

    E = int a sign(s') dt  over times with |s'| > `_GAIN`,     s mean surface speed without sign, a without bias and grade

E is the speed that the accelerometer saw the wheels gain: from rest it is V_x itself. Its sign decides once it exceeds what
bias and noise make of it; until then the more probable way is taken, and what is reported of V_x covers the other one. A car
does not change its way without a stop, where E starts again.

A gear says which way the car is driven, not which way it rolls: at a stop E starts from it, and faster than an idling engine
drives it holds; in between a car may roll back on a hill, or still roll on when the lever is moved, and E goes on.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.arrays import BoolArray, FloatArray
from estimators.memory import CarsMemory
from estimators.vehicle import VehicleParameters

_SURE = 0.5  # m/s: three times what 0.15 m/s^2 of unknown bias make in a second
_REST = 0.3  # m/s below which a wheel sensor gives no pulses (`FusionSettings.dead_speed`)
_DRIVEN = 2.0  # m/s: an idling engine drives up to that; with the clutch open a car may roll against its gear
FASTEST = 12.0  # m/s: reverse gears end there
_GAIN = 0.3  # m/s^2 of the wheels below which they gain nothing
_LAG = 0.05  # s of the filter that differentiates them


class SignedWheels(NamedTuple):
    """Leading axes are those of the batch."""

    wheel_speed: FloatArray  # (..., 4) rad/s
    turned: BoolArray  # (...) whether the car has just been found to go the other way
    speed: FloatArray  # (...) m/s, mean of the wheels with that sign
    open_deviation: FloatArray  # (...) m/s, deviation that covers the other way; 0 where the way is known


class DirectionOfTravel(CarsMemory):
    """Remembers of every car what the accelerometer has said since the last stop."""

    memory = ("evidence", "surface", "gain", "way", "lever")

    def __init__(self, vehicle: VehicleParameters, sample_time: float, batch_shape: tuple[int, ...]) -> None:
        self.kit, self.sample_time = arithmetic((math.prod(batch_shape),)), sample_time
        self.batch_shape = batch_shape
        self._radius = self.kit.signals(vehicle.radii)
        self._kept = self.kit.exp(self.kit.full(-sample_time / _LAG))
        zero = self.kit.full(0.0)
        self.evidence: Number = zero  # E, m/s
        self.surface: Number = zero  # s of the last sample, m/s
        self.gain: Number = zero  # s', low-passed, m/s^2
        self.way: Number = zero  # 1 or -1; 0 before the first sample
        self.lever: Number = zero  # the gear of the last sample: 1, -1, or 0

    def step(self, wheel_speed: FloatArray, pull: npt.ArrayLike, given: npt.ArrayLike | None) -> SignedWheels:
        """`wheel_speed` (..., 4) rad/s of any sign; `pull` (...) a, m/s^2; `given` (...) by the gear: 1, -1, or neither.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        kit, shape = self.kit, self.batch_shape
        gear = kit.car(math.nan if given is None else given, shape, "direction")
        found = self._found(kit.rows(wheel_speed, 4), kit.car(pull, shape, "pull"), gear)
        way, turned, surface, known = (np.asarray(value).reshape(shape) for value in found)
        # the other way is off by twice the speed, and a little more while the car brakes: three deviations cover it
        return SignedWheels(
            np.absolute(wheel_speed) * way[..., None], turned, way * surface, 0.8 * surface * np.logical_not(known)
        )

    def _found(self, wheel_speed: Signals, pull: Number, given: Number) -> tuple[Number, Number, Number, Number]:
        """Way, whether it has just changed while the car rolls, s, and whether it is known."""
        kit, choose, no = self.kit, self.kit.where, self.kit.no
        total, count = 0.0, 0
        for w, R in zip(wheel_speed, self._radius, strict=True):
            size = abs(R * w)
            there = size < 1e3  # False for NaN
            total, count = total + choose(there, size, 0.0), count + choose(there, 1, 0)
        surface = choose(count > 0, total / kit.maximum(count, 1), self.surface)
        first, rest = self.way == 0.0, surface < _REST
        slope = choose(first | (count == 0), 0.0, (surface - self.surface) / self.sample_time)
        self.gain = gain = self._kept * self.gain + (1.0 - self._kept) * slope
        counts = (abs(gain) > _GAIN) & (abs(pull) < 1e3)
        more = choose(counts, pull * kit.sign(gain) * self.sample_time, 0.0)
        evidence = kit.maximum(kit.minimum(self.evidence + more, 2.0 * _SURE), -2.0 * _SURE)
        geared = (given == 1.0) | (given == -1.0)
        likely = choose(geared, given * 1.1 * _SURE, 0.0)
        # at rest the gear alone says something of the next way; a start counts from half a second before the wheels say so
        evidence = choose(rest, 0.99 * evidence + 0.01 * likely, evidence)
        begins = first | (rest & geared & ((self.surface >= _REST) | (given != self.lever)))
        evidence = choose(begins, likely, evidence)
        evidence = choose(surface > FASTEST, 2.0 * _SURE, evidence)
        evidence = choose(geared & (surface > _DRIVEN), given * 2.0 * _SURE, evidence)
        found = choose(abs(evidence) > 0.1 * _SURE, kit.sign(evidence), choose(first, 1.0, self.way))
        # on the move only what is sure turns it around
        turns = first | rest | (abs(evidence) > _SURE)
        way = choose(turns, found, self.way)
        changed = no(first) & (way != self.way) & no(rest)
        self.evidence, self.surface, self.way = evidence, surface, way
        self.lever = choose(geared, given, 0.0)
        return way, changed, surface, abs(evidence) > _SURE
