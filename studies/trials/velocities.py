"""Table and figures of a paper's velocity errors: its own observers, our fusion and two baselines beside what it prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from estimators.pipeline import CornerObservers
from estimators.schedule import GainSchedule
from estimators.vehicle import VehicleParameters
from estimators.velocity import FusionSettings, SlipWeights, VelocityFusion
from studies.plots import colours
from studies.study import Cell, Drawing, PartResult, Scope, Table
from studies.trials.accuracy import Spread, nrms, spread
from studies.trials.driven import LUGRE, driven
from studies.trials.play import QUICK_SECONDS, Parts, Reading, baselines, measured, play, run_of
from studies.trials.sensors import TEST_CAR
from studies.truth import Measured
from synthesis.models.parameter_set import load_parameter_set

Array = npt.NDArray[np.float64]
OWN, FUSION = "paper's observers", "fusion"
WHEELS, INTEGRATED = "mean wheel speed", "integrated acceleration"


@dataclass(frozen=True)
class Printed:
    """A row of a paper's table of velocity errors: the manoeuvre here, its name there, NRMS in % and peaks in m/s."""

    manoeuvre: str
    title: str
    vx: float | None = None
    vx_peak: float | None = None
    vy: float | None = None
    vy_peak: float | None = None


TOLD = 0.2
"""Relative spread of the slip compliances that the fusion is told: as well as a fit to a drive knows them."""


USED = 0.6
"""Largest F_y/F_z of the fit of the side slip curve: what a car shows on a dry road before it slides."""


def side_slip_curve(compliance: float) -> tuple[float, float]:
    """c_1, c_3 in rad of alpha = c_1 mu + c_3 mu^3, least squares up to `USED`, of a bristle tire on a dry road.

    Steady bristles on a road of friction 1 without Stribeck effect carry mu = alpha/(c + alpha): alpha = c mu/(1 - mu).
    """
    mu = np.linspace(0.0, USED, 61)
    c1, c3 = np.linalg.lstsq(np.stack([mu, mu**3], axis=1), compliance * mu / (1.0 - mu), rcond=None)[0]
    return float(c1), float(c3)


