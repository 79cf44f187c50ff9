"""Figs 9, 10 and 12 on truth vehicles with compliant suspensions: the corner observers with and without (14), (15).

psi' is the velocity of the wheel against the body: V_xt of the wheel centre is that of the body plus psi'. P3 notes 3, 9 item 11.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.forces import LoadStep, VerticalLoads
from estimators.pipeline import CornerObservers, CornerSample, CornerStep, ScheduledCorners
from estimators.schedule import GainSchedule
from estimators.vehicle import CORNERS, VehicleParameters
from estimators.velocity import SlipWeights, SuspensionCompliance, side_slip_angle, slip_ratio
from estimators.velocity.corners import CornerVectors, tire_frame, vehicle_frame
from estimators.velocity.slip import LEAST_SPEED
from studies.papers.published import printed
from studies.papers.resilient_velocity.inputs import DIRECTIONS, PACKAGE, PRINTED
from studies.papers.resilient_velocity.vehicle import stribeck, table_of_estimator
from studies.plots import ZERO, Axis, Dash, Figure, Line, Mark, Panel
from studies.plots.colours import BLUE, GREY, ORANGE, RED
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import known_spread, nrms
from studies.trials.estimation import TEST_CAR, Reading, assumed_car, run_of, run_pipeline
from studies.trials.histories import estimate_lines, history, truth_line
from studies.trials.simulations import LUGRE, simulated_truth
from studies.truth import Measured, draw
from studies.truth.stepper import stepped_deflection

WITHOUT, PRINTED_WAY, INSIDE = "without", "as (15) is printed", "in the observer's input"
WAYS = (WITHOUT, PRINTED_WAY, INSIDE)


class CompliantStep(NamedTuple):
    """Per corner (..., 4, 2), x and y on the last axis, m/s; inside: of observers whose input has the wheel's acceleration."""

    vx: FloatArray  # (...) of the observers without compliance; what the pipeline compares with its own
    compliance: FloatArray  # psi' of (14), body frame
    relative: FloatArray  # V_r in the tire frame, without compliance
    centre: FloatArray  # velocity of the centre of gravity by each corner, without compliance
    relative_inside: FloatArray
    centre_inside: FloatArray  # psi' is still in it


class RecordedLoads(VerticalLoads):
    """Wheel loads whose last step can be read: the compliance needs forces in N, the corner observers get F/F_z."""

    load: FloatArray

    def step(self, *signals: Any) -> LoadStep:
        """As `VerticalLoads.step`."""
        found = super().step(*signals)
        self.load = found.load
        return found


class WithWheelMotion(ScheduledCorners):
    """Corner observers whose input also has the acceleration of the wheel against the body: u_q - psi_q''."""

    acceleration: FloatArray

    def step(self, sample: CornerSample) -> CornerStep:
        """As `ScheduledCorners.step`."""
        return super().step(sample._replace(relative_acceleration=sample.relative_acceleration - self.acceleration))


class CompliantCorners:
    """Two sets of corner observers with the shipped schedules of P3's tire, and one compliance model at every wheel.

    The model runs on the estimated forces, turned into the body frame as (15) needs them (the paper leaves the frame
    open).
    """

    def __init__(self, car: VehicleParameters, time: float, shape: tuple[int, ...], loads: RecordedLoads) -> None:
        self.batch_shape, self.sample_time, self.loads = shape, time, loads
        schedules = [GainSchedule.shipped(f"resilient-velocity-{d}") for d in DIRECTIONS]
        self.shifted = [WithWheelMotion(schedule, (*shape, 4)) for schedule in schedules]
        usual = [ScheduledCorners(schedule, (*shape, 4)) for schedule in schedules]
        self.kinds: list[list[ScheduledCorners]] = [usual, [*self.shifted]]
        self.sets = [CornerObservers(car, along, across, shape, SlipWeights()) for along, across in self.kinds]
        self.compliance = SuspensionCompliance(table_of_estimator(PRINTED), time, shape)

    def step(self, *signals: Any) -> CompliantStep:
        """One sample, as `CornerObservers.step`."""
        _, steer, ax, _, _, use_x, use_y, _ = signals
        load, total = self.loads.load, self.loads.load.sum(axis=-1, keepdims=True)
        # As the pipeline does for a stopped wheel.
        shared = self.sets[0].vehicle.mass * np.asarray(ax)[..., None] / total
        use_all = np.where(np.isfinite(use_x), use_x, shared)
        force = vehicle_frame(CornerVectors(use_all * load, use_y * load), steer)
        before = self.compliance.state[..., 1]
        rate = self.compliance.step(force.x, force.y).velocity
        acceleration = turned((rate - before) / self.sample_time, steer)
        for k, observer in enumerate(self.shifted):
            observer.acceleration = acceleration[..., k]
        steps = [corners.step(*signals) for corners in self.sets]
        found = list[FloatArray]()
        for kinds, step in zip(self.kinds, steps, strict=True):
            found.append(np.stack([kind.observer.state[..., 1] for kind in kinds], axis=-1))
            found.append(np.stack([step.corner_vx, step.corner_vy], axis=-1))
        return CompliantStep(steps[0].vx, rate, *found)


