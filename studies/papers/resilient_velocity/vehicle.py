"""The vehicle and the tire of P3: Table I, loads at rest and under acceleration (26), (27), suspension (14), LuGre tire (1), (2).

Exact statics of a car that stands still and rolls: the body rolls by r about a line at the height h_rc of the roll centre, left
side up (r > 0 in the frame x forward, y left, z up); the mass m_i of an axle then stands (h - h_rc) sin r to the right of the
middle. Its accelerometers read g sin r along y and g cos r along z.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pint
import sympy as sp
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from analysis.loads import vertical_loads
from estimators.arrays import FloatArray
from estimators.velocity import SuspensionCompliance, SuspensionParameters
from studies.claim import Finding, agrees
from studies.papers.resilient_velocity.inputs import COLOUR, DIRECTIONS, PACKAGE, PRINTED, Setting
from studies.papers.topic import Topic
from studies.papers.verdicts import derived, erratum
from studies.plots import DASHES, ZERO, Axis, Figure, Level, Line, Mark, Panel, Words, dots
from studies.plots.colours import CURVES
from studies.study import Cell, Table
from synthesis.models.catalogue.corner import Direction
from synthesis.models.parameter_set import quantities

TOPIC = Topic(PACKAGE)
SPEED = 40.0  # rad/s
FASTEST = 30.0  # m/s, where the search for the peak ends
ROADS = (1.0, 0.3)  # theta: dry, slippery
PRINTED_UNITS = {"kappa": "s/m", "z": "dimensionless"}  # Table I
CORRECTED_UNITS = {"kappa": "1/m", "z": "m"}
PATCH = 7.0 / 6.0  # kappa = 7/(6 L) for a contact patch of length L
ROLL, PITCH, GRAVITY, AXLE_MASS, HEIGHT, ROLL_HEIGHT, TRACK = sp.symbols("r p g m_i h h_rc T", positive=True)
FORCE = 3000.0  # N, a hard brake or curve at one wheel


class LoadFormula(NamedTuple):
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


def reduced(expression: sp.Expr, angle: sp.Symbol = ROLL) -> sp.Expr:
    """A polynomial in sine and cosine with every square of the cosine replaced: zero if and only if it vanishes identically."""
    sine, cosine = sp.symbols("s c")
    polynomial = sp.expand(expression.subs({sp.sin(angle): sine, sp.cos(angle): cosine}))
    rest = sp.rem(polynomial, cosine**2 + sine**2 - 1, cosine)
    return sp.expand(rest).subs({sine: sp.sin(angle), cosine: sp.cos(angle)})


def residual(formula: LoadFormula) -> tuple[sp.Expr, ...]:
    """What the formula is off by at rest: (lateral acceleration, left load, right load); zeros if it is right.

    The true loads follow from the balance of forces and of moments about the middle of the track.
    """
    left, right = wheels = sp.symbols("F_L F_R")
    weight, offset = AXLE_MASS * GRAVITY, (HEIGHT - ROLL_HEIGHT) * sp.sin(ROLL)  # the offset to the right
    true = sp.solve([left + right - weight, (right - left) * TRACK / 2 - weight * offset], wheels)
    off = [found - true[wheel] for found, wheel in zip(formula.wheels(*AT_REST), wheels, strict=True)]
    return tuple(reduced(e) for e in (formula.level(*AT_REST)[0], *off))


@TOPIC.claim("P3-26")
def loads(setting: Setting = PRINTED) -> Finding:
    """Sums, lever rule and transfer hold; rolled at rest the printed roll sign and arm fail, the corrected ones hold."""
    v = setting.vehicle
    mass, height, track, to_rear = (v[name] for name in ("mass", "cg_height", "front_track", "rear_axle_distance"))
    g, base = setting.gravity, v["front_axle_distance"] + to_rear
    motions = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    rest, driving, turning = (vertical_loads(setting.parameters, *a, gravity=g) for a in motions)
    front, rear = float(rest.front), float(rest.rear)
    longitudinal, lateral = float(driving.rear) - rear, float(turning.front_right - rest.front_right)
    lever = (
        agrees(front, mass * g * to_rear / base, 1e-9 * front)
        and agrees(longitudinal, mass * height / base, 1e-9 * longitudinal)
        and agrees(lateral, front / g * height / track, 1e-9 * lateral)
    )
    # a_theta_x of (26) at rest on a level road, nose down by p: zero if (26) levels the body.
    along, normal = -GRAVITY * sp.sin(PITCH), GRAVITY * sp.cos(PITCH)
    pitched = reduced(along * sp.cos(PITCH) + normal * sp.sin(PITCH), PITCH)
    readings, formulas = sp.symbols("a_y a_n"), (AS_PRINTED, CORRECTED)
    sums = all(reduced(sum(f.wheels(*readings)) - AXLE_MASS * f.level(*readings)[1]) == 0 for f in formulas)
    printed, corrected = residual(AS_PRINTED), residual(CORRECTED)
    leaning = {ROLL: math.radians(3.0), GRAVITY: g, AXLE_MASS: front / g}
    car = {HEIGHT: height, TRACK: track, ROLL_HEIGHT: v["roll_center_height"]}
    off = [float(sp.N(e.subs(leaning | car))) for e in printed]
    printed_holds, corrected_holds = (all(e == 0 for e in errors) for errors in (printed, corrected))
    computed = {
        "static_front_rear_N": [front, rear], "longitudinal_transfer_N_per_m_per_s2": longitudinal,
        "front_lateral_transfer_N_per_m_per_s2": lateral, "sums_conserved_exactly": sums,
        "pitch_reading_at_rest_nose_down": float(pitched),
        "lateral_reading_at_rest_leaning_3_deg_m_per_s2": off[0],
        "front_left_load_error_at_rest_leaning_3_deg_N": off[1],
        "corrected_errors": [float(e) for e in corrected] if corrected_holds else [str(e) for e in corrected]}  # fmt: skip
    reading = (
        f"Static loads {front:.1f} and {rear:.1f} N by the lever rule, transfer {longitudinal:.1f} N per m/s^2, "
        "sums conserved exactly. But (27) takes roll as left side up while a_phi_y levels with the opposite sign: "
        f"standing and leaning by 3 degrees it reads {off[0]:.2f} m/s^2 instead of 0 (g sin 2 phi). With a_phi_y = "
        "a_y cos phi - a_n sin phi and the roll arm h_CG - h_RC in place of h_RC the balance of moments holds exactly."
    )
    return Finding(computed, erratum(printed_holds, corrected_holds and lever and sums and pitched == 0), reading)


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
    computed, holds = dict[str, dict[str, float]](), True
    for direction in DIRECTIONS:
        M, C, K = compliance(setting, direction)
        pole = complex(np.linalg.eigvals([[0.0, 1.0], [-K / M, -C / M]])[0])
        frequency, ratio = abs(pole), -pole.real / abs(pole)
        holds &= agrees(frequency, math.sqrt(K / M), 1e-9 * frequency) and 0.0 < ratio < 1.0
        holds &= agrees(ratio, C / (2.0 * math.sqrt(K * M)), 1e-9)
        computed[direction] = {"natural_frequency_rad_per_s": frequency, "damping_ratio": ratio}
        computed[direction]["natural_frequency_Hz"] = frequency / (2.0 * math.pi)
    x, y = (computed[d] for d in DIRECTIONS)
    return Finding(computed, derived(holds), (
        f"A wheel against the body swings at {x['natural_frequency_Hz']:.1f} Hz along (damping ratio "
        f"{x['damping_ratio']:.2f}) and {y['natural_frequency_Hz']:.1f} Hz across ({y['damping_ratio']:.2f}): well "
        "below the 100 Hz that 200 Hz sampling can show, and integrated exactly between samples."))  # fmt: skip


def _compliance_figure() -> Figure:
    time, hertz = np.linspace(0.0, 0.2, 801), np.geomspace(0.5, 100.0, 400)
    samples = np.arange(1, round(0.2 / PRINTED.sample_time) + 1) * PRINTED.sample_time
    runtime, force = SuspensionCompliance(table_of_estimator(PRINTED), PRINTED.sample_time), np.full(4, FORCE)
    steps = np.stack([runtime.step(force, force).velocity[0] for _ in samples])
    left, right, fastest = list[Mark]([ZERO]), list[Mark](), 0.0
    for k, (direction, dash) in enumerate(zip(DIRECTIONS, DASHES, strict=False)):
        M, C, K = compliance(PRINTED, direction)
        colour, decay, natural = COLOUR[direction], 0.5 * C / M, math.sqrt(K / M) / (2.0 * math.pi)
        damped, s = math.sqrt(K / M - decay**2), 2j * np.pi * hertz
        response = FORCE / M / damped * np.exp(-decay * time) * np.sin(damped * time)
        fastest = max(fastest, float(response.max()))
        left.append(Line(1e3 * time, response, direction, colour, dash, 1.7))
        left.append(dots(1e3 * samples, steps[:, k], color=colour, size=3.2))
        amplitude, words = 1e6 * np.abs(s / (M * s**2 + C * s + K)), f"{natural:.1f} Hz"
        right += [Line(hertz, amplitude, direction, colour, dash, 1.7), Level(x=natural, color=colour, dash="dotted")]
        right.append(Words(natural, 8.0 + 22.0 * k, words, colour, offset=(3, 0)))
    title, x, y = f"force step of {FORCE / 1e3:g} kN", "time after the step [ms]", "wheel against body [m/s]"
    frequency = Axis("frequency of the force [Hz]", 0.5, 100.0, "log")
    return Figure("suspension-compliance",
        "Suspension compliance (14) with Table I: velocity of a wheel against the body after a step of the tire force (left; "
        "lines: continuous model, dots: the runtime estimator at 200 Hz, exact for held forces) and its amplitude over the "
        f"frequency of the force (right; dotted: natural frequencies). A step of 3 kN moves a wheel at up to {fastest:.2f} "
        "m/s against the body within some hundredths of a second, which a slip computed without it takes for slip.",
        "Left: two damped oscillations, the longitudinal one peaking at 0.44 m/s. Right: two resonance curves with "
        "equal peaks at 12.9 and 19.6 Hz.",
        [Panel(left, x, y, title, legend="upper right"),
         Panel(right, frequency, Axis("velocity amplitude [mm/s per kN]", 0.0), "frequency response")], (9.2, 3.7))  # fmt: skip


def stribeck(setting: Setting, velocity: ArrayLike) -> FloatArray:
    """g(v) = mu_c + (mu_s - mu_c) exp(-|v/V_s|^0.5), shape of `velocity`."""
    v = setting.vehicle
    sliding, static = v["friction_sliding"], v["friction_static"]
    ratio = np.abs(np.asarray(velocity, float)) / v["stribeck_velocity"]
    return np.asarray(sliding + (static - sliding) * np.exp(-np.sqrt(ratio)))


def steady(
    setting: Setting, direction: Direction, velocity: ArrayLike, road: float, speed: float = SPEED
) -> tuple[FloatArray, FloatArray]:
    """Normalised force f and friction disturbance rho_z [m/s] at slip velocities v [m/s], road parameter theta, ``speed`` rad/s.

    z' = 0 in (1): z = v / (a + sigma0 |v| / (theta g)), f = sigma0 z + sigma2 v, rho_z = -sigma0 |v| z / (theta g)
    """
    tire, v = setting.parameters.tire[direction], np.asarray(velocity, float)
    pull = tire.sigma0.value * np.abs(v) / (road * stribeck(setting, v))
    z = v / (setting.rolling_rate(direction, speed) + pull)
    return np.asarray(tire.sigma0.value * z + tire.sigma2.value * v), np.asarray(-pull * z)


def peak(setting: Setting, direction: Direction, road: float) -> tuple[float, float]:
    """(slip velocity in m/s, normalised force) of the first maximum of the steady force.

    The first: on slippery roads the viscous term lifts the force above it again at slip velocities that no wheel reaches.
    Raises ValueError if the force rises all the way to 30 m/s.
    """
    grid = np.linspace(0.0, FASTEST, 3001)
    falls = np.flatnonzero(np.diff(steady(setting, direction, grid, road)[0]) < 0.0)
    if not len(falls):
        raise ValueError(f"{direction}, theta = {road:g}: the steady force has no maximum below {FASTEST:g} m/s")
    ends = grid[max(falls[0] - 1, 0)], grid[falls[0] + 1]
    found = minimize_scalar(
        lambda v: -float(steady(setting, direction, v, road)[0]), bounds=ends, method="bounded", options={"xatol": 1e-9}
    )
    return float(found.x), -float(found.fun)


def consistent(units: dict[str, str]) -> bool:
    """Whether every term of z' = v_r - kappa R_e |omega| z has one dimension."""
    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    named = units["kappa"], units["z"], "m/s", "m", "rad/s"
    kappa, z, slip, radius, speed = (registry.Quantity(1.0, unit) for unit in named)
    change = z / registry.Quantity(1.0, "s")
    return all(term.check(change.dimensionality) for term in (slip, kappa * radius * speed * z))


