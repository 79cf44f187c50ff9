"""What one call costs with four corners, and what a batch of 10,000 runs delivers on one core."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators import GainSchedule, LpvVelocityObserver
from tests.support.schedule_content import schedule_content

SPEEDS = tuple(140.0 * k / 50 for k in range(51))
SCHEDULE = GainSchedule.from_content(
    schedule_content(breakpoints=SPEEDS, gains=[(0.9 - 0.002 * speed, 210 - speed) for speed in SPEEDS])
)


@pytest.mark.parametrize("missing", [0.0, 0.25], ids=["complete", "a quarter missing"])
@pytest.mark.parametrize("shape", [(4,), (10_000, 4)], ids=["4 corners", "10,000 runs of 4 corners"])
def test_step(benchmark: Any, shape: tuple[int, ...], missing: float) -> None:
    draw = np.random.default_rng(0)
    observer = LpvVelocityObserver(SCHEDULE, shape)
    u, y, p = draw.normal(size=shape), draw.normal(0, 0.1, shape), draw.uniform(0, 140, shape)
    y.flat[: int(missing * y.size)] = np.nan
    benchmark.extra_info["corner steps per call"] = y.size
    step = benchmark(observer.step, u, y, p)
    assert step.used.mean() == 1 - missing


def test_load(benchmark: Any, tmp_path: Any) -> None:
    from estimators.schedule import write_content

    write_content(tmp_path / "schedule.json", schedule_content(breakpoints=SPEEDS))
    assert benchmark(GainSchedule.load, tmp_path / "schedule.json").sample_time == 0.005
