"""What P4 and P5 take from the sensors of a trial at 100 Hz: speed, steering angle, and the samples that count."""

from __future__ import annotations

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from studies.trials.estimation import assumed_car
from studies.truth import Measured

SAMPLE_TIME = 0.01  # s, P4 and P5: 100 Hz
START = 1.0  # s left out of every error: observers that start from nothing
LEAST_SPEED = 3.0  # m/s, below which sideslip has no error
PRINTED_TEST = "Printed values are those of the paper's road test with another driver, road and car."


def rear_speed(drawn: Measured) -> FloatArray:
    """V_g (S, B, n), m/s: mean of the rear wheel speeds times the radius, P4 notes 4."""
    return np.asarray((assumed_car(drawn).radius * drawn.signals["wheel_speed"])[..., 2:].mean(axis=-1))


def front_steer(drawn: Measured) -> FloatArray:
    """Steering angle of the front wheels (S, B, n), rad: mean of both."""
    return np.asarray(drawn.signals["steer"][..., :2].mean(axis=-1))


def counted(drawn: Measured, run: int) -> BoolArray:
    """Samples (n,) of a run that count in errors: from `START` on, and not below `LEAST_SPEED`."""
    truth = drawn.truth
    return np.asarray(truth.valid[run] & (truth.time >= START) & (np.absolute(truth["vx"][run]) >= LEAST_SPEED))


def conditions(drawn: Measured) -> str:
    """The beginning of a caption: tires, time, sensor draws, and what counts."""
    truth = drawn.truth
    return (
        f"Truth vehicle on {truth.tires[0]} tires, {truth.time[-1]:.0f} s at 100 Hz: means over {len(drawn.seeds)} draws of "
        f"the sensor errors with 95 % confidence intervals, judged from {START:g} s on above {LEAST_SPEED:g} m/s."
    )
