"""Tables 1 to 5 and Figs. 5 to 8 and 12 to 18 on the truth vehicle: slalom and roundabout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.sideslip import SingleTrack
from estimators.vehicle import VehicleParameters
from studies.papers.smo_ekf_sideslip.inputs import FACTORS, FORCES, MASSES, PACKAGE, PRINTED, SAMPLE_TIME
from studies.papers.smo_ekf_sideslip.observers import Signals, axle_forces, rear_sideslip
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Panel
from studies.plots.colours import SETTINGS
from studies.study import Cell, PartResult, Scope, Table
from studies.trials import filter_inputs
from studies.trials.accuracy import ERROR_COLUMNS, SampleSpreads, sample_spreads
from studies.trials.estimation import assumed_car, measured_runs
from studies.trials.filter_inputs import PRINTED_TEST, USE, TireFacts, conditions, tire_facts
from studies.trials.histories import BANDS, estimate_lines, history, setting_lines, truth_line
from studies.trials.motion import MotionTest, motion_part
from studies.trials.simulations import LUGRE, MAGIC_FORMULA, QUICK_SECONDS, trial_part
from studies.truth import Measured, Truth

TOPIC = Topic(PACKAGE)
Setting = tuple[float, float]
"""kg by which the assumed mass is wrong, and factor on the assumed stiffness."""


@dataclass(frozen=True)
class AxleRun:
    """S sensor draws of one run over n samples. Forces (S, n, 4) in the order of `FORCES`: N in body axes, rad/s.

    Forces by error of the mass; rear sideslip in rad and stiffness in N/rad by error of the mass and factor on the stiffness.
    """

    drawn: Measured
    tire: TireFacts
    counted: BoolArray  # (n,)
    true_forces: FloatArray  # (n, 4)
    true_sideslip: FloatArray  # (n,), beta_2 as P5 (11) counts it: positive where the rear axle's force is
    forces: dict[float, FloatArray]
    static: FloatArray  # (S, n, 4), without an observer
    adaptive: dict[Setting, FloatArray]  # (S, n)
    stiffness: dict[Setting, FloatArray]  # (S, n, 2), adapted
    fixed: dict[Setting, FloatArray]  # (S, n)

    def force_errors(self, estimate: FloatArray) -> dict[str, SampleSpreads]:
        """Of (8), from (S, n, 4), by the names of `FORCES`."""
        at = self.counted
        return {name: sample_spreads(estimate[:, at, k], self.true_forces[at, k]) for k, name in enumerate(FORCES)}

    def sideslip_errors(self, estimate: FloatArray) -> SampleSpreads:
        """Of (8) of the rear sideslip, from (S, n)."""
        return sample_spreads(estimate[:, self.counted], self.true_sideslip[self.counted])


def true_axles(truth: Truth) -> FloatArray:
    """F_y1, F_y2 and F_x1 of the axles in body axes, N, and the yaw rate, rad/s: (n, 4) of the first run."""
    steer, along, across = (truth[name][0] for name in ("steer", "force_x", "force_y"))
    forward, left = along * np.cos(steer) - across * np.sin(steer), along * np.sin(steer) + across * np.cos(steer)
    columns = (left[:, :2].sum(axis=1), left[:, 2:].sum(axis=1), forward[:, :2].sum(axis=1), truth["yaw_rate"][0])
    return np.stack(columns, axis=1)


def single_track(car: VehicleParameters, tire: TireFacts, mass: float = 0.0, factor: float = 1.0) -> SingleTrack:
    """The truth's car with the secant stiffness of its axles, wrong by ``mass`` kg and by ``factor`` on the stiffness."""
    front, rear = (2.0 * factor * value for value in tire.secant)
    return SingleTrack(car.mass + mass, car.yaw_inertia, car.front_axle_distance, car.rear_axle_distance, front, rear)


