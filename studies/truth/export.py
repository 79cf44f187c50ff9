"""A truth drive as a recorded one: CSV log and drive file, to be replayed by ``gainsmith run``."""

from __future__ import annotations

import json
from pathlib import Path

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import unknown
from estimators.vehicle import CORNERS, VehicleParameters
from studies.drives.drive_file import DriveFile, read_drive
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
    and ``lateral`` are the gain schedules that the drive file names, ``vehicle`` is the car as the estimators know
    it (None: the truth). Raises SpecError for a place outside the batch, or a folder that cannot be written.
    """
    truth, name = measured.truth, measured.truth.names[run]
    signals, references = _rows(measured, seed, run)
    ready_folder(folder)
    log, drive = folder / f"{name}.csv", folder / f"{name}.toml"
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
        "[signals]", *(f'{label} = {{ column = "{label}", unit = "{SIGNALS[label]}" }}' for label in signals),
        "\n[reference]",
        *(f'{label} = {{ column = "true_{label}", unit = "{REFERENCES[label]}" }}' for label in references),
    ]  # fmt: skip
    with whole_file(drive) as beside:
        beside.write_text("\n".join(text) + "\n", encoding="utf-8")
    write_log(log, read_drive(drive), measured, seed=seed, run=run)
    return log, drive


def write_log(path: Path, drive: DriveFile, measured: Measured, *, seed: int = 0, run: int = 0) -> None:
    """Write the one log that ``drive`` describes from ``measured``: its clock and columns, in its units and signs.

    Raises SpecError for a place outside the batch, a signal that the simulation does not have, or a folder that cannot be
    written.
    """
    (log,) = drive.log
    keep = _kept(measured, run)
    columns = {log.time: measured.truth.time[keep]}
    tables = ((drive.signals, SIGNALS), (drive.reference, REFERENCES))
    for (wanted, units), rows in zip(tables, _rows(measured, seed, run), strict=True):
        for name, column in wanted.items():
            if name not in rows:
                raise SpecError(unknown("simulated signal", name, rows))
            columns[column.column] = rows[name] / column.scale(units[name], drive.vehicle.radius_for(name))
    ready_folder(path.parent)
    write_csv(path, columns)


def _kept(measured: Measured, run: int) -> BoolArray:
    kept: BoolArray = measured.truth.time <= measured.truth.duration[run] + 1e-9
    return kept


def _rows(measured: Measured, seed: int, run: int) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Measured signals and true references of one place in the batch, by their names in a drive file, SI."""
    seeds, runs = measured.batch_shape
    if not (0 <= seed < seeds and 0 <= run < runs):
        raise SpecError(f"seed {seed}, run {run}: the measurements have {seeds} seeds and {runs} runs")
    keep, truth = _kept(measured, run), measured.truth
    signals = {label: row for name in _NAMES for label, row in _columns(name, measured.signals[name][seed, run][keep])}
    steer = measured.signals["steer"][seed, run][keep]
    signals |= {f"steer_{corner}": steer[:, k] for k, corner in enumerate(CORNERS[:2])}
    references = {
        label: row
        for name, source in _REFERENCES.items()
        if source in truth.signals
        for label, row in _columns(name, truth[source][run][keep])
    }
    return signals, references


def _columns(name: str, value: FloatArray) -> list[tuple[str, FloatArray]]:
    return [(name, value)] if value.ndim == 1 else [(f"{name}_{c}", value[:, k]) for k, c in enumerate(CORNERS)]


def _vehicle(car: VehicleParameters) -> list[str]:
    lengths = (
        "front_axle_distance",
        "rear_axle_distance",
        "cg_height",
        "roll_center_height",
        "front_track",
        "rear_track",
    )
    quantities = {
        "mass": (car.mass, "kg"), **{name: (getattr(car, name), "m") for name in lengths},
        "effective_radius_front": (car.radii[0], "m"), "effective_radius_rear": (car.radii[2], "m"),
        "wheel_inertia": (car.wheel_inertia, "kg*m^2"), "yaw_inertia": (car.yaw_inertia, "kg*m^2"),
    }  # fmt: skip
    lines = [f'{name} = "{value!r} {unit}"' for name, (value, unit) in quantities.items()]
    return [*lines, f"rolling_resistance = {car.rolling_resistance!r}"]
