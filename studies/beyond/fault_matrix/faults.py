"""What becomes of a signal at fault: seven ways, between two times."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from estimators.arrays import FloatArray

DELAY = 0.1  # s
Fault = Callable[[FloatArray, slice, int], FloatArray]
"""(whole signal (n, ...), samples of the fault, samples of `DELAY`) -> the readings of these samples."""


def _frozen(value: FloatArray, at: slice, _: int) -> FloatArray:
    return np.repeat(value[at.start - 1 : at.start], at.stop - at.start, axis=0)


def _clipped(value: FloatArray, at: slice, _: int) -> FloatArray:
    """At half of the largest reading of the fault's time."""
    most = 0.5 * np.abs(value[at]).max(axis=0)
    return np.clip(value[at], -most, most)


FAULTS: dict[str, Fault] = {
    "missing": lambda value, at, _: np.full_like(value[at], np.nan),
    "frozen": _frozen,
    "zero": lambda value, at, _: np.zeros_like(value[at]),
    "clipped": _clipped,
    "negated": lambda value, at, _: -value[at],
    "doubled": lambda value, at, _: 2.0 * value[at],
    "delayed": lambda value, at, late: value[at.start - late : at.stop - late],
}
Case = tuple[tuple[str, str], ...]
"""(signal, fault) of each signal at fault at once; none of a healthy car."""
SIGNALS: dict[str, list[int] | None] = {
    "ax": None, "ay": None, "yaw_rate": None, "az": None, "roll_rate": None, "pitch_rate": None,
    "wheel_speed fl": [0], "wheel_speed rr": [3], "steer": None, "torque fl": [0],
}  # fmt: skip
"""Signals at fault, and the wheel where one of four fails alone; two wheels stand for all, front and rear, left and right."""
PAIRED: dict[str, list[int] | None] = {
    "ax": None, "ay": None, "yaw_rate": None, "steer": None, "wheel_speed rl+rr": [2, 3]
}  # fmt: skip
"""Signals of which two fail at once; the wheels of an axle by what they have in common, as a bus, count as one."""
RELATED = {"wheel_speed rl+rr": ("wheel rl", "wheel rr")}
"""What the parity relations call it, where not the same."""
SEVERE = {
    "ax": 1.0, "ay": 1.0, "yaw_rate": 0.05, "az": 2.0, "roll_rate": 0.1, "pitch_rate": 0.1, "wheel_speed": 3.0, "steer": 0.01,
    "torque": 300.0,
}  # fmt: skip
"""How far a reading is from the true one before it matters; a wheel by 1 m/s."""
UNITS = {
    "ax": "m/s^2", "ay": "m/s^2", "yaw_rate": "rad/s", "az": "m/s^2", "roll_rate": "rad/s", "pitch_rate": "rad/s",
    "wheel_speed": "rad/s", "steer": "rad", "torque": "N m",
}  # fmt: skip
