"""Normalised errors of speeds and tilt of the whole pipeline on the shipped manoeuvres, many seeds side by side.

Each seed has its own sensor errors (`TEST_CAR`), its own effective radii and its own alignment. Radii: rho of all wheels alike
and of each wheel, with the standard deviations that the fusion assumes; a wheel of the radius R (1 + rho) that is taken for R
turns by 1/(1 + rho) less. Alignment: the rear axle rolls by the thrust angle to the left of the body's x axis, and the front
wheels by an angle of their own beyond what is read of the steering (`ALIGNMENT`).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from estimators.arrays import FloatArray
from estimators.velocity import FusionSettings
from studies.trials.estimation import TEST_CAR, run_pipeline
from studies.truth import Measured, Truth, draw

SIGNALS = {"vx": "vx", "vy": "vy", "roll": "attitude.total_roll", "pitch": "attitude.total_pitch"}
"""What is compared, V_x and V_y in m/s, roll and pitch against the horizon in rad, all in the axes of the body, and where a step
has it."""
DEVIATIONS = ("vx_deviation", "vy_deviation", "attitude.roll_deviation", "attitude.pitch_deviation")
ALIGNMENT = math.radians(0.1)
"""rad, standard deviation of the thrust angle, and of the angle of the front wheels beyond the steering that is read.

Makers let the thrust angle be +-0.15 (Dodge Stratus, 2000) or +-0.3 degrees (Chrysler PT Cruiser, 2009; Chevrolet Camaro, 2014)
and the steering wheel +-3.5 degrees (Camaro), 0.2 at the road wheels: three of these and two."""
TURNED = (("ax", "ay"), ("roll_rate", "pitch_rate"))
"""Readings that turn with the axes of the body."""
MOST_VALUES = 2_000_000  # cars times samples in one batch: 25 signals of 8 bytes each, 400 MB


@dataclass(frozen=True)
class Consistency:
    """One manoeuvre on one kind of tire.

    ``nees`` is the average of e^2/sigma^2 over seeds and time of V_x, of V_y, of both (half their sum, for the pipeline
    states no correlation), of roll and of pitch: 1 where sigma is true. The others are of `SIGNALS`: ``beyond``: share of samples
    with |e| > 3 sigma; ``rms``: of the errors, m/s and rad; ``sigma``: root of the mean variance that is stated.
    """

    manoeuvre: str
    tire: str
    nees: tuple[float, ...]
    beyond: tuple[float, ...]
    rms: tuple[float, ...]
    sigma: tuple[float, ...]

    def within(self, band: tuple[float, float]) -> tuple[bool, ...]:
        """Whether V_x, V_y, both, roll and pitch are inside."""
        return tuple(band[0] <= value <= band[1] for value in self.nees)


def with_own_radii(drawn: Measured) -> Measured:
    """The same seeds on wheels of other sizes than the estimators believe."""
    s, wheels = FusionSettings(), drawn.signals["wheel_speed"].copy()
    for row, seed in enumerate(drawn.seeds):
        rng = np.random.default_rng(np.random.SeedSequence((seed, 0x7261)))
        rho = s.radius_common * rng.standard_normal() + s.radius_single * rng.standard_normal(4)
        wheels[row] /= 1.0 + rho
    return replace(drawn, signals={**drawn.signals, "wheel_speed": wheels})


def with_own_alignment(drawn: Measured) -> tuple[Measured, FloatArray]:
    """The same seeds on cars that go straight a little askew, and their thrust angles (seeds,), rad.

    The car of the truth has its axes along the rear wheels. The same car with axes that the thrust angle turns from there is one
    whose rear wheels stand at that angle: its forces and its path are the same, and what the body reads of them is turned. That
    its axles shift sideways by 3 mm is left out.
    """
    signals, thrust = dict(drawn.signals), np.empty(len(drawn.seeds))
    for name in (*(name for pair in TURNED for name in pair), "steer"):
        signals[name] = signals[name].copy()
    for row, seed in enumerate(drawn.seeds):
        rng = np.random.default_rng(np.random.SeedSequence((seed, 0x746F)))
        thrust[row], front = ALIGNMENT * rng.standard_normal(2)
        for x, y in TURNED:
            signals[x][row], signals[y][row] = turned(signals[x][row], signals[y][row], thrust[row])
        signals["steer"][row, ..., :2] += thrust[row] - front
    return replace(drawn, signals=signals), thrust


def turned(x: FloatArray, y: FloatArray, thrust: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """What is (x, y) along and across the rear wheels, in the axes of the body."""
    cosine, sine = np.cos(thrust), np.sin(thrust)
    return x * cosine - y * sine, x * sine + y * cosine


@dataclass(frozen=True)
class Errors:
    """Of one manoeuvre, (4, seeds, n): errors of `SIGNALS`, and the deviations that the pipeline states of them."""

    manoeuvre: str
    tire: str
    error: FloatArray
    sigma: FloatArray

    def tested(self, shrink: float = 1.0) -> Consistency:
        """``shrink`` divides the stated deviations."""
        sigma = self.sigma / shrink
        square = (self.error / sigma) ** 2
        x, y, roll, pitch = square.mean(axis=(1, 2)).tolist()
        beyond, rms, stated = (
            tuple(value.tolist())
            for value in (
                (square > 9.0).mean(axis=(1, 2)),
                np.sqrt((self.error**2).mean(axis=(1, 2))),
                np.sqrt((sigma**2).mean(axis=(1, 2))),
            )
        )
        return Consistency(self.manoeuvre, self.tire, (x, y, 0.5 * (x + y), roll, pitch), beyond, rms, stated)


def errors(truth: Truth, seeds: Sequence[int]) -> Iterator[Errors]:
    """Of every run of the truth, batch by batch of one car."""
    for rows in _batches(truth, len(seeds)):
        drawn, thrust = with_own_alignment(with_own_radii(draw(truth.only(rows), TEST_CAR, seeds)))
        got = run_pipeline(drawn, {name: attrgetter(name) for name in (*SIGNALS.values(), *DEVIATIONS)})
        true = drawn.truth
        for b, name in enumerate(true.names):
            counts = true.valid[b]
            pitch, roll = (true[signal][b] + true[road][b] for signal, road in (("pitch", "grade"), ("roll", "bank")))
            speeds, tilts = (turned(*pair, thrust[:, None]) for pair in ((true["vx"][b], true["vy"][b]), (pitch, roll)))
            off = np.stack([got[place][:, b] for place in SIGNALS.values()]) - np.stack([*speeds, *reversed(tilts)])
            sigma = np.stack([got[name][:, b] for name in DEVIATIONS])
            yield Errors(name, true.tires[b], off[..., counts], sigma[..., counts])


def _batches(truth: Truth, seeds: int) -> Iterator[list[int]]:
    """Rows that one pipeline takes: of one car, similar durations together, no more values than `MOST_VALUES`."""
    cars = defaultdict(list)
    for row in np.argsort(truth.duration, kind="stable").tolist():
        cars[truth.vehicles[row].parameters].append(row)
    for rows in cars.values():
        batch: list[int] = []
        for row in rows:
            samples = truth.duration[row] / truth.sample_time
            if batch and (len(batch) + 1) * seeds * samples > MOST_VALUES:
                yield batch
                batch = []
            batch.append(row)
        yield batch
