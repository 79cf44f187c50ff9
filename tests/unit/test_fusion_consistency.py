"""Are the deviations that the fusion states those of its errors? Many cars, each with errors drawn from its own priors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimators.vehicle import GRAVITY
from estimators.velocity import FusionSettings, VelocityFusion
from tests.support.fusion_course import CAR, STEP, phases

CARS = 200
OWN = FusionSettings()


def normalised_errors(settings: FusionSettings) -> np.ndarray:
    """(V_x - truth)/deviation (samples, cars) of a drive with pulling, braking and rolling.

    Drawn for every car: bias of a_x, radius of all wheels and of each, slip compliance; slip errors of every wheel that
    change every `error_memory`, in the size that the settings state; white noise of all sensors.
    """
    draw = np.random.default_rng(7)
    pull = phases((1.0, 0.0), (2.5, 1.5), (1.0, 0.0), (2.0, -2.5), (1.0, 0.0))
    speed = 15.0 + STEP * np.concatenate([[0.0], np.cumsum(pull[1:])])
    mu = pull / GRAVITY
    bias = OWN.acceleration_bias * draw.normal(size=CARS)
    radius = CAR.radius * (1.0 + OWN.radius_common * draw.normal(size=(CARS, 1)))
    radius = radius * (1.0 + OWN.radius_single * draw.normal(size=(CARS, 4)))
    compliance = np.maximum(OWN.slip_compliance + OWN.slip_compliance_spread * draw.normal(size=(CARS, 1)), 0.0)
    fusion = VelocityFusion(CAR, STEP, (CARS,), settings)
    held = round(OWN.error_memory / STEP)
    four, found = np.zeros((CARS, 4)), []
    for k, (v, a, force) in enumerate(zip(speed, pull, mu, strict=True)):
        if k % held == 0:
            slip_error = draw.normal(size=(CARS, 4))
        size = OWN.slip_floor + OWN.slip_linear * abs(force) + OWN.slip_cubic * abs(force) ** 3
        surface = v * (1.0 + compliance * force + size * slip_error)
        wheels = surface / radius + OWN.wheel_speed_noise * draw.normal(size=(CARS, 4))
        measured = a + bias + 0.05 * draw.normal(size=CARS)
        turn = OWN.yaw_rate_noise * draw.normal(size=CARS)
        step = fusion.step(wheels, four, measured, 0.05 * draw.normal(size=CARS), turn, four + force)
        found.append((step.vx - v) / step.vx_deviation)
    return np.array(found)[round(1.0 / STEP) :]


def too_sure(errors: np.ndarray) -> bool:
    """Whether more errors lie beyond two and three deviations than of a Gaussian that knows its own size.

    0.046 and 0.003 are expected. Radii make an error last all the drive: the cars count, not the samples, and of 200
    cars 0.046 is 0.08 in one draw of a hundred.
    """
    size = np.abs(errors)
    return bool((size > 2.0).mean() > 0.08 or (size > 3.0).mean() > 0.015)


def test_stated_deviations_cover_the_errors() -> None:
    errors = normalised_errors(OWN)
    assert not too_sure(errors)
    assert 0.7 < np.sqrt(np.mean(errors**2)) < 1.3  # nor does it hide behind deviations that say nothing


def test_a_fusion_told_of_better_sensors_and_tires_is_too_sure() -> None:
    """The negative control: the same cars, priors a third of what they were drawn from."""
    names = (
        "acceleration_bias",
        "radius_common",
        "radius_single",
        "slip_compliance_spread",
        "slip_floor",
        "slip_linear",
    )
    assert too_sure(normalised_errors(replace(OWN, **{name: getattr(OWN, name) / 3.0 for name in names})))
