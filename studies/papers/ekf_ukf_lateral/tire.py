"""P4-dugoff: the Dugoff tire, and what the sign of its force (3) does to the car: as printed it fails, corrected it holds."""

from __future__ import annotations

from functools import cache

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from estimators.sideslip import dugoff_force
from studies.claim import Finding
from studies.papers.ekf_ukf_lateral.inputs import CAR, PACKAGE, SUBSTITUTES_NOTE, in_numbers
from studies.papers.topic import Topic
from studies.papers.verdicts import erratum
from studies.plots import ZERO, Axis, Figure, Level, Line, Mark, Panel, Words, dots
from studies.plots.colours import BLUE, GREEN, ORANGE, RED, TRUTH
from studies.study import PartResult, Scope
from synthesis.models.catalogue.four_wheel import four_wheel_model
from synthesis.models.discretise import zero_order_hold

TOPIC = Topic(PACKAGE)
SPEED = 20.0  # m/s
LOADS = {"load_fl": 4000.0, "load_fr": 4000.0, "load_rl": 3100.0, "load_rr": 3100.0}  # linear tires: of no consequence
STIFFNESS = CAR.front_stiffness  # N/rad, one tire


@cache
def straight_poles(force_sign: int) -> tuple[FloatArray, FloatArray]:
    """Real parts in 1/s, ascending, of the poles of P4 (11) linearised at zero slip and `SPEED`; `force_sign` -1: as printed.

    First the two of sideslip and yaw rate when forces follow the slip at once (Schur complement that eliminates the forces),
    then the six with the relaxation (6). Speed and drive force are integrators in either case and are left out.
    """
    model = four_wheel_model(force_sign=force_sign)
    point = {symbol: sp.Integer(0) for symbol in (*model.state_symbols, *model.input_symbols)}
    point |= {sp.Symbol(name): sp.Rational(str(value)) for name, value in {"speed": SPEED, **LOADS}.items()}
    f, moving = in_numbers(model).f, [0, 2, 3, 4, 5, 6]
    x = [model.state_symbols[j] for j in moving]
    A = np.array([[float(f[i].diff(symbol).xreplace(point)) for symbol in x] for i in moving])
    reduced = A[:2, :2] - A[:2, 2:] @ np.linalg.solve(A[2:, 2:], A[2:, :2])
    return np.sort(np.linalg.eigvals(reduced).real), np.sort(np.linalg.eigvals(A).real)


@TOPIC.claim("P4-dugoff")
def tire_sign(printed_sign: int = -1) -> Finding:
    """Is driving straight ahead at 20 m/s stable with the sign of (3), and with the other one?"""
    (printed, printed_lagged), (corrected, corrected_lagged) = straight_poles(printed_sign), straight_poles(1)
    slowest = float(printed_lagged.max()), float(corrected_lagged.max())
    computed = {
        "speed_m_s": SPEED, "poles_printed_1_s": printed.tolist(), "poles_corrected_1_s": corrected.tolist(),
        "largest_pole_printed_with_relaxation_1_s": slowest[0],
        "largest_pole_corrected_with_relaxation_1_s": slowest[1]}  # fmt: skip
    stable = max(printed.max(), slowest[0]) < 0.0, max(corrected.max(), slowest[1]) < 0.0
    return Finding(computed, erratum(*stable), (
        "With the slip angles of (2) a left turn has positive slip and needs a positive force. The printed minus turns every "
        f"restoring force around: both poles of the single track at {SPEED:g} m/s are unstable. The plus sign gives two "
        "stable ones."))  # fmt: skip


