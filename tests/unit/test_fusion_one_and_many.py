"""One car on plain numbers is an entry of a batch on arrays, whatever comes in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.velocity import VelocityFusion
from tests.support.fusion_course import CAR, STEP, Signals, course, phases, sensed

DRIVE = course(phases((0.2, 0.0), (0.5, 3.0), (0.2, 0.0), (0.3, -5.0)))
N = DRIVE.speed.size
WHAT = ("wheel_speed", "steer", "ax", "ay", "yaw_rate", "force")
FAULT = st.tuples(
    st.sampled_from(WHAT),
    st.sampled_from([np.nan, np.inf, 0.0, 1e300, 3.0, "frozen", "doubled"]),
    st.integers(0, N - 2),
    st.integers(1, 90),
    st.integers(0, 3),
)


def put(signals: Signals, fault: tuple[str, Any, int, int, int]) -> None:
    name, how, start, length, wheel = fault
    signal = getattr(signals, name)
    part: Any = slice(start, start + length) if signal.ndim == 1 else (slice(start, start + length), slice(wheel, None))
    if how == "frozen":
        signal[part] = signal[start] if signal.ndim == 1 else signal[start, wheel:]
    elif how == "doubled":
        signal[part] *= 2.0
    else:
        signal[part] = how


def turned(signals: Signals, rng: np.random.Generator) -> None:
    """Some steering, and a car that follows it."""
    wave = np.sin(2 * np.pi * np.arange(N) * STEP / 1.5) * rng.uniform(0.0, 0.08)
    signals.steer[:, :2] = wave[:, None]
    signals.yaw_rate[:] += wave * DRIVE.speed / 3.0
    signals.ay[:] += wave * DRIVE.speed**2 / 3.0


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 1000), st.lists(FAULT, max_size=4), st.booleans())
def test_one_car_is_an_entry_of_a_batch(seed: int, faults: list[tuple[str, Any, int, int, int]], late: bool) -> None:
    rng = np.random.default_rng(seed)
    signals = sensed(DRIVE, seed, bias=0.1)
    turned(signals, rng)
    for fault in faults:
        put(signals, fault)
    one, many = VelocityFusion(CAR, STEP), VelocityFusion(CAR, STEP, (2, 1))
    elapsed = STEP * rng.choice([0.5, 1.0, 4.0, np.nan], size=N) if late else np.full(N, STEP)
    one.reset(vx=1.0)
    many.reset(vx=1.0)
    for k in range(N):
        sample = [signal[k] for signal in signals]
        alone = one.step(*sample, elapsed=elapsed[k])
        both = many.step(*(np.stack([value, value])[:, None] for value in sample), elapsed=elapsed[k])
        for name, mine, theirs in zip(alone._fields, alone, both, strict=True):
            wanted = np.stack([mine, mine])[:, None]
            assert theirs.shape == wanted.shape
            assert theirs.dtype == wanted.dtype
            np.testing.assert_allclose(theirs, wanted, rtol=1e-7, atol=1e-9, err_msg=f"{name} at sample {k}")


@pytest.mark.parametrize("shape", [(), (1,), (1, 1)])
def test_one_car_keeps_its_shape(shape: tuple[int, ...]) -> None:
    fusion = VelocityFusion(CAR, STEP, shape)
    step = fusion.step(np.full((*shape, 4), 30.0), 0.0, 0.0, 0.0, 0.0)
    saved = fusion.save()
    for name, value in zip(step._fields, step, strict=True):
        assert value.shape[: len(shape)] == shape, name
    fusion.reset(np.ones(shape, dtype=np.bool_), vx=np.full(shape, 3.0))
    fusion.restore(saved)
    for name, array in fusion.save().items():
        np.testing.assert_array_equal(array, saved[name])
