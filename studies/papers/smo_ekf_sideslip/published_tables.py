"""Tables 1 to 5 of P5 as printed."""

from __future__ import annotations

import tomllib
from importlib import resources
from typing import Any

STIFFNESS_SETTINGS = (0.5, 1.0, 1.5)
MASS_SETTINGS = (-300.0, 0.0, 300.0)  # kg


def printed() -> dict[str, dict[str, Any]]:
    """By test (slalom, roundabout), then by table: forces, stiffness, mass."""
    text = (resources.files(__package__) / "published.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def force_errors(tables: dict[str, dict[str, Any]] | None = None) -> dict[str, tuple[float, float]]:
    """(mean, standard deviation) in % of Tables 1 and 2, by test and quantity."""
    chosen = printed() if tables is None else tables
    return {
        f"{test} {quantity}": (row["mean"], row["deviation"])
        for test, found in chosen.items()
        for quantity, row in found["forces"].items()
    }
