"""(14): the oscillator of the suspension compliance."""

from __future__ import annotations

import math

import numpy as np

from estimators.velocity import SuspensionParameters
from studies.claim import ClaimFunction, Finding, agrees
from studies.papers.resilient_velocity.setting import DIRECTIONS, PRINTED, Setting
from studies.papers.verdicts import derived
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray


def oscillator(setting: Setting, direction: Direction) -> tuple[FloatArray, FloatArray]:
    """A (2, 2) and B (2, 1) of (14), states displacement m and velocity m/s, input the tire force N."""
    vehicle = setting.parameters.vehicle
    mass, damping = vehicle["unsprung_mass"].value, vehicle["suspension_damping"].value
    stiffness = vehicle[f"suspension_stiffness_{direction}"].value
    return np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]]), np.array([[0.0], [1.0 / mass]])


def table_of_estimator(setting: Setting) -> SuspensionParameters:
    """Table I as the runtime compliance takes it."""
    v = setting.parameters.vehicle
    damping = v["suspension_damping"].value
    return SuspensionParameters(
        v["suspension_stiffness_longitudinal"].value,
        v["suspension_stiffness_lateral"].value,
        damping,
        damping,
        v["unsprung_mass"].value,
    )


def modes(setting: Setting = PRINTED) -> Finding:
    """P3-susp: from the eigenvalues of (14), against sqrt(K/M) and C/(2 sqrt(K M))."""
    computed: dict[str, dict[str, float]] = {}
    holds = True
    for direction in DIRECTIONS:
        pole = complex(np.linalg.eigvals(oscillator(setting, direction)[0])[0])
        frequency, ratio = abs(pole), -pole.real / abs(pole)
        vehicle = setting.parameters.vehicle
        stiffness, mass = vehicle[f"suspension_stiffness_{direction}"].value, vehicle["unsprung_mass"].value
        damping = vehicle["suspension_damping"].value
        holds &= agrees(frequency, math.sqrt(stiffness / mass), 1e-9 * frequency) and 0.0 < ratio < 1.0
        holds &= agrees(ratio, damping / (2.0 * math.sqrt(stiffness * mass)), 1e-9)
        computed[direction] = {
            "natural_frequency_rad_per_s": frequency,
            "natural_frequency_Hz": frequency / (2.0 * math.pi),
            "damping_ratio": ratio,
        }
    x, y = (computed[d] for d in DIRECTIONS)
    return Finding(
        computed,
        derived(holds),
        f"A wheel against the body swings at {x['natural_frequency_Hz']:.1f} Hz along (damping ratio "
        f"{x['damping_ratio']:.2f}) and {y['natural_frequency_Hz']:.1f} Hz across ({y['damping_ratio']:.2f}): well "
        "below the 100 Hz that 200 Hz sampling can show, and integrated exactly between samples.",
    )


CLAIMS: dict[str, ClaimFunction] = {"P3-susp": modes}