def run_axles(drawn: Measured, settings: Sequence[Setting]) -> AxleRun:
    """Both blocks on the only run of ``drawn`` with every setting; fixed stiffness with the right mass alone.

    Block 1 starts at the greatest true values as in the paper.
    """
    car, truth, at = assumed_car(drawn), drawn.truth, filter_inputs.counted(drawn, 0)
    speed, friction = float(truth["vx"][0][at].mean()), float(truth["friction"][0].mean())
    tire = tire_facts(truth.vehicles[0], truth.tires[0], speed, friction)
    yaw_rate, ay, ax = (drawn.signals[name] for name in ("yaw_rate", "ay", "ax"))
    signals = Signals(yaw_rate, ay, ax, filter_inputs.front_steer(drawn), filter_inputs.rear_speed(drawn))
    true = true_axles(truth)
    start = np.roll(true.max(axis=0), 1)  # the observer's state begins with the yaw rate
    states = {m: axle_forces(single_track(car, tire, m), signals, start) for m in dict.fromkeys(m for m, _ in settings)}

    def sideslip(setting: Setting, adaptive: bool) -> tuple[FloatArray, FloatArray]:
        rear, stiffness = rear_sideslip(single_track(car, tire, *setting), signals, states[setting[0]], adaptive)
        return rear[:, 0], stiffness[:, 0]

    adapted = {setting: sideslip(setting, True) for setting in settings}
    front, rear, side = car.front_axle_distance, car.rear_axle_distance, car.mass / car.wheelbase * ay
    static = np.stack([side * rear, side * front, car.mass * ax, yaw_rate], axis=-1)
    to_left = truth["vy"][0] - rear * truth["yaw_rate"][0]
    return AxleRun(
        drawn, tire, at, true, np.arctan2(-to_left, np.maximum(np.absolute(truth["vx"][0]), 0.1)),
        {m: np.roll(state[:, 0], -1, axis=-1) for m, state in states.items()}, static[:, 0],
        {setting: slip for setting, (slip, _) in adapted.items()}, {setting: k for setting, (_, k) in adapted.items()},
        {setting: sideslip(setting, False)[0] for setting in settings if setting[0] == 0.0})  # fmt: skip


def axle_part(name: str, title: str, test: str, scope: Scope, tire: str = LUGRE) -> PartResult:
    """Errors and histories of both blocks in the road test "slalom" or "roundabout", by assumed stiffness and mass."""
    printed = PRINTED[test]
    settings = [(0.0, factor) for factor in FACTORS]
    settings += [(mass, 1.0) for mass in MASSES if mass and "mass" in printed]
    run = run_axles(measured_runs((f"p5-{test}",), tire, scope, QUICK_SECONDS, SAMPLE_TIME), settings)
    measures: dict[str, float] = {}
    found = [_force_table(printed["forces"], run, measures), _stiffness_table(printed["stiffness"], run, measures)]
    drawings = [_force_history(f"{name}-forces", title, run), _stiffness_history(f"{name}-stiffness", title, run)]
    if "mass" in printed:
        found.append(_mass_table(printed["mass"], run, measures))
        drawings.append(_mass_history(f"{name}-mass", title, run))
    front, rear = (2e-3 * value for value in run.tire.secant)
    about = (
        f"{conditions(run.drawn)} Believed: the truth's masses and lengths, and the secant of its tires at {USE:g} of the "
        f"static load, {front:.1f} and {rear:.1f} kN/rad an axle (the paper: 65 and 50). As in the paper accelerations are "
        f"not corrected for roll, and the force observer starts from the greatest values. {PRINTED_TEST}"
    )
    tables = [replace(t, name=f"{name}-{t.name}", caption=f"{title}: {t.caption} {about}") for t in found]
    return PartResult(tables=tables, figures=drawings, measures=measures)


