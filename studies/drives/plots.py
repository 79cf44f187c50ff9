"""Figures of a replayed drive: velocities against the baselines, slip, forces and loads of each corner and axle."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from estimators.arrays import FloatArray
from studies.drives import evaluation
from studies.drives.chain import Chain
from studies.drives.evaluation import AXLES, DriveData
from studies.drives.quantities import CORNERS
from studies.plots import ZERO, Figure, Line, Mark, Panel, colours

REFERENCE = partial(Line, label="reference", color=colours.TRUTH, width=1.8)
ESTIMATE = partial(Line, label="corner observers", color=colours.OWN_OBSERVERS, width=1.1)
PIPELINE = partial(Line, label="pipeline", color=colours.PIPELINE, width=1.2)
SIDESLIP_PART = partial(Line, color=colours.SCHEDULE, dash="dashed", width=1.1)
QUASI_STATIC = partial(Line, label="quasi-static", color=colours.MEAN_WHEEL_SPEED, dash="dashed", width=1.1)
BASELINES = {
    "mean_wheel_speed": partial(Line, label="mean wheel speed", color=colours.MEAN_WHEEL_SPEED, width=2.4),
    "integrated_acceleration": partial(
        Line, label="integrated acceleration", color=colours.INTEGRATED_ACCELERATION, dash="dashed", width=1.3
    ),
}
TITLES = ("front left", "front right", "rear left", "rear right")


def figures(data: DriveData) -> list[Figure]:
    """Every figure of a drive, named as its files."""
    drawn = [velocity(data), slip(data), forces(data)]
    if data.chain is not None:
        drawn += [lateral(data, data.chain), axle_forces(data, data.chain), loads(data, data.chain)]
    return drawn


def velocity(data: DriveData) -> Figure:
    """V_x of reference, observers and baselines, and below it what each is off by."""
    time, reference = data.log.time, data.log.reference.get("vx")
    values = [(style, data.baselines[name]) for name, style in BASELINES.items()]
    if data.replay is not None:
        values.append((ESTIMATE, data.replay.velocity))
    if data.chain is not None:
        values.append((PIPELINE, data.chain.vx))
    lines: list[Mark] = [style(time, value) for style, value in values]
    panels = [("longitudinal velocity (m/s)", lines)]
    if reference is not None:
        lines.insert(0, REFERENCE(time, reference))
        panels.append(("estimate − reference (m/s)", [*(style(time, v - reference) for style, v in values), ZERO]))
    return _stacked(data, "velocity", "longitudinal velocity", panels)


def slip(data: DriveData) -> Figure:
    """Slip ratio of each corner from the estimated velocity, and from the reference one."""

    def corner(k: int) -> list[Mark]:
        marks: list[Mark] = []
        if data.reference_slip is not None:
            marks.append(REFERENCE(data.log.time, data.reference_slip[:, k]))
        if data.replay is not None:
            marks.append(ESTIMATE(data.log.time, data.slip[:, k]))
        if data.chain is not None:
            marks.append(PIPELINE(data.log.time, _while_driving(data.chain, data.chain.slip[:, k])))
        return marks

    return _corners(data, "slip", "slip ratio from the velocity at the centre of gravity", "slip ratio (1)", corner)


def forces(data: DriveData) -> Figure:
    """Longitudinal force of each corner as fed to the observers, and the measured one where the log has it."""
    scale, unit = _force_unit(data.inputs.force)

    def corner(k: int) -> list[Mark]:
        marks = _measured(data, f"force_x_{CORNERS[k]}", scale)
        marks.append(ESTIMATE(data.log.time, data.inputs.force[:, k] / scale, label="observer input"))
        if data.chain is not None:
            marks.append(PIPELINE(data.log.time, data.chain.force_x[:, k] / scale))
        return marks

    sources = ", ".join(sorted(set(data.inputs.force_sources)))
    return _corners(data, "forces", f"longitudinal force ({sources})", f"longitudinal force ({unit})", corner)


def lateral(data: DriveData, chain: Chain) -> Figure:
    """V_y and sideslip angle of the pipeline, and of the corner observers and the sideslip part where they run."""
    time, reference = data.log.time, data.log.reference
    sideways, angles = list[Mark](), list[Mark]()
    if "vy" in reference:
        sideways.append(REFERENCE(time, reference["vy"]))
        if "vx" in reference:
            angles.append(REFERENCE(time, np.degrees(evaluation.reference_sideslip(data.log))))
    if np.isfinite(chain.corner_vy).any():
        sideways.append(ESTIMATE(time, chain.corner_vy))
    sideways.append(PIPELINE(time, chain.vy))
    if np.isfinite(chain.sideslip_part).any():
        name = data.drive.estimators.sideslip.replace("-", " ")
        angles.append(SIDESLIP_PART(time, np.degrees(chain.sideslip_part), label=f"{name} estimator"))
    angles.append(PIPELINE(time, np.degrees(_while_driving(chain, chain.sideslip))))
    panels = [("lateral velocity (m/s)", sideways), ("sideslip angle (deg)", angles)]
    return _stacked(data, "lateral", "lateral motion at the centre of gravity", panels)


def axle_forces(data: DriveData, chain: Chain) -> Figure:
    """F_y of each axle, and what its share of m a_y is."""
    time, rigid = data.log.time, evaluation.quasi_static_axle_forces(data.log, data.drive)
    scale, unit = _force_unit(chain.axle_force_y)
    panels = []
    for k, axle in enumerate(AXLES):
        reference = evaluation.reference_axle_force(data.log, axle)
        marks: list[Mark] = [] if reference is None else [REFERENCE(time, reference / scale)]
        marks += [QUASI_STATIC(time, rigid[:, k] / scale), PIPELINE(time, chain.axle_force_y[:, k] / scale)]
        panels.append((f"lateral force ({unit})", marks))
    titles = [f"{axle} axle" for axle in AXLES]
    return _stacked(data, "axle_forces", "lateral force of the axles", panels, titles)


def loads(data: DriveData, chain: Chain) -> Figure:
    """F_z of each corner: pipeline, quasi-static, and measured where the log has it."""

    def corner(k: int) -> list[Mark]:
        return [
            *_measured(data, f"force_z_{CORNERS[k]}", 1e3),
            QUASI_STATIC(data.log.time, data.inputs.vertical_load[:, k] / 1e3),
            PIPELINE(data.log.time, chain.force_z[:, k] / 1e3),
        ]

    return _corners(data, "loads", "vertical load of the wheels", "vertical load (kN)", corner)


def _measured(data: DriveData, name: str, scale: float) -> list[Mark]:
    value = data.log.reference.get(name)
    return [] if value is None else [REFERENCE(data.log.time, value / scale)]


def _while_driving(chain: Chain, value: FloatArray) -> FloatArray:
    """NaN at standstill, where slips and angles mean nothing."""
    return np.where(np.abs(chain.vx) >= evaluation.LEAST_SPEED, value, np.nan)


def _force_unit(force: FloatArray) -> tuple[float, str]:
    return (1e3, "kN") if np.nanmax(np.abs(force), initial=0.0) > 1e3 else (1.0, "N")


def _stacked(
    data: DriveData, name: str, what: str, panels: list[tuple[str, list[Mark]]], titles: list[str] | None = None
) -> Figure:
    """Panels with their y labels below each other."""
    rows = [
        [Panel(marks, "time (s)" if k == len(panels) - 1 else "", label, titles[k] if titles else "")]
        for k, (label, marks) in enumerate(panels)
    ]
    return _figure(data, name, what, rows)


def _corners(data: DriveData, name: str, what: str, label: str, corner: Callable[[int], list[Mark]]) -> Figure:
    """Four panels, front above rear, left beside right."""
    rows = [
        [Panel(corner(k), "time (s)" if k > 1 else "", "" if k % 2 else label, TITLES[k]) for k in row]
        for row in ((0, 1), (2, 3))
    ]
    return _figure(data, name, what, rows, share_y=True)


def _figure(data: DriveData, name: str, what: str, rows: list[list[Panel]], share_y: bool = False) -> Figure:
    labels = {mark.label for row in rows for panel in row for mark in panel.marks if isinstance(mark, Line)}
    title = f"{data.drive.name}: {what}"
    return Figure(
        name,
        title,
        f"Time histories of the {what}: {', '.join(sorted(labels))}.",
        rows,
        size=(9.0, 5.6 if len(rows) > 1 else 3.6), legend="below", columns=len(labels), share_x="all",
        share_y="all" if share_y else "", title=title,
    )  # fmt: skip
