"""A truth drive as a recorded one: CSV log and drive file, to be replayed by ``gainsmith run``."""

from __future__ import annotations

import json
from pathlib import Path

from estimators.arrays import FloatArray
from estimators.vehicle import CORNERS, VehicleParameters
from studies.drives.quantities import REFERENCES, SIGNALS
from studies.execution.files import ready_folder, whole_file, write_csv
from studies.truth.sensors import Measured
from synthesis.errors import SpecError

_NAMES = ("wheel_speed", "torque", "ax", "ay", "az", "yaw_rate", "roll_rate", "pitch_rate")
_REFERENCES = {
    "vx": "vx", "vy": "vy", "ax": "road_ax", "force_x": "force_x", "force_y": "force_y", "force_z": "force_z"
}  # fmt: skip
"""Reference of the drive file -> signal of the truth."""


def write_drive(
    folder: Path,
    measured: Measured,
    *,
    seed: int = 0,
    run: int = 0,
    longitudinal: str = "corner-estimation-longitudinal",
    lateral: str | None = None,
    vehicle: VehicleParameters | None = None,
) -> tuple[Path, Path]:
    """Write ``<manoeuvre>.csv`` and ``<manoeuvre>.toml`` to ``folder``; returns both paths (log, drive).

    Args:
        folder: made if needed.
        measured: from `draw`; lost samples become empty cells.
        seed, run: places in the batch of ``measured``.
        longitudinal, lateral: gain schedules that the drive file names.
        vehicle: what the estimators are told of the car; None: the truth.

    Raises:
        SpecError: a place outside the batch.
        LogError: the folder cannot be written.
    """
    seeds, runs = measured.batch_shape
    if not (0 <= seed < seeds and 0 <= run < runs):
        raise SpecError(f"seed {seed}, run {run}: the measurements have {seeds} seeds and {runs} runs")
    truth, name = measured.truth, measured.truth.names[run]
    keep = truth.time <= truth.duration[run] + 1e-9
    columns: dict[str, FloatArray] = {"t": truth.time[keep]}
    signals, references = [], []
    for signal in _NAMES:
        value = measured.signals[signal][seed, run][keep]
        for label, row in _columns(signal, value):
            columns[label] = row
            signals.append(f'{label} = {{ column = "{label}", unit = "{SIGNALS[label]}" }}')
    for k, corner in enumerate(CORNERS[:2]):
        columns[f"steer_{corner}"] = measured.signals["steer"][seed, run][keep, k]
        signals.append(f'steer_{corner} = {{ column = "steer_{corner}", unit = "rad" }}')
    for reference, source in _REFERENCES.items():
        if source in truth.signals:
            for label, row in _columns(reference, truth[source][run][keep]):
                columns[f"true_{label}"] = row
                references.append(f'{label} = {{ column = "true_{label}", unit = "{REFERENCES[label]}" }}')
    ready_folder(folder)
    log, drive = folder / f"{name}.csv", folder / f"{name}.toml"
    write_csv(log, columns)
    car = vehicle or truth.vehicles[run].parameters
    tire = truth.tires[run]
    text = [
        'schema = "gainsmith.drive/1"',
        f"name = {json.dumps(name)}",
        f"source = {json.dumps(f'simulated truth on {tire} tires, seed {measured.seeds[seed]}')}",
        f'sample_time = "{measured.sample_time!r} s"',
        "",
        "[vehicle]",
        *_vehicle(car),
        "",
        "[schedules]",
        f"longitudinal = {json.dumps(longitudinal)}",
        *([] if lateral is None else [f"lateral = {json.dumps(lateral)}"]),
        "",
        "[[log]]",
        'name = "truth"',
        f"file = {json.dumps(log.name)}",
        'time = "t"',
        f'rate = "{1.0 / measured.sample_time:.9g} Hz"',
        "",
        "[signals]",
        *signals,
        "",
        "[reference]",
        *references,
    ]
    with whole_file(drive) as beside:
        beside.write_text("\n".join(text) + "\n", encoding="utf-8")
    return log, drive


def _columns(name: str, value: FloatArray) -> list[tuple[str, FloatArray]]:
    return [(name, value)] if value.ndim == 1 else [(f"{name}_{c}", value[:, k]) for k, c in enumerate(CORNERS)]


def _vehicle(car: VehicleParameters) -> list[str]:
    front, rear = car.radii[0], car.radii[2]
    quantities = {
        "mass": (car.mass, "kg"),
        "front_axle_distance": (car.front_axle_distance, "m"),
        "rear_axle_distance": (car.rear_axle_distance, "m"),
        "cg_height": (car.cg_height, "m"),
        "front_track": (car.front_track, "m"),
        "rear_track": (car.rear_track, "m"),
        "effective_radius_front": (front, "m"),
        "effective_radius_rear": (rear, "m"),
        "wheel_inertia": (car.wheel_inertia, "kg*m^2"),
        "yaw_inertia": (car.yaw_inertia, "kg*m^2"),
    }
    lines = [f'{name} = "{value!r} {unit}"' for name, (value, unit) in quantities.items()]
    return [*lines, f"rolling_resistance = {car.rolling_resistance!r}"]
