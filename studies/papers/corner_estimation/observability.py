"""P1-O3: what the outputs say of the lateral forces, and of the states of the velocity models."""

from __future__ import annotations

from functools import cache

import numpy as np
import sympy as sp

from analysis.observability.matrix import ObservabilityMatrix, observability_matrix, observability_of, rate_symbol
from analysis.observability.rank_loss import rank_loss
from estimators.arrays import FloatArray
from studies.claim import Finding, reproduced
from studies.papers.corner_estimation.inputs import CORNERS, SPEED_AXIS, STATED_SPEED, Corner, parameters, topic
from studies.plots import ZERO, Axis, Band, Figure, Line, Mark, Panel, Words, colours, dots
from studies.study import PartResult, Scope
from synthesis.models.catalogue.planar_force import planar_force_model

TOPIC = topic()
STEER = sp.Symbol("steering_angle")
RATE, RATE2 = rate_symbol("steering_angle"), rate_symbol("steering_angle", 2)
WHEEL_RATE = 800.0  # rad/s^2


@cache
def force_observability(third_output: str = "yaw_acceleration") -> ObservabilityMatrix:
    """O_3 of (12) for the model of (9), (10), with r' as third output, or without ("none": r as printed says nothing)."""
    model = planar_force_model(parameters(), "yaw_acceleration" if third_output == "yaw_acceleration" else "none")
    A, C = (sp.Matrix(part.jacobian(model.state_symbols)) for part in (model.f, model.h))
    return observability_of(A, C, {STEER: RATE, RATE: RATE2}, 3)


def ranks(third_output: str = "yaw_acceleration") -> dict[str, int]:
    """Exact rank while steering (0.1 rad), straight ahead, and straight with the steering moving or accelerating."""
    matrix = force_observability(third_output)
    names = {str(s) for s in matrix.matrix.free_symbols}
    car = {key: str(q.value) for key, q in parameters().vehicle.items() if key in names}
    still = {**car, **{str(s): 0 for s in (STEER, RATE, RATE2)}}
    cases = {"steering": {str(STEER): "0.1"}, "straight": {}, "through_straight": {str(RATE): "0.01"},
             "starting_to_steer": {str(RATE2): "0.01"}}  # fmt: skip
    return {name: matrix.rank_at(still | case) for name, case in cases.items()}


def determinants(third_output: str = "yaw_acceleration") -> tuple[sp.Expr, ...]:
    """Maximal minors of O_3 with the steering held: only det C is left of them."""
    return force_observability(third_output).minors({str(RATE): 0, str(RATE2): 0}, symbolic=True)


@TOPIC.claim("P1-O3")
def lateral_force_rank(third_output: str = "yaw_acceleration") -> Finding:
    """rank(O_3) = 3 iff delta != k pi at a constant angle: the minors vanish with sin(delta) and nowhere else."""
    minors, found, without = determinants(third_output), ranks(third_output), ranks("none")
    shares = [sp.simplify(minor / sp.sin(STEER) ** 2) for minor in minors]
    only_sine = bool(shares) and not any(STEER in share.free_symbols or share == 0 for share in shares)
    determinant = str(minors[0]) if minors else "0"
    computed = {"determinant": determinant, "ranks": found, "ranks_with_r_as_third_output": without}
    reading = (
        f"With (a_x, a_y, dr/dt) as outputs the determinant at a constant angle is {determinant}: rank "
        f"{found['steering']} while steering and {found['straight']} at delta = k pi, where the right-left difference "
        f"of the front forces is hidden. Steering through straight ahead shows it (rank {found['through_straight']}). "
        f"With r itself as third output, as printed, the yaw row is missing and the rank is {without['steering']}."
    )
    return Finding(computed, reproduced(only_sine and found["steering"] == 3 and found["straight"] == 2), reading)


