"""P4-obs: is the eight-state model observable wherever the car moves and steers? Ranks, and what no output sees."""

from __future__ import annotations

from functools import cache

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from analysis.lie_rank import LieRankTest
from analysis.lie_structure import GenericRank, generic_rank
from estimators.sideslip import FourWheelModel
from studies.claim import Finding, judged
from studies.papers.ekf_ukf_lateral.inputs import (
    LOADS,
    PACKAGE,
    STATE,
    SUBSTITUTES_NOTE,
    corrected_model,
    in_numbers,
    printed_output_model,
    substitute_car,
)
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Level, Line, Map, Mark, Panel, Shade, Words
from studies.plots.colours import BLUE, RED
from studies.study import PartResult, Scope
from synthesis.models.nonlinear import NonlinearModel
from synthesis.polynomials.matrix import FloatArray

TOPIC = Topic(PACKAGE)
ORDER = 4  # Lie derivatives taken; the rank is complete after the first
RANGES = {
    "yaw_rate": (-0.6, 0.6), "speed": (5.0, 40.0), "sideslip": (-0.05, 0.05),
    **dict.fromkeys(("force_fl", "force_fr", "force_rl", "force_rr", "front_force_x"), (-4e3, 4e3)),
    "steering_angle": (-0.2, 0.2), **dict.fromkeys(LOADS, (1e3, 6e3)),
}  # fmt: skip
# Typical sizes of the states and of the outputs (and of their rates), to compare singular values.
STATE_SIZE = np.array([0.4, 8.0, 0.1, 2000.0, 2000.0, 1500.0, 1500.0, 2000.0])
OUTPUT_SIZE = np.array([0.4, 8.0, 3.0, 3.0])
RATE = 10.0  # 1/s, by which output rates are compared with outputs
FLOOR = 1e-17  # singular values below rounding are drawn here


@cache
def rank_of(model: NonlinearModel, straight: bool) -> GenericRank:
    """Lie rank at a random state and moving inputs (almost every one has it); `straight`: the steering angle is held at zero."""
    ranges = {**RANGES, "steering_angle": (0.0, 0.0)} if straight else RANGES
    return generic_rank(in_numbers(model), ranges, samples=1, order=ORDER, seed=4)


@cache
def rank_through_straight(rate: str = "0.1") -> int:
    """The rank of the corrected model at zero steering that moves at `rate` in rad/s."""
    return LieRankTest(in_numbers(corrected_model()), ORDER).at(STATE, {"steering_angle": [0, rate], **LOADS}).rank


def singular_at_standstill() -> bool:
    """Whether the model has no Taylor series at zero speed (sideslip rate divides by it)."""
    try:
        LieRankTest(in_numbers(corrected_model()), 1).at({**STATE, "speed": 0}, {"steering_angle": "0.05", **LOADS})
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
def rank_of_the_model(model: NonlinearModel | None = None) -> Finding:
    """Rank while steering and at zero steering, of (11)-(12) with corrected y_4 (or of `model`), beside the printed y_4."""
    chosen = model or corrected_model()
    steering, straight = rank_of(chosen, False), rank_of(chosen, True)
    printed = [rank_of(printed_output_model(), held).rank for held in (False, True)]
    hidden = rear_split_is_hidden(chosen)
    upper = 7 if hidden else 8
    computed = {
        "rank": steering.rank, "rank_upper_bound": upper, "rank_at_zero_steering": straight.rank,
        "rank_steering_through_zero": rank_through_straight(), "hidden_directions": list(steering.structure.describe()),
        "hidden_directions_at_zero_steering": list(straight.structure.describe()),
        "singular_at_zero_speed": singular_at_standstill(), "rank_with_y4_as_printed": printed[0],
        "rank_with_y4_as_printed_at_zero_steering": printed[1],
    }  # fmt: skip
    reading = f"The rank is {steering.rank} at almost every state and {straight.rank} while driving straight ahead."
    if hidden:
        reading += (
            " The difference of the rear lateral forces enters no output and no other state: two motions that differ in it "
            "alone measure the same for ever (an exact identity). It decays with V / sigma_2, so the model is detectable. "
            "Rank 8 with the exception at zero steering holds for the printed y_4, whose x_6 sin(u_1) is a misprint (rank "
            f"{printed[0]} and {printed[1]})."
        )
    return Finding(computed, judged(min(steering.rank, upper) == 8 and straight.rank < 8), reading)


