"""The force balance fails where its gap leaps, and not where it drifts, grows with a_x, or begins."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.pipeline.checks import CrossChecks, Forces
from estimators.pipeline.result import Check
from estimators.vehicle import VehicleParameters

CAR, STEP = VehicleParameters.published_suv(), 0.005
TIME = np.arange(0.0, 2.0, STEP)
MOVED = SimpleNamespace(vx=20.0, used=np.ones(4, dtype=np.bool_), standing=np.array(False))
LOADS = SimpleNamespace(load=CAR.static_loads)


def failed(gap: FloatArray, pull: FloatArray, unknown: FloatArray | None = None) -> FloatArray:
    """Times at which `FORCE_BALANCE` fails; `gap` m/s^2 between a_x and the forces, `pull` m/s^2 of a_x."""
    checks = CrossChecks(CAR, STEP)
    found = []
    for k, (off, ahead) in enumerate(zip(gap, pull, strict=True)):
        lost = unknown is not None and bool(unknown[k])
        forces = Forces(float(off) * CAR.mass, 0.0, 0.0, float(ahead - off) * CAR.mass, lost, False)
        bits = int(checks(forces, LOADS, MOVED, None, None).failed)
        if bits & Check.FORCE_BALANCE:
            found.append(TIME[k])
    return np.array(found)


@pytest.mark.parametrize("start", [1.0, 1.07, 1.155])
def test_a_leap_is_found_in_time_whatever_the_phase(start: float) -> None:
    """Of 0.45 m/s^2, less than the bound of the gap itself: the low-pass reaches 0.3 after 0.1 s ln(0.45/0.15) = 0.11 s."""
    times = failed(0.45 * (start <= TIME), 0.0 * TIME)
    assert start + 0.1 < times[0] < start + 0.12
    assert times[-1] < start + 0.4 + STEP


@pytest.mark.parametrize(
    ("gap", "pull"),
    [
        (0.25 * (TIME >= 1.0), 0.0 * TIME),
        (0.5 * np.clip(TIME - 0.5, 0.0, 1.0), 0.0 * TIME),  # a grade: at most 0.2 m/s^2 within 0.4 s
        (0.55 * (TIME >= 1.0), 4.0 * (TIME >= 1.0)),  # brakes that give 14 % more than they say
        (np.full_like(TIME, 0.45), 0.0 * TIME),
    ],
)
def test_what_drag_grade_and_scale_do_is_no_leap(gap: FloatArray, pull: FloatArray) -> None:
    assert failed(gap, pull).size == 0


def test_a_force_that_was_not_known_is_no_leap() -> None:
    unknown = (TIME >= 0.7) & (TIME < 1.0)
    gap = 0.5 * (TIME >= 1.0)
    assert failed(gap, 0.0 * TIME, unknown).size == 0
    assert failed(gap, 0.0 * TIME).size > 0