def turned(vector: FloatArray, steer: FloatArray) -> FloatArray:
    """(..., 4, 2) from the body frame into that of the tires."""
    return np.stack(tire_frame(CornerVectors(vector[..., 0], vector[..., 1]), steer), axis=-1)


def compliant_parts(car: VehicleParameters, time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """Parts of the pipeline."""
    loads = RecordedLoads(car, time, shape)
    return {"loads": loads, "corner_observers": CompliantCorners(car, time, shape, loads)}


@dataclass(frozen=True)
class ComplianceTrial:
    """S sensor draws x B runs over n samples; x and y of the tire frame on the last axis of what is per corner."""

    drawn: Measured
    slip: FloatArray  # V_r without compliance (S, B, n, 4, 2), m/s
    residual: Mapping[str, FloatArray]  # by way: measured minus calculated F/F_z (S, B, n, 4, 2)
    centre: Mapping[str, FloatArray]  # by way: V_x, V_y (S, B, n, 2), m/s
    compliance: FloatArray  # estimated psi' (S, B, n, 4, 2), m/s
    true_compliance: FloatArray  # (B, n, 4, 2) m/s


def run_trial(drawn: Measured) -> ComplianceTrial:
    """Estimate all runs of ``drawn`` and calculate the forces of every way: V_r = R_e w - V_xt - psi' with compliance."""
    forces = ("force_x", "force_y", "force_z")
    readings: dict[str, Reading] = {name: attrgetter(f"corners.{name}") for name in CompliantStep._fields[1:]}
    found = run_pipeline(drawn, readings | {name: attrgetter(name) for name in forces}, compliant_parts)
    relative, rate, truth = found["relative"], found["compliance"], drawn.truth
    rate_tire = turned(rate, drawn.signals["steer"])
    true_rate = np.stack([truth["compliance_x_rate"], truth["compliance_y_rate"]], axis=-1)
    slip = {WITHOUT: relative, PRINTED_WAY: relative - rate_tire, INSIDE: found["relative_inside"]}
    centre = {WITHOUT: found["centre"], PRINTED_WAY: found["centre"] + rate, INSIDE: found["centre_inside"] - rate}
    measured = np.stack([found["force_x"], found["force_y"]], axis=-1) / np.maximum(found["force_z"], 1.0)[..., None]
    calculated = model_force(drawn, np.stack([slip[way] for way in WAYS]))
    residual = {way: measured - force for way, force in zip(WAYS, calculated, strict=True)}
    # What each corner counts: the axle that slips less counts more, each wheel half of it.
    surface = assumed_car(drawn).radius * drawn.signals["wheel_speed"]
    along, across = surface - relative[..., 0], -relative[..., 1]
    slips = slip_ratio(surface, along), side_slip_angle(along, across)
    front = np.stack([SlipWeights().front(slip) for slip in slips], axis=-1)[..., None, :]
    shares = 0.5 * np.concatenate([front, front, 1.0 - front, 1.0 - front], axis=-2)
    mean = {way: np.einsum("...cd,...cd->...d", shares, value) for way, value in centre.items()}
    return ComplianceTrial(drawn, relative, residual, mean, rate_tire, turned(true_rate, truth["steer"]))


def model_force(drawn: Measured, slip: FloatArray) -> FloatArray:
    """F/F_z of the LuGre tire (1), (2) with Table I at slip velocities (..., S, B, n, 4, 2), m/s, each direction by itself.

    The road parameter is that of the truth: the paper does not say which one its tire model gets on ice and on dry road.
    Bristles are stepped exactly for slips held over a sample.
    """
    names, tires = ("sigma0", "sigma1", "sigma2", "kappa"), [PRINTED.parameters.tire[d] for d in DIRECTIONS]
    sigma0, sigma1, sigma2, kappa = (np.array([getattr(tire, name).value for tire in tires]) for name in names)
    road = drawn.truth["friction"][..., None]
    rolling = PRINTED.vehicle["effective_radius"] * np.abs(drawn.signals["wheel_speed"])[..., None]
    rate = kappa * rolling + sigma0 * np.abs(slip) / (road * stribeck(PRINTED, slip))
    out, z = np.empty_like(slip), np.zeros_like(slip[..., 0, :, :])
    for k in range(slip.shape[-3]):
        z, mean, speed = stepped_deflection(z, slip[..., k, :, :], rate[..., k, :, :], drawn.sample_time)
        out[..., k, :, :] = sigma0 * mean + sigma1 * speed
    return np.asarray(out + sigma2 * slip)


HARD = 500.0
"""N m at all wheels together, from which on traction counts as hard: the paper's word for where compliance helps."""


class Shown(NamedTuple):
    """A test of the paper, what it says of it, and the corners and the direction (0: along, 1: across) of its figure."""

    manoeuvre: str
    title: str
    statement: str
    corners: tuple[int, ...]
    direction: int


TESTS = (
    Shown("p3-launch-split", "harsh launch (Fig. 10)", "smaller with, in hard traction", (0, 1, 2, 3), 0),
    Shown("p3-acceleration-in-turn-dry", "acceleration in a turn (Fig. 12)", "curves alone", (0, 1), 1))  # fmt: skip
BOUNDS: tuple[float, float] = tuple(printed(PACKAGE, "P3-nrms"))
"""%, of V_x and V_y: the text of the paper."""
STYLES: tuple[tuple[str, Dash, float], ...] = ((GREY, "solid", 1.8), (RED, "dashed", 1.0), (BLUE, "solid", 0.9))
WAY_COLUMNS = ("without [%]", "as (15) is printed [%]", "in the input [%]")


def compliance_part(name: str, tests: Sequence[Shown], scope: Scope, tire: str = LUGRE) -> PartResult:
    """Every test with the three ways: forces and velocities."""
    truth = simulated_truth(tuple(test.manoeuvre for test in tests), tire, scope, seconds=4.0)
    trial = run_trial(draw(truth, TEST_CAR, range(scope.seeds)))
    forces, measures = residual_table(f"{name}-forces", trial, tests)
    figures = [residual_history(f"{name}-{test.manoeuvre}", trial, test) for test in tests]
    figures += [wheel_history(f"wheels-{test.manoeuvre}", trial, test) for test in tests if test.direction == 0]
    printed_way, inside = (sum(bool(row[forces.columns.index(f"smaller by {way}")]) for row in forces.rows)
                           for way in ("(15)", "the input"))  # fmt: skip
    note = (
        f"Of {len(forces.rows)} forces, (15) as it is printed makes {printed_way} agree better with the tire model, and psi'' in "
        f"the observers' input {inside}. (15) adds psi' to a velocity that it takes to be that of the body; but "
        "observers that are corrected by the force of the tire follow the slip of the wheel itself, so that psi' would count "
        "twice. In the input it is right for any gain."
    )
    return PartResult((), [forces, velocity_table(f"{name}-velocities", trial, tests)], figures, [note], measures)


def hard_traction(trial: ComplianceTrial, test: Shown) -> tuple[int, BoolArray]:
    """Row of the test, and its samples (n,) under drive torque and above the speed from which on slips mean something."""
    truth = trial.drawn.truth
    row, _ = run_of(truth, test.manoeuvre)
    fast = np.abs(truth["vx"][row]) >= LEAST_SPEED
    return row, truth.valid[row] & fast & (truth["torque"][row].sum(axis=-1) >= HARD)


def residual_table(name: str, trial: ComplianceTrial, tests: Sequence[Shown]) -> tuple[Table, dict[str, float]]:
    """Measured minus calculated F/F_z by corner and way, and how the two ways with compliance compare draw by draw."""
    rows, measures, truth = list[list[Cell]](), dict[str, float](), trial.drawn.truth
    for test in tests:
        row, hard = hard_traction(trial, test)
        for corner in test.corners:
            at = row, hard, corner
            each = slice(None), *at, test.direction
            force, load = (truth[key][at] for key in (("force_x", "force_y")[test.direction], "force_z"))
            peak = float(np.abs(force / np.maximum(load, 1.0)).max())
            error = {way: 100.0 * _rms(trial.residual[way][each]) / peak for way in WAYS}
            compliance = trial.true_compliance[each[1:]]
            changes = [known_spread(error[way] - error[WITHOUT]) for way in WAYS[1:]]
            missed = _rms(trial.compliance[each] - compliance).mean()
            rows.append([
                test.title, f"{DIRECTIONS[test.direction]}, {CORNERS[corner]}", round(peak, 3), test.statement,
                *(known_spread(error[way]).text() for way in WAYS),
                *(cell for change in changes for cell in (change.text(), change.high < 0.0)),
                round(float(_rms(compliance)), 4), round(float(missed), 4)])  # fmt: skip
            measures |= {f"{test.manoeuvre} {CORNERS[corner]} {way}": float(error[way].mean()) for way in WAYS}
    return Table(name,
        "Measured minus calculated normalised force, RMS in % of the peak of F/F_z under hard traction (drive torque above "
        f"{HARD:g} N m, V_x above {LEAST_SPEED:g} m/s): mean over {len(trial.drawn.seeds)} sensor draws with its 95 % "
        "confidence interval. Measured: the estimated forces; calculated: LuGre tire (1), (2) with Table I and the road's "
        "true friction at the observers' slip velocity - without compliance, with psi' taken from it as (15) is printed, and "
        "with psi'' in the input of the observers. Change: draw by draw, in percentage points; smaller: the interval lies "
        "below zero. The paper prints curves without numbers.",
        ("test", "force", "peak of F/F_z [1]", "the paper says", *WAY_COLUMNS, "change by (15) [points]", "smaller by (15)",
         "change by the input [points]", "smaller by the input", "RMS of psi' [m/s]", "RMS error of psi' [m/s]"),
        rows), measures  # fmt: skip


def _rms(error: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(error**2, axis=-1)))


