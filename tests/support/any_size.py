"""Unproved schedules of any size over any number of parameters, for tests of the runtime that solve nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule, SchedulingParameter, Signal
from estimators.schedule.plant import PlantPolynomial, PlantPolynomials

PERIOD = 0.01


def any_schedule(
    sizes: tuple[int, int, int] = (3, 2, 2), parameters: int = 2, seed: int = 0, speed: float = 20.0, **more: Any
) -> GainSchedule:
    """`sizes` are states, inputs, outputs; parameter i runs over [i, i + 2] with rates of 5 a second."""
    rng, (nx, nu, ny) = np.random.default_rng(seed), sizes
    ranges = tuple(
        SchedulingParameter(f"p{i}", "1", float(i), float(i + 2), -5.0, 5.0, False) for i in range(parameters)
    )
    shapes = {"A": (nx, nx), "B": (nx, nu), "C": (ny, nx), "D": (ny, nu), "E": (nx, 1), "F": (ny, 1)}
    plant = {}
    for key, shape in shapes.items():
        coefficients = rng.normal(size=((2,) * parameters + shape)) * (speed / nx if key == "A" else 0.3)
        if key == "A":
            coefficients[(0,) * parameters] -= speed * np.eye(nx)
        middle, half = np.arange(parameters) + 1.0, np.ones(parameters)
        plant[key] = (
            PlantPolynomial(1.0, 1.0, coefficients) if parameters == 1 else PlantPolynomials(middle, half, coefficients)
        )
    grid = tuple(np.array([i, i + 0.7, i + 2.0]) for i in range(parameters))
    values: dict[str, Any] = {
        "name": "any", "parameters": ranges, "grid": grid, "table": rng.normal(size=((3,) * parameters + (nx, ny))) * 3.0,
        "sample_time": PERIOD, "update": "held", "plant": plant, "sha256": "0" * 64,
    }  # fmt: skip
    for kind, count in (("states", nx), ("inputs", nu), ("outputs", ny), ("disturbances", 1)):
        values[kind] = tuple(Signal(f"{kind[0]}{i}", "1") for i in range(count))
    return GainSchedule(**(values | more))


def signals(schedule: GainSchedule, rng: np.random.Generator, shape: tuple[int, ...]) -> tuple[FloatArray, ...]:
    """Input, measurement and parameters inside their ranges, moving too fast for nobody."""
    nu, ny, count = len(schedule.inputs), len(schedule.outputs), len(schedule.parameters)
    low = np.array([parameter.min for parameter in schedule.parameters])
    return rng.normal(size=(*shape, nu)), rng.normal(size=(*shape, ny)), low + rng.uniform(0.9, 0.94, (*shape, count))
