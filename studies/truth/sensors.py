"""What sensors make of the truth, channel by channel, drawn for many seeds, and what a car hands to its estimators."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import ClassVar
from zlib import crc32

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.display import Display
from estimators.pipeline.signals import VehicleSignals
from estimators.signals.ticks import TickSpeed
from studies.truth.record import Truth
from synthesis.errors import SpecError

SOURCES = {
    "wheel_speed": "wheel_speed", "steer": "steer", "torque": "torque",
    "ax": "ax", "ay": "ay", "az": "az",
    "yaw_rate": "yaw_gyro", "roll_rate": "roll_rate", "pitch_rate": "pitch_rate",
}  # fmt: skip
"""The signal of the truth behind each measured one."""
_CHANNELS = {
    **dict.fromkeys(("ax", "ay", "az"), "acceleration"),
    **dict.fromkeys(("yaw_rate", "roll_rate", "pitch_rate"), "rate"),
}
"""Of `Sensors`, where the channel is not called like the signal."""


@dataclass(frozen=True)
class Drops:
    """Lost samples. With `burst` 1 they are independent, with probability `share`.

    Else Gilbert's chain: lost in the bad state only, `burst` samples long on average and `share` of all in the long run:
    bad -> good with 1/burst, good -> bad with share/((1 - share) burst). `received_in_bad` lets some through (Elliott).
    """

    share: float = 0.0
    burst: float = 1.0
    received_in_bad: float = 0.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.share < 1.0 and self.burst >= 1.0 and 0.0 <= self.received_in_bad < 1.0):
            raise SpecError(f"drops: {self}: share in [0, 1), burst at least 1 sample, received_in_bad in [0, 1)")
        if self.burst > 1.0 and self._bad / (1.0 - self._bad) / self.burst > 1.0:
            raise SpecError(
                f"drops: bursts of {self.burst:g} samples cannot be so frequent; lower share or lengthen burst"
            )

    @property
    def _bad(self) -> float:
        """Long-run share of the bad state."""
        bad = self.share / (1.0 - self.received_in_bad)
        if bad >= 1.0:
            raise SpecError(f"drops: {self}: share must be below 1 - received_in_bad")
        return bad

    def lost(self, rng: np.random.Generator, samples: int, shape: tuple[int, ...]) -> BoolArray:
        """(samples, *shape): which samples are lost; starts in the long-run distribution."""
        if self.share == 0.0:
            return np.zeros((samples, *shape), dtype=np.bool_)
        draw = rng.random((samples, *shape))
        if self.burst == 1.0:
            return np.asarray(draw < self.share)
        bad = self._bad
        stay, enter = 1.0 - 1.0 / self.burst, bad / ((1.0 - bad) * self.burst)
        # one draw u decides both ways: bad -> bad if u < stay, good -> bad if u < enter. Below both bounds the new state
        # is bad whatever the old one, above both good; in between it is kept (enter < stay) or turned: so the state is
        # that of the last sure sample, turned as often as samples since then say.
        sure = (draw < min(stay, enter)) | (draw >= max(stay, enter))
        value = draw < min(stay, enter)
        sure[0], value[0] = True, draw[0] < bad
        row = np.arange(samples).reshape(-1, *[1] * len(shape))
        last = np.maximum.accumulate(np.where(sure, row, 0), axis=0)
        state = np.take_along_axis(value, last, axis=0)
        if enter > stay:
            state ^= (row - last) % 2 == 1
        if self.received_in_bad:
            state &= rng.random(state.shape) >= self.received_in_bad
        return np.asarray(state, dtype=np.bool_)


@dataclass(frozen=True)
class Channel:
    """Errors of one sensor; the unit is that of its signal. Bias and scale are drawn once a run, noise at every sample.

    `period`: s between new values, held in between (0: every sample). `delay`: s by which they come late.
    """

    noise: float = 0.0  # standard deviation
    bias: float = 0.0  # standard deviation over runs
    scale: float = 0.0  # standard deviation over runs of the relative gain error
    resolution: float = 0.0  # least step of the reading
    period: float = 0.0
    delay: float = 0.0
    drops: Drops = Drops()
    dropped: str = "missing"  # "missing": NaN; "hold": the last value again

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, int | float) and not (math.isfinite(value) and value >= 0):
                raise SpecError(f"sensor.{entry.name} = {value!r}: must be finite and at least 0")
        if self.dropped not in {"missing", "hold"}:
            raise SpecError(f"sensor.dropped = '{self.dropped}': write missing or hold")

    def read(self, true: FloatArray, rng: np.random.Generator, time_step: float) -> FloatArray:
        """What the sensor says of ``true`` (n, ...), sampled every ``time_step``, s."""
        samples, shape = true.shape[0], true.shape[1:]
        gain = 1.0 + self.scale * rng.standard_normal(shape)
        value = true * gain + self.bias * rng.standard_normal(shape)
        if self.noise:
            value = value + self.noise * rng.standard_normal(true.shape)
        if self.resolution:
            value = self.resolution * np.round(value / self.resolution)
        late = round(self.delay / time_step)
        every = max(1, round(self.period / time_step))
        if late or every > 1:
            k = np.arange(samples)
            value = value[np.maximum(k - k % every - late, 0)]
        lost = self.drops.lost(rng, samples, shape)
        if self.drops.share == 0.0:
            return value
        if self.dropped == "missing":
            return np.where(lost, np.nan, value)
        row = np.arange(samples).reshape(-1, *[1] * len(shape))
        # a run that starts with a loss holds its first value
        last = np.maximum.accumulate(np.where(lost, 0, row), axis=0)
        return np.take_along_axis(value, np.broadcast_to(last, value.shape), axis=0)


@dataclass(frozen=True)
class Ticks:
    """A wheel encoder: `teeth` edges a revolution, counted; speed by `estimators.signals.TickSpeed`."""

    teeth: int = 96
    least_ticks: int = 8
    longest_window: int = 20

    def __post_init__(self) -> None:
        if self.teeth < 1:
            raise SpecError(f"ticks.teeth = {self.teeth}: at least 1")

    def count(self, angle: FloatArray, rng: np.random.Generator, drops: Drops) -> FloatArray:
        """Ticks (n, 4) counted up to each sample, from a random position of the teeth; lost ones are NaN."""
        counts = np.floor(angle * self.teeth / (2.0 * np.pi) + rng.random(angle.shape[1:]))
        return np.where(drops.lost(rng, angle.shape[0], angle.shape[1:]), np.nan, counts)

    def speeds(self, counts: FloatArray, sample_time: float) -> FloatArray:
        """Wheel speeds, rad/s, of counts (S, B, n, 4)."""
        meter = TickSpeed(self.teeth, sample_time, (*counts.shape[:2], 4), self.least_ticks, self.longest_window)
        return np.stack([meter.step(counts[:, :, k]).speed for k in range(counts.shape[2])], axis=2)


@dataclass(frozen=True, repr=False)
class Sensors(Display):
    """The sensors of a car; the defaults are those of a good production car at 200 Hz.

    >>> from dataclasses import replace
    >>> replace(Sensors(), acceleration=replace(Sensors().acceleration, bias=0.0)).acceleration.bias
    0.0
    """

    wheel_speed: Channel = Channel(noise=0.05)  # rad/s
    acceleration: Channel = Channel(noise=0.05, bias=0.05, scale=0.002)  # m/s^2: ax, ay, az
    rate: Channel = Channel(noise=0.002, bias=0.002, scale=0.002)  # rad/s: yaw, roll, pitch
    steer: Channel = Channel(noise=0.0005, bias=0.001)  # rad at the road wheels
    torque: Channel = Channel(noise=5.0, scale=0.02)  # N m at each wheel
    ticks: Ticks | None = None  # wheel speed from an encoder instead of a noisy speed


PERFECT = Sensors(Channel(), Channel(), Channel(), Channel(), Channel())  # sensors without any error


@dataclass(frozen=True, repr=False)
class Measured(Display):
    """Measured signals of S seeds x B runs over n samples, arrays (S, B, n) and (S, B, n, 4); SI, ISO frame.

    ``at(k)`` is what an `EstimationPipeline` of ``batch_shape`` (S, B) takes at sample k.
    """

    shown_units: ClassVar = {"time": "s"}

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
        return VehicleSignals(**{name: value[:, :, k] for name, value in self.signals.items()})

    def __iter__(self) -> Iterator[VehicleSignals]:
        return (self.at(k) for k in range(self.time.size))


def draw(truth: Truth, sensors: Sensors, seeds: Sequence[int], sample_time: float = 0.005) -> Measured:
    """Measurements of every run for every seed.

    The errors of a run depend on its seed, its manoeuvre and the signal alone, not on what else is drawn or how many:
    `numpy.random.SeedSequence` over the three. Of equal manoeuvres in one batch each has errors of its own.

    Raises SpecError: no seeds, a sample time that is no multiple of the truth's, a signal that was not recorded.

    >>> truth = simulate_manoeuvres([load_manoeuvre("p2-step-steer-dry").model_copy(update={"duration": 0.5})])
    >>> draw(truth, Sensors(), seeds=[0, 1]).signals["yaw_rate"].shape  # seeds, runs, samples
    (2, 1, 101)
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
        ticks = sensors.ticks if name == "wheel_speed" else None
        true = truth[source if ticks is None else "wheel_angle"]
        out = np.empty((*shape, samples, *true.shape[2:]))
        channel: Channel = getattr(sensors, _CHANNELS.get(name, name))
        for b in range(truth.size):
            for s, seed in enumerate(seeds):
                rng = np.random.default_rng(np.random.SeedSequence((seed, *truth.keys[b], crc32(name.encode()))))
                read = (
                    channel.read(true[b], rng, sample_time)
                    if ticks is None
                    else ticks.count(true[b], rng, channel.drops)
                )
                out[s, b] = read
        signals[name] = out if ticks is None else ticks.speeds(out, sample_time)
    return Measured(truth.time, signals, tuple(seeds), truth, shape)