def velocity_table(name: str, trial: ComplianceTrial, tests: Sequence[Shown]) -> Table:
    """V_x and V_y of the centre of gravity by way, and how the two ways with compliance change them draw by draw."""
    rows, truth = list[list[Cell]](), trial.drawn.truth
    for test in tests:
        row, samples = run_of(truth, test.manoeuvre)
        for k, signal in enumerate(("vx", "vy")[: test.direction + 1]):  # straight ahead no V_y to relate an error to
            true = truth[signal][row, samples]
            found = {way: nrms(trial.centre[way][:, row, samples, k], true) for way in WAYS}
            changes = [known_spread(found[way] - found[WITHOUT]).text(3) for way in WAYS[1:]]
            known: list[Cell] = [test.title, f"V_{signal[1]}", round(float(np.abs(true).max()), 3), BOUNDS[k]]
            rows.append([*known, *(known_spread(found[way]).text() for way in WAYS), *changes])
    return Table(name,
        "Velocity of the centre of gravity from the corner observers, NRMS in % of the peak as P1 (46): mean over "
        f"{len(trial.drawn.seeds)} sensor draws with its 95 % confidence interval. As (15) is printed, psi' is added on the way "
        "to the centre of gravity; with psi'' in the observers' input it is taken from the wheel centre's velocity. Changes "
        "against the observers without compliance, draw by draw. The paper's bounds are those of its text.",
        ("test", "signal", "peak [m/s]", "printed bound [%]", *WAY_COLUMNS, "change by (15) [points]",
         "change by the input [points]"), rows)  # fmt: skip


