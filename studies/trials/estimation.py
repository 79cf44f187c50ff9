"""Several manoeuvres of one car, many sensor draws of each: one batch through the estimation pipeline."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.forces import AttitudeObserver
from estimators.pipeline import EstimationPipeline
from estimators.pipeline.result import PipelineStep
from estimators.vehicle import VehicleParameters
from studies.study import Scope
from studies.trials.simulations import simulated_truth
from studies.truth import Measured, Sensors, Truth, draw
from studies.truth.sensors import Channel
from synthesis.errors import SpecError

QUICK_SECONDS = 4.0  # of each manoeuvre go through the pipeline when quick
Parts = Callable[[VehicleParameters, float, tuple[int, ...]], Mapping[str, Any]]
"""(vehicle, sample time, batch shape) -> parts that replace those of the pipeline, by its argument names."""
Reading = Callable[[PipelineStep], FloatArray]
"""Takes one signal out of a step."""

WHEELS, INTEGRATED = "mean wheel speed", "integrated acceleration"
TEST_CAR = Sensors(
    wheel_speed=Channel(noise=0.05), acceleration=Channel(noise=0.05, bias=0.15, scale=0.01),
    rate=Channel(noise=0.002, bias=0.002, scale=0.01), steer=Channel(noise=0.002), torque=Channel(scale=0.02))  # fmt: skip
"""Those of every trial, for which the project's accuracy targets are stated: white noise of 0.05 rad/s, 0.05 m/s^2, 0.002 rad/s,
0.002 rad; per run, standard deviations: bias 0.15 m/s^2 and 0.002 rad/s, scale 1 % of the inertial sensors and 2 % of each
wheel's torque."""


def measured_runs(
    names: Sequence[str], tire: str, scope: Scope, seconds: float = QUICK_SECONDS, sample_time: float = 0.005
) -> Measured:
    """Sensor draws (S, B) of the named manoeuvres on one kind of tire; when quick, of the first ``seconds`` of each."""
    return draw(simulated_truth(tuple(names), tire, scope, seconds), TEST_CAR, range(scope.seeds), sample_time)


def assumed_car(drawn: Measured) -> VehicleParameters:
    """The car of the truth. Raises SpecError when the runs have different ones: a pipeline assumes one car."""
    cars = [vehicle.parameters for vehicle in drawn.truth.vehicles]
    if any(car != cars[0] for car in cars[1:]):
        raise SpecError(f"manoeuvres {', '.join(drawn.truth.names)} drive different cars; play them apart")
    return cars[0]


def run_pipeline(drawn: Measured, readings: Mapping[str, Reading], parts: Parts | None = None) -> dict[str, FloatArray]:
    """Every reading at every sample: (S, B, n) or (S, B, n, k). The estimators know the truth's own parameters.

    The inertial sensors are fixed to a body that rolls and pitches: an `AttitudeObserver` levels them unless ``parts`` bring
    another attitude (None: without).
    """
    car, time, shape = assumed_car(drawn), drawn.sample_time, drawn.batch_shape
    chosen = {"attitude": AttitudeObserver(time, shape), **(parts(car, time, shape) if parts else {})}
    pipeline = EstimationPipeline(car, time, shape, **chosen)
    found: dict[str, FloatArray] = {}
    for k, signals in enumerate(drawn):
        step = pipeline.step(signals)
        for name, reading in readings.items():
            value = reading(step)
            if name not in found:
                found[name] = np.empty((*shape, drawn.time.size, *value.shape[2:]))
            found[name][:, :, k] = value
    return found


def baselines(drawn: Measured) -> dict[str, FloatArray]:
    """V_x (S, B, n) without an observer, m/s: `WHEELS`, their mean speed, and `INTEGRATED`, a_x from it on."""
    wheels = (assumed_car(drawn).radius * drawn.signals["wheel_speed"]).mean(axis=-1)
    moved = np.cumsum(drawn.signals["ax"] * drawn.sample_time, axis=-1)
    return {WHEELS: wheels, INTEGRATED: wheels[..., :1] + moved - moved[..., :1]}


def run_of(truth: Truth, name: str) -> tuple[int, slice]:
    """Row of the named manoeuvre and the samples of its own duration. Raises SpecError for one that was not driven."""
    if name not in truth.names:
        raise SpecError(f"manoeuvre '{name}' was not driven; there are: {', '.join(truth.names)}")
    row = truth.names.index(name)
    return row, slice(0, int(np.count_nonzero(truth.valid[row])))
