"""What each variant of the model of P4 hides, and two motions that no sensor tells apart."""

from __future__ import annotations

import numpy as np

from estimators.sideslip import FourWheelModel
from studies.papers.ekf_ukf_lateral.inputs import (
    CAR,
    PACKAGE,
    corrected_model,
    printed_output_model,
    rear_difference_model,
    substitute_car,
)
from studies.papers.ekf_ukf_lateral.observability import FLOOR, rank_of, rank_through_straight, singular_at_standstill
from studies.papers.topic import Topic
from studies.plots import Axis, Dash, Figure, Line, Panel, dots
from studies.plots.colours import BLUE, GREEN, PURPLE, RED, TRUTH
from studies.study import Cell, PartResult, Scope, Table
from synthesis.polynomials.matrix import FloatArray

TOPIC = Topic(PACKAGE)
STEP = 0.001  # s
SPLIT = 800.0  # N, by which the two motions differ at the start, to each side
LAG = "V / sigma"


def motion_pair(
    seconds: float = 1.5, front: bool = False, steered: bool = True
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time (n,) in s, states (n, 2, 8) and outputs (n, 2, 4) of a slalom at 20 m/s from two starts.

    They differ in the rear left-right split (or, with `front`, the front one). Not `steered`: straight ahead with held
    steering, where the front split is hidden as well.
    """
    car, left = substitute_car(), 3 if front else 5
    x = np.zeros((2, 8))
    x[:, 1], x[:, 7] = 20.0, 300.0
    x[1, left], x[1, left + 1] = SPLIT, -SPLIT
    time = np.arange(0.0, seconds, STEP)
    steering = np.radians(3.0) * np.sin(2.0 * np.pi * 0.7 * time) * steered
    ahead, behind = CAR["front_axle_distance"], CAR["rear_axle_distance"]
    loads = CAR["mass"] * 9.81 / (2 * (ahead + behind)) * np.tile([behind, behind, ahead, ahead], (2, 1))  # at rest
    states, outputs = np.empty((len(time), 2, 8)), np.empty((len(time), 2, 4))
    for k, angle in enumerate(steering):
        model = FourWheelModel.at(car, STEP, np.full(2, angle), loads, 1.0)
        states[k], outputs[k] = x, model.measurement(x)
        x = model.transition(x)
    return time, states, outputs


@TOPIC.part("hidden-split", "What no sensor tells apart", 1.0, quick=False)
def hidden_split(scope: Scope) -> PartResult:
    """What each variant of the model hides, and two motions that measure the same."""
    note = (
        "The paper sets lateral forces and sideslip to zero where it takes the model as unobservable. That is not needed: "
        "what is hidden decays with V / sigma by itself, so a filter stays bounded."
    )
    return PartResult((), [rank_table()], [pair_figure()], [note])


def rank_table() -> Table:
    """Model, situation, rank and what is hidden."""
    rows: list[list[Cell]] = []
    for name, model in (
        ("y4 corrected", corrected_model()),
        ("y4 as printed", printed_output_model()),
        ("y4 corrected, F_y22 measured as well", rear_difference_model()),
    ):
        for situation, straight in (("steering", False), ("steering held at zero", True)):
            found = rank_of(model, straight)
            hidden = found.structure
            decays = LAG if hidden.proved and hidden.basis.cols else "-"
            rows.append([name, situation, found.rank, "; ".join(hidden.describe()) or "nothing", decays])
    at_rest = "no Taylor series: the sideslip rate divides by the speed" if singular_at_standstill() else "regular"
    rows[2:2] = [
        ["y4 corrected", "steering through zero at 0.1 rad/s", rank_through_straight(), "force_rl - force_rr", LAG],
        ["y4 corrected", "standstill", None, at_rest, "-"],
    ]
    caption = (
        "Lie-derivative rank of the eight-state model at random states (20 Lie rows, 320-bit ball arithmetic: a rank is "
        "proved from below; what is hidden is proved symbolically). 'Decays with' is the rate in 1/s at which the hidden "
        "part dies out by itself."
    )
    columns = ("output equation", "situation", "rank of 8 [1]", "hidden direction", "decays with")
    return Table("ranks", caption, columns, rows)


def pair_figure() -> Figure:
    """Two starts with another rear split: forces differ, outputs do not."""
    time, states, outputs = motion_pair()
    forces, measured = [], []
    styles: tuple[tuple[str, Dash, float], ...] = (("first", "solid", 2.6), ("second", "dashed", 1.4))
    for k, (name, dash, width) in enumerate(styles):
        for side, wheel, color in (("left", 5, BLUE), ("right", 6, RED)):
            force = states[:, k, wheel] / 1e3
            forces.append(Line(time, force, f"rear {side}, {name} motion", color, dash, width))
        for what, values, color in (
            ("yaw rate [0.1 rad/s]", 10.0 * outputs[:, k, 0], GREEN),
            ("acceleration [m/s²]", outputs[:, k, 3], PURPLE),
        ):
            measured.append(Line(time, values, f"{what}, {name}", color, dash, width))
    split = np.abs(np.diff(states[:, :, 5], axis=1)[:, 0])
    seen = np.abs(np.diff(outputs, axis=1)[:, 0]).max(axis=1)
    lag = np.exp(-time * 20.0 / CAR["rear_relaxation"])
    differences = [
        Line(time, np.maximum(split / split[0], FLOOR), "rear left force / 800 N", BLUE, width=2.6),
        Line(time, lag, "exp(−t V / σ₂)", TRUTH, "dashed", 1.0),
        dots(time, np.maximum(seen, FLOOR), "outputs, largest [SI units]", GREEN, ".", 2),
    ]
    panels = [
        Panel(lines, "time [s]", y, title, legend="upper right")
        for lines, y, title in (
            (forces, Axis("lateral force [kN]", high=3.4), "not measured: rear forces"),
            (measured, Axis("measured [see legend]", high=9.5), "measured: the motions coincide"),
            (differences, Axis("difference of the motions [see legend]", FLOOR / 3, 1e4, "log"), "their difference"),
        )
    ]
    return Figure(
        "twins",
        "Two motions of the eight-state model in the same slalom (20 m/s, ±3° at 0.7 Hz) that start with the same rear axle "
        "force and another split of it between left and right. Left: the rear forces differ. Middle: yaw rate and lateral "
        "acceleration do not, nor do the other outputs. Right: the split dies out with V/σ₂ = 40 1/s by itself while the "
        "outputs agree to rounding. So the rear split cannot be observed; what filters report of it is the tire model's.",
        "Three panels over time: rear forces of two motions that start apart and merge; outputs that coincide; the "
        "difference on a logarithmic scale, a straight line for the force and rounding noise for the outputs.",
        panels, (9.6, 3.7),
    )  # fmt: skip
