"""Whether the parts of a pipeline fit to it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from estimators.errors import EstimatorError

CORNER_PARTS = ("longitudinal_force", "readings")
"""Parts whose batch has the corners on a last axis."""


def check_parts(
    parts: Mapping[str, Any], shape: tuple[int, ...], sample_time: float, with_corners: tuple[str, ...]
) -> None:
    """Compares `batch_shape` and `sample_time` of the parts, where they have them, with those of the pipeline.

    Raises:
        EstimatorError: names the part that differs.
    """
    for name, part in parts.items():
        own = getattr(part, "batch_shape", None)
        wanted = (*shape, 4) if name in with_corners else shape
        if own is not None and tuple(own) != wanted:
            raise EstimatorError(f"{name} has batch_shape {tuple(own)}, expected {wanted}; build it for that batch")
        time = getattr(part, "sample_time", None)
        if time is not None and abs(time - sample_time) > 1e-9 * sample_time:
            raise EstimatorError(
                f"{name} is for sample_time = {time:g} s, the pipeline runs at {sample_time:g} s; build both for one"
            )
