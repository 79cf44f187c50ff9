r"""Variance-based sensitivity: first-order and total Sobol indices with their confidence (Sobol 1993; Saltelli et al. 2010).

S_i = Var(E[Y | X_i]) / Var(Y): the share of the variance that X_i explains alone; T_i = 1 - Var(E[Y | X_others]) / Var(Y):
its share with all interactions. Independent uniform parameters; sum S_i <= 1 <= sum T_i, equal for an additive measure.
The estimators (Saltelli et al. 2010, Table 2 (b) and (f))

    S_i = mean((f_B - m) (f_ABi - f_A)) / V,    T_i = mean((f_A - f_ABi)^2) / (2 V),    m, V of f_A and f_B together,

are written in sums over samples, so that samples need not be held. The sums are kept for groups of samples; leaving out one
group at a time gives the standard error of every index (jackknife; Efron, Stein 1981), and its half-width at 95 % from the
normal distribution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from analysis.errors import AnalysisError
from analysis.labelled import Axis, LabelledArray
from analysis.sensitivity.box import Box, Ranges
from analysis.sensitivity.designs import Saltelli, require_power
from analysis.sensitivity.measure import Measure, evaluate, plain_axes
from estimators.arrays import FloatArray, IndexArray
from estimators.display import Display

GROUPS = 32
HALF_WIDTH = float(ndtri(0.975))


@dataclass(frozen=True)
class VarianceShares:
    """`first_order` and `total` (d, ...), each with the half-width of its 95 % confidence interval; NaN without variance."""

    first_order: FloatArray
    total: FloatArray
    first_order_confidence: FloatArray
    total_confidence: FloatArray
    samples: int


class SaltelliSums:
    """Sums over blocks (f_A, f_B, f_AB1 .. f_ABd), to be added in any portions; at least two groups must be filled.

    Give values relative to something typical of them (the nominal value, say): the sums then lose no digits.
    """

    def __init__(self, dimensions: int, groups: int, trailing: tuple[int, ...] = ()) -> None:
        if groups < 2:
            raise AnalysisError(f"{groups} groups: leaving one out needs at least two")
        self.count = np.zeros(groups)
        self.plain = np.zeros((3, groups, *trailing))  # f_A, f_B, f_A^2 + f_B^2
        self.mixed = np.zeros((3, groups, dimensions, *trailing))  # f_B (f_AB - f_A), f_AB - f_A, (f_A - f_AB)^2

    def add(self, blocks: FloatArray, group: IndexArray) -> None:
        """Blocks (k, d + 2, ...) with the group (k,) that each belongs to. Raises AnalysisError unless all are finite."""
        if not np.isfinite(blocks).all():
            raise AnalysisError(
                "a value is infinite or not a number, so its variance has no meaning; shrink the ranges"
            )
        f_A, f_B, f_AB = blocks[:, 0], blocks[:, 1], blocks[:, 2:]
        moved = f_AB - f_A[:, None]
        np.add.at(self.count, group, 1.0)
        for total, part in zip(self.plain, (f_A, f_B, f_A**2 + f_B**2), strict=True):
            np.add.at(total, group, part)
        for total, part in zip(self.mixed, (f_B[:, None] * moved, moved, moved**2), strict=True):
            np.add.at(total, group, part)

    def shares(self) -> VarianceShares:
        """The indices with their confidence. Raises AnalysisError if fewer than two groups have samples."""
        filled = np.flatnonzero(self.count)
        if len(filled) < 2:
            raise AnalysisError("Sobol indices need samples in at least two groups; take more blocks")
        count, plain, mixed = self.count[filled], self.plain[:, filled], self.mixed[:, filled]
        whole = _indices(count.sum(), plain.sum(axis=1), mixed.sum(axis=1))
        without = [
            _indices(count.sum() - count[g], plain.sum(axis=1) - plain[:, g], mixed.sum(axis=1) - mixed[:, g])
            for g in range(len(filled))
        ]
        n = len(filled)
        errors = [
            np.sqrt((n - 1) / n * ((values - values.mean(axis=0)) ** 2).sum(axis=0))
            for values in (np.stack(column) for column in zip(*without, strict=True))
        ]
        return VarianceShares(*whole, HALF_WIDTH * errors[0], HALF_WIDTH * errors[1], int(count.sum()))


@dataclass(frozen=True, repr=False)
class SobolIndices(Display):
    """Arrays with the axes (parameter, ...); NaN where the measure does not vary. `evaluations` of the measure."""

    first_order: LabelledArray
    total: LabelledArray
    first_order_confidence: LabelledArray
    total_confidence: LabelledArray
    evaluations: int


def variance_indices(
    measure: Measure,
    ranges: Ranges,
    samples: int = 1024,
    seed: int = 0,
    axes: tuple[Axis, ...] = (),
    name: str = "measure",
) -> SobolIndices:
    """Both indices from (d + 2) N evaluations on scrambled Sobol points A, B and A with one column of B.

    `samples` N must be a power of two, at least 2. Raises AnalysisError for bad ranges and a measure that is infinite
    somewhere: its variance has no meaning then; shrink the ranges.

    >>> shares = variance_indices(lambda at: 3.0 * at["a"] + at["b"], {"a": (0.0, 1.0), "b": (0.0, 1.0)})
    >>> shares.total.values.round(2).tolist()  # 9/10 and 1/10
    [0.9, 0.1]
    """
    box = Box.of(ranges)
    require_power("samples", samples)
    if samples < 2:
        raise AnalysisError("samples = 1: Sobol indices need at least 2")
    points = Saltelli(blocks=samples, seed=seed).everywhere(box)
    values = evaluate(measure, box.columns(points))
    sums = SaltelliSums(len(box.names), min(GROUPS, samples), values.shape[1:])
    blocks = values.reshape(samples, -1, *values.shape[1:])
    moved = blocks - blocks[0, 0]
    moved[np.abs(moved) <= 8.0 * np.finfo(float).eps * np.abs(blocks[0, 0])] = (
        0.0  # rounding of a constant is no variance
    )
    sums.add(moved, np.arange(samples) * len(sums.count) // samples)
    lead = (Axis("parameter", np.array(box.names)), *(axes or plain_axes(values.shape[1:])))
    notes = {"design": "saltelli", "seed": seed, "samples": samples, "ranges": {k: list(v) for k, v in ranges.items()}}
    shares = sums.shares()

    def labelled(what: str, array: FloatArray) -> LabelledArray:
        return LabelledArray(f"{what} of {name}", array, lead, "1", notes)

    return SobolIndices(
        labelled("first-order index", shares.first_order),
        labelled("total index", shares.total),
        labelled("confidence of the first-order index", shares.first_order_confidence),
        labelled("confidence of the total index", shares.total_confidence),
        len(points),
    )


def _indices(count: float, plain: FloatArray, mixed: FloatArray) -> tuple[FloatArray, FloatArray]:
    mean = (plain[0] + plain[1]) / (2.0 * count)
    variance = plain[2] / (2.0 * count) - mean**2
    # rounding of the sums; a measure that does not vary has no shares
    variance = np.where(variance > 1e-14 * plain[2] / (2.0 * count), variance, np.nan)
    first = (mixed[0] - mean * mixed[1]) / count / variance
    return np.asarray(first), np.asarray(mixed[2] / (2.0 * count) / variance)
