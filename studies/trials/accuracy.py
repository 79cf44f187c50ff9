"""Errors of many runs against one truth, and how well the mean over runs is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from estimators.arrays import FloatArray
from studies.study import Cell


def nrms(estimate: FloatArray, truth: FloatArray, least: float = 0.0) -> FloatArray:
    """P1 (46) per run, %: RMS of ``estimate`` (S, n) minus ``truth`` (n,) over max |truth|, at samples with |truth| >= ``least``.

    NaN where the truth never reaches ``least`` or stays 0.
    """
    counted, peak = np.abs(truth) >= least, float(np.max(np.abs(truth)))
    if peak == 0.0 or not counted.any():
        return np.full(estimate.shape[0], np.nan)
    return np.asarray(100.0 * np.sqrt(np.mean((estimate[:, counted] - truth[counted]) ** 2, axis=1)) / peak)


def sample_errors(estimate: FloatArray, truth: FloatArray) -> FloatArray:
    """P4 (13), P5 (8): 100 |estimate - truth|/max |truth| at every sample, %, shape of ``estimate`` (S, n)."""
    return np.asarray(100.0 * np.abs(estimate - truth) / float(np.max(np.abs(truth))))


@dataclass(frozen=True)
class Spread:
    """Mean over runs with its 95 % confidence interval (Student's t), and the worst run."""

    mean: float
    low: float
    high: float
    worst: float
    runs: int

    def text(self, digits: int = 2) -> str:
        """``mean [low, high]``."""
        return f"{self.mean:.{digits}f} [{self.low:.{digits}f}, {self.high:.{digits}f}]"


def spread(values: FloatArray) -> Spread | None:
    """Of one number a run (S,); None where it is not known in any run.

    Raises ValueError when it is known in some runs only: a mean over the others would flatter.
    """
    known = np.isfinite(values)
    if not known.any():
        return None
    if not known.all():
        raise ValueError(f"{int(np.count_nonzero(~known))} of {values.size} runs have no value")
    mean, runs = float(values.mean()), values.size
    half = float(student.ppf(0.975, runs - 1) * values.std(ddof=1) / np.sqrt(runs)) if runs > 1 else 0.0
    return Spread(mean, mean - half, mean + half, float(values.max()), runs)


def known_spread(values: FloatArray) -> Spread:
    """`spread` of values that are known in every run. Raises ValueError otherwise."""
    if (found := spread(values)) is None:
        raise ValueError(f"none of {values.size} runs has a value")
    return found


ERROR_COLUMNS = ("printed mean [%]", "mean [%]", "printed std [%]", "std [%]", "worst mean of a draw [%]")


class SampleSpreads(NamedTuple):
    """Mean and standard deviation over the samples of `sample_errors`, each over the runs."""

    mean: Spread
    deviation: Spread

    def cells(self, printed: tuple[Cell, Cell] = (None, None)) -> list[Cell]:
        """`ERROR_COLUMNS`, beside the ``printed`` mean and deviation."""
        return [printed[0], self.mean.text(), printed[1], self.deviation.text(), round(self.mean.worst, 2)]

    def measures(self, name: str) -> dict[str, float]:
        """Both means under the name."""
        return {f"{name}, mean": self.mean.mean, f"{name}, deviation": self.deviation.mean}


def sample_spreads(estimate: FloatArray, truth: FloatArray) -> SampleSpreads:
    """Of the estimates (S, n) against the truth (n,)."""
    error = sample_errors(estimate, truth)
    return SampleSpreads(known_spread(error.mean(axis=1)), known_spread(error.std(axis=1)))
