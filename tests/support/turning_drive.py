"""A kinematic drive that excites everything: it speeds up, brakes and turns both ways on wheels that roll without slip."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.support.schedule_content import EFFECTIVE_RADIUS
from tests.support.synthetic_drive import DRIVE, FRONT, GRAVITY, REAR, TRACK

EXTRA = """ay = { column = "ay", unit = "m/s^2" }
az = { column = "az", unit = "m/s^2" }
yaw_rate = { column = "r", unit = "rad/s" }
steering = { column = "d", unit = "rad" }
"""
TURNING = DRIVE.replace("200 Hz", "100 Hz").replace("[reference]", EXTRA + "[reference]")
"""Drive file of :func:`turning`."""


def turning(duration: float = 20.0, seed: int = 1, noise: float = 1.0, understeer: float = 30.0) -> dict[str, Any]:
    """Columns at 100 Hz, SI: V = 10 + 3.5 sin 0.6 t, r = 0.055 sin 0.9 t, rigid body without sideslip at the centre of gravity.

    Slow and gentle enough that a wrong unit still looks like a car: what no car can do is refused before.

    ``noise``: multiples of 0.05 rad/s, 0.05 m/s^2, 0.002 rad/s, 0.0005 rad; ``understeer``: characteristic speed, m/s.
    """
    t = np.arange(0.0, duration, 0.01)
    v, ax = 10.0 + 3.5 * np.sin(0.6 * t), 2.1 * np.cos(0.6 * t)
    r = 0.055 * np.sin(0.9 * t)
    d = (FRONT + REAR) * r / v * (1.0 + (v / understeer) ** 2)
    rng = np.random.default_rng(seed)

    def seen(value: Any, deviation: float) -> Any:
        return value + noise * deviation * rng.standard_normal(t.size)

    table = {"t": t, "v": v, "ax": seen(ax, 0.05), "ay": seen(r * v, 0.05), "az": seen(GRAVITY + 0.0 * t, 0.05)}
    table |= {"r": seen(r, 0.002), "d": seen(d, 0.0005)}
    for corner in ("fl", "fr", "rl", "rr"):
        along = v - r * (TRACK / 2 if corner.endswith("l") else -TRACK / 2)
        if corner.startswith("f"):
            along = along * np.cos(d) + r * FRONT * np.sin(d)
        table[f"w_{corner}"] = seen(along / EFFECTIVE_RADIUS, 0.05)
    return table


def write_table(path: Path, table: dict[str, Any], delimiter: str = ",") -> Path:
    """A CSV file of the columns, quickly."""
    rows = np.column_stack(list(table.values()))
    np.savetxt(path, rows, fmt="%.9g", delimiter=delimiter, header=delimiter.join(table), comments="", encoding="utf-8")
    return path
