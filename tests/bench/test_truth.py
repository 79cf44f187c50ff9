"""What a Monte Carlo on the truth costs: many varied cars at a step of a millisecond.

The promise is 1,000 runs of a 10 s drive in below two minutes on two cores. Cost grows with steps times vehicles, so a
second of the drive is timed here and the test says what ten cost; run the whole of it with GAINSMITH_TRUTH_RUNS=1000.
"""

from __future__ import annotations

import os
from typing import Any

import pytest

from studies.truth import load_manoeuvre, varied
from studies.truth.simulate import simulate_in_processes
from tests.support.truth_cases import TIRES, shortened

RUNS = int(os.environ.get("GAINSMITH_TRUTH_RUNS", "200"))
SECONDS = 10.0 if RUNS >= 1000 else 1.0
KEPT = ("vx", "vy", "yaw_rate", "ax", "ay", "wheel_speed", "force_x", "force_y")
SPREAD = {"mass": 0.1, "cg_height": 0.05, "yaw_inertia": 0.1, "wheel_inertia": 0.1, "front_ride_frequency": 0.1}


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("tire", TIRES)
def test_monte_carlo_over_vehicles(benchmark: Any, tire: str, workers: int) -> None:
    manoeuvre = load_manoeuvre("p1-lane-change-snow").with_tire(tire)
    runs = 20 if benchmark.disabled else RUNS
    one = shortened(manoeuvre.course(), SECONDS)
    cars = varied(manoeuvre.truth_vehicle(), SPREAD, range(runs))
    benchmark.extra_info["vehicle_seconds"] = runs * SECONDS

    def batch() -> Any:
        return simulate_in_processes([one] * runs, cars, workers, record=KEPT, record_time=0.005)

    truth = benchmark.pedantic(batch, rounds=1, iterations=1)
    assert truth["vx"].shape == (runs, round(SECONDS / 0.005) + 1)
    assert truth["vx"].std(axis=0)[-1] > 0.0  # they are different cars