def single_track(force_sign: int, speed: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """A (..., 2, 2) and b (..., 2, 1) of sideslip and yaw rate under steering: the linear single track in closed form."""
    front, rear = 2.0 * force_sign * CAR.front_stiffness, 2.0 * force_sign * CAR.rear_stiffness
    a, b, m, inertia = CAR.front_axle_distance, CAR.rear_axle_distance, CAR.mass, CAR.yaw_inertia
    v, moment = np.asarray(speed, float), a * front - b * rear
    A, B = np.empty((*v.shape, 2, 2)), np.empty((*v.shape, 2, 1))
    A[..., 0, 0], A[..., 0, 1] = -(front + rear) / (m * v), -1.0 - moment / (m * v**2)
    A[..., 1, 0], A[..., 1, 1] = -moment / inertia, -(a**2 * front + b**2 * rear) / (inertia * v)
    B[..., 0, 0], B[..., 1, 0] = front / (m * v), a * front / inertia
    return A, B


def single_track_poles(force_sign: int, speed: ArrayLike) -> FloatArray:
    """Real parts (..., 2) in 1/s of the poles of the linear single track at speeds [m/s], ascending."""
    return np.sort(np.linalg.eigvals(single_track(force_sign, speed)[0]).real, axis=-1)


def dugoff_figure() -> Figure:
    """Fig. 1 of P4: force over slip angle, for loads and for frictions."""
    slip = np.radians(np.linspace(-20.0, 20.0, 801))
    degrees = np.degrees(slip)
    panels: list[Panel] = []
    for title, cases in (
        ("dry road (μ = 1), three loads", [(1.0, load, f"$F_z$ = {load / 1e3:g} kN") for load in (2e3, 4e3, 6e3)]),
        ("4 kN load, three frictions", [(friction, 4e3, f"μ = {friction:g}") for friction in (0.3, 0.6, 1.0)]),
    ):
        marks: list[Mark] = []
        for (friction, load, label), color in zip(cases, (BLUE, ORANGE, GREEN), strict=True):
            # kN, and tan of the slip angle at λ = 1
            limit, knee = friction * load / 1e3, friction * load / (2.0 * STIFFNESS)
            at = np.degrees(np.arctan(knee))
            marks += [
                Line(degrees, dugoff_force(STIFFNESS, np.tan(slip), np.array(knee)) / 1e3, label, color, width=1.8),
                Level(y=limit, color=color, dash="dotted"),
                dots([-at, at], [-0.5 * limit, 0.5 * limit], color=color),
            ]
        marks.append(Line(degrees, STIFFNESS * np.tan(slip) / 1e3, r"$C_α\,\tan α$", TRUTH, "dashed", 0.9))
        force_axis = Axis("lateral force [kN]" if not panels else "", -6.6, 6.6)
        panels.append(Panel(marks, "slip angle α [deg]", force_axis, title, legend="lower right"))
    return Figure("dugoff",
        "The Dugoff tire of (3) to (5) without longitudinal slip, with the plus sign that (1) and (2) need and a cornering "
        "stiffness of 32.5 kN/rad. Dots: λ = 1, where the tire stops being linear, always at half of the friction limit "
        "μF_z; dotted: that limit, which is approached like μF_z (1 − λ/2) and never passed. P4 shows the generic curve as "
        "Fig. 1 and prints no tire values.",
        "Two panels of S-shaped curves of lateral force over slip angle: higher load or friction gives a higher plateau; all "
        "share the slope at the origin.",
        panels, (9.2, 3.7), share_y="all")  # fmt: skip


@TOPIC.part("tire", "The Dugoff tire and the sign of its force")
def tire(scope: Scope) -> PartResult:
    """The Dugoff tire; poles over speed and the response to a steering step, for both signs of its force."""
    speed, step = np.linspace(5.0, 40.0, 141), 0.01  # m/s, s
    time = np.arange(0.0, 2.0, step)
    mark = Words(SPEED + 0.4, 15.0, f"{SPEED:g} m/s", "0.35")
    left, right = list[Mark]([ZERO, Level(x=SPEED, color="0.5", dash="dotted"), mark]), list[Mark]([ZERO])
    for sign, color, label in ((1, BLUE, "plus (corrected)"), (-1, RED, "minus (as printed)")):
        left.append(Line(speed, single_track_poles(sign, speed), label, color, width=1.6))
        Phi, Gamma = zero_order_hold(*single_track(sign, SPEED), step)
        x, yaw = np.zeros(2), np.empty(len(time))
        for k in range(len(time)):
            yaw[k], x = x[1], Phi @ x + Gamma[:, 0] * np.radians(1.0)
        right.append(Line(time, np.degrees(yaw), label, color, width=1.6))
    poles, turn = Axis("real part of the poles [1/s]", -20, 20), Axis("yaw rate [deg/s]", -12.0, 12.0)
    figure = Figure("force-sign",
        "What the sign in (3) decides, on the linear single track of the same car (P5 values). Left: with the printed minus "
        "both poles lie in the right half plane at every speed, with the plus in the left one. Right: after a steering step "
        "to the left the corrected car turns left and settles; with the printed sign it turns right and diverges.",
        "Left: poles over speed, blue below zero, red above. Right: yaw rate after a step, blue settles at a positive value, "
        "red runs away to negative values.",
        [Panel(left, "speed [m/s]", poles, legend="lower right"),
         Panel(right, "time [s]", turn, f"step of 1° to the left at {SPEED:g} m/s", legend="upper right")],
        (9.2, 3.5))  # fmt: skip
    return PartResult(TOPIC.found(), (), [dugoff_figure(), figure], [SUBSTITUTES_NOTE])
