"""P2's rank and unknown-start tests on wheel speeds of the truth: a wheel that stands, then spins up, then too fast."""

from __future__ import annotations

import numpy as np
import pytest

from studies.papers.longitudinal_speed.model import gramian_rank
from studies.papers.longitudinal_speed.truth_records import begun, rank_table, start_table, wheel_record
from studies.trials.motion import MotionTest
from studies.truth import Truth, load_manoeuvre

ROW = MotionTest("p2-launch-dry", "launch")
STANDING, RAMP, STEP = 0.2, 150.0, 0.005  # s, rad/s^2, s


@pytest.fixture
def launch() -> Truth:
    time = np.asarray(STEP * np.arange(261), dtype=np.float64)
    speed = RAMP * np.maximum(time - STANDING, 0.0)
    signals = {"wheel_speed": np.repeat(speed[None, :, None], 4, axis=2)}
    car = load_manoeuvre(ROW.manoeuvre).truth_vehicle()
    return Truth(time, signals, (ROW.manoeuvre,), time[-1:], (car,), ("lugre",))


def test_the_record_ends_where_the_wheel_is_faster_than_the_model(launch: Truth) -> None:
    record = wheel_record(launch, ROW)
    assert record.time[-1] == pytest.approx(STANDING + 140.0 / RAMP, abs=STEP)
    assert record.speed.max() <= 140.0 and record.acceleration.max() == pytest.approx(RAMP)


def test_rank_is_full_only_once_the_wheel_turns(launch: Truth) -> None:
    record = wheel_record(launch, ROW)
    (row,) = rank_table([record], [gramian_rank(record)]).rows
    assert row[2] == 1 and row[3] == 3
    assert isinstance(row[4], float) and STANDING <= row[4] <= STANDING + 5 * STEP
    still = record.cut(0, 30)
    (row,) = rank_table([still], [gramian_rank(still)]).rows
    assert row[3] == 2 and row[4] is None and row[1] is None


def test_an_accelerating_wheel_forgets_its_start_in_as_many_samples_as_states(launch: Truth) -> None:
    record = begun(wheel_record(launch, ROW))
    assert record.time[0] == pytest.approx(STANDING, abs=STEP)
    later = record.cut(40)
    fine, _ = start_table([later]).rows
    assert fine[2] == pytest.approx(3 * STEP)
    constant = type(record)("constant", later.time, np.full_like(later.speed, 40.0), np.zeros_like(later.speed))
    assert start_table([constant]).rows[0][2] is None
