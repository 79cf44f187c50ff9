"""Pieces of time histories that several experiments draw: truth, first sensor draw, and the band of all draws."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from studies.plots.colours import TRUTH

Array = npt.NDArray[np.float64]
BAND = (2.5, 97.5)
"""Percentiles over the sensor draws."""


def true_line(axes: Any, time: Array, truth: Array) -> None:
    """The truth (n,), wide, below the estimates."""
    axes.plot(time, truth, color=TRUTH, linewidth=2.0, alpha=0.8, label="truth", zorder=1)


def estimate_line(axes: Any, time: Array, estimate: Array, label: str, **style: Any) -> None:
    """First draw of (S, n) as a line, all draws as a band."""
    (line,) = axes.plot(time, estimate[0], label=label, zorder=3, **{"linewidth": 0.9, **style})
    if estimate.shape[0] > 1:
        low, high = np.percentile(estimate, BAND, axis=0)
        axes.fill_between(time, low, high, color=line.get_color(), alpha=0.18, linewidth=0, zorder=2)


def finished(axes: Any, label: str, last: bool = False) -> None:
    """Axis label, light grid, and the time axis under the last panel."""
    axes.set_ylabel(label)
    axes.grid(alpha=0.25)
    axes.margins(x=0.01)
    if last:
        axes.set_xlabel("time [s]")
