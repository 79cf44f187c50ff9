"""What the claims of P2 start from: the model, covariances in their readings, and wheel speed histories."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np

from analysis.observability.gramians import SampledSequence, sampled_sequence
from estimators.arrays import FloatArray
from studies.papers.published import printed_numbers
from studies.papers.topic import Topic
from synthesis.models.catalogue.longitudinal_speed import longitudinal_speed_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, load_parameter_set

PACKAGE = "studies.papers.longitudinal_speed"
topic = partial(Topic, PACKAGE)  # one for each file
PARAMETERS = "longitudinal-speed"
TYPICAL = (1e-3, 1.0, 0.1)  # sizes of z [m], V_r [m/s], z' [m/s], to compare singular values
SAMPLE_TIME = float(printed_numbers(PACKAGE)["filter"]["sample_time"])  # s, 200 Hz


@cache
def parameters(name: str = PARAMETERS) -> ParameterSet:
    """A shipped parameter set; by default the values of P2 notes 1."""
    return load_parameter_set(name)


@cache
def speed_model() -> LpvModel:
    """The three-state model (19) in wheel speed and wheel acceleration."""
    return longitudinal_speed_model(parameters())


def noise(mode: str = "normal") -> tuple[float, FloatArray]:
    """The number q of Q = q S, and R (1, 1); mode "normal" or "high_slip"."""
    entry = printed_numbers(PACKAGE)["filter"][mode]
    return float(entry["process"]), np.array([[float(entry["measurement"])]])


def structures(sequence: SampledSequence) -> dict[str, FloatArray]:
    """What may stand for the unprinted 3 x 3 structure S of Q = q S (P2 notes 10): each (K, 3, 3)."""
    B, held = np.array(speed_model().B, float), sequence.B @ np.swapaxes(sequence.B, 1, 2)
    return {"I": np.broadcast_to(np.eye(3), held.shape), "B B'": np.broadcast_to(B @ B.T, held.shape), "B_k B_k'": held}


@dataclass(frozen=True)
class WheelRecord:
    """A wheel speed history: time in s, speed in rad/s, acceleration in rad/s^2, each (K,)."""

    name: str
    time: FloatArray
    speed: FloatArray
    acceleration: FloatArray

    @cached_property
    def sequence(self) -> SampledSequence:
        """The model along it, sampled with its parameters held; equal samples share one matrix exponential."""
        trajectory = np.stack([self.speed, self.acceleration], axis=1)
        distinct, where = np.unique(trajectory, axis=0, return_inverse=True)
        short = sampled_sequence(speed_model(), distinct, SAMPLE_TIME)
        return SampledSequence(short.A[where], short.B[where], short.C[where], short.E[where], short.sample_time)

    def cut(self, start: int = 0, end: int | None = None) -> WheelRecord:
        """Its samples from ``start`` on and before ``end``."""
        return WheelRecord(self.name, *(values[start:end] for values in (self.time, self.speed, self.acceleration)))


def times(samples: int) -> FloatArray:
    """Sample times in s, from zero, (samples,)."""
    return np.asarray(SAMPLE_TIME * np.arange(samples), np.float64)


def constant(speed: float, samples: int) -> WheelRecord:
    """A wheel that turns at one speed."""
    return WheelRecord(f"constant {speed:g} rad/s", times(samples), np.full(samples, speed), np.zeros(samples))


def accelerating(speed: float, acceleration: float, ramp: int, samples: int) -> WheelRecord:
    """From `speed` at a constant acceleration for `ramp` samples, then constant."""
    k, name = np.arange(samples), f"{acceleration:g} rad/s² from {speed:g} rad/s"
    speeds = speed + acceleration * SAMPLE_TIME * np.minimum(k, ramp)
    return WheelRecord(name, times(samples), speeds, np.where(k < ramp, acceleration, 0.0))


def launch(standing: float, duration: float) -> WheelRecord:
    """Stand, launch to 60 rad/s in 4 s with wheel flutter of 3 rad/s, then cruise with it; both in s."""
    t = times(round(duration / SAMPLE_TIME))
    u = np.maximum(t - standing, 0.0)
    ramp = np.minimum(u, 4.0) * np.pi / 4.0
    speed = 30.0 * (1.0 - np.cos(ramp)) + 3.0 * np.sin(6.0 * u) ** 2
    acceleration = np.where(u < 4.0, 30.0 * np.pi / 4.0 * np.sin(ramp), 0.0) + 18.0 * np.sin(12.0 * u)
    return WheelRecord("launch after 2 s" if standing else "launch", t, speed, acceleration)


def slalom(speed: float, amplitude: float, frequency: float, duration: float) -> WheelRecord:
    """The outer and inner wheel in turn: speed + amplitude sin(2 pi frequency t), duration in s."""
    t = times(round(duration / SAMPLE_TIME))
    w = 2.0 * np.pi * frequency
    wave, slope = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    return WheelRecord(f"slalom at {speed:g} rad/s", t, speed + wave, slope)


def braking(start: float, end: float, duration: float) -> WheelRecord:
    """From one speed to another with a smooth beginning and end, then constant; duration of the whole in s."""
    t = times(round(duration / SAMPLE_TIME))
    share = np.clip(t / (0.7 * duration), 0.0, 1.0)
    slope = np.where(share < 1.0, np.pi / (0.7 * duration) * np.sin(np.pi * share), 0.0)
    fall, name = 0.5 * (start - end), f"braking from {start:g} to {end:g} rad/s"
    return WheelRecord(name, t, start - fall * (1.0 - np.cos(np.pi * share)), -fall * slope)
