"""The vehicle of P3: loads at rest and under acceleration (26), (27), and the oscillator of the suspension compliance (14).

Exact statics of a car that stands still and rolls: the body rolls by r about a line at the height h_rc of the roll centre, left
side up (r > 0 in the frame x forward, y left, z up); the mass m_i of an axle then stands (h - h_rc) sin r to the right of the
middle. Its accelerometers read g sin r along y and g cos r along z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import sympy as sp

from analysis.loads import vertical_loads
from estimators.velocity import SuspensionCompliance, SuspensionParameters
from studies.claim import Finding, agrees
from studies.papers.resilient_velocity.inputs import COLOUR, DIRECTIONS, PACKAGE, PRINTED, Setting
from studies.papers.topic import Topic
from studies.papers.verdicts import derived, erratum
from studies.plots import DASHES, ZERO, Axis, Figure, Level, Line, Mark, Panel, Words, dots
from synthesis.models.catalogue.corner import Direction

TOPIC = Topic(PACKAGE)
ROLL, PITCH, GRAVITY, AXLE_MASS, HEIGHT, ROLL_HEIGHT, TRACK = sp.symbols("r p g m_i h h_rc T", positive=True)
ROLLED = math.radians(3.0)
FORCE = 3000.0  # N, a hard brake or curve at one wheel
DURATION = 0.2  # s


@dataclass(frozen=True)
class LoadFormula:
    """(27) with the sign of the normal acceleration in the levelling of a_y, a_n, and the arm of the sideways shift."""

    levelling: int  # +1: a_y cos r + a_n sin r as printed; -1: what levels the body
    arm: sp.Expr

    def level(self, lateral: sp.Expr, normal: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """a_phi_y and a_phi_n for readings of the inertial unit."""
        cos, sin = sp.cos(ROLL), self.levelling * sp.sin(ROLL)
        return lateral * cos + normal * sin, normal * cos - lateral * sin

    def wheels(self, lateral: sp.Expr, normal: sp.Expr) -> list[sp.Expr]:
        """F_z of the left and the right wheel of an axle."""
        y, n = self.level(lateral, normal)
        shift = self.arm * sp.sin(ROLL)
        return [AXLE_MASS / TRACK * (n * (TRACK / 2 + side * shift) + side * y * HEIGHT) for side in (-1, 1)]


AS_PRINTED = LoadFormula(1, ROLL_HEIGHT)
CORRECTED = LoadFormula(-1, HEIGHT - ROLL_HEIGHT)
AT_REST = (GRAVITY * sp.sin(ROLL), GRAVITY * sp.cos(ROLL))


def true_wheels() -> list[sp.Expr]:
    """Loads from the balance of forces and of moments about the middle of the track."""
    left, right = wheels = sp.symbols("F_L F_R")
    weight, offset = AXLE_MASS * GRAVITY, (HEIGHT - ROLL_HEIGHT) * sp.sin(ROLL)  # the offset to the right
    solved = sp.solve([left + right - weight, (right - left) * TRACK / 2 - weight * offset], wheels)
    return [solved[wheel] for wheel in wheels]


def reduced(expression: sp.Expr, angle: sp.Symbol = ROLL) -> sp.Expr:
    """A polynomial in sine and cosine with every square of the cosine replaced: zero if and only if it vanishes identically."""
    sine, cosine = sp.symbols("s c")
    polynomial = sp.expand(expression.subs({sp.sin(angle): sine, sp.cos(angle): cosine}))
    rest = sp.rem(polynomial, cosine**2 + sine**2 - 1, cosine)
    return sp.expand(rest).subs({sine: sp.sin(angle), cosine: sp.cos(angle)})


def residual(formula: LoadFormula) -> tuple[sp.Expr, ...]:
    """What the formula is off by at rest: (lateral acceleration, left load, right load); zeros if it is right."""
    wheels = zip(formula.wheels(*AT_REST), true_wheels(), strict=True)
    return tuple(reduced(e) for e in (formula.level(*AT_REST)[0], *(found - true for found, true in wheels)))


def axle_sum(formula: LoadFormula) -> sp.Expr:
    """F_L + F_R - m_i a_phi_n for any readings: zero if the axle load is conserved."""
    readings = sp.symbols("a_y a_n")
    return reduced(sum(formula.wheels(*readings)) - AXLE_MASS * formula.level(*readings)[1])


def pitched_car() -> sp.Expr:
    """a_theta_x of (26) at rest on a level road, nose down by p: readings -g sin p and g cos p; zero if (26) levels the body."""
    along, normal = -GRAVITY * sp.sin(PITCH), GRAVITY * sp.cos(PITCH)
    return reduced(along * sp.cos(PITCH) + normal * sp.sin(PITCH), PITCH)


@TOPIC.claim("P3-26")
def loads(setting: Setting = PRINTED) -> Finding:
    """Sums, lever rule and transfer hold; rolled at rest the printed roll sign and arm fail, the corrected ones hold."""
    v = setting.vehicle
    mass, height, track, base = (
        v["mass"],
        v["cg_height"],
        v["front_track"],
        v["front_axle_distance"] + v["rear_axle_distance"],
    )
    g, motions = setting.gravity, ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    rest, driving, turning = (vertical_loads(setting.parameters, *a, gravity=g) for a in motions)
    front, rear = float(rest.front), float(rest.rear)
    longitudinal, lateral = float(driving.rear) - rear, float(turning.front_right - rest.front_right)
    lever = (
        agrees(front, mass * g * v["rear_axle_distance"] / base, 1e-9 * front)
        and agrees(longitudinal, mass * height / base, 1e-9 * longitudinal)
        and agrees(lateral, front / g * height / track, 1e-9 * lateral)
    )
    sums = axle_sum(AS_PRINTED) == 0 and axle_sum(CORRECTED) == 0
    printed, corrected = residual(AS_PRINTED), residual(CORRECTED)
    at = {
        ROLL: ROLLED, GRAVITY: g, AXLE_MASS: front / g, HEIGHT: height, TRACK: track,
        ROLL_HEIGHT: v["roll_center_height"],
    }  # fmt: skip
    off = [float(sp.N(e.subs(at))) for e in printed]
    printed_holds, corrected_holds = (all(e == 0 for e in errors) for errors in (printed, corrected))
    computed = {
        "static_front_rear_N": [front, rear], "longitudinal_transfer_N_per_m_per_s2": longitudinal,
        "front_lateral_transfer_N_per_m_per_s2": lateral, "sums_conserved_exactly": sums,
        "pitch_reading_at_rest_nose_down": float(pitched_car()),
        "lateral_reading_at_rest_leaning_3_deg_m_per_s2": off[0],
        "front_left_load_error_at_rest_leaning_3_deg_N": off[1],
        "corrected_errors": [float(e) for e in corrected] if corrected_holds else [str(e) for e in corrected],
    }  # fmt: skip
    return Finding(
        computed,
        erratum(printed_holds, corrected_holds and lever and sums and pitched_car() == 0),
        f"Static loads {front:.1f} and {rear:.1f} N by the lever rule, transfer {longitudinal:.1f} N per m/s^2, "
        "sums conserved exactly. But (27) takes roll as left side up while a_phi_y levels with the opposite sign: "
        f"standing and leaning by 3 degrees it reads {off[0]:.2f} m/s^2 instead of 0 (g sin 2 phi). With a_phi_y = "
        "a_y cos phi - a_n sin phi and the roll arm h_CG - h_RC in place of h_RC the balance of moments holds exactly.",
    )


def compliance(setting: Setting, direction: Direction) -> tuple[float, float, float]:
    """Mass, damping and stiffness of (14): kg, N s/m, N/m."""
    v = setting.vehicle
    return v["unsprung_mass"], v["suspension_damping"], v[f"suspension_stiffness_{direction}"]


def table_of_estimator(setting: Setting) -> SuspensionParameters:
    """Table I as the runtime compliance takes it."""
    (mass, damping, along), (_, _, across) = (compliance(setting, direction) for direction in DIRECTIONS)
    return SuspensionParameters(along, across, damping, damping, mass)


@TOPIC.claim("P3-susp")
def modes(setting: Setting = PRINTED) -> Finding:
    """From the eigenvalues of (14), against sqrt(K/M) and C/(2 sqrt(K M))."""
    computed: dict[str, dict[str, float]] = {}
    holds = True
    for direction in DIRECTIONS:
        M, C, K = compliance(setting, direction)
        pole = complex(np.linalg.eigvals([[0.0, 1.0], [-K / M, -C / M]])[0])
        frequency, ratio = abs(pole), -pole.real / abs(pole)
        holds &= agrees(frequency, math.sqrt(K / M), 1e-9 * frequency) and 0.0 < ratio < 1.0
        holds &= agrees(ratio, C / (2.0 * math.sqrt(K * M)), 1e-9)
        computed[direction] = {
            "natural_frequency_rad_per_s": frequency, "natural_frequency_Hz": frequency / (2.0 * math.pi),
            "damping_ratio": ratio,
        }  # fmt: skip
    x, y = (computed[d] for d in DIRECTIONS)
    return Finding(
        computed,
        derived(holds),
        f"A wheel against the body swings at {x['natural_frequency_Hz']:.1f} Hz along (damping ratio "
        f"{x['damping_ratio']:.2f}) and {y['natural_frequency_Hz']:.1f} Hz across ({y['damping_ratio']:.2f}): well "
        "below the 100 Hz that 200 Hz sampling can show, and integrated exactly between samples.",
    )


def compliance_figure(setting: Setting = PRINTED) -> Figure:
    """Response of the wheel velocity to a force step, with the runtime at 200 Hz on it, and over frequency."""
    time, hertz = np.linspace(0.0, DURATION, 801), np.geomspace(0.5, 100.0, 400)
    samples = np.arange(1, round(DURATION / setting.sample_time) + 1) * setting.sample_time
    runtime, force = SuspensionCompliance(table_of_estimator(setting), setting.sample_time), np.full(4, FORCE)
    steps = np.stack([runtime.step(force, force).velocity[0] for _ in samples])
    left: list[Mark] = [ZERO]
    right: list[Mark] = []
    fastest = 0.0
    for k, (direction, dash) in enumerate(zip(DIRECTIONS, DASHES, strict=False)):
        M, C, K = compliance(setting, direction)
        colour, decay, natural = COLOUR[direction], 0.5 * C / M, math.sqrt(K / M) / (2.0 * math.pi)
        damped, s = math.sqrt(K / M - decay**2), 2j * np.pi * hertz
        response = FORCE / M / damped * np.exp(-decay * time) * np.sin(damped * time)
        fastest = max(fastest, float(response.max()))
        left.append(Line(1e3 * time, response, direction, colour, dash, 1.7))
        left.append(dots(1e3 * samples, steps[:, k], color=colour, size=3.2))
        right.append(Line(hertz, 1e6 * np.abs(s / (M * s**2 + C * s + K)), direction, colour, dash, 1.7))
        right.append(Level(x=natural, color=colour, dash="dotted"))
        right.append(Words(natural, 8.0 + 22.0 * k, f"{natural:.1f} Hz", colour, offset=(3, 0)))
    title, x, y = f"force step of {FORCE / 1e3:g} kN", "time after the step [ms]", "wheel against body [m/s]"
    frequency, amplitude = Axis("frequency of the force [Hz]", 0.5, 100.0, "log"), "velocity amplitude [mm/s per kN]"
    return Figure(
        "suspension-compliance",
        "Suspension compliance (14) with Table I: velocity of a wheel against the body after a step of the tire force (left; "
        "lines: continuous model, dots: the runtime estimator at 200 Hz, exact for held forces) and its amplitude over the "
        f"frequency of the force (right; dotted: natural frequencies). A step of 3 kN moves a wheel at up to {fastest:.2f} "
        "m/s against the body within some hundredths of a second, which a slip computed without it takes for slip.",
        "Left: two damped oscillations, the longitudinal one peaking at 0.44 m/s. Right: two resonance curves with "
        "equal peaks at 12.9 and 19.6 Hz.",
        [
            Panel(left, x, y, title, legend="upper right"),
            Panel(right, frequency, Axis(amplitude, 0.0), "frequency response"),
        ],
        size=(9.2, 3.7),
    )
