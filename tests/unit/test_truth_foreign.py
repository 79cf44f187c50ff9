"""Ours beside vehicles by other people (commonroad-vehicle-models), on the same tire data, under gentle driving."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.pipeline import EstimationPipeline
from studies.truth import Sensors, Truth, draw, simulate
from tests.support.truth_cases import course, ramp

pytest.importorskip(
    "vehiclemodels", reason="commonroad-vehicle-models is not installed: no foreign vehicle to compare with"
)

from tests.support.truth_foreign import as_truth_vehicle, bmw_320i, drive_foreign

CASES = {
    "turn": course("magic-formula", speed=15.0, duration=2.0, steer=ramp(0.1, 0.5, 0.02), name="turn"),
    "pull": course("magic-formula", speed=8.0, duration=2.0, drive_torque=ramp(0.1, 0.4, 700.0), name="pull"),
}


@pytest.fixture(scope="module")
def ours() -> Truth:
    car = as_truth_vehicle(bmw_320i())
    return simulate(list(CASES.values()), [car, car], record_time=0.01)


@pytest.fixture(scope="module")
def theirs() -> dict[tuple[str, str], Truth]:
    p = bmw_320i()
    return {(model, name): drive_foreign(one, model, p) for model in ("std", "mb") for name, one in CASES.items()}


def apart(a: Truth, b: Truth, name: str, where: slice = slice(None)) -> float:
    """Greatest difference in the part, over the greatest value."""
    return float(np.abs(a[name] - b[name])[0, where].max() / np.abs(b[name]).max())


def test_turn_beside_the_single_track_drift_model(ours: Truth, theirs: dict[tuple[str, str], Truth]) -> None:
    """No roll there, all else alike: yaw rate within 1 % throughout, the rest once the roll has settled."""
    own, other = ours.only("turn"), theirs["std", "turn"]
    assert apart(own, other, "yaw_rate") < 0.01
    assert apart(own, other, "vx") < 1e-3
    settled = slice(170, None)
    for name, bound in (("road_ay", 0.01), ("vy", 0.05), ("wheel_speed", 0.02)):
        assert apart(own, other, name, settled) < bound, name


def test_turn_beside_the_multi_body_model(ours: Truth, theirs: dict[tuple[str, str], Truth]) -> None:
    """It has unsprung masses, camber and roll steer besides: 2 % in the steady turn, 10 % on the way there."""
    own, other = ours.only("turn"), theirs["mb", "turn"]
    settled = slice(170, None)
    assert apart(own, other, "yaw_rate") < 0.1
    for name, bound in (("yaw_rate", 0.02), ("road_ay", 0.02), ("wheel_speed", 0.02)):
        assert apart(own, other, name, settled) < bound, name
    assert other["yaw_rate"][0, -1] > 0.05
    # with the same roll stiffness the lean would be alike; ours has a springing of its own, the sign must agree
    assert own["roll"][0, -1] > 0.0


@pytest.mark.parametrize("model", ["std", "mb"])
def test_acceleration(ours: Truth, theirs: dict[tuple[str, str], Truth], model: str) -> None:
    """The wheel inertias of the single track count for an axle, ours and the multi-body ones for a wheel: 2 %."""
    own, other = ours.only("pull"), theirs[model, "pull"]
    gained, wanted = (float(t["vx"][0, -1] - t["vx"][0, 0]) for t in (own, other))
    assert wanted > 2.0
    assert gained == pytest.approx(wanted, rel=0.02 if model == "mb" else 0.04)


def test_another_car_is_told_apart(theirs: dict[tuple[str, str], Truth]) -> None:
    """The comparison can fail: 5 % more wheelbase breaks the bound."""
    car = as_truth_vehicle(bmw_320i())
    longer = car.changed(front_axle_distance=1.05 * car.parameters.front_axle_distance)
    own = simulate([CASES["turn"]], [longer], record_time=0.01)
    assert apart(own, theirs["std", "turn"], "yaw_rate") > 0.01


def test_estimators_run_on_the_foreign_vehicle(theirs: dict[tuple[str, str], Truth]) -> None:
    """The same way from truth to sensors to estimates."""
    truth = theirs["mb", "turn"]
    measured = draw(truth, Sensors(), range(4), sample_time=0.01)
    pipeline = EstimationPipeline(truth.vehicles[0].parameters, 0.01, measured.batch_shape)
    speed = np.stack([pipeline.step(s._replace(roll_rate=None, pitch_rate=None)).vx for s in measured], axis=-1)
    assert np.abs(speed - truth["vx"]).max() < 0.3