@TOPIC.claim("P3-lugre")
def steady_curve(setting: Setting = PRINTED) -> Finding:
    """Slope and peaks of the steady force, bound of the friction disturbance, and the unit of kappa that Table I misprints."""
    printed, corrected, tire = consistent(PRINTED_UNITS), consistent(CORRECTED_UNITS), setting.parameters.tire
    stiffness = {d: tire[d].sigma0.value / tire[d].kappa.value for d in DIRECTIONS}
    small = 1e-7  # m/s: the slope at the origin, over the slip v / (R_e omega)
    travel = setting.vehicle["effective_radius"] * SPEED
    slope = float(steady(setting, "longitudinal", small, 1.0)[0]) / small * travel
    viscous = tire["longitudinal"].sigma2.value * travel
    peaks = {f"{road:g}": list(peak(setting, "longitudinal", road)) for road in ROADS}
    v = np.linspace(-FASTEST, FASTEST, 6001)
    largest = np.max([np.abs(steady(setting, d, v, road)[1]) for d in DIRECTIONS for road in ROADS], axis=0)
    bounded = bool((largest <= np.abs(v) * (1 + 1e-12)).all())
    holds = corrected and not printed and bounded and abs(slope - viscous - stiffness["longitudinal"]) < 1e-4
    computed = {
        "slip_stiffness": stiffness, "slope_at_origin": slope, "peak_velocity_and_force_by_road": peaks,
        "disturbance_at_most_slip_velocity": bounded,
        "contact_patch_m": {d: PATCH / tire[d].kappa.value for d in DIRECTIONS},
        "printed_units_consistent": printed, "corrected_units_consistent": corrected}  # fmt: skip
    return Finding(computed, derived(holds), (
        f"At {SPEED:g} rad/s the steady longitudinal force rises with sigma0/kappa = {stiffness['longitudinal']:.2f} "
        "per unit of slip and peaks at "
        + " and ".join(f"{f:.3f} at {at:.2f} m/s (theta = {road})" for road, (at, f) in peaks.items())
        + ". The friction term never exceeds the slip velocity, so it is a bounded disturbance. kappa must be in 1/m "
        "and z in m: with the printed units s/m and 1 (1) adds unlike quantities."))  # fmt: skip


