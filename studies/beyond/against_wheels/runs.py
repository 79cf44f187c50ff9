"""RMS errors of V_x on the shipped manoeuvres: the default pipeline, the mean wheel speed and the corner observers.

The truth turns on wheels of exactly the radii that all of them assume. The pipeline may not rely on that: its radii are unknown
by `FusionSettings.radius_common`. `known_radii` is the same pipeline that is given them, as the others are.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.pipeline import CornerObservers
from estimators.schedule import GainSchedule
from estimators.vehicle import CORNERS, VehicleParameters
from estimators.velocity import FusionSettings, VelocityFusion
from studies.trials.accuracy import Spread, known_spread
from studies.trials.estimation import TEST_CAR, WHEELS, Reading, baselines, run_pipeline
from studies.truth import Truth, draw

EXACT = 1e-5  # relative error of radii that are known
PIPELINE: dict[str, Reading] = {"vx": lambda step: step.vx}
CORNER: dict[str, Reading] = {"mean": lambda step: step.corners.vx, "each": lambda step: step.corners.corner_vx}


@dataclass(frozen=True)
class Errors:
    """One manoeuvre on one kind of tire: RMS errors of V_x, m/s, mean over the seeds."""

    manoeuvre: str
    tire: str
    pipeline: float
    known_radii: float
    wheels: float  # their mean speed
    corners: float  # mean of the four corner observers
    alone: tuple[float, float, float, float]  # each of them
    gap: Spread  # pipeline minus the best of these, seed by seed

    @property
    def best_corner(self) -> str:
        """The one that is nearest, which is known afterwards only."""
        return CORNERS[int(np.argmin(self.alone))]

    @property
    def best(self) -> float:
        """The least error of what is not the pipeline."""
        return min(self.wheels, self.corners, *self.alone)


def known_radii(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """Parts of a pipeline that takes the radii of the car for exact."""
    settings = FusionSettings(radius_common=EXACT, radius_single=EXACT)
    return {"velocity": VelocityFusion(car, sample_time, shape, settings)}


def with_corners(car: VehicleParameters, _: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """Parts of the default pipeline, and the corner observers of the shipped schedule beside it."""
    schedule = GainSchedule.shipped("corner-estimation-longitudinal")
    return {"corner_observers": CornerObservers(car, schedule, batch_shape=shape)}


def errors(truth: Truth, seeds: Sequence[int]) -> Iterator[Errors]:
    """Of every run of the truth, car by car."""
    cars = defaultdict(list)
    for row, vehicle in enumerate(truth.vehicles):
        cars[vehicle.parameters].append(row)
    for rows in cars.values():
        drawn = draw(truth.only(rows), TEST_CAR, seeds)
        got = run_pipeline(drawn, PIPELINE | CORNER, with_corners)
        known = run_pipeline(drawn, PIPELINE, known_radii)["vx"]
        wheels, true = baselines(drawn)[WHEELS], drawn.truth
        signals = (got["vx"], known, wheels, got["mean"], *np.moveaxis(got["each"], -1, 0))

        for b, name in enumerate(true.names):
            speed, counts = true["vx"][b, true.valid[b]], true.valid[b]

            rms = np.stack([np.sqrt(((one[:, b, counts] - speed) ** 2).mean(axis=-1)) for one in signals])
            own, given, *others = rms.mean(axis=1).tolist()
            gap = known_spread(rms[0] - rms[2 + int(np.argmin(others))])
            mean, corners, fl, fr, rl, rr = others
            yield Errors(name, true.tires[b], own, given, mean, corners, (fl, fr, rl, rr), gap)