@TOPIC.part("observability", "Observability of forces and velocities", 3.0)
def observability(scope: Scope) -> PartResult:
    """Observability of the lateral forces and of the velocities."""
    lost = lost_speeds(CORNERS["lateral"])[0]
    note = (
        f"The lateral velocity model loses rank at a constant wheel speed of {lost:.4f} rad/s "
        f"({lost * 0.33:.1f} m/s), inside the operating range; what is hidden there is the bristle deflection, "
        "which decays at kappa R_e |omega|, so the model stays detectable."
    )
    return PartResult(TOPIC.found(), figures=[force_figure(), velocity_figure()], notes=[note])


def force_figure() -> Figure:
    """det C(delta) of the lateral force model over the steering angle."""
    values = {sp.Symbol(name): q.value for name, q in parameters().vehicle.items()}
    function = sp.lambdify(STEER, determinants()[0].subs(values), "numpy")
    full = abs(float(function(np.pi / 2)))
    degrees = np.geomspace(0.05, 35.0, 200)
    marks: list[Mark] = [Line(degrees, np.abs(function(np.deg2rad(degrees))) / full)]
    for angle in (0.02, 0.08):
        at = np.rad2deg(angle), abs(float(function(angle))) / full
        marks += [dots(*at, color=colours.RED), Words(*at, f"{angle:g} rad: {at[1]:.1e}", offset=(8, -10))]
    labels = "steering angle [deg]", "determinant, share of its value at 90° [1]"
    x, y = (Axis(label, scale="log") for label in labels)
    return Figure(
        "force-observability",
        "Determinant of the output matrix of the lateral force model (outputs a_x, a_y and yaw acceleration) over "
        "the steering angle: it falls with the square of the sine and is zero straight ahead, where the right-left "
        "difference of the front forces cannot be seen. P1 (10), (12).",
        "A straight line of slope two on logarithmic axes: four ten-thousandths of its largest value at 0.02 radians.",
        Panel(marks, x, y), size=(4.8, 3.2),
    )  # fmt: skip


def velocity_determinant(corner: Corner, omega: FloatArray, rate: float) -> FloatArray:
    """det O_2 of the time-varying observability matrix over its value at rest, (g,)."""
    (determinant,) = observability_matrix(corner.model).minors()
    function = sp.lambdify(["wheel_speed", "wheel_speed_rate"], determinant, "numpy")
    return np.asarray(function(omega, rate) / function(0.0, 0.0) * np.ones_like(omega))


def lost_speeds(corner: Corner) -> list[float]:
    """Constant wheel speeds in the stated range at which rank is lost, rad/s; exact roots, rounded to floats."""
    return [float(root) for root in rank_loss(observability_matrix(corner.model)).roots_inside("wheel_speed")]


def velocity_figure() -> Figure:
    """Where the measured force says nothing of the bristle deflection."""
    omega = np.linspace(0.0, STATED_SPEED, 361)
    panels = []
    for direction, corner in CORNERS.items():
        slow, still, fast = (velocity_determinant(corner, omega, rate) for rate in (-WHEEL_RATE, 0.0, WHEEL_RATE))
        around = Band(omega, slow, fast, f"wheel acceleration within ±{WHEEL_RATE:g} rad/s²")
        marks: list[Mark] = [around, Line(omega, still, "constant wheel speed"), ZERO]
        for root in lost_speeds(corner):
            marks += [dots([root], [0.0], color=colours.RED), Words(root, 0.0, f"{root:.1f} rad/s", offset=(6, 8))]
        panels.append(Panel(marks, SPEED_AXIS, "determinant over its value at rest [1]", direction))
    return Figure(
        "velocity-observability",
        "Determinant of the time-varying observability matrix of the velocity models, over its value at rest. "
        "Laterally it vanishes inside the operating range (dot: constant wheel speed); the bristle deflection is "
        "hidden there, and decays by itself. Derived from P1 (22), (23), (36), (37).",
        "Longitudinally the determinant stays positive; laterally it crosses zero near 53 radians per second.",
        panels, legend="below", share_y="all",
    )  # fmt: skip
