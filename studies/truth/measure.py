"""Sensor errors drawn for many seeds from one truth, and what a car then hands to its estimators."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from zlib import crc32

import numpy as np

from estimators.arrays import FloatArray
from estimators.pipeline.signals import VehicleSignals
from estimators.signals.ticks import TickSpeed
from studies.truth.record import Truth
from studies.truth.sensors import Sensors
from synthesis.errors import SpecError

SOURCES = {
    "wheel_speed": "wheel_speed", "steer": "steer", "torque": "torque",
    "ax": "ax", "ay": "ay", "az": "az",
    "yaw_rate": "yaw_gyro", "roll_rate": "roll_rate", "pitch_rate": "pitch_rate",
}  # fmt: skip
"""The signal of the truth behind each measured one."""
_CHANNELS = {
    "wheel_speed": "wheel_speed", "steer": "steer", "torque": "torque",
    "ax": "acceleration", "ay": "acceleration", "az": "acceleration",
    "yaw_rate": "rate", "roll_rate": "rate", "pitch_rate": "rate",
}  # fmt: skip


@dataclass(frozen=True)
class Measured:
    """Measured signals of S seeds x B runs over n samples, arrays (S, B, n) and (S, B, n, 4); SI, ISO frame.

    ``at(k)`` is what an `EstimationPipeline` of ``batch_shape`` (S, B) takes at sample k.
    """

    time: FloatArray  # (n,) s
    signals: dict[str, FloatArray]
    seeds: tuple[int, ...]
    truth: Truth  # at the same samples
    batch_shape: tuple[int, int]

    @property
    def sample_time(self) -> float:
        """s."""
        return float(self.time[1] - self.time[0])

    def at(self, k: int) -> VehicleSignals:
        """Sample k of all seeds and runs. Grade and bank of the road are not measured: they stay 0."""
        s = self.signals
        return VehicleSignals(
            wheel_speed=s["wheel_speed"][:, :, k],
            ax=s["ax"][:, :, k],
            ay=s["ay"][:, :, k],
            yaw_rate=s["yaw_rate"][:, :, k],
            steer=s["steer"][:, :, k],
            torque=s["torque"][:, :, k],
            az=s["az"][:, :, k],
            roll_rate=s["roll_rate"][:, :, k],
            pitch_rate=s["pitch_rate"][:, :, k],
        )

    def __iter__(self) -> Iterator[VehicleSignals]:
        return (self.at(k) for k in range(self.time.size))


def draw(truth: Truth, sensors: Sensors, seeds: Sequence[int], sample_time: float = 0.005) -> Measured:
    """Measurements of every run for every seed.

    The errors of a run depend on its seed, its manoeuvre and the signal alone, not on what else is drawn or how many:
    `numpy.random.SeedSequence` over the three. Of equal manoeuvres in one batch each has errors of its own.

    Raises:
        SpecError: no seeds, a sample time that is no multiple of the truth's, a signal that was not recorded.
    """
    every = round(sample_time / truth.sample_time)
    if every < 1 or abs(every * truth.sample_time - sample_time) > 1e-9:
        raise SpecError(f"sample_time = {sample_time:g} s is not a multiple of the truth's {truth.sample_time:g} s")
    if not len(seeds):
        raise SpecError("draw: no seeds; give at least one, such as range(200)")
    truth = truth.every(every)
    samples, shape = truth.time.size, (len(seeds), truth.size)
    signals: dict[str, FloatArray] = {}
    for name, source in SOURCES.items():
        count = name == "wheel_speed" and sensors.ticks is not None
        true = truth["wheel_angle" if count else source]
        out = np.empty((*shape, samples, *true.shape[2:]))
        channel = getattr(sensors, _CHANNELS[name])
        for b in range(truth.size):
            for s, seed in enumerate(seeds):
                rng = np.random.default_rng(np.random.SeedSequence((seed, *truth.keys[b], crc32(name.encode()))))
                value = _counted(true[b], rng, sensors) if count else true[b]
                out[s, b] = value if count else channel.read(value, rng, sample_time)
        signals[name] = _speeds(out, sensors, sample_time) if count else out
    return Measured(truth.time, signals, tuple(seeds), truth, shape)


def _counted(angle: FloatArray, rng: np.random.Generator, sensors: Sensors) -> FloatArray:
    """Ticks (n, 4) counted up to each sample, from a random position of the teeth; lost ones are NaN."""
    assert sensors.ticks is not None
    start = rng.random(angle.shape[1:])
    counts = np.floor(angle * sensors.ticks.teeth / (2.0 * np.pi) + start)
    lost = sensors.wheel_speed.drops.lost(rng, angle.shape[0], angle.shape[1:])
    return np.where(lost, np.nan, counts)


def _speeds(counts: FloatArray, sensors: Sensors, sample_time: float) -> FloatArray:
    assert sensors.ticks is not None
    own = sensors.ticks
    shape = (*counts.shape[:2], 4)
    meter = TickSpeed(own.teeth, sample_time, shape, own.least_ticks, own.longest_window)
    return np.stack([meter.step(counts[:, :, k]).speed for k in range(counts.shape[2])], axis=2)
