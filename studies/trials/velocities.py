"""Table and figures of a paper's velocity errors: its own observers, our fusion and two baselines beside what it prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.pipeline import CornerObservers
from estimators.schedule import GainSchedule
from estimators.vehicle import CORNERS, VehicleParameters
from estimators.velocity import FusionSettings, SlipWeights, VelocityFusion
from studies.plots import Axis, Figure, Line, Mark, Panel, colours, dots
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import Spread, nrms, spread
from studies.trials.estimation import INTEGRATED, WHEELS, Parts, Reading, baselines, measured_runs, run_of, run_pipeline
from studies.trials.histories import error_dots, history, row_axis, truth_line
from studies.trials.simulations import LUGRE
from studies.truth import Truth
from synthesis.models.parameter_set import load_parameter_set

OWN, FUSION = "paper's observers", "fusion"
LOOKS = {
    OWN: ("s", colours.OWN_OBSERVERS), FUSION: ("o", colours.FUSION),
    WHEELS: ("^", colours.MEAN_WHEEL_SPEED), INTEGRATED: ("v", colours.INTEGRATED_ACCELERATION)}  # fmt: skip
COMPLIANCE_SPREAD = 0.2  # relative, of the fusion's slip compliances: as well as a fit to logged signals knows them
USED = 0.6  # largest F_y/F_z of the fit of the side slip curve: what a car shows on a dry road before it slides


@dataclass(frozen=True)
class VelocityTest:
    """A row of a paper's table of velocity errors: the manoeuvre here, its name there, NRMS in % and peaks in m/s."""

    manoeuvre: str
    title: str
    vx: float | None = None
    vx_peak: float | None = None
    vy: float | None = None
    vy_peak: float | None = None


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
        slip_compliance=along, slip_compliance_spread=COMPLIANCE_SPREAD * along,
        side_compliance=linear, side_compliance_spread=COMPLIANCE_SPREAD * linear,
        side_cubic=cubic, side_cubic_spread=cubic,  # the fusion does not know the friction of the road
    )  # fmt: skip

    def parts(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
        forward, sideways = (GainSchedule.shipped(f"{parameters}-{d}") for d in ("longitudinal", "lateral"))
        return {
            "corner_observers": CornerObservers(car, forward, sideways, shape, SlipWeights()),
            "velocity": VelocityFusion(car, sample_time, shape, settings),
        }

    return parts


READINGS: dict[str, Reading] = {
    "vx": lambda step: step.vx, "own_vx": lambda step: step.corners.vx,
    "vy": lambda step: step.vy, "own_vy": lambda step: step.corners.vy}  # fmt: skip
COLUMNS = (
    "manoeuvre", "signal", "peak [m/s]", "printed peak [m/s]", "printed NRMS [%]", "paper's observers NRMS [%]",
    "fusion NRMS [%]", "fusion, worst run [%]", "mean wheel speed NRMS [%]", "integrated acceleration NRMS [%]")  # fmt: skip


def velocity_part(name: str, rows: Sequence[VelocityTest], parts: Parts, scope: Scope, tire: str = LUGRE) -> PartResult:
    """Errors of every manoeuvre of ``rows`` over the seeds of ``scope``, beside the printed ones."""
    drawn = measured_runs([row.manoeuvre for row in rows], tire, scope)
    truth, estimates = drawn.truth, run_pipeline(drawn, READINGS, parts) | baselines(drawn)
    table, measures = list[list[Cell]](), dict[str, float]()
    found: dict[str, list[dict[str, Spread]]] = {"vx": [], "vy": []}
    for row in rows:
        run, samples = run_of(truth, row.manoeuvre)
        for signal, others in (("vx", {WHEELS: WHEELS, INTEGRATED: INTEGRATED}), ("vy", {})):
            true, keys = truth[signal][run, samples], {FUSION: signal, OWN: f"own_{signal}"} | others
            errors = {who: spread(nrms(estimates[key][:, run, samples], true)) for who, key in keys.items()}
            known = {who: error for who, error in errors.items() if error is not None}
            own, fused, *simple = (known[who].text() if who in known else None for who in LOOKS)
            worst = round(known[FUSION].worst, 2) if FUSION in known else None
            peaks = round(float(np.abs(true).max()), 3), getattr(row, f"{signal}_peak")
            table.append([row.title, f"V_{signal[1]}", *peaks, getattr(row, signal), own, fused, worst, *simple])
            measures |= {f"{row.manoeuvre} {signal} {who}": error.mean for who, error in known.items()}
            found[signal].append(known)
    caption = (
        f"Velocity errors on the truth vehicle ({' and '.join(sorted(set(truth.tires)))} tires), NRMS in % of the peak as P1 "
        f"(46): mean over {scope.seeds} sensor draws with its 95 % confidence interval. The printed values come from a test "
        "car on real roads; manoeuvres, speeds and frictions are those that the paper names, everything else is ours."
    )
    drawings = [_dots(f"{name}-errors", rows, found), *(_history(name, truth, row, estimates) for row in rows)]
    return PartResult((), [Table(f"{name}-errors", caption, COLUMNS, table)], drawings, measures=measures)


def _dots(name: str, rows: Sequence[VelocityTest], found: Mapping[str, Sequence[Mapping[str, Spread]]]) -> Figure:
    panels = []
    for signal, errors in found.items():
        marks, at = error_dots(errors, LOOKS), [k for k, row in enumerate(rows) if getattr(row, signal) is not None]
        if at:
            marks.append(dots([getattr(rows[k], signal) for k in at], at, "printed", colours.TRUTH, "|", 14.0))
        x = Axis(f"$V_{signal[1]}$ NRMS [% of the peak]", scale="log")
        panels.append(Panel(marks, x, row_axis([row.title for row in rows])))
    return Figure(name,
        "Velocity errors by manoeuvre, mean over the sensor draws with 95 % interval; bars: printed values of the paper's "
        "own car.",
        "Dot plot of normalised velocity errors of the paper's observers, the fusion and two baselines for every manoeuvre.",
        panels, size=(8.0, 1.6 + 0.45 * len(rows)), legend="below", columns=3, share_y="row")  # fmt: skip


def _history(name: str, truth: Truth, row: VelocityTest, estimates: Mapping[str, FloatArray]) -> Figure:
    run, samples = run_of(truth, row.manoeuvre)
    time = truth.time[samples]

    def line(key: str, who: str, width: float = 0.9) -> Mark:
        return Line(time, estimates[key][0, run, samples], who, LOOKS[who][1], width=width)

    panels = []
    for signal, first in (("vx", [line(WHEELS, WHEELS, 0.7)]), ("vy", [])):
        true = truth_line(time, truth[signal][run, samples])
        marks = [*first, true, line(f"own_{signal}", OWN), line(signal, FUSION)]
        panels.append(Panel(marks, y=f"$V_{signal[1]}$ [m/s]", legend="best" if signal == "vx" else "", columns=4))
    slips = [
        Line(time, 100.0 * truth["slip"][run, samples, k], corner, color, width=0.8)
        for k, (corner, color) in enumerate(zip(CORNERS, colours.CORNERS, strict=True))
    ]
    return history(f"{name}-{row.manoeuvre}",
        f"{row.title}: velocities at the centre of gravity and wheel slip, first sensor draw.",
        f"Time histories of longitudinal and lateral velocity with estimates, and of the four wheel slips, for {row.title}.",
        [*panels, Panel(slips, y="wheel slip [%]", legend="best", columns=4)], (8.0, 5.0))  # fmt: skip
