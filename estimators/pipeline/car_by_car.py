"""A few cars one after the other: below the break-even, plain numbers of every car are faster than arrays of all."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from estimators.arguments import entries
from estimators.arithmetic import Number
from estimators.arrays import AnyArray, BoolArray, FloatArray
from estimators.forces import LoadStep
from estimators.memory import Memory, Saved
from estimators.pipeline.checks import Forces
from estimators.pipeline.motion import BeforeForces, CarMotion
from estimators.pipeline.result import Consistency
from estimators.pipeline.signals import VehicleSignals
from estimators.velocity.fusion_step import FusionStep, joined_steps

FEW = 4
"""Cars up to which this is faster: on arrays four cars cost hardly less than eight, and more than four times one."""
_Step = TypeVar("_Step", LoadStep, Consistency)


class CarByCar(Memory):
    """What a `CarMotion` of several cars does, by one for each; saved, every array of a car has the axes of the batch in front.

    Args:
        batch_shape: of the cars.
        build: makes the motion of one car, with the default parts.
    """

    def __init__(self, batch_shape: tuple[int, ...], build: Callable[[], CarMotion]) -> None:
        self.batch_shape, self.cars = batch_shape, [build() for _ in range(math.prod(batch_shape))]
        self._checks: tuple[Consistency, ...]  # of this sample
        self._sideslip: tuple[float, ...]  # rad

    def signed(self, w: FloatArray, ax: Number, gear: npt.ArrayLike | None) -> tuple[FloatArray, None]:
        """As they are: the wheel speeds of these cars have a sign."""
        return w, None

    def before_forces(
        self, ax: Number, ay: Number, turn: Number, steer: FloatArray, signals: VehicleSignals
    ) -> BeforeForces:
        """As `CarMotion.before_forces`."""
        body = (value.ravel().tolist() for value in (ax, ay, turn))
        given = zip(*body, steer.reshape(-1, 4), signals.of_cars(self.batch_shape), strict=True)
        found = [car.before_forces(*own) for car, own in zip(self.cars, given, strict=True)]
        numbers = np.array([one[1:6] for one in found]).T.reshape(5, *self.batch_shape)
        return BeforeForces(joined([one.loads for one in found], self.batch_shape), *numbers)

    def after_forces(self, w: FloatArray, use: FloatArray, forces: Forces, more: dict[str, Any]) -> FusionStep:
        """As `CarMotion.after_forces`; one car is finished before the next."""
        own = map(Forces._make, zip(*(value.ravel().tolist() for value in forces), strict=True))
        given = zip(self.cars, w.reshape(-1, 4), use.reshape(-1, 4), own, strict=True)
        found = [(car.after_forces(wheels, uses, known, more), *car.checked()) for car, wheels, uses, known in given]
        steps, self._checks, self._sideslip = zip(*found, strict=True)
        return joined_steps(steps, self.batch_shape)

    def checked(self, corner_speed: Number | None = None) -> tuple[Consistency, Number]:
        """As `CarMotion.checked`: what `after_forces` has found; no corner observers run beside these cars."""
        return joined(self._checks, self.batch_shape), np.array(self._sideslip)

    def reset(self, chosen: BoolArray, vx: npt.ArrayLike, vy: npt.ArrayLike) -> None:
        """As `CarMotion.reset`."""
        starts = (entries(value, self.batch_shape, what).ravel() for value, what in ((vx, "vx"), (vy, "vy")))
        for car, *own in zip(self.cars, chosen.reshape(-1, 1), *starts, strict=True):
            car.reset(own[0].reshape(()), *own[1:])

    def save(self) -> Saved:
        """Everything needed to continue later."""
        saved = [car.save() for car in self.cars]
        arrays = {key: np.array([one[key] for one in saved]) for key in saved[0]}
        return {key: array.reshape(*self.batch_shape, *array.shape[1:]) for key, array in arrays.items()}

    def _all_unknowns(self) -> set[str]:
        return self.cars[0]._all_unknowns()

    def _take(self, saved: Mapping[str, AnyArray]) -> None:
        flat = {key: np.reshape(saved[key], (len(self.cars), *own.shape)) for key, own in self.cars[0].save().items()}
        for k, car in enumerate(self.cars):
            car.restore({key: value[k] for key, value in flat.items()})


def joined(steps: Sequence[_Step], shape: tuple[int, ...]) -> _Step:
    """Steps of single cars as the one of a batch of `shape`: its axes stand in front."""
    columns = map(np.array, zip(*steps, strict=True))
    return type(steps[0])(*(column.reshape(*shape, *column.shape[1:]) for column in columns))
