"""Table I and Figs. 6 to 9 of P4 on a truth vehicle: both filters, what a car without them would say, and the pipeline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.forces import AttitudeObserver, VerticalLoads, levelled
from estimators.sideslip import FourWheel, FourWheelObserver, used_friction
from estimators.signals import FilteredDerivative
from estimators.vehicle import CORNERS, VehicleParameters
from studies.papers.ekf_ukf_lateral.accuracy import Row
from studies.plots import Axis, Dash, Figure, Level, Mark, Panel, colours, dots
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import ERROR_COLUMNS, SampleSpreads, known_spread, sample_errors, sample_spreads
from studies.trials.estimation import Reading, assumed_car, measured_runs, run_pipeline
from studies.trials.filter_inputs import PRINTED_TEST, SAMPLE_TIME, conditions, counted, front_steer, rear_speed
from studies.trials.histories import BANDS, dot_heights, error_dots, estimate_lines, history, row_axis, truth_line
from studies.trials.simulations import LUGRE
from studies.trials.tire_curve import USE, TireFacts, tire_facts
from studies.truth import Measured

EKF, UKF, PIPELINE = "EKF", "UKF", "pipeline"
AT_REST = ", stiffness at rest"
SHARE, NO_SLIP, STEADY = "m a_y shared by load", "no slip at the rear", "steady linear car"
READINGS: dict[str, Reading] = {"force_y": lambda step: step.force_y, "sideslip": lambda step: step.sideslip}
LOOKS = {
    EKF: ("s", colours.EXTENDED), UKF: ("o", colours.UNSCENTED), PIPELINE: ("D", colours.PIPELINE),
    SHARE: ("^", colours.STEADY), STEADY: ("v", colours.STEADY),
}  # fmt: skip
LINES: dict[str, tuple[Dash, float]] = {EKF: ("solid", 1.9), UKF: ("dashed", 0.9)}
QUICK_SECONDS = 6.5
_LAG = 0.1  # s, of the derivative of the speed
_Kind = Literal["extended", "unscented"]


@dataclass(frozen=True)
class FourWheelRun:
    """Estimates of S sensor draws of one run over n samples by who made them, beside the truth (n[, 4])."""

    drawn: Measured
    forces: dict[str, FloatArray]  # (S, n, 4) N, tire frame
    sideslip: dict[str, FloatArray]  # (S, n) rad
    loads: FloatArray  # (S, n, 4) N, of block 1
    counted: BoolArray  # (n,) samples that count in errors
    tire: TireFacts

    def true(self, signal: str) -> FloatArray:
        """A signal of the truth, (n,) or (n, 4)."""
        return np.asarray(self.drawn.truth[signal][0])

    def pair(self, k: int, who: str) -> tuple[FloatArray, FloatArray]:
        """Estimate (S, m) and truth (m,) of the force of corner k, of the sideslip for k = 4, at the samples that count."""
        if k < 4:
            return self.forces[who][:, self.counted, k], self.true("force_y")[self.counted, k]
        return self.sideslip[who][:, self.counted], self.true("sideslip")[self.counted]

    def errors(self, k: int) -> dict[str, SampleSpreads]:
        """Mean and standard deviation of (13) by estimate, of the quantity ``k`` as in `pair`."""
        return {who: sample_spreads(*self.pair(k, who)) for who in (self.forces if k < 4 else self.sideslip)}


def four_wheel_car(car: VehicleParameters, tire: TireFacts, at_rest: bool = False) -> FourWheel:
    """The truth's masses and lengths; of its tires the secant (or slope at rest), relaxation length and greatest friction."""
    front, rear = tire.slope if at_rest else tire.secant
    return FourWheel(
        car.mass, car.yaw_inertia, car.front_axle_distance, car.rear_axle_distance, 0.5 * (car.front_track + car.rear_track),
        front, rear, *tire.relaxation, friction=float(np.mean(tire.peak)),
    )  # fmt: skip


