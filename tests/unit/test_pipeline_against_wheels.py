"""V_x of the pipeline beside the mean wheel speed and the corner observers: wheels that slide, and wheels that hardly slip.

This is not said of every drive: `gainsmith study against-wheels` has them all, and says why where one is lost.
"""

from __future__ import annotations

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.forces import AttitudeObserver
from estimators.pipeline import CornerObservers, EstimationPipeline
from estimators.schedule import GainSchedule
from estimators.velocity import FusionSettings, VelocityFusion
from estimators.velocity.lateral_fusion import LateralFusion
from studies.trials.estimation import TEST_CAR, assumed_car
from studies.truth import Measured, draw, load_manoeuvre, simulate_manoeuvres

NAMES = ("p2-sharp-turn", "p2-launch-wet-dry", "p2-step-steer-dry")
SEEDS = range(2)


@pytest.fixture(scope="module")
def drawn() -> Measured:
    """A turn in which the front axle slides, a launch over a change of friction, and a turn in which V_y is far off."""
    short = [load_manoeuvre(name).model_copy(update={"duration": 7.5}) for name in NAMES]
    return draw(simulate_manoeuvres(short), TEST_CAR, SEEDS)


def rms(drawn: Measured, settings: FusionSettings | None = None) -> dict[str, FloatArray]:
    """RMS error of V_x (manoeuvres,), m/s: mean over seeds."""
    car, time, shape = assumed_car(drawn), drawn.sample_time, drawn.batch_shape
    corners = CornerObservers(car, GainSchedule.shipped("corner-estimation-longitudinal"), batch_shape=shape)
    fusion = VelocityFusion(car, time, shape, settings)
    level = AttitudeObserver(time, shape)
    pipeline = EstimationPipeline(car, time, shape, attitude=level, corner_observers=corners, velocity=fusion)
    steps = [pipeline.step(signals) for signals in drawn]
    speeds = {
        "pipeline": np.stack([step.vx for step in steps], axis=-1),
        "wheels": (car.radius * drawn.signals["wheel_speed"]).mean(axis=-1),
        "corners": np.stack([step.corners.vx for step in steps], axis=-1),
    }
    alone = np.stack([step.corners.corner_vx for step in steps], axis=-2)
    speeds |= {f"corner {k}": alone[..., k] for k in range(4)}
    found: dict[str, FloatArray] = {}
    for name, value in speeds.items():
        found[name] = np.sqrt(((value - drawn.truth["vx"]) ** 2).mean(axis=-1)).mean(axis=0)
    return found


def best_other(found: dict[str, FloatArray]) -> FloatArray:
    return np.asarray(np.min([value for name, value in found.items() if name != "pipeline"], axis=0))


def test_it_is_at_least_as_good_as_wheels_and_corner_observers(drawn: Measured) -> None:
    found = rms(drawn)
    assert (found["pipeline"] <= best_other(found)).all(), found


def test_a_pipeline_whose_tires_slip_along_by_force_alone_is_found_out(
    drawn: Measured, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Negative control: without what side slip adds, the mean wheel speed is the better estimate in the turn."""
    monkeypatch.setattr(LateralFusion, "wheel_bend", property(lambda self: np.zeros_like(np.stack([*self.bend] * 2))))
    found = rms(drawn)
    assert found["pipeline"][0] > found["wheels"][0]


def test_a_pipeline_that_takes_v_y_for_exact_is_found_out(drawn: Measured) -> None:
    """Negative control: what V_y is off in the step steer, times the yaw rate, then leads V_x away from wheels that roll."""
    found = rms(drawn, FusionSettings(side_speed_spread=1e-3))
    assert found["pipeline"][2] > best_other(found)[2]
