"""How the truth moves in a paper's tests: the panels of accelerations, yaw rate, path and g-g diagram beside its estimates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from estimators.vehicle import CORNERS, GRAVITY
from studies.plots.colours import BLUE, ORANGE, RED
from studies.study import Cell, Drawing, PartResult, Scope, Table
from studies.trials.driven import LUGRE, driven
from studies.trials.panels import finished
from studies.trials.play import run_of
from studies.truth import Truth, load_manoeuvre

Array = npt.NDArray[np.float64]
COLUMNS = (
    "manoeuvre", "shown in", "the paper gives", "V_x, least [m/s]", "V_x, greatest [m/s]", "|a_x|, greatest [m/s^2]",
    "|a_y|, greatest [m/s^2]", "|yaw rate|, greatest [deg/s]", "steering at the wheels, greatest [deg]",
)  # fmt: skip


@dataclass(frozen=True)
class Moved:
    """A manoeuvre, its name in the paper, and whether the paper draws path and g-g diagram, or the rear wheels, of it."""

    manoeuvre: str
    title: str
    course: bool = False
    rear: bool = False


def motion_part(name: str, rows: Sequence[Moved], scope: Scope, tire: str = LUGRE) -> PartResult:
    """Histories, diagrams and extremes of every manoeuvre; nothing is estimated."""
    truth = driven(tuple(row.manoeuvre for row in rows), tire, scope)
    drawings = [drawing for row in rows for drawing in motion_drawings(name, truth, row)]
    return PartResult(tables=[extremes(f"{name}-extremes", truth, rows)], drawings=drawings)


def motion_drawings(name: str, truth: Truth, row: Moved) -> list[Drawing]:
    """The history of one manoeuvre, and what else the paper draws of it."""
    extra = [(_course, "course")] * row.course + [(_rear_wheels, "rear")] * row.rear
    found = [_history(f"{name}-{row.manoeuvre}", truth, row)]
    return found + [draw(f"{name}-{what}-{row.manoeuvre}", truth, row) for draw, what in extra]


def extremes(name: str, truth: Truth, rows: Sequence[Moved]) -> Table:
    """How hard each manoeuvre is, beside what the paper says of it."""
    table: list[list[Cell]] = []
    for row in rows:
        told = load_manoeuvre(row.manoeuvre)
        vx, ax, ay, turn, steer = _signals(truth, row.manoeuvre)
        greatest = [float(np.abs(value).max()) for value in (ax, ay, turn, steer)]
        table.append(
            [
                row.title, told.where, "; ".join(told.given), round(float(vx.min()), 2), round(float(vx.max()), 2),
                *(round(value, 2) for value in greatest),
            ]
        )  # fmt: skip
    return Table(
        name,
        f"Extremes of the truth's motion on {truth.tires[0]} tires: accelerations at the centre of gravity along the road, yaw "
        "rate and steering of the front left wheel, beside what the paper gives of the test. What it does not give is ours.",
        COLUMNS,
        table,
    )


def _signals(truth: Truth, manoeuvre: str) -> tuple[Array, ...]:
    """V_x m/s, a_x and a_y m/s^2, yaw rate deg/s, steering deg: (n,) each."""
    k, samples = run_of(truth, manoeuvre)
    vx, ax, ay, turn = (truth[signal][k, samples] for signal in ("vx", "road_ax", "road_ay", "yaw_rate"))
    return vx, ax, ay, np.degrees(turn), np.degrees(truth["steer"][k, samples, 0])


def _history(name: str, truth: Truth, row: Moved) -> Drawing:
    vx, ax, ay, turn, steer = _signals(truth, row.manoeuvre)
    time = truth.time[: vx.size]
    figure = Figure(figsize=(8.0, 5.2), layout="constrained")
    speed, pull, yaw, wheel = figure.subplots(4, 1, sharex=True)
    speed.plot(time, vx, color=BLUE, linewidth=1.2)
    pull.plot(time, ax, color=BLUE, linewidth=1.2, label="$a_x$")
    pull.plot(time, ay, color=RED, linewidth=1.2, linestyle="--", label="$a_y$")
    pull.legend(ncols=2, fontsize="small", frameon=False)
    yaw.plot(time, turn, color=BLUE, linewidth=1.2)
    wheel.plot(time, steer, color=ORANGE, linewidth=1.2)
    finished(speed, "$V_x$ [m/s]")
    finished(pull, "[m/s$^2$]")
    finished(yaw, "yaw rate [deg/s]")
    finished(wheel, "steering [deg]", last=True)
    return Drawing(
        name,
        f"{row.title}: speed, accelerations at the centre of gravity along the road, yaw rate, and steering of the front left "
        f"wheel of the truth on {truth.tires[0]} tires.",
        f"Four panels over time for {row.title}: speed, longitudinal and lateral acceleration, yaw rate, steering angle.",
        figure,
    )


def _course(name: str, truth: Truth, row: Moved) -> Drawing:
    k, samples = run_of(truth, row.manoeuvre)
    _, ax, ay, _, _ = _signals(truth, row.manoeuvre)
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    path, diagram = figure.subplots(1, 2)
    path.plot(truth["x"][k, samples], truth["y"][k, samples], color=BLUE, linewidth=1.3)
    path.plot(0.0, 0.0, "o", color=BLUE, markersize=5)
    path.set_aspect("equal", adjustable="datalim")
    path.set_xlabel("x [m]")
    diagram.plot(ay / GRAVITY, ax / GRAVITY, color=RED, linewidth=0.9)
    diagram.set_aspect("equal", adjustable="datalim")
    diagram.set_xlabel("$a_y$ [g]")
    finished(path, "y [m]")
    finished(diagram, "$a_x$ [g]")
    return Drawing(
        name,
        f"{row.title}: path of the centre of gravity from its start (dot), and longitudinal over lateral acceleration of the "
        f"truth on {truth.tires[0]} tires.",
        f"Left: the path of the car in the plane for {row.title}. Right: its accelerations in a g-g diagram.",
        figure,
    )


def _rear_wheels(name: str, truth: Truth, row: Moved) -> Drawing:
    k, samples = run_of(truth, row.manoeuvre)
    time = truth.time[samples]
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    shown = (
        ("force_x", 1e-3, "$F_x$ [kN]"),
        ("torque", 1.0, "torque [N m]"),
        ("wheel_speed", 1.0, "wheel speed [rad/s]"),
    )
    for axes, (signal, scale, text) in zip(panels, shown, strict=True):
        for corner, colour, dash in ((2, BLUE, "-"), (3, RED, "--")):
            value = scale * truth[signal][k, samples, corner]
            axes.plot(time, value, color=colour, linestyle=dash, linewidth=1.0, label=CORNERS[corner])
        finished(axes, text, last=axes is panels[-1])
    panels[0].legend(ncols=2, fontsize="small", frameon=False)
    return Drawing(
        name,
        f"{row.title}: longitudinal force, torque and speed of the rear wheels of the truth on {truth.tires[0]} tires; torques "
        "are those that act at the wheels, drive less brakes.",
        f"Three panels over time for {row.title}: force, torque and speed of the rear left and the rear right wheel.",
        figure,
    )
