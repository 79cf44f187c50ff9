"""What an identification found: plain data, warnings, rows of a table, the parameter file for `gainsmith schedules`, pictures."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.drives.mounted import Mountings
from studies.execution.files import only_run, ready_folder, whole_file, write_json
from studies.identify.identify import Identification
from studies.identify.parameters import Identified, mounting_parameters, tire_parameters, vehicle_parameters
from studies.identify.plots import figures
from studies.identify.slip_limit import LimitedFit
from studies.plots.save import write_figures
from synthesis.models.parameter_set import Quantity, Tire, load_parameter_set
from synthesis.toml_file import StrictTable, load_toml

SCHEMA = "gainsmith.identification/1"
HEADER = ("parameter", "value", "95 % interval", "unit", "excited", "rows")
CONSTANTS = ("sigma0", "sigma1", "sigma2", "kappa")


@dataclass(frozen=True)
class TireResidual:
    """RMS over ``samples`` rows: of the slip velocity that the tire asks for, m/s, and of the force it makes of the slip, 1."""

    velocity: float
    force: float
    samples: int


def tire_residual(found: Identification, direction: str, tire: Tire, limit: float = 0.03) -> TireResidual | None:
    """Of any ``tire`` on the drive of ``found``, with the radii and angle zeros that this drive says; None: no usable row.

    Velocity: measured minus asked slip velocity, dynamic, m/s. Force: mu - C slip, quasi-static, both filtered; slips below
    ``limit``. Both with the linear corner model: friction is a disturbance to the observers.
    """
    limited: LimitedFit | None = found.fits.get(direction)
    if limited is None:
        return None
    values = limited.fit.values()
    values |= {
        "slip_stiffness": tire.sigma0.value / tire.kappa.value, "relaxation_length": 1.0 / tire.kappa.value,
        "damping_time": tire.sigma1.value / tire.sigma0.value, "saturation": 0.0, "bend": 0.0,
    }  # fmt: skip
    mask = limited.model.mask(limit, values)
    if not mask.any():
        return None
    error = limited.model.residual(values)[mask]
    mu, _ = limited.model.force_and_speed()
    width = min(mask.shape[1], limited.model.slip(values).shape[1])
    inside = mask[:, :width]
    force = (mu[:, :width] - values["slip_stiffness"] * limited.model.slip(values))[inside]
    return TireResidual(
        velocity=float(np.sqrt(np.mean(error**2))),
        force=float(np.sqrt(np.mean(force**2))) if force.size else float("nan"),
        samples=int(mask.sum()),
    )


def all_parameters(found: Identification) -> dict[str, dict[str, Identified]]:
    """By group: vehicle, longitudinal, lateral, mounting."""
    groups: dict[str, dict[str, Identified]] = {"vehicle": vehicle_parameters(found)}
    for direction in ("longitudinal", "lateral"):
        if direction in found.base.tire:
            groups[direction] = tire_parameters(found, direction)
    mounted = mounting_parameters(found)
    return groups | ({"mounting": mounted} if mounted else {})


def identified_tire(found: Identification, direction: str) -> Tire:
    """The tire that the parameter file holds."""
    named = tire_parameters(found, direction)
    named = {name: entry for name, entry in named.items() if name in Tire.model_fields}
    values = {n: Quantity(value=e.value, unit=e.unit, source=e.source) for n, e in named.items()}
    return Tire.model_validate(values)


def content(found: Identification) -> dict[str, Any]:
    """The content of identification.json."""
    inputs = found.data.inputs
    return {
        "schema": SCHEMA, "drive": found.drive.name, "logs": list(found.logs), "base": found.base.id,
        "velocity_reference": found.velocity_reference, "force_sources": list(inputs.force_sources),
        "assumptions": list(inputs.assumptions), "confidence": found.settings.confidence,
        "parameters": {
            group: {name: asdict(entry) for name, entry in entries.items()}
            for group, entries in all_parameters(found).items()
        },
        "fits": {direction: _fit(limited) for direction, limited in found.fits.items()},
        "residuals": {direction: _residuals(found, direction) for direction in found.fits},
        "warnings": warnings(found),
    }  # fmt: skip


def warnings(found: Identification) -> list[str]:
    """One sentence for every parameter that the log does not say, and for a direction without a fit."""
    lines = [f"assumed: {text}" for text in found.assumptions]
    lines += [f"{direction}: {why}" for direction, why in found.absent.items()]
    for group, entries in all_parameters(found).items():
        for name, entry in entries.items():
            if entry.excited or name in ("sigma2", "saturation") or group in found.absent:
                continue
            half = entry.half_width
            width = "no trace in the log" if half is None or half > 10 else f"half width {100 * half:.0f} %"
            if group == "mounting" and width.endswith("%"):
                width = f"half width {half:.2g} {entry.unit}"
            lines.append(f"{group} {name}: not excited ({width}); {entry.source.split('; ', 1)[-1]}")
    return lines


def rows(found: Identification) -> list[tuple[str, ...]]:
    """One row a parameter in the columns of ``HEADER``."""
    out: list[tuple[str, ...]] = []
    for group, entries in all_parameters(found).items():
        for name, entry in entries.items():
            between = "" if entry.interval is None else f"{entry.interval[0]:.4g} .. {entry.interval[1]:.4g}"
            yes = "yes" if entry.excited else "no"
            label = name.replace("_", " ") if group == "vehicle" else f"{group} {name.replace('_', ' ')}"
            out.append((label, f"{entry.value:.4g}", between, entry.unit, yes, str(entry.samples)))
    return out


def _fit(limited: LimitedFit) -> dict[str, Any]:
    fit = limited.fit
    values = {name: value for name, value in fit.values().items() if name.startswith("angle")}
    return {
        "slip_limit": limited.limit,
        "stiffness_by_slip_limit": {f"{limit:g}": value for limit, value in limited.tried.items()},
        "rows": fit.samples, "residual_rms_mps": fit.rms, "residual_correlation_rows": fit.correlation,
        "degrees_of_freedom": fit.freedom, "singular_values": list(fit.singular_values), "nuisances": values,
    }  # fmt: skip


def _residuals(found: Identification, direction: str) -> dict[str, Any]:
    """Of the tire in the file and of the base set on this very drive, at low slip."""
    out: dict[str, Any] = {}
    for name, tire in (("identified", identified_tire(found, direction)), (found.base.id, found.base.tire[direction])):
        result = tire_residual(found, direction, tire)
        out[name] = None if result is None else {
            "slip_velocity_rms_mps": result.velocity,
            "normalised_force_rms": result.force if np.isfinite(result.force) else None, "rows": result.samples,
        }  # fmt: skip
    return out


def parameter_file(found: Identification) -> str:
    """TOML text. ``effective_radius``, which the corner models take, is the mean of both axles."""
    car, drive = found.drive.vehicle, f"drive file '{found.drive.name}'"
    fitted = vehicle_parameters(found)
    front, rear = fitted["effective_radius_front"], fitted["effective_radius_rear"]
    lengths = ("front_axle_distance", "rear_axle_distance", "cg_height", "front_track", "rear_track")
    given = {"mass": (car.mass, "kg"), "wheel_base": (car.front_axle_distance + car.rear_axle_distance, "m")}
    given |= {name: (getattr(car, name), "m") for name in lengths}
    slug = re.sub(r"[^a-z0-9]+", "-", found.drive.name.lower()).strip("-") or "car"
    how = front.source if front.source == rear.source else f"front: {front.source}; rear: {rear.source}"
    lines = [
        f"id = {_text('identified-' + slug)}", f"citation = {_text(', '.join(found.logs))}",
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


class MountingFile(StrictTable):
    """What `mounting.toml` holds."""

    mounting: Mountings


def mounting_file(found: Identification) -> str:
    """The table `[mounting.inertial]` of a drive file: what was identified, and what the drive file had besides."""
    lines = [f"# {', '.join(found.logs)}: into the drive file, for its mounting.inertial", "[mounting.inertial]"]
    for name, entry in mounting_parameters(found).items():
        if entry.interval is not None:
            lines.append(
                f'{name} = "{entry.value:.4g} {entry.unit}"  # 95 % [{entry.interval[0]:.4g}, {entry.interval[1]:.4g}]'
            )
        elif entry.value:
            lines.append(f'{name} = "{entry.value!r} {entry.unit}"  # not excited')
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


def write_identification(found: Identification, out: Path) -> tuple[Path, ...]:
    """Write everything to ``out`` and return the paths; the parameter file is read back before it gets its name.

    Raises LogError when ``out`` cannot be written.
    """
    ready_folder(out)
    paths = [out / "identified.toml", out / "identification.json"]
    with only_run(out):
        with whole_file(paths[0]) as beside:
            beside.write_text(parameter_file(found), encoding="utf-8")
            load_parameter_set(beside)
        write_json(paths[1], content(found))
        if any(entry.excited for entry in mounting_parameters(found).values()):
            paths.append(out / "mounting.toml")
            with whole_file(paths[2]) as beside:
                beside.write_text(mounting_file(found), encoding="utf-8")
                load_toml(beside, MountingFile, "mounting")
        return (*paths, *write_figures(figures(found), out))
