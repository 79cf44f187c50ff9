"""How the truth moves in a paper's tests: the panels of accelerations, yaw rate, path and g-g diagram beside its estimates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from estimators.vehicle import CORNERS, GRAVITY
from studies.plots import Axis, Figure, Line, Panel, dots
from studies.plots.colours import BLUE, ORANGE, RED
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.estimation import run_of
from studies.trials.histories import history
from studies.trials.simulations import LUGRE, simulated_truth
from studies.truth import Truth, load_manoeuvre

COLUMNS = (
    "manoeuvre", "shown in", "the paper gives", "V_x, least [m/s]", "V_x, greatest [m/s]", "|a_x|, greatest [m/s^2]",
    "|a_y|, greatest [m/s^2]", "|yaw rate|, greatest [deg/s]", "steering at the wheels, greatest [deg]")  # fmt: skip
REAR = (("force_x", 1e-3, "$F_x$ [kN]"), ("torque", 1.0, "torque [N m]"), ("wheel_speed", 1.0, "wheel speed [rad/s]"))


@dataclass(frozen=True)
class MotionTest:
    """A manoeuvre, its name in the paper, and whether the paper draws path and g-g diagram, or the rear wheels, of it."""

    manoeuvre: str
    title: str
    course: bool = False
    rear: bool = False


def motion_part(name: str, rows: Sequence[MotionTest], scope: Scope, tire: str = LUGRE) -> PartResult:
    """Histories, diagrams and extremes of every manoeuvre; nothing is estimated."""
    truth = simulated_truth(tuple(row.manoeuvre for row in rows), tire, scope)
    drawings = [drawing for row in rows for drawing in motion_drawings(name, truth, row)]
    return PartResult((), [extremes(f"{name}-extremes", truth, rows)], drawings)


def extremes(name: str, truth: Truth, rows: Sequence[MotionTest]) -> Table:
    """How hard each manoeuvre is, beside what the paper says of it."""
    table: list[list[Cell]] = []
    for row in rows:
        manoeuvre = load_manoeuvre(row.manoeuvre)
        vx, *others = _signals(truth, row.manoeuvre)
        extreme = (vx.min(), vx.max(), *(np.abs(value).max() for value in others))
        cells = (round(float(value), 2) for value in extreme)
        table.append([row.title, manoeuvre.where, "; ".join(manoeuvre.given), *cells])
    return Table(name,
        f"Extremes of the truth's motion on {truth.tires[0]} tires: accelerations at the centre of gravity along the road, yaw "
        "rate and steering of the front left wheel, beside what the paper gives of the test. What it does not give is ours.",
        COLUMNS, table)  # fmt: skip


def _signals(truth: Truth, manoeuvre: str) -> tuple[FloatArray, ...]:
    """V_x m/s, a_x and a_y m/s^2, yaw rate deg/s, steering deg: (n,) each."""
    k, samples = run_of(truth, manoeuvre)
    vx, ax, ay, turn = (truth[signal][k, samples] for signal in ("vx", "road_ax", "road_ay", "yaw_rate"))
    return vx, ax, ay, np.degrees(turn), np.degrees(truth["steer"][k, samples, 0])


def motion_drawings(name: str, truth: Truth, row: MotionTest) -> list[Figure]:
    """The history of one manoeuvre, and what else the paper draws of it."""
    k, samples = run_of(truth, row.manoeuvre)
    time, on = truth.time[samples], f"the truth on {truth.tires[0]} tires"
    vx, ax, ay, turn, steer = _signals(truth, row.manoeuvre)
    alone = ((vx, "$V_x$ [m/s]", BLUE), (turn, "yaw rate [deg/s]", BLUE), (steer, "steering [deg]", ORANGE))
    panels = [Panel([Line(time, value, color=color, width=1.2)], y=label) for value, label, color in alone]
    pull = [Line(time, ax, "$a_x$", BLUE, width=1.2), Line(time, ay, "$a_y$", RED, "dashed", 1.2)]
    panels.insert(1, Panel(pull, y="[m/s$^2$]", legend="best", columns=2))
    found = [history(f"{name}-{row.manoeuvre}",
        f"{row.title}: speed, accelerations at the centre of gravity along the road, yaw rate, and steering of the front left "
        f"wheel of {on}.",
        f"Four panels over time for {row.title}: speed, longitudinal and lateral acceleration, yaw rate, steering angle.",
        panels, (8.0, 5.2))]  # fmt: skip
    if row.course:
        path = [Line(truth["x"][k, samples], truth["y"][k, samples], color=BLUE, width=1.3), dots(0.0, 0.0, color=BLUE)]
        diagram = [Line(ay / GRAVITY, ax / GRAVITY, color=RED, width=0.9)]
        found.append(Figure(f"{name}-course-{row.manoeuvre}",
            f"{row.title}: path of the centre of gravity from its start (dot), and longitudinal over lateral acceleration of "
            f"{on}.",
            f"Left: the path of the car in the plane for {row.title}. Right: its accelerations in a g-g diagram.",
            [Panel(path, Axis("x [m]", margin=0.01), "y [m]", equal=True),
             Panel(diagram, Axis("$a_y$ [g]", margin=0.01), "$a_x$ [g]", equal=True)],
            (8.0, 3.6)))  # fmt: skip
    if row.rear:
        panels = []
        for signal, scale, label in REAR:
            left, right = (scale * truth[signal][k, samples, corner] for corner in (2, 3))
            marks = [Line(time, left, CORNERS[2], BLUE, width=1.0), Line(time, right, CORNERS[3], RED, "dashed", 1.0)]
            panels.append(Panel(marks, y=label, legend="" if panels else "best", columns=2))
        found.append(history(f"{name}-rear-{row.manoeuvre}",
            f"{row.title}: longitudinal force, torque and speed of the rear wheels of {on}; torques are those that act at the "
            "wheels, drive less brakes.",
            f"Three panels over time for {row.title}: force, torque and speed of the rear left and the rear right wheel.",
            panels, (8.0, 4.6)))  # fmt: skip
    return found
