"""P4-obs: is the eight-state model observable wherever the car moves and steers? Ranks, and motions that measure the same."""

from __future__ import annotations

from functools import cache
from typing import get_args

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.lie_rank import LieRankTest
from analysis.observability.lie_structure import GenericRank, generic_rank
from estimators.arrays import FloatArray
from estimators.sideslip import FourWheelModel
from studies.claim import Finding, reproduced
from studies.papers.ekf_ukf_lateral import inputs
from studies.papers.ekf_ukf_lateral.inputs import CAR, LOADS, STATE, Outputs, in_numbers, model_with
from studies.papers.topic import Topic
from studies.plots import DASHES, Axis, Figure, Level, Line, Map, Mark, Panel, Shade, Words, dots
from studies.plots.colours import BLUE, GREEN, PURPLE, RED, TRUTH
from studies.study import Cell, PartResult, Scope, Table
from synthesis.models.nonlinear import NonlinearModel

TOPIC = Topic(inputs.PACKAGE)
ORDER = 4  # Lie derivatives taken; the rank is complete after the first
RANGES = {
    "yaw_rate": (-0.6, 0.6), "speed": (5.0, 40.0), "sideslip": (-0.05, 0.05),
    **dict.fromkeys(("force_fl", "force_fr", "force_rl", "force_rr", "front_force_x"), (-4e3, 4e3)),
    "steering_angle": (-0.2, 0.2), **dict.fromkeys(LOADS, (1e3, 6e3))}  # fmt: skip
# Typical sizes of the states and of the outputs (and of their rates), to compare singular values.
STATE_SIZE = np.array([0.4, 8.0, 0.1, 2000.0, 2000.0, 1500.0, 1500.0, 2000.0])
OUTPUT_SIZE = np.array([0.4, 8.0, 3.0, 3.0])
RATE = 10.0  # 1/s, by which output rates are compared with outputs
FLOOR = 1e-17  # singular values below rounding are drawn here
STEP = 0.001  # s
SPLIT = 800.0  # N, by which two motions that measure the same differ at the start, to each side
LAG = "V / sigma"


@cache
def rank_of(model: NonlinearModel, straight: bool) -> GenericRank:
    """Lie rank at a random state and moving inputs (almost every one has it); `straight`: the steering angle is held at zero."""
    ranges = {**RANGES, "steering_angle": (0.0, 0.0)} if straight else RANGES
    return generic_rank(in_numbers(model), ranges, samples=1, order=ORDER, seed=4)


@cache
def rank_through_straight() -> int:
    """The rank of the corrected model at zero steering that moves at 0.1 rad/s."""
    return LieRankTest(in_numbers(model_with()), ORDER).at(STATE, {"steering_angle": [0, "0.1"], **LOADS}).rank


def singular_at_standstill() -> bool:
    """Whether the model has no Taylor series at zero speed (sideslip rate divides by it)."""
    try:
        LieRankTest(in_numbers(model_with()), 1).at({**STATE, "speed": 0}, {"steering_angle": "0.05", **LOADS})
    except AnalysisError:
        return True
    return False


def rear_split_is_hidden(model: NonlinearModel) -> bool:
    r"""f(x + s v) = f(x) - (V_g / sigma_2) s v and h(x + s v) = h(x) for every x, u, s and all constants, v = e_6 - e_7.

    Then two motions that start with the same rear sum and another rear split have the same outputs for ever, whatever the
    inputs do: rank 7 at most. An identity of expressions, no linearisation.
    """
    s, speed, length, left, right = sp.symbols("s speed rear_relaxation force_rl force_rr")
    shift = {left: left + s, right: right - s}
    v = sp.Matrix([0, 0, 0, 0, 0, 1, -1, 0])
    moved = model.f.subs(shift, simultaneous=True) - model.f + speed / length * s * v
    seen = model.h.subs(shift, simultaneous=True) - model.h
    return all(sp.expand(entry) == 0 for entry in (*moved, *seen))


@TOPIC.claim("P4-obs")
def rank_of_the_model(outputs: Outputs = "y4 corrected") -> Finding:
    """Rank while steering and at zero steering, of (11)-(12) with corrected y_4 (or other `outputs`), beside the printed y_4."""
    steering, straight = (rank_of(model_with(outputs), held) for held in (False, True))
    printed = [rank_of(model_with("y4 as printed"), held).rank for held in (False, True)]
    hidden = rear_split_is_hidden(model_with(outputs))
    upper = 7 if hidden else 8
    computed = {
        "rank": steering.rank, "rank_upper_bound": upper, "rank_at_zero_steering": straight.rank,
        "rank_steering_through_zero": rank_through_straight(), "hidden_directions": list(steering.structure.describe()),
        "hidden_directions_at_zero_steering": list(straight.structure.describe()),
        "singular_at_zero_speed": singular_at_standstill(), "rank_with_y4_as_printed": printed[0],
        "rank_with_y4_as_printed_at_zero_steering": printed[1]}  # fmt: skip
    reading = f"The rank is {steering.rank} at almost every state and {straight.rank} while driving straight ahead."
    if hidden:
        reading += (
            " The difference of the rear lateral forces enters no output and no other state: two motions that differ in it "
            "alone measure the same for ever (an exact identity). It decays with V / sigma_2, so the model is detectable. "
            "Rank 8 with the exception at zero steering holds for the printed y_4, whose x_6 sin(u_1) is a misprint (rank "
            f"{printed[0]} and {printed[1]})."
        )
    return Finding(computed, reproduced(min(steering.rank, upper) == 8 and straight.rank < 8), reading)