def singular_values(steering: FloatArray, speed: FloatArray, printed: bool = False) -> FloatArray:
    """Of the gradients of [y; y'] by the states, both in typical sizes, descending, over the largest one: (..., 8).

    In the bend `STATE` at other steering angles [rad] and speeds [m/s]. h is linear in x, so with held steering the gradient
    of y' is H A: eight rows, as many as states. `printed` takes y_4 of (12) as printed.
    """
    angle, v = np.broadcast_arrays(np.asarray(steering, float), np.asarray(speed, float))
    x = np.broadcast_to([float(value) for value in STATE.values()], (*angle.shape, 8)).copy()
    x[..., 1] = v
    step = 1e-4  # s; the Euler step is undone below, and T V / sigma stays below 1
    loads = np.broadcast_to([float(value) for value in LOADS.values()], (*angle.shape, 4))
    model = FourWheelModel.at(substitute_car(), step, angle, loads, 1e-3)
    A = (model.transition_jacobian(x) - np.eye(8)) / step
    H = model.measurement_jacobian(x)
    if printed:
        H[..., 3, 7], H[..., 3, 5] = 0.0, H[..., 3, 5] + np.sin(angle) / model.vehicle.mass
    rows = np.concatenate([H, H @ A / RATE], axis=-2)
    values = np.linalg.svd(rows * STATE_SIZE / np.tile(OUTPUT_SIZE, 2)[:, None], compute_uv=False)
    return np.asarray(values / values[..., :1])


@TOPIC.part("observability", "Is the eight-state model observable?", 2.0)
def observability(scope: Scope) -> PartResult:
    """The claim, and a map of the rank."""
    return PartResult(TOPIC.found(), (), [rank_figure(41 if scope.quick else 161)], [SUBSTITUTES_NOTE])


def rank_figure(points: int = 161) -> Figure:
    """Singular values over steering angle and speed."""
    degrees, speed = np.linspace(-8.0, 8.0, points), np.geomspace(1.0, 40.0, max(points // 3, 12))
    angle, at_20 = np.radians(degrees), np.array(20.0)
    corrected, printed = (singular_values(angle, at_20, which) for which in (False, True))
    field = singular_values(angle[None, :], speed[:, None])[..., 6]
    curves: list[Mark] = [
        Line(degrees, np.maximum(corrected[:, 6], FLOOR), "7th, y₄ corrected", BLUE, width=1.8),
        Line(degrees, np.maximum(corrected[:, 7], FLOOR), "8th, y₄ corrected", BLUE, "dotted"),
        Line(degrees, np.maximum(printed[:, 7], FLOOR), "8th, y₄ as printed", RED, "dashed"),
        Shade(FLOOR / 3, 1e-14),
        Words(0.98, 0.07, "zero up to rounding", horizontal="right", relative=True),
    ]
    colours: list[Mark] = [
        Map(degrees, speed, np.log10(np.maximum(field, 1e-9)), "log₁₀ (value / largest) [1]", "viridis", -7.0),
        Level(x=0.0, color=RED, width=1.6),
        Words(0.0, 2.0, "rank 6", "white", 9, offset=(6, 0)),
        Words(-7.5, 22.0, "rank 7", "white", 9),
    ]
    steering = "steering angle of the front wheels [deg]"
    size = Axis("singular value / largest [1]", FLOOR / 3, 1e-1, "log")
    heights = Axis("speed [m/s]", scale="log", ticks=[1, 2, 5, 10, 20, 40])
    panels = [
        Panel(curves, steering, size, "at 20 m/s, steering held", legend="center right"),
        Panel(colours, steering, heights, "7th singular value, y₄ corrected", grid=False),
    ]
    return Figure(
        "observability",
        "Observability of the eight-state model in a left bend (yaw rate 0.25 rad/s, forces 1.1 to 2.2 kN): singular values "
        "of the gradients of the four outputs and of their first derivatives, states and outputs in typical sizes. Left: the "
        "eighth value is zero at every steering angle, so the rank is 7, not 8; the seventh vanishes at zero steering, rank "
        "6. Only with y₄ as misprinted in (12) is the eighth value not zero. Right: the seventh value over steering angle "
        "and speed; speed moves it little, steering decides.",
        "Left: three curves over the steering angle; one stays at rounding level, two drop sharply at zero steering. Right: "
        "colour map over steering angle and speed with a dark vertical valley at zero steering.",
        panels, (9.2, 3.9), widths=(1.15, 1.0),
    )  # fmt: skip