def level(drawn: Measured) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Block 1 of P4: wheel loads (S, B, n, 4) in N, and a_x, a_y (S, B, n) along the road without their share of gravity.

    The paper's own (earlier work) uses suspension deflections; here roll and pitch come from gyros led back by
    accelerometers, with the motion of the car from `rear_speed` and the yaw rate.
    """
    time, shape = drawn.sample_time, drawn.batch_shape
    car, speed = assumed_car(drawn), rear_speed(drawn)
    attitude, vertical = AttitudeObserver(time, shape), VerticalLoads(car, time, shape)
    slope = FilteredDerivative(time, _LAG, shape)
    loads, along, across = np.empty((*speed.shape, 4)), np.empty_like(speed), np.empty_like(speed)
    for k in range(drawn.time.size):
        v = speed[:, :, k]
        ax, ay, az, turn, rolling, pitching = (
            drawn.signals[name][:, :, k] for name in ("ax", "ay", "az", "yaw_rate", "roll_rate", "pitch_rate")
        )
        tilt = attitude.step(rolling, pitching, ax, ay, slope.step(v).derivative, v * turn, turn)
        loads[:, :, k] = vertical.step(ax, ay, az, tilt.pitch, tilt.roll).load
        along[:, :, k], across[:, :, k], _ = levelled(ax, ay, az, tilt.pitch, tilt.roll)
    return loads, along, across


def run_four_wheel(drawn: Measured) -> FourWheelRun:
    """Everything on the only run of ``drawn`` (at 100 Hz).

    Without a filter: m a_y shared by load; sideslip L_r r/V if the rear axle did not slip, and less m L_f a_y/(L C_r) if it did
    as a linear one does.
    """
    car, truth = assumed_car(drawn), drawn.truth
    speed, steer, (loads, ax, ay) = rear_speed(drawn), front_steer(drawn), level(drawn)
    friction = float(truth["friction"][0].mean())
    tire = tire_facts(truth.vehicles[0], truth.tires[0], float(truth["vx"][0].mean()), friction)
    yaw_rate = drawn.signals["yaw_rate"]
    measurement = np.stack([yaw_rate, speed, ax, ay], axis=-1)
    forces: dict[str, FloatArray] = {}
    sideslip: dict[str, FloatArray] = {}
    kinds: tuple[tuple[str, _Kind], ...] = ((EKF, "extended"), (UKF, "unscented"))
    for at_rest in (False, True):
        vehicle = four_wheel_car(car, tire, at_rest)
        for name, kind in kinds:
            label = name + AT_REST * at_rest
            forces[label], sideslip[label] = _observed(drawn, vehicle, kind, steer, loads, measurement)
    forces[SHARE] = (loads * (car.mass * ay / loads.sum(axis=-1))[..., None])[:, 0]
    free = car.rear_axle_distance * yaw_rate / np.maximum(speed, 1.0)
    slip = car.mass * car.front_axle_distance / (car.wheelbase * (2.0 * tire.secant[1])) * ay
    sideslip |= {NO_SLIP: free[:, 0], STEADY: (free - slip)[:, 0]}
    ours = run_pipeline(drawn, READINGS)
    forces[PIPELINE], sideslip[PIPELINE] = ours["force_y"][:, 0], ours["sideslip"][:, 0]
    return FourWheelRun(drawn, forces, sideslip, loads[:, 0], counted(drawn, 0), tire)


def _observed(
    drawn: Measured, vehicle: FourWheel, kind: _Kind, steer: FloatArray, loads: FloatArray, measurement: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Forces (S, n, 4) and sideslip (S, n); the filter starts straight ahead at the measured speed."""
    shape, samples = drawn.batch_shape, drawn.time.size
    observer = FourWheelObserver(vehicle, kind, shape, drawn.sample_time)
    start = np.zeros((*shape, 8))
    start[..., 1] = measurement[:, :, 0, 1]
    observer.reset(state=start)
    forces, sideslip = np.empty((shape[0], samples, 4)), np.empty((shape[0], samples))
    for k in range(samples):
        step = observer.step(steer[:, :, k], loads[:, :, k], measurement[:, :, k])
        forces[:, k], sideslip[:, k] = step.forces[:, 0], step.sideslip[:, 0]
    return forces, sideslip


