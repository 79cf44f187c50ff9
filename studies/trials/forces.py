"""Table and figure of a paper's force errors: its own observers and the pipeline's force, beside what it prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.pipeline import DifferentiatedPid
from estimators.vehicle import CORNERS, VehicleParameters
from studies.plots import Figure, Line, Panel, colours
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import nrms, spread
from studies.trials.estimation import Parts, Reading, measured_runs, run_of, run_pipeline
from studies.trials.histories import history
from studies.trials.simulations import LUGRE
from studies.truth import Truth

LEAST = 1000.0  # N: samples below it are left out, and a force that never reaches it has no row
AXLES = ("front axle", "rear axle")
SHOWN = (("F_x", "force_x", CORNERS), ("F_y", "axle_force_y", AXLES), ("F_z", "force_z", CORNERS))
READINGS: dict[str, Reading] = {
    "own": lambda step: step.wheels.force, "force_x": lambda step: step.force_x,
    "axle_force_y": lambda step: step.axle_force_y, "force_z": lambda step: step.force_z}  # fmt: skip


@dataclass(frozen=True)
class ForceTest:
    """A manoeuvre, its name in the paper, and the printed NRMS in % by (signal, place, method)."""

    manoeuvre: str
    title: str
    printed: Mapping[tuple[str, str, str], float] = field(default_factory=dict)


def differentiated_pid(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """Parts with the PID-type observer of P1 (2)-(8) at the wheels."""
    return {"longitudinal_force": DifferentiatedPid(car, sample_time, (*shape, 4))}


def force_part(
    name: str, rows: Sequence[ForceTest], methods: Mapping[str, Parts], scope: Scope, tire: str = LUGRE
) -> PartResult:
    """Every manoeuvre with each of the paper's wheel force observers in the pipeline; F_y and F_z from the first one."""
    drawn = measured_runs([row.manoeuvre for row in rows], tire, scope)
    truth = drawn.truth
    estimates = {method: run_pipeline(drawn, READINGS, parts) for method, parts in methods.items()}
    first = next(iter(estimates.values()))
    compared = {signal: {"pipeline": first[key]} for signal, key, _ in SHOWN}
    compared["F_x"] = {who: found["own"] for who, found in estimates.items()} | compared["F_x"]
    at_rest = truth.vehicles[0].parameters.static_loads
    compared["F_z"]["quasi-static"] = np.broadcast_to(at_rest, (1, *first["force_z"].shape[1:]))
    table, measures = list[list[Cell]](), dict[str, float]()
    for row in rows:
        run, samples = run_of(truth, row.manoeuvre)
        for signal, key, places in SHOWN:
            for k, where in enumerate(places):
                true = _true(truth, key, run)[samples, k]
                peak = round(float(np.abs(true).max()))
                for who, value in compared[signal].items():
                    error = spread(nrms(value[:, run, samples, k], true, LEAST))
                    if error is not None:
                        cells = (peak, row.printed.get((signal, where, who)), error.text(), round(error.worst, 2))
                        table.append([row.title, signal, where, who, *cells])
                        measures[f"{row.title}: {signal} {where}, {who}"] = error.mean
    caption = (
        f"Force errors on the truth vehicle, NRMS in % of the peak as P1 (46), where the force exceeds {LEAST:g} N: mean over "
        f"{scope.seeds} sensor draws with its 95 % confidence interval, and the worst draw. Quasi-static: the load at rest. "
        "The printed values come from a test car or another simulator.")  # fmt: skip
    columns = ("manoeuvre", "force", "place", "estimate", "peak [N]", "printed NRMS [%]", "NRMS [%]", "worst run [%]")
    drawings = [_history(name, truth, row, first) for row in rows]
    return PartResult((), [Table(f"{name}-errors", caption, columns, table)], drawings, measures=measures)


def _true(truth: Truth, key: str, run: int) -> FloatArray:
    """(n, k) N: of the corners, or of the axles for F_y."""
    if key == "axle_force_y":
        return np.asarray(truth["force_y"][run].reshape(-1, 2, 2).sum(axis=-1))
    return np.asarray(truth[key][run])


def _history(name: str, truth: Truth, row: ForceTest, estimates: Mapping[str, FloatArray]) -> Figure:
    run, samples = run_of(truth, row.manoeuvre)
    time = truth.time[samples]
    panels = []
    for signal, key, places in SHOWN:
        marks = []
        for k, (where, color) in enumerate(zip(places, colours.CORNERS, strict=False)):
            marks += [
                Line(time, 1e-3 * _true(truth, key, run)[samples, k], color=color, width=2.2, alpha=0.35),
                Line(time, 1e-3 * estimates[key][0, run, samples, k], where, color, width=0.8),
            ]
        panels.append(Panel(marks, y=f"${signal}$ [kN]", legend="best", columns=4))
    return history(f"{name}-{row.manoeuvre}",
        f"{row.title}: forces of the truth (wide) and of the pipeline (thin), first sensor draw.",
        f"Time histories of longitudinal, lateral and vertical tire forces with their estimates for {row.title}.",
        panels, (8.0, 5.6))  # fmt: skip
