"""What the claims of P2 start from: the model, covariances in their readings, and wheel speed histories."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from typing import Any

import numpy as np

from analysis.gramians import SampledSequence, sampled_sequence
from studies.claim import JsonValue
from studies.papers.published import published_claims
from synthesis.models.catalogue.longitudinal_speed import longitudinal_speed_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, load_parameter_set
from synthesis.polynomials.matrix import FloatArray

PACKAGE = "studies.papers.longitudinal_speed"
PARAMETERS = "longitudinal-speed"
TYPICAL = (1e-3, 1.0, 0.1)  # sizes of z [m], V_r [m/s], z' [m/s], to compare singular values


@cache
def parameters(name: str = PARAMETERS) -> ParameterSet:
    """A shipped parameter set; the values of P2 section IV unless told otherwise."""
    return load_parameter_set(name)


@cache
def speed_model() -> LpvModel:
    """The three-state model (19) in wheel speed and wheel acceleration."""
    return longitudinal_speed_model(parameters())


def printed_value(claim_id: str) -> JsonValue:
    """What the paper prints for a claim, from ``claims.toml``."""
    return published_claims(PACKAGE)[claim_id].published


@cache
def printed_numbers() -> dict[str, Any]:
    """Printed tables and values by name, from ``printed.toml``."""
    text = (resources.files(PACKAGE) / "printed.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def sample_time() -> float:
    """200 Hz, in s."""
    return float(printed_numbers()["filter"]["sample_time"])


def noise(mode: str = "normal") -> tuple[float, FloatArray]:
    """The number q of Q = q S, and R (1, 1); mode "normal" or "high_slip"."""
    entry = printed_numbers()["filter"][mode]
    return float(entry["process"]), np.array([[float(entry["measurement"])]])


def structures(sequence: SampledSequence) -> dict[str, FloatArray]:
    """What may stand for the unprinted 3 x 3 structure S of Q = q S: each (K, 3, 3)."""
    count = len(sequence.A)
    B = np.array(speed_model().B, float)
    held = sequence.B @ np.swapaxes(sequence.B, 1, 2)
    return {"I": np.broadcast_to(np.eye(3), (count, 3, 3)), "B B'": np.broadcast_to(B @ B.T, (count, 3, 3)),
            "B_k B_k'": held}  # fmt: skip


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
        short = sampled_sequence(speed_model(), distinct, sample_time())
        return SampledSequence(short.A[where], short.B[where], short.C[where], short.E[where], short.sample_time)


def times(samples: int) -> FloatArray:
    """Sample times in s, from zero, (samples,)."""
    return np.asarray(sample_time() * np.arange(samples), np.float64)


def constant(speed: float, samples: int) -> WheelRecord:
    """A wheel that turns at one speed."""
    time = times(samples)
    return WheelRecord(f"constant {speed:g} rad/s", time, np.full(samples, speed), np.zeros(samples))


def accelerating(speed: float, acceleration: float, ramp: int, samples: int) -> WheelRecord:
    """From `speed` at a constant acceleration for `ramp` samples, then constant."""
    time = times(samples)
    rising = np.arange(samples) < ramp
    return WheelRecord(
        f"{acceleration:g} rad/s² from {speed:g} rad/s", time,
        speed + acceleration * sample_time() * np.minimum(np.arange(samples), ramp), np.where(rising, acceleration, 0.0),
    )  # fmt: skip


def launch(standing: float, duration: float) -> WheelRecord:
    """Stand, launch to 60 rad/s in 4 s with wheel flutter of 3 rad/s, then cruise with it; both in s."""
    t = times(round(duration / sample_time()))
    u = np.maximum(t - standing, 0.0)
    ramp = np.minimum(u, 4.0) * np.pi / 4.0
    speed = 30.0 * (1.0 - np.cos(ramp)) + 3.0 * np.sin(6.0 * u) ** 2
    acceleration = np.where(u < 4.0, 30.0 * np.pi / 4.0 * np.sin(ramp), 0.0) + 18.0 * np.sin(12.0 * u)
    return WheelRecord("launch after 2 s" if standing else "launch", t, speed, acceleration)


def slalom(speed: float, swing: float, frequency: float, duration: float) -> WheelRecord:
    """The outer and inner wheel in turn: speed + swing sin(2 pi frequency t), duration in s."""
    t = times(round(duration / sample_time()))
    w = 2.0 * np.pi * frequency
    return WheelRecord(f"slalom at {speed:g} rad/s", t, speed + swing * np.sin(w * t), swing * w * np.cos(w * t))


def braking(start: float, end: float, duration: float) -> WheelRecord:
    """From one speed to another with a smooth beginning and end, then constant; duration of the whole in s."""
    t = times(round(duration / sample_time()))
    share = np.clip(t / (0.7 * duration), 0.0, 1.0)
    slope = np.where(share < 1.0, np.pi / (0.7 * duration) * np.sin(np.pi * share), 0.0)
    fall = 0.5 * (start - end)
    return WheelRecord(
        f"braking from {start:g} to {end:g} rad/s", t, start - fall * (1.0 - np.cos(np.pi * share)), -fall * slope
    )
