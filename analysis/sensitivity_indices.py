r"""Variance-based sensitivity: first-order and total Sobol indices (Sobol 1993; Saltelli et al. 2010).

S_i = Var(E[Y | X_i]) / Var(Y): the share of the variance that X_i explains alone; T_i = 1 - Var(E[Y | X_others]) / Var(Y):
its share with all interactions. Independent uniform parameters; sum S_i <= 1 <= sum T_i, equal for an additive measure.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc, sobol_indices

from analysis.errors import AnalysisError
from analysis.labelled import Axis, LabelledArray
from analysis.sensitivity import Measure, evaluate
from analysis.sensitivity_designs import Ranges, bounds, power_of_two
from estimators.arrays import FloatArray


@dataclass(frozen=True)
class SobolIndices:
    """Arrays with the axes (parameter, ...); NaN where the measure does not vary. `evaluations` of the measure."""

    first_order: LabelledArray
    total: LabelledArray
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

    `samples` N must be a power of two. Raises AnalysisError for bad ranges and a measure that is infinite somewhere: its
    variance has no meaning then; shrink the ranges.
    """
    names, low, high = bounds(ranges)
    power, d = power_of_two(samples), len(names)
    points = qmc.Sobol(2 * d, rng=np.random.default_rng(seed)).random_base2(power)
    A, B = low + points[:, :d] * (high - low), low + points[:, d:] * (high - low)
    mixed = np.repeat(A[None], d, axis=0)
    mixed[np.arange(d), :, np.arange(d)] = B.T
    everything = np.concatenate([A, B, mixed.reshape(-1, d)])
    values = evaluate(measure, {key: everything[:, i] for i, key in enumerate(names)})
    first, total = _indices(values, samples, d)
    own = axes or tuple(Axis(f"output_{i}", np.arange(n, dtype=float)) for i, n in enumerate(values.shape[1:]))
    lead = (Axis("parameter", np.array(names)), *own)
    notes = {"design": "saltelli", "seed": seed, "samples": samples, "ranges": {k: list(v) for k, v in ranges.items()}}
    return SobolIndices(
        LabelledArray(f"first-order index of {name}", first, lead, "1", notes),
        LabelledArray(f"total index of {name}", total, lead, "1", notes),
        len(everything),
    )


def _indices(values: FloatArray, samples: int, d: int) -> tuple[FloatArray, FloatArray]:
    if not np.isfinite(values).all():
        raise AnalysisError(
            f"the measure is infinite at {int((~np.isfinite(values)).sum())} of {values.size} values, so its variance has no "
            "meaning; shrink the ranges or use a bounded measure"
        )
    trailing = values.shape[1:]
    flat = values.reshape(len(values), -1).T
    f_A, f_B, f_AB = flat[:, :samples], flat[:, samples : 2 * samples], flat[:, 2 * samples :]
    varies = np.ptp(flat, axis=1) > 0.0
    first, total = np.full((d, len(flat)), np.nan), np.full((d, len(flat)), np.nan)
    if varies.any():
        stacked = f_AB[varies].reshape(-1, d, samples).swapaxes(0, 1)
        result = sobol_indices(func={"f_A": f_A[varies], "f_B": f_B[varies], "f_AB": stacked}, n=samples)
        shape = (int(varies.sum()), d)
        first[:, varies] = np.reshape(result.first_order, shape).T
        total[:, varies] = np.reshape(result.total_order, shape).T
    return first.reshape(d, *trailing), total.reshape(d, *trailing)
