"""Table I and Figs. 5 to 9 of P4 on a truth vehicle: both filters, what a car without them would say, and the pipeline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.forces import AttitudeObserver, VerticalLoads, levelled
from estimators.sideslip import FourWheel, FourWheelObserver, used_friction
from estimators.signals import FilteredDerivative
from estimators.vehicle import CORNERS, VehicleParameters
from studies.papers.ekf_ukf_lateral.accuracy import TABLE_1
from studies.plots import Axis, Dash, Figure, Level, Mark, Panel, colours, dots
from studies.study import Cell, PartResult, Scope, Table
from studies.trials import filter_inputs
from studies.trials.accuracy import ERROR_COLUMNS, SampleSpreads, known_spread, sample_errors, sample_spreads
from studies.trials.estimation import assumed_car, measured_runs, run_pipeline
from studies.trials.filter_inputs import PRINTED_TEST, SAMPLE_TIME, USE, TireFacts, conditions, tire_facts
from studies.trials.histories import BANDS, dot_heights, error_dots, estimate_lines, history, row_axis, truth_line
from studies.trials.motion import MotionTest, motion_part
from studies.trials.simulations import MAGIC_FORMULA, trial_part
from studies.truth import Measured

MANOEUVRE = "p4-bends-dry"
EKF, UKF, PIPELINE = "EKF", "UKF", "pipeline"
AT_REST = ", stiffness at rest"
SHARE, NO_SLIP, STEADY = "m a_y shared by load", "no slip at the rear", "steady linear car"
KINDS: dict[str, Literal["extended", "unscented"]] = {EKF: "extended", UKF: "unscented"}
LOOKS = {
    EKF: ("s", colours.EXTENDED), UKF: ("o", colours.UNSCENTED), PIPELINE: ("D", colours.PIPELINE),
    SHARE: ("^", colours.STEADY), STEADY: ("v", colours.STEADY)}  # fmt: skip
LINES: dict[str, tuple[Dash, float]] = {EKF: ("solid", 1.9), UKF: ("dashed", 0.9)}
QUICK_SECONDS = 6.5


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


def four_wheel_car(car: VehicleParameters, tire: TireFacts, at_rest: bool) -> FourWheel:
    """The truth's masses and lengths; of its tires the secant (or slope at rest), relaxation length and greatest friction."""
    front, rear = tire.slope if at_rest else tire.secant
    return FourWheel(
        car.mass, car.yaw_inertia, car.front_axle_distance, car.rear_axle_distance, 0.5 * (car.front_track + car.rear_track),
        front, rear, *tire.relaxation, friction=float(np.mean(tire.peak)))  # fmt: skip


