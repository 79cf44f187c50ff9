"""What the rows and columns of a table of gains stand for, by name and unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Named = Mapping[str, str]


def gain_signals(content: Mapping[str, Any]) -> tuple[list[Named], list[Named]]:
    """Rows and columns of `gain.table` of a checked content, each {"name", "unit"}.

    Of an observer: its states by the outputs. Of a feedback law: its own states and the plant's inputs by its own states and what
    it measures, states or outputs; its own states are numbers without unit.
    """
    model, update = content["model"], content["update"]
    if update["kind"] != "feedback":
        return list(model["states"]), list(model["outputs"])
    own = [{"name": f"law_state_{k + 1}", "unit": "1"} for k in range(update["order"])]
    return [*own, *model["inputs"]], [*own, *model[update["measured"]]]


def quotient(unit: str, rate: bool, below: str) -> str:
    """The unit of a gain: unit/below, per second where the gain feeds a derivative."""
    above = per_second(unit) if rate else unit
    return above if below == "1" else f"({above})/({below})"


def per_second(unit: str) -> str:
    """The unit of a rate."""
    if unit == "1":
        return "1/s"
    if unit.endswith("/s"):
        return f"{unit}^2"
    return f"({unit})/s" if any(c in unit for c in "*/") else f"{unit}/s"