def _table() -> Table:
    rows: list[list[Cell]] = [
        [f"{name}, {d}", q.value, q.unit, PRINTED_UNITS.get(name, q.unit)]
        for d in DIRECTIONS for name, q in quantities(PRINTED.parameters.tire[d]).items()]  # fmt: skip
    rows += [[name.replace("_", " "), q.value, q.unit, q.unit] for name, q in PRINTED.parameters.vehicle.items()]
    for name, gain in (*PRINTED.gains.items(), ("longitudinal, high slip", PRINTED.high_slip)):
        rows += [[f"gain L{k + 1}, {name}", gain[k], unit, "not printed"] for k, unit in enumerate(("m/s", "m/s^2"))]
    return Table("table-1",
        "Table I of P3 with the gains of the road tests, as every result of this study uses them. The unit of kappa is "
        "corrected: with s/m the bristle equation (1) would add unlike quantities.",
        ("quantity", "value", "unit used", "unit printed"), rows)  # fmt: skip


def _friction_figure() -> Figure:
    v = np.linspace(0.0, 13.0, 1301)
    left, right = list[Mark](), list[Mark]()
    pairs = [(d, road) for d in DIRECTIONS for road in ROADS]
    for (direction, road), colour, dash in zip(pairs, CURVES, DASHES, strict=False):
        force, disturbance = steady(PRINTED, direction, v, road)
        left.append(Line(v, force, f"{direction}, θ = {road:g}", colour, dash, 1.7))
        right.append(Line(v[1:], np.abs(disturbance[1:]) / v[1:], color=colour, dash=dash, width=1.7))
        if direction == "longitudinal":  # the softer lateral tire rises all the way
            left.append(dots(*peak(PRINTED, direction, road), color=colour, hollow=True))
    slip, share = "slip velocity v [m/s]", Axis("share |ϱ| / |v| [1]", 0.0, 1.0)
    return Figure("lugre-curves",
        f"Steady average lumped LuGre tire (1), (2) with Table I at {SPEED:g} rad/s (13.2 m/s): normalised force over slip "
        "velocity on a dry (θ = 1) and a slippery road (θ = 0.3), circles at the first maximum (left), and the friction term "
        "that the linear observer models treat as a disturbance, as a share of the slip velocity (right). It never exceeds "
        "the slip velocity, and nearly reaches it once the tire slides: then the force says little about slip.",
        "Left: force curves rising to a plateau, 0.92 on dry road and 0.29 on the slippery one. Right: shares "
        "rising from zero towards one, first for the longitudinal tire on the slippery road.",
        [Panel(left, Axis(slip, 0.0, v[-1]), Axis("normalised force f [1]", 0.0), "steady force"),
         Panel(right, Axis(slip, v[1], v[-1], "log"), share, "slip velocity hidden by friction")],
        (9.2, 3.9), "below")  # fmt: skip


TOPIC.show("vehicle", "Table I, loads, suspension and tire", 0.7, (), [_table], [_compliance_figure, _friction_figure])
