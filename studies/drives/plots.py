"""Figures of a replayed drive: velocities against the baselines, slip, forces and loads of each corner and axle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from estimators.arrays import FloatArray
from studies.drives import evaluation
from studies.drives.chain import Chain
from studies.drives.evaluation import AXLES, DriveData
from studies.drives.flag_plot import flag_figure
from studies.drives.quantities import CORNERS
from studies.drives.raised import raised
from studies.plots import ZERO, Axis, Band, Figure, Line, Mark, Panel, colours

REFERENCE = partial(Line, label="reference", color=colours.TRUTH, width=1.8)
ESTIMATE = partial(Line, label="corner observers", color=colours.OWN_OBSERVERS, dash="dashed", width=1.2)
PIPELINE = partial(Line, label="pipeline", color=colours.PIPELINE, width=1.2)
SIDESLIP_PART = partial(Line, color=colours.SCHEDULE, dash="dash-dot", width=1.2)
TWO_SIGMA = partial(Band, label="pipeline ±2σ", color=colours.PIPELINE)
QUASI_STATIC = partial(Line, label="quasi-static", color=colours.INTEGRATED_ACCELERATION, dash="dashed", width=1.1)
BASELINES = {
    "mean_wheel_speed": partial(Line, label="mean wheel speed", color=colours.MEAN_WHEEL_SPEED, width=2.4),
    "integrated_acceleration": partial(
        Line, label="integrated acceleration", color=colours.INTEGRATED_ACCELERATION, dash="dotted", width=1.3
    ),
}
MOST_BAND = 0.6  # of the span of the curves, to either side: a wide band must not flatten them
TITLES = ("front left", "front right", "rear left", "rear right")


def figures(data: DriveData) -> list[Figure]:
    """Every figure of a drive, named as its files."""
    drawn = [velocity(data), slip(data), forces(data)]
    if data.chain is not None:
        drawn += [lateral(data, data.chain), axle_forces(data, data.chain), loads(data, data.chain)]
    flags = flag_figure(data.drive.name, raised(data))
    return drawn if flags is None else [*drawn, flags]


def velocity(data: DriveData) -> Figure:
    """V_x of reference, observers and baselines, and below it what each is off by."""
    time, reference = data.log.time, data.log.reference.get("vx")
    values = [(style, data.baselines[name]) for name, style in BASELINES.items()]
    if data.replay is not None:
        values.append((ESTIMATE, data.replay.velocity))
    if data.chain is not None:
        values.append((PIPELINE, data.chain.vx))
    lines: list[Mark] = [style(time, value) for style, value in values]
    panels = [("longitudinal velocity [m/s]", lines)]
    if reference is not None:
        lines.insert(0, REFERENCE(time, reference))
        errors: list[Mark] = [*(style(time, v - reference) for style, v in values), ZERO]
        if data.chain is not None:
            errors = [*_band(time, data.chain.vx - reference, data.chain.vx_deviation), *errors]
        panels.append(("estimate − reference [m/s]", errors))
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

    return _corners(data, "slip", "slip ratio from the velocity at the centre of gravity", "slip ratio [1]", corner)


def forces(data: DriveData) -> Figure:
    """Longitudinal force of each corner as fed to the observers, and the measured one where the log has it."""
    scale, unit = _force_unit(data.inputs.force)

    def corner(k: int) -> list[Mark]:
        marks = _measured(data, f"force_x_{CORNERS[k]}", scale)
        marks.append(ESTIMATE(data.log.time, data.inputs.force[:, k] / scale, label="observer input"))
        if data.chain is not None:
            value, deviation = data.chain.force_x[:, k] / scale, data.chain.force_x_deviation[:, k] / scale
            marks += [*_band(data.log.time, value, deviation), PIPELINE(data.log.time, value)]
        return marks

    sources = ", ".join(sorted(set(data.inputs.force_sources)))
    return _corners(data, "forces", f"longitudinal force ({sources})", f"longitudinal force [{unit}]", corner)


def lateral(data: DriveData, chain: Chain) -> Figure:
    """V_y and sideslip angle of the pipeline, and of the corner observers and the sideslip part where they run."""
    time, reference = data.log.time, data.log.reference
    sideways, angles = _band(time, chain.vy, chain.vy_deviation), list[Mark]()
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
    panels = [("lateral velocity [m/s]", sideways), ("sideslip angle [deg]", angles)]
    return _stacked(data, "lateral", "lateral motion at the centre of gravity", panels)


def axle_forces(data: DriveData, chain: Chain) -> Figure:
    """F_y of each axle, and what its share of m a_y is."""
    time, rigid = data.log.time, evaluation.quasi_static_axle_forces(data.log, data.drive)
    scale, unit = _force_unit(chain.axle_force_y)
    panels = []
    for k, axle in enumerate(AXLES):
        reference = evaluation.reference_axle_force(data.log, axle)
        marks: list[Mark] = [] if reference is None else [REFERENCE(time, reference / scale)]
        value, deviation = chain.axle_force_y[:, k] / scale, chain.axle_force_y_deviation[:, k] / scale
        marks = [*_band(time, value, deviation), *marks, QUASI_STATIC(time, rigid[:, k] / scale), PIPELINE(time, value)]
        panels.append((f"lateral force [{unit}]", marks))
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

    return _corners(data, "loads", "vertical load of the wheels", "vertical load [kN]", corner)


def _band(time: FloatArray, value: FloatArray, deviation: FloatArray) -> list[Mark]:
    """Two standard deviations to either side, where any are stated."""
    return [TWO_SIGMA(time, value - 2.0 * deviation, value + 2.0 * deviation)] if np.isfinite(deviation).any() else []


def _axis(label: str, marks: Sequence[Mark]) -> Axis:
    """As far as the curves go, and of the bands so much as leaves the curves readable."""
    curves, bands = (_ends(marks, kind) for kind in (Line, Band))
    if bands is None or curves is None:
        return Axis(label)
    room = MOST_BAND * (curves[1] - curves[0]) or np.inf
    low, high = max(bands[0], curves[0] - room), min(bands[1], curves[1] + room)
    low, high = min(low, curves[0]), max(high, curves[1])
    edge = 0.04 * (high - low)
    return Axis(label, low - edge, high + edge)


def _ends(marks: Sequence[Mark], kind: type[Line | Band]) -> tuple[float, float] | None:
    """The smallest and the largest y of all marks of a kind."""
    found = [y for m in marks if isinstance(m, kind) for y in ((m.y,) if isinstance(m, Line) else (m.low, m.high))]
    values = np.concatenate([np.ravel(np.asarray(y, float)) for y in found]) if found else np.empty(0)
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if values.size else None


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
        [Panel(marks, "time [s]" if k == len(panels) - 1 else "", _axis(label, marks), titles[k] if titles else "")]
        for k, (label, marks) in enumerate(panels)
    ]
    return _figure(data, name, what, rows)


def _corners(data: DriveData, name: str, what: str, label: str, corner: Callable[[int], list[Mark]]) -> Figure:
    """Four panels, front above rear, left beside right."""
    marks = [corner(k) for k in range(4)]
    shared = _axis(label, [mark for own in marks for mark in own])
    rows = [
        [
            Panel(marks[k], "time [s]" if k > 1 else "", replace(shared, label="") if k % 2 else shared, TITLES[k])
            for k in row
        ]
        for row in ((0, 1), (2, 3))
    ]
    return _figure(data, name, what, rows, share_y=True)


def _figure(data: DriveData, name: str, what: str, rows: list[list[Panel]], share_y: bool = False) -> Figure:
    labels = {mark.label for row in rows for panel in row for mark in panel.marks if isinstance(mark, Line | Band)}
    title = f"{data.drive.name}: {what}"
    return Figure(
        name,
        title,
        f"Time histories of the {what}: {', '.join(sorted(labels))}.",
        rows,
        size=(9.0, 5.6 if len(rows) > 1 else 3.6), legend="below", columns=6, share_x="all",
        share_y="all" if share_y else "", title=title,
    )  # fmt: skip
