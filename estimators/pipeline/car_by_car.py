"""A few cars one after the other: below the break-even, plain numbers of every car are faster than arrays of all."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from estimators.arguments import apart
from estimators.arithmetic import Number
from estimators.arrays import AnyArray, BoolArray, FloatArray
from estimators.forces import AttitudeStep, LoadStep
from estimators.memory import Memory, Saved
from estimators.pipeline.checks import Forces
from estimators.pipeline.direction import SignedWheels
from estimators.pipeline.motion import BeforeForces, CarMotion
from estimators.pipeline.parts import AttitudePart, LoadPart, VelocityPart, VelocityResult, divides
from estimators.pipeline.result import Consistency
from estimators.pipeline.signals import VehicleSignals
from estimators.velocity.fusion_step import joined_steps

FEW = 4
"""Cars up to which this is faster: on arrays four cars cost hardly less than eight, and more than four times one."""
_READ = (
    *("vx", "vy", "yaw_rate", "sensor_bias", "used", "standing", "flags"),
    *("force_contested", "inertial_used", "inertial", "gravity"),  # where the velocity part has them
)
_Step = TypeVar("_Step", LoadStep, AttitudeStep, Consistency, SignedWheels)


class CarByCar(Memory):
    """What a `CarMotion` of several cars does, by one for each; saved, every array of a car has the axes of the batch in front.

    A velocity part that cannot be divided steps all cars at once, between what each of them does before and after it.

    Args:
        batch_shape: of the cars.
        build: makes the motion of one car, from its loads, velocity and attitude.
        loads, velocity, attitude: for all cars; loads and attitude can be divided.
    """

    def __init__(
        self,
        batch_shape: tuple[int, ...],
        build: Callable[..., CarMotion],
        loads: LoadPart,
        velocity: VelocityPart,
        attitude: AttitudePart | None,
    ) -> None:
        self.batch_shape = batch_shape
        self.velocity = None if divides(velocity, batch_shape) else velocity
        self.parts = ("velocity",) if hasattr(self.velocity, "save") else ()
        own: list[Any] = [loads, velocity if self.velocity is None else None, attitude]
        self.cars = [
            build(*(None if part is None else part.like(()) for part in own)) for _ in range(math.prod(batch_shape))
        ]
        self._takes_gravity = bool(getattr(velocity, "uses_gravity", False))
        self._given: tuple[Number, FloatArray, npt.ArrayLike | None]  # yaw rate, steering, time, of this sample

    def signed(self, w: FloatArray, ax: Number, gear: npt.ArrayLike | None) -> SignedWheels | None:
        """As `CarMotion.signed`."""
        if self.cars[0].direction is None:
            return None
        given = zip(
            self.cars, w.reshape(-1, 4), ax.ravel().tolist(), apart(gear, self.batch_shape, "direction"), strict=True
        )
        found = (car.signed(wheels, pull, way) for car, wheels, pull, way in given)
        signed = joined([one for one in found if one is not None], self.batch_shape)
        if np.count_nonzero(signed.turned):
            self._restart(signed.turned, signed.speed)
        return signed

    def before_forces(
        self, ax: Number, ay: Number, turn: Number, steer: FloatArray, signals: VehicleSignals
    ) -> BeforeForces:
        """As `CarMotion.before_forces`."""
        shape, self._given = self.batch_shape, (turn, steer, signals.elapsed)
        body = (value.ravel().tolist() for value in (ax, ay, turn))
        given = zip(*body, steer.reshape(-1, 4), signals.of_cars(shape), strict=True)
        found = [car.before_forces(*own) for car, own in zip(self.cars, given, strict=True)]
        own_x, own_y, yaw_rate, angle, total = np.array([one[1:6] for one in found]).T.reshape(5, *shape)
        tilts = [one.attitude for one in found if one.attitude is not None]
        attitude = joined(tilts, shape) if tilts else None
        return BeforeForces(joined([one.loads for one in found], shape), own_x, own_y, yaw_rate, angle, total, attitude)

    def after_forces(self, w: FloatArray, use: FloatArray, forces: Forces, more: dict[str, Any]) -> VelocityResult:
        """As `CarMotion.after_forces`."""
        own = map(Forces._make, zip(*(value.ravel().tolist() for value in forces), strict=True))
        if self.velocity is None:
            given = zip(self.cars, w.reshape(-1, 4), use.reshape(-1, 4), own, strict=True)
            steps: list[Any] = [car.after_forces(wheels, uses, known, more) for car, wheels, uses, known in given]
            return joined_steps(steps, self.batch_shape)
        shape, (turn, steer, elapsed) = self.batch_shape, self._given
        *pulls, gravity = zip(*(car.felt(self._takes_gravity) for car in self.cars), strict=True)
        ax, ay = np.array(pulls).reshape(2, *shape)
        if gravity[0] is not None:
            more = {**more, "gravity": np.array(gravity).reshape(*shape, 4)}
        moved = self.velocity.step(w, steer, ax, ay, turn, use, elapsed, **more)
        for car, known, its in zip(self.cars, own, _of_cars(moved, len(self.cars), len(shape)), strict=True):
            car.take(known, its)
        return moved

    def checked(self, corner_speed: Number | None = None) -> tuple[Consistency, Number]:
        """As `CarMotion.checked`."""
        speeds = apart(corner_speed, self.batch_shape, "corner_speed")
        found = (car.checked(speed) for car, speed in zip(self.cars, speeds, strict=True))
        checks, sideslip = zip(*found, strict=True)
        return joined(checks, self.batch_shape), np.array(sideslip)

    def reset(self, chosen: BoolArray, vx: npt.ArrayLike, vy: npt.ArrayLike) -> None:
        """As `CarMotion.reset`."""
        self._restart(chosen, vx, vy)
        starts = (apart(value, self.batch_shape, what) for value, what in ((vx, "vx"), (vy, "vy")))
        for car, *own in zip(self.cars, chosen.reshape(-1, 1), *starts, strict=True):
            car.reset(own[0].reshape(()), *own[1:])

    def save(self) -> Saved:
        """Everything needed to continue later."""
        saved = [car.save() for car in self.cars]
        arrays = {key: np.array([one[key] for one in saved]) for key in saved[0]}
        return super().save() | {
            key: array.reshape(*self.batch_shape, *array.shape[1:]) for key, array in arrays.items()
        }

    def _all_unknowns(self) -> set[str]:
        return super()._all_unknowns() | self.cars[0]._all_unknowns()

    def _take(self, saved: Mapping[str, AnyArray]) -> None:
        flat = {key: np.reshape(saved[key], (len(self.cars), *own.shape)) for key, own in self.cars[0].save().items()}
        for k, car in enumerate(self.cars):
            car.restore({key: value[k] for key, value in flat.items()})
        super()._take(saved)

    def _restart(self, chosen: BoolArray, *start: npt.ArrayLike) -> None:
        """Forgets the entries `chosen` of the velocity part of all cars."""
        if (reset := getattr(self.velocity, "reset", None)) is not None:
            reset(chosen, *start)


def joined(steps: Sequence[_Step], shape: tuple[int, ...]) -> _Step:
    """Steps of single cars as the one of a batch of `shape`: its axes stand in front."""
    columns = [np.array(column) for column in zip(*steps, strict=True)]
    if len(shape) > 1:
        columns = [column.reshape(*shape, *column.shape[1:]) for column in columns]
    return type(steps[0])(*columns)


def _of_cars(moved: VelocityResult, cars: int, axes: int) -> list[Any]:
    """What a motion reads of the step of a velocity part, of each car: plain numbers, or arrays without `axes` of the batch."""
    columns: dict[str, Any] = {}
    for name in _READ:
        if (value := getattr(moved, name, None)) is not None:
            column = value.reshape(cars, *value.shape[axes:])
            columns[name] = column.tolist() if column.ndim == 1 else column
    return [SimpleNamespace(**{name: column[k] for name, column in columns.items()}) for k in range(cars)]