def corner_observers(parameters: str) -> Parts:
    """Parts that know the tires of a shipped parameter set: the corner observers of its two schedules, and the fusion."""
    tires = load_parameter_set(parameters).tire
    along, across = (tires[d].kappa.value / tires[d].sigma0.value for d in ("longitudinal", "lateral"))
    linear, cubic = side_slip_curve(across)
    settings = FusionSettings(
        slip_compliance=along,
        slip_compliance_spread=TOLD * along,
        side_compliance=linear,
        side_compliance_spread=TOLD * linear,
        side_cubic=cubic,
        side_cubic_spread=cubic,  # friction of the road is not told
    )

    def parts(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
        forward, sideways = (GainSchedule.shipped(f"{parameters}-{d}") for d in ("longitudinal", "lateral"))
        return {
            "corner_observers": CornerObservers(car, forward, sideways, shape, SlipWeights()),
            "velocity": VelocityFusion(car, sample_time, shape, settings),
        }

    return parts


READINGS: dict[str, Reading] = {
    "vx": lambda step: step.vx,
    "vy": lambda step: step.vy,
    "own_vx": lambda step: step.corners.vx,
    "own_vy": lambda step: step.corners.vy,
}
COLUMNS = (
    "manoeuvre", "signal", "peak [m/s]", "printed peak [m/s]", "printed NRMS [%]", "paper's observers NRMS [%]",
    "fusion NRMS [%]", "fusion, worst run [%]", "mean wheel speed NRMS [%]", "integrated acceleration NRMS [%]",
)  # fmt: skip


def velocity_part(name: str, rows: Sequence[Printed], parts: Parts, scope: Scope, tire: str = LUGRE) -> PartResult:
    """Play every manoeuvre of ``rows`` for the seeds of ``scope`` and put the errors beside the printed ones."""
    truth = driven(tuple(row.manoeuvre for row in rows), tire, scope, QUICK_SECONDS)
    drawn = measured(truth, range(scope.seeds), TEST_CAR)
    estimates = play(drawn, READINGS, parts)
    others = baselines(drawn)
    table: list[list[Cell]] = []
    measures: dict[str, float] = {}
    means: dict[str, dict[str, Spread]] = {}
    for row in rows:
        place, samples = run_of(truth, row.manoeuvre)
        for signal, printed, peak in (("vx", row.vx, row.vx_peak), ("vy", row.vy, row.vy_peak)):
            true = truth[signal][place, samples]
            found = {FUSION: estimates[signal], OWN: estimates[f"own_{signal}"]}
            found |= others if signal == "vx" else {}
            errors = {who: spread(nrms(value[:, place, samples], true)) for who, value in found.items()}
            known = {who: value for who, value in errors.items() if value is not None}
            means[f"{row.title}: {signal}"] = known
            table.append(
                [
                    row.title, f"V_{signal[1]}", round(float(np.abs(true).max()), 3), peak, printed,
                    *(known[who].text() if who in known else None for who in (OWN, FUSION)),
                    round(known[FUSION].worst, 2) if FUSION in known else None,
                    *(known[who].text() if who in known else None for who in (WHEELS, INTEGRATED)),
                ]
            )  # fmt: skip
            measures |= {f"{row.manoeuvre} {signal} {who}": value.mean for who, value in known.items()}
    caption = (
        f"Velocity errors on the truth vehicle ({' and '.join(sorted(set(truth.tires)))} tires), NRMS in % of "
        "the peak as P1 (46): "
        f"mean over {scope.seeds} sensor draws with its 95 % confidence interval. The printed values come "
        "from a test car on real "
        "roads; manoeuvres, speeds and frictions are those that the paper names, everything else is ours."
    )
    drawings = [
        _dots(f"{name}-errors", rows, means),
        *(_history(name, drawn, row, estimates, others) for row in rows),
    ]
    return PartResult(tables=[Table(f"{name}-errors", caption, COLUMNS, table)], drawings=drawings, measures=measures)


STYLE = {
    OWN: ("s", colours.OWN_OBSERVERS),
    FUSION: ("o", colours.FUSION),
    WHEELS: ("^", colours.MEAN_WHEEL_SPEED),
    INTEGRATED: ("v", colours.INTEGRATED_ACCELERATION),
}


def _dots(name: str, rows: Sequence[Printed], means: Mapping[str, Mapping[str, Spread]]) -> Drawing:
    figure = Figure(figsize=(8.0, 1.6 + 0.45 * len(rows)), layout="constrained")
    for axes, signal in zip(figure.subplots(1, 2, sharey=True), ("vx", "vy"), strict=True):
        for y, row in enumerate(rows):
            for who, value in means[f"{row.title}: {signal}"].items():
                marker, colour = STYLE[who]
                ends = [[value.mean - value.low], [value.high - value.mean]]
                label = who if y == 0 else None
                axes.errorbar(
                    value.mean,
                    y,
                    xerr=ends,
                    fmt=marker,
                    color=colour,
                    markersize=5,
                    capsize=2,
                    linewidth=1,
                    label=label,
                )
            printed = getattr(row, signal)
            if printed is not None:
                axes.plot(printed, y, "k|", markersize=14, markeredgewidth=2, label="printed" if y == 0 else None)
        axes.set_xscale("log")
        axes.set_xlabel(f"$V_{signal[1]}$ NRMS [% of the peak]")
        axes.grid(axis="x", which="both", alpha=0.25)
    first = figure.axes[0]
    first.set_yticks(range(len(rows)), [row.title for row in rows])
    first.set_ylim(len(rows) - 0.5, -0.5)
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return Drawing(
        name,
        "Velocity errors by manoeuvre, mean over the sensor draws with 95 % interval; bars: printed values "
        "of the paper's own car.",
        "Dot plot of normalised velocity errors of the paper's observers, the fusion and two baselines for every manoeuvre.",
        figure,
    )


def _history(
    name: str, drawn: Measured, row: Printed, estimates: Mapping[str, Array], others: Mapping[str, Array]
) -> Drawing:
    truth = drawn.truth
    place, samples = run_of(truth, row.manoeuvre)
    time = truth.time[samples]
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    for axes, signal in ((top, "vx"), (middle, "vy")):
        axes.plot(time, truth[signal][place, samples], color="black", linewidth=1.6, label="truth")
        axes.plot(time, estimates[f"own_{signal}"][0, place, samples], color=STYLE[OWN][1], linewidth=0.9, label=OWN)
        axes.plot(time, estimates[signal][0, place, samples], color=STYLE[FUSION][1], linewidth=0.9, label=FUSION)
        axes.set_ylabel(f"$V_{signal[1]}$ [m/s]")
    top.plot(time, others[WHEELS][0, place, samples], color=STYLE[WHEELS][1], linewidth=0.7, label=WHEELS, zorder=0)
    bottom.plot(time, 100.0 * truth["slip"][place, samples], linewidth=0.8, label=["fl", "fr", "rl", "rr"])
    bottom.set_ylabel("wheel slip [%]")
    bottom.set_xlabel("time [s]")
    for axes in (top, middle, bottom):
        axes.grid(alpha=0.25)
    top.legend(ncols=4, fontsize="small", frameon=False, loc="best")
    bottom.legend(ncols=4, fontsize="small", frameon=False, loc="best")
    return Drawing(
        f"{name}-{row.manoeuvre}",
        f"{row.title}: velocities at the centre of gravity and wheel slip, first sensor draw.",
        f"Time histories of longitudinal and lateral velocity with estimates, and of the four wheel slips, for {row.title}.",
        figure,
    )