def singular_values(steering: FloatArray, speed: FloatArray, printed: bool = False) -> FloatArray:
    """Of the gradients of [y; y'] by the states, both in typical sizes, descending, over the largest one: (..., 8).

    In the bend `STATE` at other steering angles [rad] and speeds [m/s]. h is linear in x, so with held steering the gradient
    of y' is H A: eight rows, as many as states. `printed` takes y_4 of (12) as printed.
    """
    angle, v = np.broadcast_arrays(np.asarray(steering, float), np.asarray(speed, float))
    x = np.broadcast_to(inputs.STATES, (*angle.shape, 8)).copy()
    x[..., 1] = v
    step = 1e-4  # s; the Euler step is undone below, and T V / sigma stays below 1
    loads = np.broadcast_to(inputs.WHEEL_LOADS, (*angle.shape, 4))
    model = FourWheelModel.at(CAR, step, angle, loads, 1e-3)
    A = (model.transition_jacobian(x) - np.eye(8)) / step
    H = model.measurement_jacobian(x)
    if printed:
        H[..., 3, 7], H[..., 3, 5] = 0.0, H[..., 3, 5] + np.sin(angle) / model.vehicle.mass
    rows = np.concatenate([H, H @ A / RATE], axis=-2)
    values = np.linalg.svd(rows * STATE_SIZE / np.tile(OUTPUT_SIZE, 2)[:, None], compute_uv=False)
    return np.asarray(values / values[..., :1])


