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
    """Write ``<manoeuvre>.csv`` and ``<manoeuvre>.toml`` to ``folder``, made if needed; returns both paths (log, drive).

    ``measured`` is from `draw`, lost samples become empty cells; ``seed`` and ``run`` are places in its batch; ``longitudinal``
    and ``lateral`` are the gain schedules that the drive file names, ``vehicle`` is what the estimators are told of the car
    (None: the truth). Raises SpecError for a place outside the batch, or a folder that cannot be written.
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
    text = [
        'schema = "gainsmith.drive/1"',
        f"name = {json.dumps(name)}",
        f"source = {json.dumps(f'simulated truth on {truth.tires[run]} tires, seed {measured.seeds[seed]}')}",
        f'sample_time = "{measured.sample_time!r} s"\n',
        "[vehicle]", *_vehicle(vehicle or truth.vehicles[run].parameters),
        f"\n[schedules]\nlongitudinal = {json.dumps(longitudinal)}",
        *([] if lateral is None else [f"lateral = {json.dumps(lateral)}"]),
        f'\n[[log]]\nname = "truth"\nfile = {json.dumps(log.name)}\ntime = "t"',
        f'rate = "{1.0 / measured.sample_time:.9g} Hz"\n',
        "[signals]", *signals, "\n[reference]", *references,
    ]  # fmt: skip
    with whole_file(drive) as beside:
        beside.write_text("\n".join(text) + "\n", encoding="utf-8")
    return log, drive


def _columns(name: str, value: FloatArray) -> list[tuple[str, FloatArray]]:
    return [(name, value)] if value.ndim == 1 else [(f"{name}_{c}", value[:, k]) for k, c in enumerate(CORNERS)]


def _vehicle(car: VehicleParameters) -> list[str]:
    lengths = ("front_axle_distance", "rear_axle_distance", "cg_height", "front_track", "rear_track")
    quantities = {
        "mass": (car.mass, "kg"), **{name: (getattr(car, name), "m") for name in lengths},
        "effective_radius_front": (car.radii[0], "m"), "effective_radius_rear": (car.radii[2], "m"),
        "wheel_inertia": (car.wheel_inertia, "kg*m^2"), "yaw_inertia": (car.yaw_inertia, "kg*m^2"),
    }  # fmt: skip
    lines = [f'{name} = "{value!r} {unit}"' for name, (value, unit) in quantities.items()]
    return [*lines, f"rolling_resistance = {car.rolling_resistance!r}"]
