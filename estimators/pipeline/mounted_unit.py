"""An inertial unit that is not at the centre of gravity, or not along the axes of the car, before a pipeline."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, entries, mask, setting
from estimators.arrays import BoolArray, FloatArray
from estimators.faults import Flag
from estimators.memory import Memory
from estimators.pipeline.signals import VehicleSignals
from estimators.signals import FilteredDerivative, limits
from estimators.signals.mounting import Mounting, UnitAxes, lever_acceleration
from estimators.vehicle import GRAVITY

RATE_LAG = 0.02  # s, of the derivative of the angular rate, as for the yaw acceleration of the pipeline
USUAL_PULL, USUAL_RATE = (0.0, 0.0, GRAVITY), (0.0, 0.0, 0.0)
"""What is taken of an axis that no sensor measures: m/s^2 and rad/s of the car."""
_LATE = 0.5  # relative error of the sample time beyond which a difference of rates is no derivative
_MOSTLY = 0.5  # share of a reading in an axis of the car above which its repetition is that of the axis
_PULLS, _RATES = ("ax", "ay", "az"), ("roll_rate", "pitch_rate", "yaw_rate")


class MountedUnit(Memory):
    """Accelerations and rates of the unit turned into the axes of the car, and accelerations moved to its centre of gravity.

        a_cg = R a - w' x l - w x (w x l),   w = R w_unit                                   (`estimators.signals.mounting`)

    w' is a causal derivative with `lag`, so it comes late by lag + Ts/2. An axis that the car has no sensor for stays None; a
    missing reading (NaN, or beyond `signals.limits`) makes the axes missing that it has a larger share of. An axis that
    consists mostly of a reading that repeats its predecessor bit for bit repeats, too: what the others mix into a frozen
    reading would make it look alive. `step` goes before `EstimationPipeline.step`: pipeline.step(unit.step(signals)).

    Args:
        mounting: of the unit that measures a_x to the pitch rate.
        sample_time: s.
        batch_shape: leading axes of every signal; () for one car.
        lag: s.

    Raises:
        EstimatorError: a setting that is not positive.

    >>> import numpy as np
    >>> unit = MountedUnit(Mounting(roll=0.01), sample_time=0.005)
    >>> turned = unit.step(VehicleSignals(wheel_speed=np.full(4, 60.0), ax=1.0, az=9.81))
    >>> round(float(turned.ax), 3)
    1.0
    """

    memory = ("last", "moved")
    unknowns = ("moved",)
    parts = ("slope",)

    def __init__(
        self, mounting: Mounting, sample_time: float, batch_shape: tuple[int, ...] = (), lag: float = RATE_LAG
    ) -> None:
        self.mounting, self.batch_shape = mounting, batch(batch_shape)
        self.sample_time = setting(sample_time, "sample_time", "s")
        self.slope = FilteredDerivative(sample_time, lag, (*self.batch_shape, 3))
        self._start = np.tile([*USUAL_PULL, *USUAL_RATE], (*self.batch_shape, 1))
        self.last: FloatArray = self._start.copy()  # last readings of the unit: a_x, a_y, a_z, p, q, r
        self.moved: FloatArray = np.full_like(self._start, np.nan)  # what was last made of them
        self._axes: dict[tuple[bool, ...], tuple[UnitAxes, UnitAxes]] = {}

    def step(self, signals: VehicleSignals) -> VehicleSignals:
        """One sample of the unit as one at the centre of gravity; what it does not measure is handed on as it is.

        Raises:
            EstimatorError: another shape, or not numbers; angles that need an axis which is None.
        """
        if not (self.mounting.turned or self.mounting.away):
            return signals
        given = {name: getattr(signals, name) for name in (*_PULLS, *_RATES)}
        measured = tuple(value is not None for value in given.values())
        raw = np.stack([self._read(name, value) for name, value in given.items()], axis=-1)
        repeats = raw == self.last
        self.last = np.where(np.isfinite(raw), raw, self.last)
        pull_axes, rate_axes = self._axes_of(measured)
        pull, rate = pull_axes(raw[..., :3], self.last[..., :3]), rate_axes(raw[..., 3:], self.last[..., 3:])
        if self.mounting.away:
            turning = _turning(self.slope, self._in_time(rate, signals.elapsed))
            pull = pull - lever_acceleration(self.mounting.lever, *turning)
        moved = np.concatenate((pull, rate), axis=-1)
        old = repeating((pull_axes, rate_axes), repeats & measured)
        if old.any():
            moved = np.where(old & np.isfinite(moved) & np.isfinite(self.moved), self.moved, moved)
        self.moved = moved
        names = (name for name, there in zip(given, measured, strict=True) if there)
        return signals._replace(**dict(zip(names, np.moveaxis(moved, -1, 0)[list(measured)], strict=True)))

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Forgets the entries `where` (bool mask of the batch shape; None: all).

        Raises:
            EstimatorError: a mask of another shape.
        """
        chosen = mask(where, self.batch_shape, "where")[..., None]
        self.last = np.where(chosen, self._start, self.last)
        self.moved = np.where(chosen, np.nan, self.moved)
        self.slope.reset(np.repeat(chosen, 3, axis=-1))

    def _read(self, name: str, value: npt.ArrayLike | None) -> FloatArray:
        """(...) of the batch shape; NaN for what no sensor reads, zero for what is not measured."""
        array = entries(0.0 if value is None else value, self.batch_shape, name)
        limit = limits.ACCELERATION if name in _PULLS else limits.YAW_RATE
        return np.where(np.absolute(array) <= limit, array, np.nan)

    def _in_time(self, rate: FloatArray, elapsed: npt.ArrayLike | None) -> FloatArray:
        """NaN where the sample came too early or too late for a difference quotient."""
        if elapsed is None:
            return rate
        off = entries(elapsed, self.batch_shape, "elapsed") / self.sample_time - 1.0
        return np.where((np.absolute(off) <= _LATE)[..., None], rate, np.nan)

    def _axes_of(self, measured: tuple[bool, ...]) -> tuple[UnitAxes, UnitAxes]:
        if measured not in self._axes:
            pulls = UnitAxes(self.mounting, measured[:3], USUAL_PULL)
            self._axes[measured] = pulls, UnitAxes(self.mounting, measured[3:], USUAL_RATE)
        return self._axes[measured]


def repeating(axes: tuple[UnitAxes, UnitAxes], repeats: BoolArray) -> BoolArray:
    """Which axes of the car (..., 6) consist mostly of readings (..., 6) that repeat their predecessors: they repeat, too."""
    parts = (part.touched(repeats[..., k : k + 3], _MOSTLY) for part, k in zip(axes, (0, 3), strict=True))
    return np.concatenate(list(parts), axis=-1)


def held_turning(rate: FloatArray, sample_time: float, lag: float) -> tuple[FloatArray, FloatArray]:
    """w and w' (n, 3) of the rates (n, 3) of a log, as `MountedUnit` has them sample by sample."""
    slope = FilteredDerivative(sample_time, lag, (3,))
    rows = [_turning(slope, row) for row in rate]
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])


def _turning(slope: FilteredDerivative, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The last known rate, zero where it was lost for long, and its derivative."""
    found = slope.step(rate)
    stale = (found.flags & Flag.STALE_MEASUREMENT) != 0
    return (np.where(stale, 0.0, found.value) if stale.any() else found.value), found.derivative
