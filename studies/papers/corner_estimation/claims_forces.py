"""P1-pid-K, P1-prop1: the longitudinal force observer and the bound of its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.bounds import force_observer_bound, wheel_error_is_hurwitz, wheel_error_matrix
from studies.claim import ClaimFunction, Finding, agrees, judged
from studies.papers.corner_estimation.inputs import FORCE_GAINS, parameters, printed_value
from synthesis.models.discretise import zero_order_hold
from synthesis.polynomials.matrix import FloatArray

DISTURBANCE_RATE = 100.0  # N/s, what the paper takes as the order of magnitude of dOmega_f/dt
STEP = 0.005  # s
SECONDS = 60.0  # behind the wheel speed's transient, which takes 1/0.177 s for a factor e
LATE = 50.0  # s, from where on the asymptotic bound is looked at


def wheel() -> tuple[float, float]:
    """I_w in kg*m^2 and R_e in m of P1 Table I."""
    values = parameters().vehicle
    return values["wheel_inertia"].value, values["effective_radius"].value


def wheel_error(gains: tuple[float, float] = FORCE_GAINS[:2]) -> Finding:
    """Poles of K of (7) by its characteristic polynomial, and Routh-Hurwitz without tolerance."""
    inertia, radius = wheel()
    poles = np.linalg.eigvals(wheel_error_matrix(*gains, inertia, radius))
    stable = wheel_error_is_hurwitz(*gains, inertia, radius)
    size = float(np.abs(poles).max())
    real, imaginary = float(poles.real.max()), float(np.abs(poles.imag).max())
    computed = {
        "poles_1_s": [[real, imaginary], [float(poles.real.min()), -imaginary]],
        "natural_frequency_rad_s": size,
        "damping_ratio": -real / size,
        "hurwitz": stable,
    }
    reading = (
        f"K is {'' if stable else 'not '}Hurwitz with poles {real:.8f} +- {imaginary:.8f}j 1/s: slow and hardly damped "
        f"({size:.3g} rad/s, damping ratio {-real / size:.3f}), so a wrong initial wheel speed rings for half a minute."
    )
    return Finding(computed, judged(stable and real < 0.0), reading)


@dataclass(frozen=True)
class ForceErrors:
    """Error of the force observer under disturbances of slope at most 100 N/s: `time` (k,), `force` (k, runs) in N."""

    names: tuple[str, ...]
    time: FloatArray
    force: FloatArray
    wheel_speed: FloatArray  # (k,) e_omega in rad/s, the same in every run

    def late(self) -> FloatArray:
        """Largest |e_F| behind the transient, per run."""
        return np.asarray(np.abs(self.force[self.time >= LATE]).max(axis=0))


def force_errors(eta3: float = FORCE_GAINS[2], rate: float = DISTURBANCE_RATE) -> ForceErrors:
    """(3) with its e_omega term, from 1 rad/s and 30 N off, under a ramp, a square wave of slope and a cosine.

    States e_omega, e_omega', e_F: e_F' = -eta3 e_F + eta1 e_omega' + Omega_f'; exact over each sample.
    """
    inertia, radius = wheel()
    A = np.zeros((3, 3))
    A[:2, :2] = wheel_error_matrix(*FORCE_GAINS[:2], inertia, radius)
    A[2] = [0.0, FORCE_GAINS[0], -eta3]
    move, push = zero_order_hold(A, np.array([[0.0], [0.0], [1.0]]), STEP)
    time = np.asarray(STEP * np.arange(round(SECONDS / STEP) + 1), float)
    slopes = rate * np.stack([np.ones_like(time), np.sign(np.sin(np.pi * time + 1e-9)), np.cos(2.8 * time)], axis=1)
    x = np.repeat([[1.0], [0.0], [30.0]], slopes.shape[1], axis=1)
    states = np.empty((len(time), 3, slopes.shape[1]))
    for k, slope in enumerate(slopes):
        states[k] = x
        x = move @ x + push * slope
    names = ("ramp", "slope changing sign each second", "cosine, 2.8 rad/s")
    return ForceErrors(names, time, states[:, 2], states[:, 0, 0])


def force_bound(eta3: float = FORCE_GAINS[2], rate: float = DISTURBANCE_RATE) -> Finding:
    """sup|Omega_f'| / eta3, and what three disturbances of that slope really leave."""
    bound = force_observer_bound(eta3, rate).ultimate
    errors = force_errors(eta3, rate)
    late = dict(zip(errors.names, errors.late().tolist(), strict=True))
    computed = {"bound_N": bound, "largest_late_error_N": late, "seen_from_s": LATE}
    ramp = late[errors.names[0]]
    # Behind the wheel speed's transient: what is left of it at LATE adds a share below 1e-3.
    kept = max(late.values()) <= bound * (1.0 + 1e-3)
    attained = abs(ramp / bound - 1.0) <= 1e-3
    printed = float(printed_value("P1-prop1"))
    reading = (
        f"The bound is {bound:.8f} N, printed as about {printed:g} N. From {LATE:g} s on, when the wheel speed "
        f"error has died out, the full error equation leaves {ramp:.5f} N under a ramp, which attains it, and at "
        f"most {max(late.values()):.5f} N otherwise. The bound is asymptotic: before that e_omega drives the force "
        "error."
    )
    return Finding(computed, judged(agrees(bound, printed, 0.5) and kept and attained), reading)


CLAIMS: dict[str, ClaimFunction] = {"P1-pid-K": wheel_error, "P1-prop1": force_bound}
