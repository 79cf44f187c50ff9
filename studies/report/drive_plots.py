"""Plots of a replayed drive: velocity against the baselines, slip and force of each corner."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from studies.drives.judge import LEAST_SPEED, DriveData
from studies.drives.quantities import CORNERS
from studies.report.colours import BLUE, RED

Array = npt.NDArray[np.float64]
Save = Callable[[Path], None]

REFERENCE = {"color": "0.1", "linewidth": 1.8, "label": "reference"}
ESTIMATE = {"color": BLUE, "linewidth": 1.1, "label": "corner observers"}
PIPELINE = {"color": RED, "linewidth": 1.2, "label": "pipeline"}
BASELINES = {
    "mean_wheel_speed": {"color": "#f4a261", "linewidth": 2.4, "label": "mean wheel speed"},
    "integrated_acceleration": {
        "color": "#4d9a2a",
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
    return {name: partial(_save, figure) for name, figure in drawn.items()}


def velocity(data: DriveData) -> Figure:
    """V_x of reference, observers and baselines, and below it what each is off by."""
    time = data.log.time
    reference = data.log.reference.get("vx")
    lines = [(name, data.baselines[name], style) for name, style in BASELINES.items()]
    lines.append(("corner_observers", data.replay.velocity, ESTIMATE))
    if data.chain is not None:
        lines.append(("pipeline", data.chain.vx, PIPELINE))
    figure = _figure(9.0, 5.6 if reference is not None else 3.6)
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
    _finish(figure, axes[0], data, "longitudinal velocity")
    return figure


def slip(data: DriveData) -> Figure:
    """Slip ratio of each corner from the estimated velocity, and from the reference one."""
    figure = _figure(9.0, 5.6)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for k, ax in enumerate(axes.flat):
        if data.reference_slip is not None:
            ax.plot(data.log.time, data.reference_slip[:, k], **REFERENCE)
        ax.plot(data.log.time, data.slip[:, k], **ESTIMATE)
        if data.chain is not None:
            fast = np.where(np.abs(data.chain.vx) >= LEAST_SPEED, data.chain.slip[:, k], np.nan)
            ax.plot(data.log.time, fast, **PIPELINE)
    _label_corners(axes, "slip ratio (1)")
    _finish(figure, axes[0, 0], data, "slip ratio from the velocity at the centre of gravity")
    return figure


def forces(data: DriveData) -> Figure:
    """Longitudinal force of each corner as fed to the observers, and the measured one where the log has it."""
    scale, unit = (1e3, "kN") if np.nanmax(np.abs(data.inputs.force), initial=0.0) > 1e3 else (1.0, "N")
    figure = _figure(9.0, 5.6)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for k, (corner, ax) in enumerate(zip(CORNERS, axes.flat, strict=True)):
        measured = data.log.reference.get(f"force_x_{corner}")
        if measured is not None:
            ax.plot(data.log.time, measured / scale, **REFERENCE)
        ax.plot(data.log.time, data.inputs.force[:, k] / scale, **{**ESTIMATE, "label": "observer input"})
        if data.chain is not None:
            ax.plot(data.log.time, data.chain.force_x[:, k] / scale, **PIPELINE)
    _label_corners(axes, f"longitudinal force ({unit})")
    sources = ", ".join(sorted(set(data.inputs.force_sources)))
    _finish(figure, axes[0, 0], data, f"longitudinal force ({sources})")
    return figure


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _label_corners(axes: Any, label: str) -> None:
    for corner, ax in zip(CORNERS, axes.flat, strict=True):
        ax.set_title(TITLES[corner], loc="left", fontsize=9)
    for ax in axes[:, 0]:
        ax.set_ylabel(label)
    for ax in axes[-1]:
        ax.set_xlabel("time (s)")


def _finish(figure: Figure, first: Axes, data: DriveData, what: str) -> None:
    """Title, and one legend for all panels, above them where it covers nothing."""
    figure.suptitle(f"{data.drive.name}: {what}", fontsize=10, x=0.01, ha="left")
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), frameon=False)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once; the layout does not depend on the file format


def _save(figure: Figure, path: Path) -> None:
    metadata = {"Date": None} if path.suffix == ".svg" else {}  # the same drive gives the same file
    with mpl.rc_context(STYLE):
        figure.savefig(path, dpi=150, metadata=metadata)
