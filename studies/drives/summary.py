"""The result of a run as rows of text, for whoever draws the table."""

from __future__ import annotations

from typing import Any

from studies.drives.run import RunResult

HEADER = ("quantity", "NRMS (%)", "RMS", "maximum", "reference peak", "unit", "samples")


def summary_rows(result: RunResult) -> list[tuple[str, ...]]:
    """One row a compared quantity in the columns of ``HEADER``, velocities first; none without references."""
    named = {**result.metrics["velocity"], **result.metrics["force"]}
    return [(name.replace("_", " "), *_cells(entry)) for name, entry in named.items()]


def _cells(entry: dict[str, Any]) -> tuple[str, ...]:
    digits = 3 if entry["unit"] == "m/s" else 0
    sizes = [_number(entry[key], digits) for key in ("rms", "max_error", "reference_peak")]
    return (_number(entry["nrms_percent"], 2), *sizes, entry["unit"], str(entry["samples"]))


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