def four_wheel_part(name: str, manoeuvre: str, printed: Sequence[Row], scope: Scope, tire: str = LUGRE) -> PartResult:
    """Both filters on one manoeuvre; ``printed`` are four force rows in the order of the corners, then sideslip."""
    run = run_four_wheel(measured_runs((manoeuvre,), tire, scope, QUICK_SECONDS, SAMPLE_TIME))
    found = [run.errors(k) for k in range(len(printed))]
    rows: list[list[Cell]] = []
    measures: dict[str, float] = {}
    for k, (row, errors) in enumerate(zip(printed, found, strict=True)):
        peak = float(np.abs(run.pair(k, EKF)[1]).max())
        about = (row.quantity, row.unit, row.largest, round(peak, 4) if peak < 1.0 else round(peak))
        for who, error in errors.items():
            rows.append([*about, who, *error.cells((row.mean.get(who.lower()), row.deviation.get(who.lower())))])
            measures |= error.measures(f"{row.quantity}, {who}")
    caption = f"Errors (13) of lateral forces and sideslip, in % of the peak. {_about(run)}"
    columns = ("quantity", "unit", "printed peak", "peak", "estimate", *ERROR_COLUMNS)
    drawings = [
        dot_figure(f"{name}-errors", printed, found),
        force_history(f"{name}-forces", run),
        sideslip_history(f"{name}-sideslip", run),
        used_friction_history(f"{name}-used-friction", run),
    ]
    tables = [Table(f"{name}-errors", caption, columns, rows), _difference(name, run, printed)]
    return PartResult(tables=tables, figures=drawings, measures=measures)


def _difference(name: str, run: FourWheelRun, printed: Sequence[Row]) -> Table:
    """How much worse the extended filter is, draw by draw: what both share cancels."""
    rows: list[list[Cell]] = []
    for k, row in enumerate(printed):
        extended, unscented = (sample_errors(*run.pair(k, who)) for who in (EKF, UKF))
        mean = known_spread(extended.mean(axis=1) - unscented.mean(axis=1)).text(3)
        deviation = known_spread(extended.std(axis=1) - unscented.std(axis=1)).text(3)
        own = (round(values["ekf"] - values["ukf"], 2) for values in (row.mean, row.deviation))
        rows.append([row.quantity, next(own), mean, next(own), deviation])
    return Table(
        f"{name}-difference",
        "How much larger the error of the extended filter is than that of the unscented one with the same model, noise and "
        f"start, in percentage points, compared draw by draw. {_about(run)}",
        ("quantity", "printed mean [points]", "mean [points]", "printed std [points]", "std [points]"), rows,
    )  # fmt: skip


def _about(run: FourWheelRun) -> str:
    tire = run.tire
    return (
        f"{conditions(run.drawn)} The filters believe the truth's masses and lengths, its relaxation length "
        f"({tire.relaxation[0]:.3g} m), its greatest friction ({np.mean(tire.peak):.2f}), and the secant of its tire at "
        f"{USE:g} of the static load ({tire.secant[0] / 1e3:.1f} and {tire.secant[1] / 1e3:.1f} kN/rad a tire){AT_REST}: the "
        f"slope at no slip instead ({tire.slope[0] / 1e3:.1f} and {tire.slope[1] / 1e3:.1f} kN/rad). {PRINTED_TEST}"
    )


