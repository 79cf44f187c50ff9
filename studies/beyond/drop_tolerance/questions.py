"""What is asked of the runtime observer: cases around every predicted number, and how to read the number from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from estimators import GainSchedule
from studies.beyond.drop_tolerance.estimate import crossing
from studies.beyond.drop_tolerance.population import EVERY
from studies.beyond.drop_tolerance.prediction import (
    Channel,
    bursts,
    critical,
    critical_bursts,
    harmless_from,
    independent_drops,
)
from synthesis.polynomials.matrix import FloatArray

Kind = Literal["drop", "growth", "burst"]
NEAR_ONE = 0.97  # a critical probability above this leaves no room for a bracket; growth at HIGH_DROP is asked instead
HIGH_DROP = 0.95
LOSS_RATES = (0.5, 0.35, 0.2)
MOST_BURST = 60.0  # samples; the simulated time must hold some bursts
SHORT, LONG = 48, 160  # samples: as few as tell the growth, as the spread over seeds grows with time
STRETCH = 0.25  # of the logarithm of a burst length, to either side
THREE = np.array([-1.0, 0.0, 1.0])


@dataclass(frozen=True)
class Question:
    """`read` turns the log growths per sample of the cases (..., c) into the number, or its logarithm if `logarithmic`."""

    kind: Kind
    place: float  # wheel speed in rad/s, or loss rate
    predicted: float
    channel: Channel
    read: Callable[[FloatArray], FloatArray]
    logarithmic: bool
    steps: int = SHORT  # simulated samples


def questions(schedule: GainSchedule, quick: bool) -> list[Question]:
    """Critical drop probabilities at four wheel speeds and critical bursts at the worst of them.

    Where every loss is survived, the growth of the second moment at 95 % drops stands in for a critical probability.
    """
    speeds = asked_speeds(schedule)
    p = critical(schedule, speeds)
    asked = [_about_drops(float(w), float(q)) for w, q in zip(speeds, p, strict=True)]
    worst = float(speeds[p.argmin()])
    rates = LOSS_RATES[:2] if quick else LOSS_RATES
    for rate, length in zip(rates, critical_bursts(schedule, worst, rates), strict=True):
        if length is not None and length < MOST_BURST and rate / (1.0 - rate) < length * np.exp(-STRETCH):
            at = np.log(length) + STRETCH * THREE
            read = partial(crossing, at)
            steps = EVERY * round(min(max(4.0 * length, SHORT), LONG) / EVERY)
            channel = bursts(worst, rate, np.exp(at))
            asked.append(Question("burst", rate, length, channel, read, logarithmic=True, steps=steps))
    return asked


def asked_speeds(schedule: GainSchedule) -> FloatArray:
    """Standstill, one and two thirds of the way to harmless speed, and half-way from there to the end of the range."""
    start, end = harmless_from(schedule), schedule.parameter.max
    return np.array([schedule.parameter.min, start / 3.0, 2.0 * start / 3.0, 0.5 * (start + end)])


def _about_drops(speed: float, critical_probability: float) -> Question:
    if critical_probability > NEAR_ONE:
        return Question("growth", speed, 1.0, independent_drops(speed, HIGH_DROP), _only, logarithmic=True)
    at = critical_probability + min(0.05, 0.4 * (1.0 - critical_probability)) * THREE
    read = partial(crossing, at)
    return Question("drop", speed, critical_probability, independent_drops(speed, at), read, logarithmic=False)


def _only(growth: FloatArray) -> FloatArray:
    return np.asarray(growth[..., 0])
