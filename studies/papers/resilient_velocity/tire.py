"""Table I, and the steady average lumped LuGre tire (1), (2): force and friction disturbance at a held slip velocity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pint
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from estimators.arrays import FloatArray
from studies.claim import Finding
from studies.papers.resilient_velocity import vehicle
from studies.papers.resilient_velocity.inputs import DIRECTIONS, PACKAGE, PRINTED, Setting
from studies.papers.topic import Topic
from studies.papers.verdicts import derived
from studies.plots import DASHES, Axis, Figure, Line, Mark, Panel, dots
from studies.plots.colours import CURVES
from studies.study import Cell, PartResult, Scope, Table
from synthesis.models.catalogue.corner import Direction
from synthesis.models.parameter_set import quantities

TOPIC = Topic(PACKAGE)
SPEED = 40.0  # rad/s
FASTEST = 30.0  # m/s, where the search for the peak ends
ROADS = (1.0, 0.3)  # theta: dry, slippery
PRINTED_UNITS = {"kappa": "s/m", "z": "dimensionless"}  # Table I
CORRECTED_UNITS = {"kappa": "1/m", "z": "m"}
PATCH = 7.0 / 6.0  # kappa = 7/(6 L) for a contact patch of length L


class Steady(NamedTuple):
    """At slip velocities (...) in m/s: normalised force 1, friction disturbance rho_z m/s."""

    force: FloatArray
    disturbance: FloatArray


def stribeck(setting: Setting, velocity: ArrayLike) -> FloatArray:
    """g(v) = mu_c + (mu_s - mu_c) exp(-|v/V_s|^0.5), shape of `velocity`."""
    v = setting.vehicle
    sliding, static = v["friction_sliding"], v["friction_static"]
    ratio = np.abs(np.asarray(velocity, float)) / v["stribeck_velocity"]
    return np.asarray(sliding + (static - sliding) * np.exp(-np.sqrt(ratio)))


def steady(setting: Setting, direction: Direction, velocity: ArrayLike, road: float, speed: float = SPEED) -> Steady:
    """z' = 0 in (1) at slip velocities v, road parameter theta and a wheel speed in rad/s:

    z = v / (a + sigma0 |v| / (theta g)), f = sigma0 z + sigma2 v, rho_z = -sigma0 |v| z / (theta g)
    """
    tire, v = setting.parameters.tire[direction], np.asarray(velocity, float)
    pull = tire.sigma0.value * np.abs(v) / (road * stribeck(setting, v))
    z = v / (setting.rolling_rate(direction, speed) + pull)
    return Steady(tire.sigma0.value * z + tire.sigma2.value * v, -pull * z)


def peak(setting: Setting, direction: Direction, road: float, speed: float = SPEED) -> tuple[float, float]:
    """(slip velocity in m/s, normalised force) of the first maximum of the steady force.

    The first: on slippery roads the viscous term lifts the force above it again at slip velocities that no wheel reaches.
    Raises ValueError if the force rises all the way to 30 m/s.
    """
    grid = np.linspace(0.0, FASTEST, 3001)
    falls = np.flatnonzero(np.diff(steady(setting, direction, grid, road, speed).force) < 0.0)
    if not len(falls):
        raise ValueError(f"{direction}, theta = {road:g}: the steady force has no maximum below {FASTEST:g} m/s")
    found = minimize_scalar(
        lambda v: -float(steady(setting, direction, v, road, speed).force),
        bounds=(grid[max(falls[0] - 1, 0)], grid[falls[0] + 1]),
        method="bounded",
        options={"xatol": 1e-9},
    )
    return float(found.x), -float(found.fun)


def consistent(units: dict[str, str]) -> bool:
    """Whether every term of z' = v_r - kappa R_e |omega| z has one dimension."""
    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    kappa, z, metre, second, rate = (
        registry.Quantity(1.0, unit) for unit in (units["kappa"], units["z"], "m", "s", "rad/s")
    )
    change = z / second
    return all(term.check(change.dimensionality) for term in (metre / second, kappa * metre * rate * z))


