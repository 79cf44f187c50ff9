"""Launches of the truth vehicle on roads of falling friction: what the corner observers miss, what the fusion recovers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from estimators.arrays import FloatArray
from estimators.vehicle import GRAVITY
from studies.beyond.friction_floor.resting_tire import FRICTIONS, friction_curve, missed_share
from studies.papers.topic import Topic
from studies.plots import Axis, ErrorBars, Figure, Line, Mark, Panel
from studies.plots.colours import FUSION, INTEGRATED_ACCELERATION, MEAN_WHEEL_SPEED, OWN_OBSERVERS, ROADS
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import Spread, known_spread, nrms
from studies.trials.estimation import TEST_CAR, Reading, baselines, run_of, run_pipeline
from studies.trials.velocities import corner_observers
from studies.truth import Truth, draw, load_manoeuvre, simulate_manoeuvres
from studies.truth.road import Road
from synthesis.models.parameter_set import load_parameter_set

TOPIC = Topic("studies.beyond.friction_floor")
BEYOND = 1.15
"""Peak torque over what the road holds of sliding wheels: enough to leave static friction, mu_s/mu_c = 1.3, at the front."""
LEAST_SLIP = 0.01  # below it the slip velocity drowns in the noise of the wheel speeds and shares mean nothing
READINGS: dict[str, Reading] = {
    "fusion": lambda step: step.vx, "corner observers": lambda step: step.corners.vx,
    "relative": lambda step: step.corners.relative_velocity,
}  # fmt: skip
ESTIMATES = {
    "corner observers": OWN_OBSERVERS, "fusion": FUSION, "mean wheel speed": MEAN_WHEEL_SPEED,
    "integrated acceleration": INTEGRATED_ACCELERATION,
}  # fmt: skip
QUICK_SHARE = 0.5
"""Durations of a quick run, over those of the manoeuvre: the torque still changes slowly against the bristles."""


@cache
def launched(quick: bool) -> Truth:
    """One run for each friction, in this order, integrated together."""
    share, base = QUICK_SHARE if quick else 1.0, load_manoeuvre("floor-launch")
    car = base.truth_vehicle()
    grip = car.lugre.sliding * car.parameters.mass * GRAVITY * float(np.mean(car.parameters.radius))
    runs = []
    for friction in FRICTIONS:
        held, rise, fall = (piece.model_copy(update={"time": share * (piece.time or 0.0)}) for piece in base.torque)
        pieces = [held, rise.model_copy(update={"to": f"{BEYOND * friction * grip:.6g} N*m"}), fall]
        changes = {"name": f"floor-launch-{round(100 * friction)}", "road": Road(friction=friction), "torque": pieces}
        runs.append(base.model_copy(update=changes | {"duration": share * base.duration}))
    return simulate_manoeuvres(runs)


@dataclass(frozen=True)
class Launch:
    """One road: slips and shares over time of the first sensor draw, velocity errors over all draws."""

    friction: float
    time: FloatArray  # (n,)
    slip: FloatArray  # (n,) mean over the wheels, v_r/(R_e w)
    predicted: FloatArray  # (n,) share of the slip velocity missed, NaN at little slip
    missed: FloatArray  # (n,) mean over the draws
    errors: dict[str, Spread]


def launches(scope: Scope) -> list[Launch]:
    """The estimates on all roads, computed in one batch."""
    truth = launched(scope.quick)
    drawn = draw(truth, TEST_CAR, range(scope.seeds))
    estimates = run_pipeline(drawn, READINGS, corner_observers("corner-estimation"))
    velocities = estimates | baselines(drawn)
    tire, car = load_parameter_set("corner-estimation").tire["longitudinal"], truth.vehicles[0]
    found = []
    for friction, name in zip(FRICTIONS, truth.names, strict=True):
        row, samples = run_of(truth, name)
        speed, relative = truth["wheel_speed"][row, samples], truth["slip_velocity_x"][row, samples]
        slip = relative / np.maximum(car.parameters.radius * speed, 1.0)
        level = friction * friction_curve(car.lugre, relative)
        share = missed_share(tire, float(np.mean(car.parameters.radius)), speed, slip, level)
        total = np.where(np.abs(slip).mean(axis=1) > LEAST_SLIP, relative.sum(axis=1), np.nan)
        predicted = (share * relative).sum(axis=1) / total
        missed = (relative - estimates["relative"][:, row, samples].mean(axis=0)).sum(axis=1) / total
        true = truth["vx"][row, samples]
        errors = {who: known_spread(nrms(velocities[who][:, row, samples], true)) for who in ESTIMATES}
        found.append(Launch(friction, truth.time[samples], slip.mean(axis=1), predicted, missed, errors))
    return found


@TOPIC.part("launches", "Launches on five roads", 41.0)
def simulation(scope: Scope) -> PartResult:
    """The truth vehicle on five roads."""
    found, rows, slips, shares = launches(scope), list[list[Cell]](), list[Mark](), list[Mark]()
    for launch, colour in zip(found, ROADS, strict=True):
        known = np.isfinite(launch.predicted) & np.isfinite(launch.missed)
        own, fused = launch.errors["corner observers"], launch.errors["fusion"]
        percents = (launch.slip.max(), np.median(launch.predicted[known]), np.median(launch.missed[known]))
        errors = (launch.errors[name].text() for name in ESTIMATES)
        recovered = round(100 * (1 - fused.mean / own.mean), 1)
        rows.append([launch.friction, *(round(100 * float(x), 1) for x in percents), *errors, recovered])
        slips += [Line(launch.time, 100 * launch.slip, f"friction {launch.friction:g}", colour)]
        shares += [
            Line(launch.time, 100 * launch.predicted, color=colour, width=2.4, alpha=0.35),
            Line(launch.time, 100 * launch.missed, color=colour, width=1.0),
        ]
    columns = [
        "friction [1]", "largest mean slip [%]", "missed, closed form [%]", "missed, simulated [%]",
        *(f"{name} NRMS [%]" for name in ESTIMATES), "recovered by the fusion [%]",
    ]  # fmt: skip
    caption = (
        f"Launches of the truth vehicle on LuGre tires, {scope.seeds} sensor draws: median share of the slip velocity "
        "missed where slip exceeds 1 %, and velocity errors with 95 % interval. The last column is the error of the corner "
        "observers that the fusion removes."
    )
    measures = {f"recovered at friction {row[0]}": float(row[-1] or 0.0) for row in rows}
    over_time = Figure(
        "missed-over-time",
        "Launches on five roads. Below: what the corner observers miss of the slip velocity (thin), and the closed form at the "
        "slip and friction of the moment (wide), where slip exceeds 1 %.",
        "Time histories of wheel slip and of the missed share on five roads, measured lines on top of predicted ones.",
        [[Panel(slips, y="mean wheel slip [%]", legend="upper left", columns=3)],
         [Panel(shares, "time [s]", Axis("slip velocity missed [%]", 0, 110))]],
        (8.0, 5.2), share_x="all",
    )  # fmt: skip
    table = Table("launches", caption, columns, rows)
    return PartResult((), [table], [over_time, error_figure(found)], (), measures)


def error_figure(found: Sequence[Launch]) -> Figure:
    """Velocity errors by road."""
    marks, theta = list[Mark](), [launch.friction for launch in found]
    for name, colour in ESTIMATES.items():
        mean, low, high = np.array([[(e := launch.errors[name]).mean, e.low, e.high] for launch in found]).T
        marks += [Line(theta, mean, name, colour, marker="o")]
        marks += [ErrorBars(theta, mean, mean - low, high - mean, color=colour)]
    return Figure(
        "recovered",
        "Velocity errors of the same launches, mean over the sensor draws with 95 % interval: the corner observers stay near the "
        "mean wheel speed, the fusion does not.",
        "Errors over road friction for corner observers, fusion, mean wheel speed and integrated acceleration.",
        Panel(marks, "friction of the road [1]", Axis("$V_x$ NRMS [% of the peak]", scale="log"), legend="upper left"),
        (6.4, 4.0),
    )