@TOPIC.part("observability", "Is the eight-state model observable?", 2.0)
def observability(scope: Scope) -> PartResult:
    """The claim, and singular values over steering angle and speed."""
    points = 41 if scope.quick else 161
    degrees, speed = np.linspace(-8.0, 8.0, points), np.geomspace(1.0, 40.0, max(points // 3, 12))
    angle, at_20 = np.radians(degrees), np.array(20.0)
    corrected, printed = (singular_values(angle, at_20, which) for which in (False, True))
    field = singular_values(angle[None, :], speed[:, None])[..., 6]
    curves: list[Mark] = [
        Line(degrees, np.maximum(corrected[:, 6], FLOOR), "7th, y₄ corrected", BLUE, width=1.8),
        Line(degrees, np.maximum(corrected[:, 7], FLOOR), "8th, y₄ corrected", BLUE, "dotted"),
        Line(degrees, np.maximum(printed[:, 7], FLOOR), "8th, y₄ as printed", RED, "dashed"),
        Shade(FLOOR / 3, 1e-14),
        Words(0.98, 0.07, "zero up to rounding", horizontal="right", relative=True)]  # fmt: skip
    colours: list[Mark] = [
        Map(degrees, speed, np.log10(np.maximum(field, 1e-9)), "log₁₀ (value / largest) [1]", "viridis", -7.0),
        Level(x=0.0, color=RED, width=1.6),
        Words(0.0, 2.0, "rank 6", "white", 9, offset=(6, 0)),
        Words(-7.5, 22.0, "rank 7", "white", 9)]  # fmt: skip
    x, size = "steering angle of the front wheels [deg]", Axis("singular value / largest [1]", FLOOR / 3, 1e-1, "log")
    heights = Axis("speed [m/s]", scale="log", ticks=[1, 2, 5, 10, 20, 40])
    figure = Figure("observability",
        "Observability of the eight-state model in a left bend (yaw rate 0.25 rad/s, forces 1.1 to 2.2 kN): singular values "
        "of the gradients of the four outputs and of their first derivatives, states and outputs in typical sizes. Left: the "
        "eighth value is zero at every steering angle, so the rank is 7, not 8; the seventh vanishes at zero steering, rank "
        "6. Only with y₄ as misprinted in (12) is the eighth value not zero. Right: the seventh value over steering angle "
        "and speed; speed moves it little, steering decides.",
        "Left: three curves over the steering angle; one stays at rounding level, two drop sharply at zero steering. Right: "
        "colour map over steering angle and speed with a dark vertical valley at zero steering.",
        [Panel(curves, x, size, "at 20 m/s, steering held", legend="center right"),
         Panel(colours, x, heights, "7th singular value, y₄ corrected", grid=False)],
        (9.2, 3.9), widths=(1.15, 1.0))  # fmt: skip
    return PartResult(TOPIC.found(), (), [figure], [inputs.SUBSTITUTES_NOTE])


def motion_pair(seconds: float = 1.5, front: bool = False, steered: bool = True) -> tuple[FloatArray, ...]:
    """Time (n,) in s, states (n, 2, 8) and outputs (n, 2, 4) of a slalom at 20 m/s from two starts.

    They differ in the rear left-right split (or, with `front`, the front one). Not `steered`: straight ahead with held
    steering, where the front split is hidden as well.
    """
    left, x = 3 if front else 5, np.zeros((2, 8))
    x[:, 1], x[:, 7] = 20.0, 300.0
    x[1, left], x[1, left + 1] = SPLIT, -SPLIT
    time = np.arange(0.0, seconds, STEP)
    steering = np.radians(3.0) * np.sin(2.0 * np.pi * 0.7 * time) * steered
    ahead, behind = CAR.front_axle_distance, CAR.rear_axle_distance
    loads = CAR.mass * 9.81 / (2 * (ahead + behind)) * np.tile([behind, behind, ahead, ahead], (2, 1))  # at rest
    states, outputs = np.empty((len(time), 2, 8)), np.empty((len(time), 2, 4))
    for k, angle in enumerate(steering):
        model = FourWheelModel.at(CAR, STEP, np.full(2, angle), loads, 1.0)
        states[k], outputs[k] = x, model.measurement(x)
        x = model.transition(x)
    return time, states, outputs


@TOPIC.part("hidden-split", "What no sensor tells apart", 1.0, quick=False)
def hidden_split(scope: Scope) -> PartResult:
    """What each variant of the model hides, and two motions that measure the same."""
    rows: list[list[Cell]] = []
    for outputs in get_args(Outputs):
        for situation, straight in (("steering", False), ("steering held at zero", True)):
            found = rank_of(model_with(outputs), straight)
            hidden = found.structure
            decays = LAG if hidden.proved and hidden.basis.cols else "-"
            rows.append([outputs, situation, found.rank, "; ".join(hidden.describe()) or "nothing", decays])
    at_rest = "no Taylor series: the sideslip rate divides by the speed" if singular_at_standstill() else "regular"
    rows[2:2] = [
        ["y4 corrected", "steering through zero at 0.1 rad/s", rank_through_straight(), "force_rl - force_rr", LAG],
        ["y4 corrected", "standstill", None, at_rest, "-"],
    ]
    ranks = Table("ranks",
        "Lie-derivative rank of the eight-state model at random states (20 Lie rows, 320-bit ball arithmetic: a rank is "
        "proved from below; what is hidden is proved symbolically). 'Decays with' is the rate in 1/s at which the hidden "
        "part dies out by itself.",
        ("output equation", "situation", "rank of 8 [1]", "hidden direction", "decays with"), rows)  # fmt: skip
    note = (
        "The paper sets lateral forces and sideslip to zero where it takes the model as unobservable. That is not needed: "
        "what is hidden decays with V / sigma by itself, so a filter stays bounded."
    )
    time, states, outputs = motion_pair()
    forces, measured = [], []
    for k, (name, width) in enumerate((("first", 2.6), ("second", 1.4))):
        yaw, lateral = 10.0 * outputs[:, k, 0], outputs[:, k, 3]
        forces += [
            Line(time, states[:, k, 5] / 1e3, f"rear left, {name} motion", BLUE, DASHES[k], width),
            Line(time, states[:, k, 6] / 1e3, f"rear right, {name} motion", RED, DASHES[k], width),
        ]
        measured += [
            Line(time, yaw, f"yaw rate [0.1 rad/s], {name}", GREEN, DASHES[k], width),
            Line(time, lateral, f"acceleration [m/s²], {name}", PURPLE, DASHES[k], width),
        ]
    split = np.abs(np.diff(states[:, :, 5], axis=1)[:, 0])
    seen = np.abs(np.diff(outputs, axis=1)[:, 0]).max(axis=1)
    lag = np.exp(-time * 20.0 / CAR.rear_relaxation)
    differences = [
        Line(time, np.maximum(split / split[0], FLOOR), "rear left force / 800 N", BLUE, width=2.6),
        Line(time, lag, "exp(−t V / σ₂)", TRUTH, "dashed", 1.0),
        dots(time, np.maximum(seen, FLOOR), "outputs, largest [SI units]", GREEN, ".", 2),
    ]
    shown = (
        (forces, Axis("lateral force [kN]", high=3.4), "not measured: rear forces"),
        (measured, Axis("measured [see legend]", high=9.5), "measured: the motions coincide"),
        (differences, Axis("difference of the motions [see legend]", FLOOR / 3, 1e4, "log"), "their difference"),
    )
    figure = Figure("twins",
        "Two motions of the eight-state model in the same slalom (20 m/s, ±3° at 0.7 Hz) that start with the same rear axle "
        "force and another split of it between left and right. Left: the rear forces differ. Middle: yaw rate and lateral "
        "acceleration do not, nor do the other outputs. Right: the split dies out with V/σ₂ = 40 1/s by itself while the "
        "outputs agree to rounding. So the rear split cannot be observed; what filters report of it is the tire model's.",
        "Three panels over time: rear forces of two motions that start apart and merge; outputs that coincide; the "
        "difference on a logarithmic scale, a straight line for the force and rounding noise for the outputs.",
        [Panel(lines, "time [s]", y, title, legend="upper right") for lines, y, title in shown], (9.6, 3.7))  # fmt: skip
    return PartResult((), [ranks], [figure], [note])