@TOPIC.claim("P3-lugre")
def steady_curve(setting: Setting = PRINTED) -> Finding:
    """Slope and peaks of the steady force, bound of the friction disturbance, and the unit of kappa that Table I misprints."""
    printed, corrected = consistent(PRINTED_UNITS), consistent(CORRECTED_UNITS)
    tire = setting.parameters.tire
    stiffness = {d: tire[d].sigma0.value / tire[d].kappa.value for d in DIRECTIONS}
    small = 1e-7  # m/s: the slope at the origin, over the slip v / (R_e omega)
    travel = setting.vehicle["effective_radius"] * SPEED
    slope = float(steady(setting, "longitudinal", small, 1.0).force) / small * travel
    viscous = tire["longitudinal"].sigma2.value * travel
    peaks = {f"{road:g}": list(peak(setting, "longitudinal", road)) for road in ROADS}
    v = np.linspace(-FASTEST, FASTEST, 6001)
    largest = np.max([np.abs(steady(setting, d, v, road).disturbance) for d in DIRECTIONS for road in ROADS], axis=0)
    bounded = bool((largest <= np.abs(v) * (1 + 1e-12)).all())
    holds = corrected and not printed and bounded and abs(slope - viscous - stiffness["longitudinal"]) < 1e-4
    computed = {
        "slip_stiffness": stiffness, "slope_at_origin": slope, "peak_velocity_and_force_by_road": peaks,
        "disturbance_at_most_slip_velocity": bounded,
        "contact_patch_m": {d: PATCH / tire[d].kappa.value for d in DIRECTIONS},
        "printed_units_consistent": printed, "corrected_units_consistent": corrected,
    }  # fmt: skip
    return Finding(
        computed,
        derived(holds),
        f"At {SPEED:g} rad/s the steady longitudinal force rises with sigma0/kappa = {stiffness['longitudinal']:.2f} "
        "per unit of slip and peaks at "
        + " and ".join(f"{f:.3f} at {at:.2f} m/s (theta = {road})" for road, (at, f) in peaks.items())
        + ". The friction term never exceeds the slip velocity, so it is a bounded disturbance. kappa must be in 1/m "
        "and z in m: with the printed units s/m and 1 (1) adds unlike quantities.",
    )


@TOPIC.part("vehicle", "Table I, loads, suspension and tire", 0.7)
def vehicle_and_tire(_: Scope) -> PartResult:
    """Loads, suspension and tire; tire constants, vehicle and gains, with the units that the equations need."""
    rows: list[tuple[Cell, ...]] = []
    for d in DIRECTIONS:
        for name, q in quantities(PRINTED.parameters.tire[d]).items():
            rows.append((f"{name}, {d}", q.value, q.unit, PRINTED_UNITS.get(name, q.unit)))
    rows += [(name.replace("_", " "), q.value, q.unit, q.unit) for name, q in PRINTED.parameters.vehicle.items()]
    for name, gain in (*PRINTED.gains.items(), ("longitudinal, high slip", PRINTED.high_slip)):
        for index, unit in enumerate(("m/s", "m/s^2")):
            rows.append((f"gain L{index + 1}, {name}", gain[index], unit, "not printed"))
    table = Table(
        "table-1",
        "Table I of P3 with the gains of the road tests, as every result of this study uses them. The unit of "
        "kappa is corrected: with s/m the bristle equation (1) would add unlike quantities.",
        ("quantity", "value", "unit used", "unit printed"),
        rows,
    )
    figures = [vehicle.compliance_figure(), friction_figure()]
    return PartResult([*vehicle.TOPIC.found(), *TOPIC.found()], [table], figures)


def friction_figure(setting: Setting = PRINTED) -> Figure:
    """Steady force over slip velocity, and the friction disturbance that the observers do not know."""
    v = np.linspace(0.0, 13.0, 1301)
    left: list[Mark] = []
    right: list[Mark] = []
    pairs = [(d, road) for d in DIRECTIONS for road in ROADS]
    for (direction, road), colour, dash in zip(pairs, CURVES, DASHES, strict=False):
        found = steady(setting, direction, v, road)
        left.append(Line(v, found.force, f"{direction}, θ = {road:g}", colour, dash, 1.7))
        right.append(Line(v[1:], np.abs(found.disturbance[1:]) / v[1:], color=colour, dash=dash, width=1.7))
        if direction == "longitudinal":  # the softer lateral tire rises all the way
            left.append(dots(*peak(setting, direction, road), color=colour, hollow=True))
    slip, share = "slip velocity v [m/s]", Axis("share |ϱ| / |v| [1]", 0.0, 1.0)
    return Figure(
        "lugre-curves",
        f"Steady average lumped LuGre tire (1), (2) with Table I at {SPEED:g} rad/s (13.2 m/s): normalised force over slip "
        "velocity on a dry (θ = 1) and a slippery road (θ = 0.3), circles at the first maximum (left), and the friction term "
        "that the linear observer models treat as a disturbance, as a share of the slip velocity (right). It never exceeds "
        "the slip velocity, and nearly reaches it once the tire slides: then the force says little about slip.",
        "Left: force curves rising to a plateau, 0.92 on dry road and 0.29 on the slippery one. Right: shares "
        "rising from zero towards one, first for the longitudinal tire on the slippery road.",
        [
            Panel(left, Axis(slip, 0.0, v[-1]), Axis("normalised force f [1]", 0.0), "steady force"),
            Panel(right, Axis(slip, v[1], v[-1], "log"), share, "slip velocity hidden by friction"),
        ],
        size=(9.2, 3.9),
        legend="below",
    )
