"""The floor: what the friction term hides from any observer of this structure, and what the runtime observers do miss.

At rest of the bristle P1 (18) gives, with a = kappa R_e |w| and theta the friction level (g about 1),

    z = v_r/(a + sigma0 |v_r|/theta),   Omega_z = -sigma0 |v_r| z/theta = -v_r s/(1 + s),   s = sigma0 |v_r|/(theta a).

The static gain from Omega_z to the velocity error is -sigma0/(sigma0 + sigma2 a) for every gain with L_2 != 0
(:func:`analysis.norms.static_gain.static_gain`), so the share of the slip velocity that is missed,

    (v_r - v_r_hat)/v_r = s/(1 + s) sigma0/(sigma0 + sigma2 a),   s = (sigma0/kappa) |lambda|/theta,   lambda = v_r/(R_e w),

depends on slip, friction and tire alone. No gain, schedule or degree changes it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.norms.static_gain import static_gain
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from estimators.velocity import LpvVelocityObserver
from studies.beyond.observers import SHIPPED
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Line, Mark, Panel, dots
from studies.plots.colours import ROADS
from studies.study import Cell, PartResult, Scope, Table
from studies.truth.lugre import LuGreParameters
from synthesis.models.catalogue import corner_velocity_model
from synthesis.models.parameter_set import Tire, load_parameter_set

TOPIC = Topic("studies.beyond.friction_floor")
FRICTIONS = (0.2, 0.35, 0.5, 0.8, 1.0)  # of the roads, 1
SLIPS = (0.003, 0.01, 0.02, 0.05, 0.1, 0.3, 1.0)
WHEEL_SPEEDS = (15.0, 40.0, 90.0)  # rad/s
SETTLED = 6.0  # s: sixty time constants of the slowest shipped observer


def hidden_ratio(tire: Tire, slip: ArrayLike, friction: ArrayLike) -> FloatArray:
    """s = (sigma0/kappa) |lambda|/theta [1]: the slip that friction hides over the slip that deflects the bristles."""
    stiffness = tire.sigma0.value / tire.kappa.value
    return np.asarray(stiffness * np.abs(slip) / np.asarray(friction))


def missed_share(tire: Tire, radius: float, wheel_speed: ArrayLike, slip: ArrayLike, friction: ArrayLike) -> FloatArray:
    """(v_r - v_r_hat)/v_r [1] at rest; ``wheel_speed`` rad/s, ``slip`` v_r/(R_e w), ``friction`` theta, broadcast."""
    s = hidden_ratio(tire, slip, friction)
    a = tire.kappa.value * radius * np.abs(np.asarray(wheel_speed))
    return np.asarray(s / (1.0 + s) * tire.sigma0.value / (tire.sigma0.value + tire.sigma2.value * a))


def resting_force(
    tire: Tire, radius: float, wheel_speed: ArrayLike, slip: ArrayLike, friction: ArrayLike
) -> FloatArray:
    """mu = sigma0 z + sigma2 v_r of P1 (19) with the bristle at rest: what a force sensor would say."""
    speed = radius * np.asarray(wheel_speed)
    relative = np.asarray(slip) * speed
    rate = tire.kappa.value * np.abs(speed) + tire.sigma0.value * np.abs(relative) / np.asarray(friction)
    return np.asarray(tire.sigma0.value * relative / rate + tire.sigma2.value * relative)


def friction_curve(tire: LuGreParameters, relative: ArrayLike) -> FloatArray:
    """g(v_r) [1] of P1 below (19) with exponent 0.5: falls from mu_s to mu_c over the Stribeck velocity; v_r in m/s."""
    fall = np.exp(-np.sqrt(np.abs(relative) / tire.stribeck))
    return np.asarray(tire.sliding + (tire.static - tire.sliding) * fall)


@dataclass(frozen=True)
class Missed:
    """Shares (wheel speeds, friction, slip), predicted and missed by the observer of one shipped schedule."""

    schedule: str
    predicted: FloatArray
    simulated: FloatArray

    @property
    def largest_gap(self) -> float:
        """Largest difference of both [1]."""
        return float(np.max(np.abs(self.predicted - self.simulated)))


def missed_by(schedule_name: str, friction: ArrayLike, slip: ArrayLike) -> Missed:
    """Hold each resting tire for ``SETTLED`` s before the observer of the shipped schedule, all in one batch."""
    schedule, (values, direction) = GainSchedule.shipped(schedule_name), SHIPPED[schedule_name]
    parameters = load_parameter_set(values)
    tire, radius = parameters.tire[direction], parameters.vehicle["effective_radius"].value
    speed, theta, ratio = np.meshgrid(WHEEL_SPEEDS, friction, slip, indexing="ij")
    measured = resting_force(tire, radius, speed, ratio, theta)
    observer, still = LpvVelocityObserver(schedule, speed.shape, stale_after=None), np.zeros_like(speed)
    for _ in range(round(SETTLED / schedule.sample_time) + 1):
        step = observer.step(still, measured, speed)
    true = ratio * radius * speed
    simulated = (true - step.estimate[..., 1]) / true
    return Missed(schedule_name, missed_share(tire, radius, speed, ratio, theta), simulated)


@TOPIC.part("theory", "The floor in closed form, and the runtime observers at rest", 15.0)
def theory(_: Scope) -> PartResult:
    """Closed form against the runtime observer of every shipped schedule."""
    rows, found = list[list[Cell]](), [missed_by(name, FRICTIONS, SLIPS) for name in SHIPPED]
    for missed in found:
        values, direction = SHIPPED[missed.schedule]
        model = corner_velocity_model(load_parameter_set(values), direction, wheel_speed_maximum=140.0)
        free = static_gain(model, "friction", "relative_velocity").free_of_gain
        shares = (round(100 * float(missed.simulated[1, 1, k]), 1) for k in (1, 3, 5))
        rows.append([missed.schedule, str(free), *shares, missed.largest_gap])
    caption = (
        f"Share of the slip velocity missed at rest, at {WHEEL_SPEEDS[1]:g} rad/s and friction {FRICTIONS[1]:g}; the last "
        "column is the largest difference between closed form and runtime observer over all wheel speeds, frictions and "
        "slips."
    )
    columns = [
        "schedule", "static gain free of L", "at slip 0.01 [%]", "at slip 0.05 [%]", "at slip 0.3 [%]",
        "largest difference [1]",
    ]  # fmt: skip
    note = (
        "The static gain from the friction term to the velocity error is the same for every observer gain. What a corner "
        "observer of this structure misses of the slip velocity is therefore s/(1 + s) with s = (sigma0/kappa) "
        "|slip|/friction, whatever its schedule: half of it already where the slip is friction over slip stiffness."
    )
    shipped, fine, marks = load_parameter_set("corner-estimation"), np.geomspace(SLIPS[0], SLIPS[-1], 200), list[Mark]()
    radius = shipped.vehicle["effective_radius"].value
    for theta, simulated, colour in zip(FRICTIONS, found[0].simulated[1], ROADS, strict=True):
        line = missed_share(shipped.tire["longitudinal"], radius, WHEEL_SPEEDS[1], fine, theta)
        marks += [Line(100 * fine, 100 * line, f"friction {theta:g}", colour)]
        marks += [dots(100 * np.array(SLIPS), 100 * simulated, color=colour, size=4)]
    x, y = Axis("slip $v_r/(R_e\\omega)$ [%]", scale="log"), Axis("share of the slip velocity missed [%]", 0, 100)
    figure = Figure(
        "missed-shares",
        f"Share of the slip velocity that the longitudinal corner observer misses at {WHEEL_SPEEDS[1]:g} rad/s: closed form "
        "(lines) and the runtime observer held before a resting tire (points). No gain changes the lines.",
        "Curves of the missed share rising with slip from near zero to near one hundred per cent, earlier on slippery roads.",
        Panel(marks, x, y, legend="lower right"), (6.4, 4.0),
    )  # fmt: skip
    gap = max(missed.largest_gap for missed in found)
    return PartResult((), [Table("shares", caption, columns, rows)], [figure], [note], {"largest difference": gap})
