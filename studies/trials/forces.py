"""Table and figure of a paper's force errors: its own observers and the pipeline's force, beside what it prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from estimators.pipeline import DifferentiatedPid
from estimators.vehicle import CORNERS, VehicleParameters
from studies.plots import colours
from studies.study import Cell, Drawing, PartResult, Scope, Table
from studies.trials.accuracy import Spread, nrms, spread
from studies.trials.driven import LUGRE, driven
from studies.trials.play import QUICK_SECONDS, Parts, Reading, measured, play, run_of
from studies.trials.sensors import TEST_CAR
from studies.truth import Truth

Array = npt.NDArray[np.float64]
LEAST = 1000.0
"""N: samples below it are left out, and a force that never reaches it has no row."""
AXLES = ("front axle", "rear axle")
QUASI_STATIC = "quasi-static"
READINGS: dict[str, Reading] = {
    "own": lambda step: step.wheels.force,
    "force_x": lambda step: step.force_x,
    "axle_force_y": lambda step: step.axle_force_y,
    "force_z": lambda step: step.force_z,
}


@dataclass(frozen=True)
class Driven:
    """A manoeuvre, its name in the paper, and the printed NRMS in % by (signal, place, method)."""

    manoeuvre: str
    title: str
    printed: Mapping[tuple[str, str, str], float] = field(default_factory=dict)


def differentiated_pid(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """Parts with the PID-type observer of P1 (2)-(8) at the wheels."""
    return {"longitudinal_force": DifferentiatedPid(car, sample_time, (*shape, 4))}


def force_part(
    name: str, rows: Sequence[Driven], methods: Mapping[str, Parts], scope: Scope, tire: str = LUGRE
) -> PartResult:
    """Play every manoeuvre with each of the paper's wheel force observers in the pipeline; F_y and F_z from the first one."""
    truth = driven(tuple(row.manoeuvre for row in rows), tire, scope, QUICK_SECONDS)
    drawn = measured(truth, range(scope.seeds), TEST_CAR)
    played = {method: play(drawn, READINGS, parts) for method, parts in methods.items()}
    first = next(iter(played.values()))
    still = np.asarray(truth.vehicles[0].parameters.static_loads)
    table: list[list[Cell]] = []
    errors: dict[str, dict[str, Spread]] = {}
    for row in rows:
        place, samples = run_of(truth, row.manoeuvre)
        wanted = [
            ("F_x", corner, k, {m: p["own"] for m, p in played.items()} | {"pipeline": first["force_x"]})
            for k, corner in enumerate(CORNERS)
        ]
        wanted += [("F_y", axle, k, {"pipeline": first["axle_force_y"]}) for k, axle in enumerate(AXLES)]
        wanted += [("F_z", corner, k, {"pipeline": first["force_z"]}) for k, corner in enumerate(CORNERS)]
        for signal, where, k, estimates in wanted:
            true = _true(truth, signal, place, k)[samples]
            found = {who: spread(nrms(value[:, place, samples, k], true, LEAST)) for who, value in estimates.items()}
            if signal == "F_z":
                found[QUASI_STATIC] = spread(nrms(np.full((1, true.size), still[k]), true, LEAST))
            for who, value in found.items():
                if value is None:
                    continue
                printed = row.printed.get((signal, where, who))
                errors.setdefault(f"{row.title}: {signal}", {})[f"{where}, {who}"] = value
                table.append(
                    [
                        row.title,
                        signal,
                        where,
                        who,
                        round(float(np.abs(true).max())),
                        printed,
                        value.text(),
                        round(value.worst, 2),
                    ]
                )
    caption = (
        f"Force errors on the truth vehicle, NRMS in % of the peak as P1 (46), where the force exceeds {LEAST:g} N: mean over "
        f"{scope.seeds} sensor draws with its 95 % confidence interval, and the worst draw. Quasi-static: the load at rest. "
        "The printed values come from a test car or another simulator."
    )  # fmt: skip
    columns = ("manoeuvre", "force", "place", "estimate", "peak [N]", "printed NRMS [%]", "NRMS [%]", "worst run [%]")
    measures = {f"{title} {who}": value.mean for title, entries in errors.items() for who, value in entries.items()}
    drawings = [_history(name, truth, row, first) for row in rows]
    return PartResult(tables=[Table(f"{name}-errors", caption, columns, table)], drawings=drawings, measures=measures)


def _true(truth: Truth, signal: str, run: int, k: int) -> Array:
    """(n,) N: of a corner, or of an axle for F_y."""
    if signal == "F_y":
        return np.asarray(truth["force_y"][run, :, 2 * k : 2 * k + 2].sum(axis=1))
    return np.asarray(truth[{"F_x": "force_x", "F_z": "force_z"}[signal]][run, :, k])


def _history(name: str, truth: Truth, row: Driven, estimates: Mapping[str, Array]) -> Drawing:
    place, samples = run_of(truth, row.manoeuvre)
    time = truth.time[samples]
    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    shown = (("F_x", "force_x", CORNERS), ("F_y", "axle_force_y", AXLES), ("F_z", "force_z", CORNERS))
    for axes, (signal, key, places) in zip(panels, shown, strict=True):
        for k, (where, colour) in enumerate(zip(places, colours.CORNERS, strict=False)):
            axes.plot(time, 1e-3 * _true(truth, signal, place, k)[samples], color=colour, linewidth=2.2, alpha=0.35)
            axes.plot(time, 1e-3 * estimates[key][0, place, samples, k], color=colour, linewidth=0.8, label=where)
        axes.set_ylabel(f"${signal[0]}_{signal[2]}$ [kN]")
        axes.grid(alpha=0.25)
        axes.legend(ncols=4, fontsize="small", frameon=False)
    panels[-1].set_xlabel("time [s]")
    return Drawing(
        f"{name}-{row.manoeuvre}",
        f"{row.title}: forces of the truth (wide) and of the pipeline (thin), first sensor draw.",
        f"Time histories of longitudinal, lateral and vertical tire forces with their estimates for {row.title}.",
        figure,
    )
