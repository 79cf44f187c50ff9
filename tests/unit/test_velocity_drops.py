"""Random drops of the force: the observer's error statistics are those that the Markov-jump analysis predicts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from analysis.drops.frozen import drop_radius
from analysis.markov.system import independent
from estimators import GainSchedule, LpvVelocityObserver
from estimators.velocity import SwitchedVelocityObserver
from tests.support.schedule_content import schedule_content

STEP, RUNS = 0.005, 40000
SCHEDULES = {
    name: GainSchedule.from_content(schedule_content(name)) for name in ("resilient-longitudinal", "resilient-lateral")
}


def sampled_modes(schedule: GainSchedule, speed: float) -> np.ndarray:
    """e^(A T) while dropped, e^((A - L C) T) otherwise."""
    plant, gain = schedule.plant_at(speed), schedule.gain(speed)
    return np.stack([expm(STEP * plant.A), expm(STEP * (plant.A - gain @ plant.C))])


@pytest.mark.parametrize("name", SCHEDULES)
@pytest.mark.parametrize("speed", [5.0, 40.0, 120.0])
@pytest.mark.parametrize("probability", [0.2, 0.6])
@pytest.mark.parametrize("kind", ["scheduled", "switched"])
def test_second_moment_of_the_error(name: str, speed: float, probability: float, kind: str) -> None:
    """The truth is zero, so the estimate is the error; a drop is a NaN. P3 (24)-(25)."""
    schedule = SCHEDULES[name]
    start = np.array([1e-3, 1.0])
    system = independent(sampled_modes(schedule, speed), [probability, 1.0 - probability])
    steps = 6
    exact = system.propagate_second_moment(np.outer(start, start), [probability, 1.0 - probability], steps).sum(axis=-3)
    rng = np.random.default_rng(0)
    zero, parameter = np.zeros(RUNS), np.full(RUNS, speed)
    if kind == "scheduled":
        plain = LpvVelocityObserver(schedule, (RUNS,))
        plain.reset(state=start)
    else:
        switched = SwitchedVelocityObserver(schedule, batch_shape=(RUNS,))
        switched.reset(state=start)
    for k in range(1, steps + 1):
        force = np.where(rng.random(RUNS) < probability, np.nan, 0.0)
        step = (
            plain.step(zero, force, parameter) if kind == "scheduled" else switched.step(zero, force, parameter, zero)
        )
        np.testing.assert_array_equal(step.used, np.isfinite(force))
        for axis in (0, 1):
            squares = step.estimate[:, axis] ** 2
            error = squares.mean() - exact[k, axis, axis]
            assert abs(error) < 5 * squares.std() / np.sqrt(RUNS) + 1e-12 * exact[0, axis, axis]


def test_beyond_the_critical_probability_the_error_grows() -> None:
    """P3 notes 6: p_cr = 0.64 at 5 rad/s; below it the mean square falls, above it grows."""
    modes = sampled_modes(SCHEDULES["resilient-longitudinal"], 5.0)
    below, above = drop_radius(*modes, [0.55, 0.75])
    assert below < 1.0 < above
    rng = np.random.default_rng(1)
    ratios = []
    for probability in (0.55, 0.75):
        observer = LpvVelocityObserver(SCHEDULES["resilient-longitudinal"], (RUNS,))
        observer.reset(state=[1e-3, 1.0])
        sizes = []
        for _ in range(12):
            force = np.where(rng.random(RUNS) < probability, np.nan, 0.0)
            sizes.append(np.mean(observer.step(np.zeros(RUNS), force, np.full(RUNS, 5.0)).estimate[:, 1] ** 2))
        ratios.append(sizes[-1] / sizes[5])
    assert ratios[0] < 1.0 < ratios[1]
