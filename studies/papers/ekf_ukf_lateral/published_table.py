"""Table I of P4 as printed."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib import resources


@dataclass(frozen=True)
class Row:
    """One row: largest measured value, and mean and standard deviation of the error (13) in % for both filters."""

    quantity: str
    largest: float
    unit: str
    mean: dict[str, float]
    deviation: dict[str, float]


def table_1() -> tuple[Row, ...]:
    """The five rows, in the order of the paper."""
    text = (resources.files(__package__) / "published.toml").read_text(encoding="utf-8")
    return tuple(Row(**entry) for entry in tomllib.loads(text)["table_1"])
