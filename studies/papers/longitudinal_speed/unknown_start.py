"""Both tests of Lemma 1 along wheel speed histories, in every reading that P2 leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import solve_discrete_are

from analysis.stochastic_observability import (
    RANK_TOLERANCE,
    StochasticObservability,
    stochastic_observability,
    stochastic_observability_along,
)
from studies.papers.longitudinal_speed.inputs import (
    WheelRecord,
    accelerating,
    constant,
    noise,
    parameters,
    sample_time,
    structures,
)
from synthesis.models.catalogue.corner import corner_velocity_model

SPEEDS = (40.0, 100.0)  # rad/s, 13 and 33 m/s
STRUCTURES = {"I": 1600, "B B'": 600, "B_k B_k'": 600}  # samples until N has settled to 1e-3; the first is slow
RAMP = 100.0  # rad/s^2, a wheel that spins up on a slippery road


def both_tests(record: WheelRecord, structure: str = "I", tolerance: float = RANK_TOLERANCE) -> StochasticObservability:
    """M and N of (26) along a record with Q = 2.5e-3 S and R = 1e-3."""
    sequence = record.sequence
    q, R = noise()
    return stochastic_observability(sequence.A, sequence.C, q * structures(sequence)[structure], R, tolerance)


@cache
def two_states(samples: int = 13) -> StochasticObservability:
    """The same without the redundant third state: z and V_r alone, accelerating."""
    q, R = noise()
    record = accelerating(SPEEDS[0], RAMP, samples, samples)
    model = corner_velocity_model(parameters(), "longitudinal")
    return stochastic_observability_along(model, record.speed, sample_time(), q * np.eye(2), R)


def time_to_zero(found: StochasticObservability) -> float:
    """Seconds after which M is exactly zero; inf if not on this record."""
    return np.inf if found.samples_needed is None else found.samples_needed * sample_time()


@dataclass(frozen=True)
class Settling:
    """Test 2 on a record that ends at a constant speed: the peak of lambda_max(N) and when, where it ends, where it must."""

    peak: float
    peak_sample: int
    last: float
    limit: float

    @property
    def bounded(self) -> bool:
        """Whether it ended at the Riccati solution of the last speed, to 1e-3."""
        return bool(np.isfinite(self.peak) and abs(self.last - self.limit) <= 1e-3 * self.limit)


def settling(record: WheelRecord, structure: str = "I", tolerance: float = RANK_TOLERANCE) -> Settling:
    """Run test 2 and compare its end with the stabilising Riccati solution; limit inf where there is none."""
    found = both_tests(record, structure, tolerance)
    sequence = record.sequence
    q, R = noise()
    known = found.largest_known
    try:
        steady = solve_discrete_are(sequence.A[-1].T, sequence.C[-1].T, q * structures(sequence)[structure][-1], R)
        limit = float(np.linalg.eigvalsh(steady)[-1])
    except np.linalg.LinAlgError:  # an undetectable mode on the unit circle: no stabilising solution exists
        limit = np.inf
    return Settling(float(known.max()), int(known.argmax()), float(known[-1]), limit)


def standard_records(samples: int) -> dict[str, WheelRecord]:
    """Constant speed, and spinning up before it."""
    return {"constant": constant(SPEEDS[0], samples), "accelerating": accelerating(SPEEDS[0], RAMP, 60, samples)}


@cache
def standard_settlings() -> dict[tuple[str, str], Settling]:
    """Test 2 for every reading of Q on the standard records, by (record, structure)."""
    return {
        (name, structure): settling(record, structure)
        for structure, samples in STRUCTURES.items()
        for name, record in standard_records(samples).items()
    }