def _force_table(printed: Mapping[str, Any], run: AxleRun, measures: dict[str, float]) -> Table:
    rows: list[list[Cell]] = []
    found = {"sliding mode": run.force_errors(run.forces[0.0]), "static split": run.force_errors(run.static)}
    peaks = np.abs(run.true_forces[run.counted]).max(axis=0)
    for quantity, value in zip(FORCES, peaks, strict=True):
        own = printed[quantity]
        peak = round(float(np.degrees(value)), 1) if quantity == "yaw_rate" else round(float(value))
        for who, errors in found.items():
            paper = (own["mean"], own["deviation"]) if who == "sliding mode" else (None, None)
            rows.append([quantity, own["unit"], own["largest"], peak, who, *errors[quantity].cells(paper)])
            measures |= errors[quantity].measures(f"{quantity}, {who}")
    return Table("forces",
        "errors (8) of the axle forces (body axes) and of the yaw rate. Static split: m a_y on the axles as in a steady turn, "
        "m a_x in front, and the gyro as it is.",
        ("quantity", "unit", "printed peak", "peak", "estimate", *ERROR_COLUMNS), rows)  # fmt: skip


def _stiffness_table(printed: Mapping[str, Any], run: AxleRun, measures: dict[str, float]) -> Table:
    rows: list[list[Cell]] = []
    peak = round(float(np.degrees(np.abs(run.true_sideslip[run.counted]).max())), 2)
    for who, estimates in (("adaptive (EKF)", run.adaptive), ("fixed (ORL)", run.fixed)):
        for factor, *own in zip(FACTORS, printed["mean"], printed["deviation"], strict=True):
            errors = run.sideslip_errors(estimates[0.0, factor])
            paper = (own[0], own[1]) if who == "adaptive (EKF)" else (None, None)
            rows.append([who, factor, printed["largest"], peak, *errors.cells(paper)])
            measures |= errors.measures(f"beta_2, {who}, stiffness x {factor:g}")
    columns = ("observer", "stiffness setting", "printed peak [deg]", "peak [deg]", *ERROR_COLUMNS)
    return Table("stiffness",
        "errors (8) of the rear sideslip by believed cornering stiffness, adapted or fixed (the paper shows the fixed one in "
        "figures alone).", columns, rows)  # fmt: skip


def _mass_table(printed: Mapping[str, Any], run: AxleRun, measures: dict[str, float]) -> Table:
    rows: list[list[Cell]] = []
    for j, mass in enumerate(MASSES):
        errors = run.force_errors(run.forces[mass]) | {"beta_2": run.sideslip_errors(run.adaptive[mass, 1.0])}
        for quantity, paper in printed.items():
            rows.append([quantity, mass, *errors[quantity].cells((paper["mean"][j], paper["deviation"][j]))])
            measures |= errors[quantity].measures(f"{quantity}, mass {mass:+g} kg")
    caption = "errors (8) of forces and rear sideslip by believed mass, stiffness adapted."
    return Table("mass", caption, ("quantity", "mass error [kg]", *ERROR_COLUMNS), rows)


def _force_history(name: str, title: str, run: AxleRun) -> Figure:
    time, panels = run.drawn.truth.time, []
    labels = ("$F_{y1}$ [kN]", "$F_{y2}$ [kN]", "$F_{x1}$ [kN]", "yaw rate [deg/s]")
    for k, label in enumerate(labels):
        scale = float(np.degrees(1.0)) if k == 3 else 1e-3
        found = estimate_lines(time, scale * run.forces[0.0][:, :, k], "sliding mode", SETTINGS[1])
        marks = [truth_line(time, scale * run.true_forces[:, k]), *found]
        panels.append(Panel(marks, y=label, legend="" if k else "upper left", columns=2))
    return history(name,
        f"{title}: axle forces and yaw rate of the sliding-mode observer, as Figs. 7 and 8 of P5. It starts from the greatest "
        f"values of the drive. {BANDS}",
        "Four panels over time: front and rear lateral force, front longitudinal force, yaw rate, each with its estimate.",
        panels, (9.0, 7.0))  # fmt: skip