def dot_figure(name: str, printed: Sequence[Row], found: Sequence[Mapping[str, SampleSpreads]]) -> Figure:
    """Means and deviations of every quantity beside the printed ones."""
    panels = []
    for title, key in (("mean", "mean"), ("standard deviation", "deviation")):
        marks = error_dots([{who: getattr(error, key) for who, error in errors.items()} for errors in found], LOOKS)
        for who in (EKF, UKF):
            own = [getattr(row, key)[who.lower()] for row in printed]
            heights, (marker, color) = dot_heights(range(len(printed)), who, LOOKS), LOOKS[who]
            marks.append(dots(own, heights, f"{who} as printed", color, marker, 8.0, hollow=True))
        x = Axis(f"{title} of the error (13) [% of the peak]", 0.0)
        panels.append(Panel(marks, x, row_axis([row.quantity for row in printed])))
    return Figure(
        name,
        "Errors of lateral forces and sideslip on the truth vehicle (filled, with 95 % confidence interval) and as printed "
        "(open). EKF and UKF have the same model, noise and start.",
        "Dot plot: mean and standard deviation of the error for four lateral forces and the sideslip, by estimate.",
        panels, size=(8.6, 4.4), legend="below", share_y="row",
    )  # fmt: skip


def _estimate(time: FloatArray, value: FloatArray, who: str) -> list[Mark]:
    label = {SHARE: "m a_y by load"}.get(who, who)
    return estimate_lines(time, value, label, LOOKS[who][1], *LINES.get(who, ()))


def _corners(run: FourWheelRun, marks: Sequence[Sequence[Mark]], label: str) -> list[Panel]:
    """A panel for each corner."""
    return [
        Panel(marks[k], y="" if k % 2 else label, title=corner, legend="" if k else "best", columns=2)
        for k, corner in enumerate(CORNERS)
    ]


def force_history(name: str, run: FourWheelRun) -> Figure:
    """Figs. 6 and 7: the four lateral forces."""
    time, true = run.drawn.truth.time, 1e-3 * run.true("force_y")
    shown = {who: 1e-3 * run.forces[who] for who in (EKF, UKF, PIPELINE)}
    marks = [
        [
            truth_line(time, true[:, k]),
            *(m for who, found in shown.items() for m in _estimate(time, found[:, :, k], who)),
        ]
        for k in range(4)
    ]
    return history(
        name,
        f"Figs. 6 and 7 of P4 on {run.drawn.truth.tires[0]} tires: lateral forces of the four wheels, positive to the left. "
        f"{BANDS}",
        "Four panels of lateral force over time, front wheels above, rear wheels below, with estimates of both filters.",
        _corners(run, marks, "$F_y$ [kN]"), (9.0, 5.4), columns=2, share_y="row",
    )  # fmt: skip


def sideslip_history(name: str, run: FourWheelRun) -> Figure:
    """Fig. 8."""
    time = run.drawn.truth.time
    found = [m for who in (STEADY, PIPELINE, EKF, UKF) for m in _estimate(time, np.degrees(run.sideslip[who]), who)]
    marks = [truth_line(time, np.degrees(run.true("sideslip"))), *found]
    return history(
        name,
        f"Fig. 8 of P4 on {run.drawn.truth.tires[0]} tires: sideslip at the centre of gravity, positive to the left. {BANDS}",
        "Sideslip over time: truth, both filters, the pipeline and the formula of a linear car in a steady turn.",
        [Panel(marks, y="sideslip [deg]", legend="best", columns=3)], (8.0, 3.2),
    )  # fmt: skip


def used_friction_history(name: str, run: FourWheelRun) -> Figure:
    """Fig. 9: F_y/F_z of (14), estimated force over estimated load."""
    time, limit = run.drawn.truth.time, float(np.mean(run.tire.peak))
    true = used_friction(run.true("force_y"), run.true("force_z"))
    found = used_friction(run.forces[UKF], run.loads)
    look: dict[str, Any] = {"color": colours.LIMIT, "dash": "dotted"}
    marks = [
        [truth_line(time, true[:, k]), *_estimate(time, found[:, :, k], UKF), Level(limit, label="limit", **look),
         Level(-limit, **look)]
        for k in range(4)
    ]  # fmt: skip
    return history(
        name,
        f"Fig. 9 of P4 on {run.drawn.truth.tires[0]} tires: used lateral friction (14) of the four wheels, and the greatest "
        "that the tire has.",
        "Four panels of lateral force over vertical load with the unscented filter's estimate and the friction limit.",
        _corners(run, marks, "$F_y/F_z$"), (9.0, 4.6), columns=2, share_y="all",
    )  # fmt: skip
