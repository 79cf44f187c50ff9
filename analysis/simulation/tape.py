"""The arrays that a simulation fills, sample after sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import BoolArray, FlagArray, FloatArray


@dataclass
class Tape:
    """R runs of N samples: x, p (R, N+1, ..), estimate likewise or None; u, d, y (R, N, ..), flags, lost (R, N)."""

    x: FloatArray
    p: FloatArray
    u: FloatArray
    d: FloatArray
    y: FloatArray
    flags: FlagArray
    lost: BoolArray
    estimate: FloatArray | None = None

    def arrived(self, measured: FloatArray, k: int) -> FloatArray:
        """Measurements (R, ..), NaN in the runs whose sample k is lost."""
        return np.where(self.lost[:, k, None], np.nan, measured)