def _sideslip(run: AxleRun, estimates: Sequence[FloatArray], labels: Sequence[str], y: str, title: str = "") -> Panel:
    """True rear sideslip where it counts, with the estimates (S, n)."""
    time, limit = run.drawn.truth.time, 1.9 * float(np.degrees(np.abs(run.true_sideslip[run.counted]).max()))
    true = truth_line(time, np.where(run.counted, np.degrees(run.true_sideslip), np.nan))
    marks = [true, *setting_lines(time, [np.degrees(value) for value in estimates], labels)]
    return Panel(marks, y=Axis(y, -limit, limit), title=title)


def _stiffness_history(name: str, title: str, run: AxleRun) -> Figure:
    labels = [f"× {factor:g}" for _, factor in run.fixed]
    fixed, adapted, stiffness = ([found[s] for s in run.fixed] for found in (run.fixed, run.adaptive, run.stiffness))
    panels = [_sideslip(run, fixed, labels, "sideslip [deg]", "rear sideslip, stiffness fixed (ORL)"),
              _sideslip(run, adapted, labels, "", "rear sideslip, stiffness adapted (EKF)")]  # fmt: skip
    for k, axle in enumerate(("front", "rear")):
        marks = setting_lines(run.drawn.truth.time, [1e-3 * value[:, :, k] for value in stiffness], labels)
        panels.append(Panel(marks, y=Axis("" if k else "stiffness [kN/rad]", 0.0), title=f"{axle} axle"))
    return history(name,
        f"{title}: rear sideslip with the believed stiffness times 0.5, 1 and 1.5, fixed and adapted, and the adapted "
        f"stiffness of both axles, as Figs. 12 to 17 of P5. {BANDS}",
        "Upper panels: rear sideslip over time for three settings, fixed left, adapted right. Lower panels: adapted "
        "stiffness of the axles.",
        panels, (9.4, 6.2), columns=2, legend="below")  # fmt: skip


def _mass_history(name: str, title: str, run: AxleRun) -> Figure:
    time, masses = run.drawn.truth.time, sorted(run.forces)
    labels = [f"m {mass:+g} kg" if mass else "m" for mass in masses]
    forces = setting_lines(time, [1e-3 * run.forces[mass][:, :, 0] for mass in masses], labels)
    marks = [truth_line(time, 1e-3 * run.true_forces[:, 0]), *forces]
    force = Panel(marks, y="$F_{y1}$ [kN]", legend="upper left", columns=4)
    slip = _sideslip(run, [run.adaptive[mass, 1.0] for mass in masses], labels, "rear sideslip [deg]")
    return history(name,
        f"{title}: front axle force and rear sideslip by believed mass, as Fig. 18 of P5. {BANDS}",
        "Front lateral force and rear sideslip over time for three believed masses.",
        [force, slip], (9.0, 5.0))  # fmt: skip


MOTION = (
    MotionTest("p5-slalom", "Slalom, dry (Fig. 5)", course=True),
    MotionTest("p5-roundabout", "Roundabout, dry (Fig. 6)", course=True))  # fmt: skip
TOPIC.parts.extend([
    trial_part("slalom-driven", "Tables 1, 3 and 5 on the truth vehicle: slalom",
               partial(axle_part, "slalom", "Slalom", "slalom"), 43.0, quick=True),
    trial_part("slalom-other-tire", "Tables 1, 3 and 5 on a tire with another shape: Magic Formula with slip lag",
               partial(axle_part, "slalom-other-tire", "Slalom, other tire", "slalom"), 45.0, MAGIC_FORMULA),
    trial_part("roundabout-driven", "Tables 2 and 4 on the truth vehicle: roundabout",
               partial(axle_part, "roundabout", "Roundabout", "roundabout"), 43.0),
    trial_part("motion", "Figs. 5 and 6 on the truth vehicle: path and accelerations",
               partial(motion_part, "motion", MOTION), 5.0)])  # fmt: skip
