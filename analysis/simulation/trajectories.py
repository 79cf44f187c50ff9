"""Random parameter trajectories inside range and rate bounds: sinusoids, band-limited sums of them, bang-bang."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from analysis.errors import AnalysisError
from analysis.simulation.box import box_of
from estimators.arrays import FloatArray
from estimators.errors import unknown
from estimators.schedule import GainSchedule
from synthesis.models.lpv import LpvModel

TONES = 8  # of a band-limited trajectory
FASTEST = 0.25 * np.pi  # rad/sample: eight samples a period
FAMILIES = ("sinusoid", "band-limited", "bang-bang")
Share = Callable[[np.random.Generator, int, int, float], FloatArray]


def random_trajectories(
    system: GainSchedule | LpvModel,
    samples: int,
    runs: int,
    sample_time: float | None = None,
    seed: int = 0,
    families: Sequence[str] = FAMILIES,
) -> FloatArray:
    """Parameters (runs, samples + 1, p) at the sample instants, in their units: every run admissible, exactly.

    Every value is in the range and every step within sample_time (s; None: that of the schedule) times the rate bounds, also
    after rounding. Run i is of the family i modulo their number: "sinusoid" of random centre, size and frequency;
    "band-limited", sums of eight sinusoids; "bang-bang", at its largest rates from end to end with random switching times
    (jumps, where a parameter may jump). Parameters are drawn independently. Raises AnalysisError for a count below 1, an
    unknown family, and a model without a sample time.

    >>> schedule = GainSchedule.shipped("corner-estimation-longitudinal")
    >>> random_trajectories(schedule, samples=50, runs=6).shape
    (6, 51, 1)
    """
    box = box_of(system)
    period = _period(system, sample_time)
    for what, count in (("samples", samples), ("runs", runs)):
        if not count >= 1:
            raise AnalysisError(f"{what} = {count}; give 1 at least")
    for family in families:
        if family not in FAMILIES:
            raise AnalysisError(unknown("family", family, FAMILIES))
    if not families:
        raise AnalysisError(f"no families; choose from {', '.join(FAMILIES)}")
    rng, wanted = np.random.default_rng(seed), np.empty((runs, samples + 1, len(box.names)))
    draws: dict[str, Share] = {"sinusoid": _sinusoid, "band-limited": _tones, "bang-bang": _switching}
    for place, family in enumerate(families):
        chosen = slice(place, None, len(families))
        count = len(range(*chosen.indices(runs)))
        for axis, width in enumerate(box.high - box.low):
            slope = period * min(box.rate_high[axis], -box.rate_low[axis]) / width
            wanted[chosen, :, axis] = box.low[axis] + width * draws[family](rng, count, samples + 1, slope)
    return box.limited(wanted, period)


def _period(system: GainSchedule | LpvModel, given: float | None) -> float:
    if given is None and isinstance(system, GainSchedule):
        return system.sample_time
    if given is None or not 0.0 < given < np.inf:
        raise AnalysisError(f"sample_time = {given} s; a model has none of its own, so give a positive one")
    return float(given)


def _frequency(rng: np.random.Generator, shape: tuple[int, ...], count: int) -> FloatArray:
    """rad/sample, from a quarter of a period over all samples to the fastest, each octave as likely."""
    return np.exp(rng.uniform(np.log(0.5 * np.pi / count), np.log(FASTEST), shape))


def _sinusoid(rng: np.random.Generator, runs: int, count: int, slope: float) -> FloatArray:
    """In parts of the range (runs, count), no steeper than `slope` a sample."""
    size = 0.5 * np.sqrt(rng.uniform(size=(runs, 1)))
    centre = size + (1.0 - 2.0 * size) * rng.uniform(size=(runs, 1))
    frequency = np.minimum(_frequency(rng, (runs, 1), count), slope / size)
    return centre + size * np.sin(frequency * np.arange(count) + rng.uniform(0.0, 2.0 * np.pi, (runs, 1)))


def _tones(rng: np.random.Generator, runs: int, count: int, slope: float) -> FloatArray:
    """A sum of sinusoids below a random band limit, slowed down together until it is never too steep."""
    sizes = rng.exponential(size=(runs, TONES, 1))
    sizes *= 0.5 / sizes.sum(axis=1, keepdims=True)
    frequency = _frequency(rng, (runs, 1, 1), count) * rng.uniform(size=(runs, TONES, 1))
    steepest = (sizes * frequency).sum(axis=1, keepdims=True)
    frequency *= np.minimum(1.0, slope / steepest)
    waves = np.sin(frequency * np.arange(count) + rng.uniform(0.0, 2.0 * np.pi, (runs, TONES, 1)))
    return np.asarray(0.5 + (sizes * waves).sum(axis=1))


def _switching(rng: np.random.Generator, runs: int, count: int, slope: float) -> FloatArray:
    """Either end of the range, switching at random; the rate bounds make ramps of it. The first value is anywhere."""
    dwell = np.exp(rng.uniform(np.log(2.0), np.log(max(4.0, float(count))), (runs, 1)))  # samples, in the mean
    toggles = rng.uniform(size=(runs, count)) < 1.0 / dwell
    wanted = np.asarray((np.cumsum(toggles, axis=1) + rng.integers(0, 2, (runs, 1))) % 2, float)
    if np.isfinite(slope):
        wanted[:, 0] = rng.uniform(size=runs)
    return wanted