def residual_history(name: str, trial: ComplianceTrial, test: Shown) -> Figure:
    """Left: measured minus calculated F/F_z by way; right: psi' of the truth and of (14); a row a corner, first draw."""
    truth = trial.drawn.truth
    row, samples = run_of(truth, test.manoeuvre)
    time, axis, k = truth.time[samples], "xy"[test.direction], test.direction
    moving = np.abs(truth["vx"][row, samples]) >= LEAST_SPEED
    shown = trial.residual[WITHOUT][0, row, samples, :, k][moving][:, test.corners]
    limit = 1.2 * float(np.percentile(np.abs(shown), 99.0))  # all but the greatest hundredth of them
    rows = []
    for corner in test.corners:
        left: list[Mark] = [
            Line(time, np.where(moving, trial.residual[way][0, row, samples, corner, k], np.nan), way, *style)
            for way, style in zip(WAYS, STYLES, strict=True)
        ]
        right: list[Mark] = [
            truth_line(time, trial.true_compliance[row, samples, corner, k]),
            Line(time, trial.compliance[0, row, samples, corner, k], "(14) on estimated forces", ORANGE, width=0.9),
        ]
        x = Axis("time [s]" if corner == test.corners[-1] else "", margin=0.01)
        residual = Axis(f"$\\Delta f_{{n{axis}}}$ [1]", -limit, limit)
        rows.append([Panel([*left, ZERO], x, residual, CORNERS[corner]), Panel(right, x, f"$\\dot\\psi_{axis}$ [m/s]")])
    direction, size = DIRECTIONS[k], (9.4, 1.2 + 1.55 * len(test.corners))
    return Figure(name,
        f"{test.title}: {direction} force of the wheels, measured minus calculated, over the vertical load (left), "
        "with and without the suspension compliance, and the velocity of the wheel against the body (right). First sensor draw.",
        f"Rows of two panels over time, one for each corner: the difference of the {direction} forces for three ways of "
        "treating the compliance, and the wheel's velocity against the body with its estimate.",
        rows, size, "below", 5, "all")  # fmt: skip


