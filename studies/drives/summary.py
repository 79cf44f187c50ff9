"""The result of a run as rows of text, for whoever draws the table."""

from __future__ import annotations

from typing import Any

from studies.drives.run import RunResult

HEADER = ("quantity", "NRMS (%)", "RMS", "maximum", "reference peak", "unit", "samples")


def summary_rows(result: RunResult) -> list[tuple[str, ...]]:
    """One row an estimate of a quantity in the columns of ``HEADER``, V_x first; none without references.

    Forces that never exceed the least one of the rule have nothing to compare, and no row.
    """
    notes = result.metrics["pipeline"].get("notes", {})
    signals = {"vx": result.metrics["velocity"], **result.metrics["pipeline"].get("signals", {})}
    rows = []
    for signal, estimates in signals.items():
        for name, entry in estimates.items():
            if entry["samples"]:
                mark = " (*)" if signal in notes else ""
                rows.append((f"{signal.replace('_', ' ')}: {name.replace('_', ' ')}{mark}", *_cells(entry)))
    return rows


def remarks(result: RunResult) -> list[str]:
    """What to know beside the table, one line each: rows marked (*) first, then everything that was assumed."""
    pipeline = result.metrics["pipeline"]
    marked = [f"(*) {signal.replace('_', ' ')}: {text}" for signal, text in _shown(pipeline).items()]
    assumed = dict.fromkeys([*result.metrics["assumptions"], *pipeline.get("assumptions", [])])
    return [*marked, *(f"assumed: {text}" for text in assumed)]


def _shown(pipeline: dict[str, Any]) -> dict[str, str]:
    """Notes of the signals that have a row."""
    signals = pipeline.get("signals", {})
    notes: dict[str, str] = pipeline.get("notes", {})
    return {
        name: text for name, text in notes.items() if any(entry["samples"] for entry in signals.get(name, {}).values())
    }


def _cells(entry: dict[str, Any]) -> tuple[str, ...]:
    digits = {"m/s": 3, "rad": 4}.get(entry["unit"], 0)
    sizes = [_number(entry[key], digits) for key in ("rms", "max_error", "reference_peak")]
    return (_number(entry["nrms_percent"], 2), *sizes, entry["unit"], str(entry["samples"]))


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
