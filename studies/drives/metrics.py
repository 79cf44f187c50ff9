"""How far an estimate is from a reference."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from estimators.arrays import FloatArray


@dataclass(frozen=True)
class Deviation:
    """Deviation of an estimate from a reference over the ``samples`` where both are known.

    ``nrms_percent`` is P1 (46): RMS error over the largest magnitude of the reference, ``reference_peak``, in %; None
    where the reference is zero throughout. ``rms``, ``max_error`` and ``reference_peak`` are in ``unit``; all are None
    where nothing can be compared.
    """

    samples: int
    unit: str
    nrms_percent: float | None
    rms: float | None
    max_error: float | None
    reference_peak: float | None

    def as_dict(self) -> dict[str, Any]:
        """Plain data, for a JSON file."""
        return asdict(self)


def deviation(estimate: FloatArray, reference: FloatArray, unit: str) -> Deviation:
    """Compare (n,) samples; missing ones on either side are left out and not counted.

    Raises ValueError when the two differ in length.
    """
    if estimate.shape != reference.shape:
        raise ValueError(f"estimate has shape {estimate.shape}, reference {reference.shape}; they must be the same")
    both = np.isfinite(estimate) & np.isfinite(reference)
    samples = int(np.count_nonzero(both))
    if samples == 0:
        return Deviation(0, unit, None, None, None, None)
    error = estimate[both] - reference[both]
    rms = float(np.sqrt(np.mean(error**2)))
    peak = float(np.max(np.abs(reference[both])))
    return Deviation(
        samples=samples,
        unit=unit,
        nrms_percent=100.0 * rms / peak if peak > 0 else None,
        rms=rms,
        max_error=float(np.max(np.abs(error))),
        reference_peak=peak,
    )