def wheel_history(name: str, trial: ComplianceTrial, test: Shown) -> Figure:
    """Fig. 9: surface speed of each wheel, velocity of its centre, and what the observers without compliance make of it."""
    truth = trial.drawn.truth
    row, samples = run_of(truth, test.manoeuvre)
    time, radius = truth.time[samples], assumed_car(trial.drawn).radius
    panels = []
    for corner in range(4):
        surface = radius[corner] * trial.drawn.signals["wheel_speed"][:, row, samples, corner]
        centre = surface - trial.slip[:, row, samples, corner, 0]
        true = truth_line(time, truth["wheel_vx"][row, samples, corner])
        wheel = Line(time, surface[0], "$R_e\\omega$", GREY, width=0.8)
        marks = [true, wheel, *estimate_lines(time, centre, "$R_e\\omega-\\hat V_{rx}$", RED)]
        panels.append(Panel(marks, y="speed [m/s]" if corner % 2 == 0 else "", title=CORNERS[corner]))
    return history(name,
        f"{test.title.replace('10', '9')}: surface speed of the wheels, velocity of their centres along the car, and the corner "
        "observers' estimate of it, as Fig. 9 of P3. Lines: first sensor draw; band: 95 % of all draws. On ice the wheels spin "
        "and their observers follow them: what friction hides of the slip, no gain brings back.",
        "Four panels of speed over time: on the right side all lines agree, on the left the wheel's surface and its estimate "
        "run away from the car.",
        panels, (9.4, 5.4), columns=2, legend="below")  # fmt: skip