def level(drawn: Measured) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Block 1 of P4: wheel loads (S, B, n, 4) in N, and a_x, a_y (S, B, n) along the road without their share of gravity.

    The paper's own (earlier work) uses suspension deflections; here roll and pitch come from gyros led back by
    accelerometers, with the motion of the car from `rear_speed` and the yaw rate.
    """
    time, shape, speed = drawn.sample_time, drawn.batch_shape, filter_inputs.rear_speed(drawn)
    attitude, vertical = AttitudeObserver(time, shape), VerticalLoads(assumed_car(drawn), time, shape)
    slope, names = FilteredDerivative(time, 0.1, shape), ("ax", "ay", "az", "yaw_rate", "roll_rate", "pitch_rate")
    loads, along, across = np.empty((*speed.shape, 4)), np.empty_like(speed), np.empty_like(speed)
    for k in range(drawn.time.size):
        v = speed[:, :, k]
        ax, ay, az, turn, rolling, pitching = (drawn.signals[name][:, :, k] for name in names)
        tilt = attitude.step(rolling, pitching, ax, ay, slope.step(v).derivative, v * turn, turn)
        loads[:, :, k] = vertical.step(ax, ay, az, tilt.pitch, tilt.roll).load
        along[:, :, k], across[:, :, k], _ = levelled(ax, ay, az, tilt.pitch, tilt.roll)
    return loads, along, across


def run_four_wheel(drawn: Measured) -> FourWheelRun:
    """Everything on the only run of ``drawn`` (at 100 Hz); the filters start straight ahead at the measured speed.

    Without a filter: m a_y shared by load; sideslip L_r r/V if the rear axle did not slip, and less m L_f a_y/(L C_r) if it did
    as a linear one does.
    """
    car, truth, shape = assumed_car(drawn), drawn.truth, drawn.batch_shape
    speed, steer, (loads, ax, ay) = filter_inputs.rear_speed(drawn), filter_inputs.front_steer(drawn), level(drawn)
    friction = float(truth["friction"][0].mean())
    tire = tire_facts(truth.vehicles[0], truth.tires[0], float(truth["vx"][0].mean()), friction)
    yaw_rate = drawn.signals["yaw_rate"]
    measurement = np.stack([yaw_rate, speed, ax, ay], axis=-1)
    start = np.zeros((*shape, 8))
    start[..., 1] = speed[:, :, 0]
    forces, sideslip = dict[str, FloatArray](), dict[str, FloatArray]()
    for at_rest in (False, True):
        for who, kind in KINDS.items():
            observer = FourWheelObserver(four_wheel_car(car, tire, at_rest), kind, shape, drawn.sample_time)
            observer.reset(state=start)
            force, slip = np.empty_like(loads[:, 0]), np.empty_like(speed[:, 0])
            for k in range(drawn.time.size):
                step = observer.step(steer[:, :, k], loads[:, :, k], measurement[:, :, k])
                force[:, k], slip[:, k] = step.forces[:, 0], step.sideslip[:, 0]
            forces[who + AT_REST * at_rest], sideslip[who + AT_REST * at_rest] = force, slip
    forces[SHARE] = (loads * (car.mass * ay / loads.sum(axis=-1))[..., None])[:, 0]
    free = car.rear_axle_distance * yaw_rate / np.maximum(speed, 1.0)
    slipping = car.mass * car.front_axle_distance / (car.wheelbase * (2.0 * tire.secant[1])) * ay
    ours = run_pipeline(drawn, {"force_y": lambda step: step.force_y, "sideslip": lambda step: step.sideslip})
    forces[PIPELINE] = ours["force_y"][:, 0]
    sideslip |= {NO_SLIP: free[:, 0], STEADY: (free - slipping)[:, 0], PIPELINE: ours["sideslip"][:, 0]}
    return FourWheelRun(drawn, forces, sideslip, loads[:, 0], filter_inputs.counted(drawn, 0), tire)


def four_wheel_part(name: str, scope: Scope, tire: str) -> PartResult:
    """Both filters beside Table I, whose rows are four forces in the order of the corners, then sideslip."""
    run = run_four_wheel(measured_runs((MANOEUVRE,), tire, scope, QUICK_SECONDS, SAMPLE_TIME))
    found = [run.errors(k) for k in range(len(TABLE_1))]
    rows, differences = list[list[Cell]](), list[list[Cell]]()
    measures: dict[str, float] = {}
    for k, (row, errors) in enumerate(zip(TABLE_1, found, strict=True)):
        peak = float(np.abs(run.pair(k, EKF)[1]).max())
        about = (row.quantity, row.unit, row.largest, round(peak, 4) if peak < 1.0 else round(peak))
        for who, error in errors.items():
            rows.append([*about, who, *error.cells((row.mean.get(who.lower()), row.deviation.get(who.lower())))])
            measures |= error.measures(f"{row.quantity}, {who}")
        extended, unscented = (
            sample_errors(*run.pair(k, who)) for who in KINDS
        )  # draw by draw: what both share cancels
        mean = known_spread(extended.mean(axis=1) - unscented.mean(axis=1)).text(3)
        deviation = known_spread(extended.std(axis=1) - unscented.std(axis=1)).text(3)
        own, own_deviation = (round(values["ekf"] - values["ukf"], 2) for values in (row.mean, row.deviation))
        differences.append([row.quantity, own, mean, own_deviation, deviation])
    known = run.tire
    about_run = (
        f"{conditions(run.drawn)} The filters believe the truth's masses and lengths, its relaxation length "
        f"({known.relaxation[0]:.3g} m), its greatest friction ({np.mean(known.peak):.2f}), and the secant of its tire at "
        f"{USE:g} of the static load ({known.secant[0] / 1e3:.1f} and {known.secant[1] / 1e3:.1f} kN/rad a tire){AT_REST}: the "
        f"slope at no slip instead ({known.slope[0] / 1e3:.1f} and {known.slope[1] / 1e3:.1f} kN/rad). {PRINTED_TEST}"
    )
    tables = [
        Table(f"{name}-errors", f"Errors (13) of lateral forces and sideslip, in % of the peak. {about_run}",
              ("quantity", "unit", "printed peak", "peak", "estimate", *ERROR_COLUMNS), rows),
        Table(f"{name}-difference",
              "How much larger the error of the extended filter is than that of the unscented one with the same model, noise and "
              f"start, in percentage points, compared draw by draw. {about_run}",
              ("quantity", "printed mean [points]", "mean [points]", "printed std [points]", "std [points]"),
              differences)]  # fmt: skip
    return PartResult((), tables, [dot_figure(f"{name}-errors", found), *histories(name, run)], measures=measures)


def dot_figure(name: str, found: Sequence[Mapping[str, SampleSpreads]]) -> Figure:
    """Means and deviations of every quantity beside the printed ones."""
    panels, rows = [], row_axis([row.quantity for row in TABLE_1])
    for title, key in (("mean", "mean"), ("standard deviation", "deviation")):
        marks = error_dots([{who: getattr(error, key) for who, error in errors.items()} for errors in found], LOOKS)
        for who in KINDS:
            own = [getattr(row, key)[who.lower()] for row in TABLE_1]
            heights = dot_heights(range(len(found)), who, LOOKS)
            marks.append(dots(own, heights, f"{who} as printed", LOOKS[who][1], LOOKS[who][0], 8.0, hollow=True))
        panels.append(Panel(marks, Axis(f"{title} of the error (13) [% of the peak]", 0.0), rows))
    return Figure(name,
        "Errors of lateral forces and sideslip on the truth vehicle (filled, with 95 % confidence interval) and as printed "
        "(open). EKF and UKF have the same model, noise and start.",
        "Dot plot: mean and standard deviation of the error for four lateral forces and the sideslip, by estimate.",
        panels, size=(8.6, 4.4), legend="below", share_y="row")  # fmt: skip


def histories(name: str, run: FourWheelRun) -> list[Figure]:
    """Figs. 6 and 7, the four lateral forces; Fig. 8, sideslip; Fig. 9, F_y/F_z of (14): estimated force over estimated load."""
    time, limit, on = run.drawn.truth.time, float(np.mean(run.tire.peak)), f"on {run.drawn.truth.tires[0]} tires"

    def shown(truth: FloatArray, estimates: Mapping[str, FloatArray]) -> list[Mark]:
        marks: list[Mark] = [truth_line(time, truth)]
        for who, value in estimates.items():
            marks += estimate_lines(time, value, who, LOOKS[who][1], *LINES.get(who, ()))
        return marks

    def corners(label: str, truth: FloatArray, estimates: Mapping[str, FloatArray], *levels: Mark) -> list[Panel]:
        panels = []
        for k, corner in enumerate(CORNERS):
            marks = [*shown(truth[:, k], {who: value[:, :, k] for who, value in estimates.items()}), *levels]
            panels.append(Panel(marks, y="" if k % 2 else label, title=corner, legend="" if k else "best", columns=2))
        return panels

    slips = {who: np.degrees(run.sideslip[who]) for who in (STEADY, PIPELINE, EKF, UKF)}
    used, seen = used_friction(run.true("force_y"), run.true("force_z")), used_friction(run.forces[UKF], run.loads)
    limits = [Level(y, label=text, color=colours.LIMIT, dash="dotted") for y, text in ((limit, "limit"), (-limit, ""))]
    return [
        history(f"{name}-forces",
            f"Figs. 6 and 7 of P4 {on}: lateral forces of the four wheels, positive to the left. {BANDS}",
            "Four panels of lateral force over time, front wheels above, rear wheels below, with estimates of both filters.",
            corners("$F_y$ [kN]", 1e-3 * run.true("force_y"), {w: 1e-3 * run.forces[w] for w in (EKF, UKF, PIPELINE)}),
            (9.0, 5.4), columns=2, share_y="row"),
        history(f"{name}-sideslip",
            f"Fig. 8 of P4 {on}: sideslip at the centre of gravity, positive to the left. {BANDS}",
            "Sideslip over time: truth, both filters, the pipeline and the formula of a linear car in a steady turn.",
            [Panel(shown(np.degrees(run.true("sideslip")), slips), y="sideslip [deg]", legend="best", columns=3)], (8.0, 3.2)),
        history(f"{name}-used-friction",
            f"Fig. 9 of P4 {on}: used lateral friction (14) of the four wheels, and the greatest that the tire has.",
            "Four panels of lateral force over vertical load with the unscented filter's estimate and the friction limit.",
            corners("$F_y/F_z$", used, {UKF: seen}, *limits), (9.0, 4.6), columns=2, share_y="all")]  # fmt: skip


MOTION = (MotionTest(MANOEUVRE, "Right, left and right bend, dry (Fig. 5)", course=True),)
PARTS = (
    trial_part("table-1-driven", "Table I on the truth vehicle", partial(four_wheel_part, "bends"), 53.0, quick=True),
    trial_part("table-1-other-tire", "Table I on a tire with another shape: Magic Formula with slip lag",
               partial(four_wheel_part, "bends-other-tire"), 53.0, MAGIC_FORMULA),
    trial_part("motion", "Fig. 5 on the truth vehicle: path, speed, steering, g-g diagram",
               partial(motion_part, "motion", MOTION), 5.0))  # fmt: skip
