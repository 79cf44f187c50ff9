"""Plots of a replayed drive: velocities against the baselines, slip, forces and loads of each corner and axle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from estimators.arrays import FloatArray
from studies.drives.chain import Chain
from studies.drives.evaluation import (
    AXLES,
    LEAST_SPEED,
    DriveData,
    quasi_static_axle_forces,
    reference_axle_force,
    reference_sideslip,
)
from studies.drives.quantities import CORNERS
from studies.report import colours

Save = Callable[[Path], None]
Corners = Sequence[FloatArray | None] | FloatArray
"""One (n,) of each corner."""
Lines = list[tuple[Corners, Any]]
"""With the style of each."""
NOTHING = (None,) * 4

REFERENCE = {"color": colours.TRUTH, "linewidth": 1.8, "label": "reference"}
ESTIMATE = {"color": colours.OWN_OBSERVERS, "linewidth": 1.1, "label": "corner observers"}
PIPELINE = {"color": colours.PIPELINE, "linewidth": 1.2, "label": "pipeline"}
SIDESLIP_PART = {"color": colours.SCHEDULE, "linewidth": 1.1, "linestyle": (0, (5, 2))}
QUASI_STATIC = {"color": colours.MEAN_WHEEL_SPEED, "linewidth": 1.1, "linestyle": (0, (4, 2)), "label": "quasi-static"}
BASELINES = {
    "mean_wheel_speed": {"color": colours.MEAN_WHEEL_SPEED, "linewidth": 2.4, "label": "mean wheel speed"},
    "integrated_acceleration": {
        "color": colours.INTEGRATED_ACCELERATION,
        "linewidth": 1.3,
        "linestyle": (0, (4, 2)),
        "label": "integrated acceleration",
    },
}
TITLES = dict(zip(CORNERS, ("front left", "front right", "rear left", "rear right"), strict=True))
STYLE: Any = {
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "0.88",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.hashsalt": "gainsmith",
}


def figures(data: DriveData) -> dict[str, Save]:
    """Every plot of a drive by file stem: a function that writes it to a path, in the format of its suffix."""
    with mpl.rc_context(STYLE):
        drawn = {"velocity": velocity(data), "slip": slip(data), "forces": forces(data)}
        if data.chain is not None:
            drawn["lateral"] = lateral(data, data.chain)
            drawn["axle_forces"] = axle_forces(data, data.chain)
            drawn["loads"] = loads(data, data.chain)
    return {name: partial(save_figure, figure) for name, figure in drawn.items()}


def velocity(data: DriveData) -> Figure:
    """V_x of reference, observers and baselines, and below it what each is off by."""
    time = data.log.time
    reference = data.log.reference.get("vx")
    lines = [(name, data.baselines[name], style) for name, style in BASELINES.items()]
    lines.append(("corner_observers", data.replay.velocity, ESTIMATE))
    if data.chain is not None:
        lines.append(("pipeline", data.chain.vx, PIPELINE))
    figure = new_figure(9.0, 5.6 if reference is not None else 3.6)
    axes = np.atleast_1d(figure.subplots(1 + (reference is not None), 1, sharex=True))
    if reference is not None:
        axes[0].plot(time, reference, **REFERENCE)
        for _, value, style in lines:
            axes[1].plot(time, value - reference, **style)
        axes[1].axhline(0.0, color="0.1", linewidth=0.8)
        axes[1].set_ylabel("estimate − reference (m/s)")
    for _, value, style in lines:
        axes[0].plot(time, value, **style)
    axes[0].set_ylabel("longitudinal velocity (m/s)")
    axes[-1].set_xlabel("time (s)")
    _finish(figure, axes, data, "longitudinal velocity")
    return figure


def slip(data: DriveData) -> Figure:
    """Slip ratio of each corner from the estimated velocity, and from the reference one."""
    known = data.reference_slip
    lines: Lines = [(NOTHING if known is None else known.T, REFERENCE), (data.slip.T, ESTIMATE)]
    if data.chain is not None:
        fast = np.abs(data.chain.vx)[:, None] >= LEAST_SPEED
        lines.append((np.where(fast, data.chain.slip, np.nan).T, PIPELINE))
    return _corner_figure(data, lines, "slip ratio (1)", "slip ratio from the velocity at the centre of gravity")


def forces(data: DriveData) -> Figure:
    """Longitudinal force of each corner as fed to the observers, and the measured one where the log has it."""
    scale, unit = _force_unit(data.inputs.force)
    lines: Lines = [
        (_measured(data, "force_x", scale), REFERENCE),
        (data.inputs.force.T / scale, {**ESTIMATE, "label": "observer input"}),
    ]
    if data.chain is not None:
        lines.append((data.chain.force_x.T / scale, PIPELINE))
    sources = ", ".join(sorted(set(data.inputs.force_sources)))
    return _corner_figure(data, lines, f"longitudinal force ({unit})", f"longitudinal force ({sources})")


def lateral(data: DriveData, chain: Chain) -> Figure:
    """V_y and sideslip angle of the pipeline, and of the corner observers and the sideslip part where they run."""
    time, reference = data.log.time, data.log.reference
    figure = new_figure(9.0, 5.6)
    axes = figure.subplots(2, 1, sharex=True)
    if "vy" in reference:
        axes[0].plot(time, reference["vy"], **REFERENCE)
        if "vx" in reference:
            axes[1].plot(time, np.degrees(reference_sideslip(data.log)), **REFERENCE)
    if np.isfinite(chain.corner_vy).any():
        axes[0].plot(time, chain.corner_vy, **ESTIMATE)
    axes[0].plot(time, chain.vy, **PIPELINE)
    if np.isfinite(chain.sideslip_part).any():
        name = data.drive.estimators.sideslip.replace("-", " ")
        axes[1].plot(time, np.degrees(chain.sideslip_part), **SIDESLIP_PART, label=f"{name} estimator")
    fast = np.where(np.abs(chain.vx) >= LEAST_SPEED, chain.sideslip, np.nan)
    axes[1].plot(time, np.degrees(fast), **PIPELINE)
    axes[0].set_ylabel("lateral velocity (m/s)")
    axes[1].set_ylabel("sideslip angle (deg)")
    axes[1].set_xlabel("time (s)")
    _finish(figure, axes, data, "lateral motion at the centre of gravity")
    return figure


def axle_forces(data: DriveData, chain: Chain) -> Figure:
    """F_y of each axle, and what its share of m a_y is."""
    references = [reference_axle_force(data.log, axle) for axle in AXLES]
    rigid = quasi_static_axle_forces(data.log, data.drive)
    scale, unit = _force_unit(chain.axle_force_y)
    figure = new_figure(9.0, 5.6)
    axes = figure.subplots(2, 1, sharex=True)
    for k, (ax, reference) in enumerate(zip(axes, references, strict=True)):
        if reference is not None:
            ax.plot(data.log.time, reference / scale, **REFERENCE)
        ax.plot(data.log.time, rigid[:, k] / scale, **QUASI_STATIC)
        ax.plot(data.log.time, chain.axle_force_y[:, k] / scale, **PIPELINE)
        ax.set_title(f"{AXLES[k]} axle", loc="left", fontsize=9)
        ax.set_ylabel(f"lateral force ({unit})")
    axes[1].set_xlabel("time (s)")
    _finish(figure, axes, data, "lateral force of the axles")
    return figure


def loads(data: DriveData, chain: Chain) -> Figure:
    """F_z of each corner: pipeline, quasi-static, and measured where the log has it."""
    lines: Lines = [
        (_measured(data, "force_z", 1e3), REFERENCE),
        (data.inputs.vertical_load.T / 1e3, QUASI_STATIC),
        (chain.force_z.T / 1e3, PIPELINE),
    ]
    return _corner_figure(data, lines, "vertical load (kN)", "vertical load of the wheels")


def _measured(data: DriveData, signal: str, scale: float) -> Corners:
    """The reference of each corner that the log has."""
    found = [data.log.reference.get(f"{signal}_{corner}") for corner in CORNERS]
    return [None if value is None else value / scale for value in found]


def _corner_figure(data: DriveData, lines: Lines, label: str, what: str) -> Figure:
    """Four panels, with one line of each of ``lines`` where the corner has it."""
    figure = new_figure(9.0, 5.6)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for k, (corner, ax) in enumerate(zip(CORNERS, axes.flat, strict=True)):
        for values, style in lines:
            if values[k] is not None:
                ax.plot(data.log.time, values[k], **style)
        ax.set_title(TITLES[corner], loc="left", fontsize=9)
    for ax in axes[:, 0]:
        ax.set_ylabel(label)
    for ax in axes[-1]:
        ax.set_xlabel("time (s)")
    _finish(figure, axes, data, what)
    return figure


def _force_unit(force: FloatArray) -> tuple[float, str]:
    return (1e3, "kN") if np.nanmax(np.abs(force), initial=0.0) > 1e3 else (1.0, "N")


def new_figure(width: float, height: float) -> Figure:
    """An empty one, inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _finish(figure: Figure, axes: Any, data: DriveData, what: str) -> None:
    """Title, and one legend for all panels, below them where it covers nothing."""
    figure.suptitle(f"{data.drive.name}: {what}", fontsize=10, x=0.01, ha="left")
    found: dict[str, Any] = {}
    for ax in axes.flat:
        for handle, text in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(text, handle)
    figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=len(found), frameon=False)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once; the layout does not depend on the file format


def save_figure(figure: Figure, path: Path) -> None:
    """In the format of the suffix; the same drive gives the same file."""
    metadata = {"Date": None} if path.suffix == ".svg" else {}
    with mpl.rc_context(STYLE):
        figure.savefig(path, dpi=150, metadata=metadata)
