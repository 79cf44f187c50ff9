"""What a schedule's certified levels look like from below: the largest amplification that runs show, beside each level.

Random admissible trajectories, each with the input that is amplified most along it; the worst frozen place; a periodic
trajectory found by search. The worst of all is run again by plant and runtime, from rest. None of it may exceed what is
certified: a test of every proof that shares nothing with it but the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.simulation.channel import channel_of
from analysis.simulation.linear import Linear
from analysis.simulation.norms_along import h2_along, peak_along
from analysis.simulation.searched import (
    Measure,
    ScheduleQuestion,
    bad_trajectories,
    largest_continuous_gain,
    least_decay,
)
from analysis.simulation.simulate import simulate
from analysis.simulation.simulation import Simulation
from analysis.simulation.trajectories import random_trajectories
from analysis.simulation.worst_input import worst_inputs
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.schedule import FIRST_FORMAT, GainSchedule, upgraded
from synthesis.certificate.claims import (
    ERROR_EQUATION,
    GAINS,
    UPDATE_OF,
    WITH_CHANNEL,
    Claim,
    ClaimChannel,
    claim_name,
    claim_unit,
)
from synthesis.certificate.content import claims_of, subject_of
from synthesis.certificate.proof import certificate

SETTLED = 5.0  # decay times that a run lasts
FEWEST, MOST = 200, 3000  # samples
MOST_NUMBERS = 50_000_000  # of all matrices along all runs: 400 MB
ALONG = {"sampled H2 norm": h2_along, "sampled energy to peak": peak_along}
CONTINUOUS = ("decay rate", "gain")  # of the error equation
MEASURED = ("sampled gain", "motion gain", *ALONG)
ROUGH, ROUNDS = 6, 20  # of the worst input, while searching and in the end
ROUNDING, QUADRATURE = 1e-9, 1e-4  # relative, of samples and of continuous time: a level is not beaten by less


@dataclass(frozen=True, repr=False)
class Amplification(Display):
    """One claim: `level` in `unit`, and what runs show of it.

    `mean` and `largest` over the random trajectories (NaN for decay and for the error equation), `worst` along `trajectory`
    (N+1, p) under `inputs` (N, m), numbers of their sizes, by `names`. A decay rate is beaten from below, a gain from above.
    """

    claim: str
    kind: str
    level: float
    unit: str
    proved: bool
    mean: float
    largest: float
    worst: float
    every: FloatArray  # (runs,) of the random trajectories
    trajectory: FloatArray
    inputs: FloatArray
    names: tuple[str, ...]
    errors: tuple[str, ...]

    @property
    def share(self) -> float:
        """Of the certified level that was reached; infinite if what should decay grows."""
        if self.is_decay:
            return self.level / self.worst if self.worst > 0.0 else np.inf
        return self.worst / self.level

    @property
    def beaten(self) -> bool:
        """Whether a run contradicts the claim."""
        return self.share > 1.0 + (QUADRATURE if self.kind in ERROR_EQUATION else ROUNDING)

    @property
    def is_decay(self) -> bool:
        """Whether the claim says how fast an error falls."""
        return self.kind not in WITH_CHANNEL


def amplification(
    content: Mapping[str, Any], runs: int = 60, samples: int | None = None, seed: int = 0
) -> tuple[Amplification, ...]:
    """Every claim about gain or decay of a schedule file's content (`read_content`), proved again, beside what runs show.

    `samples` of a run; None: five decay times, 200 to 3000. Raises ScheduleError for a content that is no schedule, and
    AnalysisError for counts below one or beyond memory.

    >>> from estimators.schedule import SHIPPED, read_content
    >>> found = amplification(read_content(SHIPPED / "longitudinal-speed.json"), runs=2, samples=60)
    >>> any(one.beaten for one in found)
    False
    """
    if content.get("schema") == FIRST_FORMAT:
        content = upgraded(content, "schedule content")
    schedule = GainSchedule.from_content(content)
    subject = subject_of(content, schedule.name)
    claims = claims_of(content, subject, schedule.name)
    proofs = certificate(content, schedule.name).proofs
    decay = next(c.level for c in claims if c.kind == UPDATE_OF[schedule.update])
    most = int(
        MOST_NUMBERS / (max(runs, 1) * len(schedule.states) * (2 * len(schedule.states) + len(schedule.disturbances)))
    )
    if samples is None:
        wanted = np.ceil(SETTLED / (decay * schedule.sample_time))
        samples = int(np.clip(wanted, FEWEST, max(FEWEST, min(MOST, most))))
    if samples > most:
        raise AnalysisError(
            f"{runs} runs of {samples} samples are too many; take {most} samples at most, or fewer runs"
        )
    paths = random_trajectories(schedule, samples, runs, seed=seed)
    found = []
    for claim, proof in zip(claims, proofs, strict=True):
        if claim.kind not in (*MEASURED, *CONTINUOUS, UPDATE_OF[schedule.update]):
            continue
        measured = _searched if claim.channel is None or claim.kind in CONTINUOUS else _norm
        words = claim_name(claim.kind, claim.channel, subject.units), claim.kind, claim.level
        unit = claim_unit(claim.kind, claim.channel, subject.units)
        found.append(Amplification(*words, unit, proof.proved, *measured(schedule, claim, paths, seed)))
    return tuple(found)


def replayed(schedule: GainSchedule, found: Amplification) -> Simulation:
    """Plant and runtime from rest along the worst trajectory of a gain from disturbances, under its worst input."""
    given = {name: found.inputs[:, i] for i, name in enumerate(found.names)}
    return simulate(schedule, schedule, found.trajectory[None], disturbances=given)


def _norm(schedule: GainSchedule, claim: Claim, paths: FloatArray, seed: int) -> tuple[Any, ...]:
    """A gain by the input that is amplified most, another norm by its gramians."""
    assert claim.channel is not None
    channel, count = claim.channel, paths.shape[1]
    rng = np.random.default_rng(seed)

    def amplified_most(system: Linear, rounds: int = ROUGH) -> tuple[FloatArray, FloatArray]:
        start = rng.standard_normal((len(system.A), system.A.shape[1] - 1, system.B.shape[-1]))
        return worst_inputs(system, start, rounds)

    def roughly(system: Linear) -> FloatArray:
        return amplified_most(system)[0]

    measure: Measure = ALONG.get(claim.kind, roughly)
    question = ScheduleQuestion(schedule, claim.kind, channel)
    every = np.concatenate([paths, bad_trajectories(question, measure, count, seed)])
    system = channel_of(schedule, claim.kind, channel, every)
    if claim.kind in GAINS:
        ratios, w = amplified_most(system, ROUNDS)
    else:
        ratios, w = measure(system), np.zeros((len(every), count - 1, len(channel.inputs)))
        ratios = ratios / np.sqrt(schedule.sample_time)  # energies are integrals over time, not sums over samples
    best, random = int(ratios.argmax()), ratios[: len(paths)]
    sizes = np.array(list(channel.inputs.values()))
    return (
        float(random.mean()), float(random.max()), float(ratios[best]), random, every[best], w[best] * sizes,
        tuple(channel.inputs), channel.errors,
    )  # fmt: skip


def _searched(schedule: GainSchedule, claim: Claim, paths: FloatArray, seed: int) -> tuple[Any, ...]:
    """A decay, or a gain of the error equation: by the worst place and a periodic trajectory alone."""
    count, kind = paths.shape[1], "gain" if claim.kind in ERROR_EQUATION else "sampled gain"
    everything = ClaimChannel({s.name: 1.0 for s in schedule.disturbances}, tuple(s.name for s in schedule.states))
    channel = claim.channel or everything
    look_for = least_decay if claim.channel is None else largest_continuous_gain
    found, path = look_for(ScheduleQuestion(schedule, kind, channel), count)
    return np.nan, np.nan, found, np.empty(0), path, np.empty((count - 1, 0)), (), channel.errors
