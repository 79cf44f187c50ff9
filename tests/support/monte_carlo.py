"""What the tests of consistency share: normalised squares of many runs, step by step, against their chi-square bands."""

from __future__ import annotations

import numpy as np

from estimators.filters import Consistency, consistency

RUNS = 1000


def normal(draw: np.random.Generator, variances: np.ndarray) -> np.ndarray:
    return draw.normal(size=(RUNS, len(variances))) * np.sqrt(variances)


def consistency_of(
    errors: list[np.ndarray], innovations: list[np.ndarray], n: int, m: int
) -> tuple[Consistency, Consistency]:
    """NEES and NIS of all runs (steps of (RUNS,)) with n and m degrees of freedom, without the first quarter."""
    skip = len(errors) // 4  # the effect of the start
    return consistency(np.array(errors)[skip:].T, n), consistency(np.array(innovations)[skip:].T, m)
