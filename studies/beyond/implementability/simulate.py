"""Observers run sample by sample, each in the form in which people write it down; the exact update is the runtime's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimators.phi import phi_of
from estimators.velocity import LpvVelocityObserver
from studies.beyond.implementability.designs import WHEEL_SPEED, Design, with_sample_time
from synthesis.polynomials.matrix import FloatArray

LARGEST = 1e12  # a diverging estimate is followed up to here
SUBSTEPS = 20  # of the true motion in one sample
Step = Callable[[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, float], FloatArray]
B = np.array([0.0, 1.0])


def _euler(x: FloatArray, A: FloatArray, L: FloatArray, C: FloatArray, uy: FloatArray, T: float) -> FloatArray:
    """x + T (A x + B u + L (y - C x))."""
    return np.asarray(x + T * (A @ x + B * uy[0] + L * (uy[1] - C @ x)))


def _sampled(x: FloatArray, A: FloatArray, L: FloatArray, C: FloatArray, uy: FloatArray, T: float) -> FloatArray:
    """The open loop over a sample, driven by B u and the held correction L (y - C x)."""
    return np.asarray(x + T * phi_of(T * A) @ (A @ x + B * uy[0] + L * (uy[1] - C @ x)))


def _predict(x: FloatArray, A: FloatArray, L: FloatArray, C: FloatArray, uy: FloatArray, T: float) -> FloatArray:
    """The open loop over a sample, then T L (y - C x)."""
    return np.asarray(x + T * phi_of(T * A) @ (A @ x + B * uy[0]) + T * L * (uy[1] - C @ x))


def _tustin(x: FloatArray, A: FloatArray, L: FloatArray, C: FloatArray, uy: FloatArray, T: float) -> FloatArray:
    """The trapezoidal rule, u and y held."""
    closed = 0.5 * T * (A - np.outer(L, C))
    return np.linalg.solve(np.eye(2) - closed, x + closed @ x + T * (B * uy[0] + L * uy[1]))


def _backward(x: FloatArray, A: FloatArray, L: FloatArray, C: FloatArray, uy: FloatArray, T: float) -> FloatArray:
    """The implicit Euler rule, u and y held."""
    return np.linalg.solve(np.eye(2) - T * (A - np.outer(L, C)), x + T * (B * uy[0] + L * uy[1]))


STEPS: dict[str, Step] = {
    "forward Euler": _euler,
    "sampled innovation": _sampled,
    "predict, then T·L": _predict,
    "Tustin": _tustin,
    "backward Euler": _backward,
}
RUNTIME = "exact closed loop"


@dataclass(frozen=True)
class Motion:
    """Samples (n,): wheel speed rad/s, relative acceleration m/s^2, normalised force; states (n, 2) m and m/s."""

    sample_time: float
    wheel_speed: FloatArray
    acceleration: FloatArray
    force: FloatArray
    states: FloatArray

    @property
    def time(self) -> FloatArray:
        """Of the samples, s."""
        return np.asarray(self.sample_time * np.arange(len(self.wheel_speed)), dtype=np.float64)


def rolling(design: Design, sample_time: float, samples: int, wheel_speed: float) -> Motion:
    """A wheel that rolls freely at constant speed: no slip, no force. Whatever the estimate does, it does by itself."""
    zero = np.zeros(samples)
    return Motion(sample_time, np.full(samples, wheel_speed), zero, zero, np.zeros((samples, 2)))


def launch(design: Design, sample_time: float = 0.005, seconds: float = 8.0, slip: float = 0.3) -> Motion:
    """The wheel speeds up evenly through the whole range while its relative velocity oscillates with 0.5 Hz.

    The true states follow the design model without friction term, in 20 exact substeps of each sample.
    """
    samples, fine = round(seconds / sample_time), sample_time / SUBSTEPS
    time = fine * np.arange(samples * SUBSTEPS)
    speed = np.interp(time, [0.0, seconds], WHEEL_SPEED)
    velocity = slip * np.sin(np.pi * time)
    decay = -design.model.on(np.array([1.0])).A[0, 0, 0] * speed  # kappa R_e omega, 1/s
    deflection = np.zeros(len(time))
    for k in range(len(time) - 1):  # z' = -a z + v, v linear over the substep
        fade = np.exp(-decay[k] * fine)
        deflection[k + 1] = fade * deflection[k] + 0.5 * fine * (velocity[k] * fade + velocity[k + 1])
    states = np.stack([deflection, velocity], axis=1)[::SUBSTEPS]
    wheel_speed = speed[::SUBSTEPS]
    acceleration = np.append(np.diff(states[:, 1]) / sample_time, 0.0)  # mean over the sample: no error from holding it
    C = design.model.on(wheel_speed).C[:, 0]
    return Motion(sample_time, wheel_speed, acceleration, np.einsum("gi,gi->g", C, states), states)


def run(design: Design, scheme: str, motion: Motion, start: FloatArray) -> FloatArray:
    """Estimates (n, 2) at the sample times from the initial estimate `start`; frozen once beyond 1e12."""
    if scheme == RUNTIME:
        return _runtime(design, motion, start)
    A, L, C = design.matrices(motion.wheel_speed)
    step, x, path = STEPS[scheme], np.array(start, float), []
    uy = np.stack([motion.acceleration, motion.force], axis=1)
    for k in range(len(uy)):
        path.append(x)
        if np.abs(x).max() < LARGEST:
            x = step(x, A[k], L[k, :, 0], C[k, 0], uy[k], motion.sample_time)
    return np.array(path)


def _runtime(design: Design, motion: Motion, start: FloatArray) -> FloatArray:
    observer = LpvVelocityObserver(with_sample_time(design, motion.sample_time), batch_shape=())
    observer.reset(state=start)
    path = [np.array(start, float)]
    for u, y, p in zip(motion.acceleration, motion.force, motion.wheel_speed, strict=True):
        path.append(observer.step(u, y, p).estimate)
    return np.array(path[:-1])


def growth(design: Design, scheme: str, rate: float, wheel_speed: float, samples: int = 400) -> float:
    """Factor per sample by which the size of the error changes in the end, from a run of `samples` at `rate` [Hz].

    Sizes are taken over the last quarter, in states scaled so that both count; complex poles are averaged out.
    """
    motion = rolling(design, 1.0 / rate, samples, wheel_speed)
    path = run(design, scheme, motion, np.array([0.0, 0.5]))
    weight = np.array([design.model.on(np.array([0.0])).C[0, 0, 0], 1.0])
    size = np.linalg.norm(path * weight, axis=1)
    size = size[(size > 1e-250) & (size < 0.1 * LARGEST)]
    quarter = len(size) // 4
    slope = np.polyfit(np.arange(3 * quarter), np.log(size[-3 * quarter :]), 1)[0]
    return float(np.exp(slope))
