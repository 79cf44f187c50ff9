"""Many cars that differ a little, and a batch spread over processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any
from zlib import crc32

import numpy as np

from estimators.vehicle import VehicleParameters
from studies.execution.processes import in_order
from studies.truth.course import Course
from studies.truth.record import Truth
from studies.truth.simulate import simulate
from studies.truth.vehicle import Chassis, TruthVehicle
from synthesis.errors import SpecError, unknown


def varied(vehicle: TruthVehicle, spread: Mapping[str, float], seeds: Sequence[int]) -> list[TruthVehicle]:
    """One car per seed, each parameter of ``spread`` times 1 + spread u, u uniform in [-1, 1].

    Keys are those of `VehicleParameters` and `Chassis`; a seed gives a parameter the same u whatever else is varied.
    Raises SpecError for an unknown key or a spread outside [0, 1).
    """
    known = {entry.name for kind in (VehicleParameters, Chassis) for entry in fields(kind) if entry.init}
    for name, size in spread.items():
        if name not in known:
            raise SpecError(f"spread: {unknown('parameter', name, known)}")
        if not 0.0 <= size < 1.0:
            raise SpecError(f"spread of {name} = {size!r}: a share of the value, at least 0 and below 1")
    cars = []
    for seed in seeds:
        changes: dict[str, object] = {}
        for name, size in spread.items():
            rng = np.random.default_rng(np.random.SeedSequence((seed, crc32(name.encode()))))
            owner = vehicle.chassis if hasattr(vehicle.chassis, name) else vehicle.parameters
            factor = 1.0 + size * rng.uniform(-1.0, 1.0)
            value = getattr(owner, name)
            changes[name] = tuple(v * factor for v in value) if isinstance(value, tuple) else value * factor
        cars.append(vehicle.changed(**changes))
    return cars


def simulate_in_processes(
    courses: Sequence[Course], vehicles: Sequence[TruthVehicle], workers: int, **options: Any
) -> Truth:
    """`simulate` in ``workers`` processes, each with its share of the batch; the numbers are the same."""
    parts = min(workers, len(courses))
    if parts < 2:
        return simulate(courses, vehicles, **options)
    rows = [range(k * len(courses) // parts, (k + 1) * len(courses) // parts) for k in range(parts)]
    longest = max(c.duration for c in courses)
    work = [([courses[k] for k in r], [vehicles[k] for k in r], {**options, "until": longest}) for r in rows]
    done = list(in_order(_work, work, parts))
    merged = {name: np.concatenate([part.signals[name] for part in done]) for name in done[0].signals}
    names = tuple(name for part in done for name in part.names)
    tires = tuple(tire for part in done for tire in part.tires)
    duration = np.concatenate([part.duration for part in done])
    return replace(
        done[0], signals=merged, names=names, duration=duration, vehicles=tuple(vehicles), tires=tires, keys=()
    )


def _work(item: tuple[list[Course], list[TruthVehicle], dict[str, Any]]) -> Truth:
    courses, vehicles, options = item
    return simulate(courses, vehicles, **options)
