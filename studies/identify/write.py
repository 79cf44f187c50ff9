"""An identification on disk: the parameter file for `gainsmith schedules`, identification.json and the residual pictures."""

from __future__ import annotations

import json
import re
from pathlib import Path

from studies.execution.files import ready_folder, whole_file, write_json
from studies.identify.identify import Identification
from studies.identify.parameters import Identified, tire_parameters, vehicle_parameters
from studies.identify.plots import figures
from studies.identify.result import content
from studies.plots.save import write_figures
from synthesis.models.parameter_set import load_parameter_set

CONSTANTS = ("sigma0", "sigma1", "sigma2", "kappa")


def parameter_file(found: Identification) -> str:
    """TOML text. ``effective_radius``, which the corner models take, is the mean of both axles."""
    car, drive = found.drive.vehicle, f"drive file '{found.drive.name}'"
    fitted = vehicle_parameters(found)
    front, rear = fitted["effective_radius_front"], fitted["effective_radius_rear"]
    given = {
        "mass": (car.mass, "kg"),
        "wheel_base": (car.front_axle_distance + car.rear_axle_distance, "m"),
        "front_axle_distance": (car.front_axle_distance, "m"),
        "rear_axle_distance": (car.rear_axle_distance, "m"),
        "cg_height": (car.cg_height, "m"),
        "front_track": (car.front_track, "m"),
        "rear_track": (car.rear_track, "m"),
    }
    how = front.source if front.source == rear.source else f"front: {front.source}; rear: {rear.source}"
    lines = [
        f"id = {_text('identified-' + _slug(found.drive.name))}", f"citation = {_text(', '.join(found.logs))}",
        f"note = {_text(note(found))}", "", "[vehicle]",
        *(_line(name, value, unit, drive) for name, (value, unit) in given.items()),
        _line("effective_radius", (front.value + rear.value) / 2, "m", f"mean of both axles; {how}"),
        *(_line(name, entry.value, entry.unit, entry.source) for name, entry in fitted.items()),
    ]  # fmt: skip
    for direction in ("longitudinal", "lateral"):
        if direction in found.base.tire:
            tire = tire_parameters(found, direction)
            lines += ["", f"[tire.{direction}]", *(_entry(name, tire[name]) for name in CONSTANTS)]
    return "\n".join(lines) + "\n"


def note(found: Identification) -> str:
    """What the file is, and what in it is not from the log."""
    held = [
        f"{direction} {name}"
        for direction in found.base.tire
        for name, entry in tire_parameters(found, direction).items()
        if name in CONSTANTS and not entry.excited
    ]
    rest = f"; not excited, from {found.base.id}: {', '.join(held)}" if held else ""
    return f"Identified by gainsmith with the velocity reference {found.velocity_reference}{rest}."


def _entry(name: str, entry: Identified) -> str:
    between = f", 95 % [{entry.interval[0]:.4g}, {entry.interval[1]:.4g}]" if entry.interval else ""
    return _line(name, entry.value, entry.unit, entry.source + between)


def _line(name: str, value: float, unit: str, source: str) -> str:
    return f"{name} = {{ value = {value!r}, unit = {_text(unit)}, source = {_text(source)} }}"


def _text(value: str) -> str:
    """A TOML basic string: JSON's escapes are a subset of TOML's, apart from DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _slug(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "car"


def write_identification(found: Identification, out: Path) -> tuple[Path, ...]:
    """Write everything to ``out`` and return the paths; the parameter file is read back before it gets its name.

    Raises LogError when ``out`` cannot be written.
    """
    ready_folder(out)
    paths = [out / "identified.toml", out / "identification.json"]
    with whole_file(paths[0]) as beside:
        beside.write_text(parameter_file(found), encoding="utf-8")
        load_parameter_set(beside)
    write_json(paths[1], content(found))
    return (*paths, *write_figures(figures(found), out))
