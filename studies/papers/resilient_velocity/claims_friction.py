"""(1), (2): the steady LuGre curve, and the unit of kappa that Table I misprints."""

from __future__ import annotations

import numpy as np
import pint

from studies.claim import ClaimFunction, Finding
from studies.papers.resilient_velocity.friction import FASTEST, SPEED, peak, steady
from studies.papers.resilient_velocity.setting import DIRECTIONS, PRINTED, Setting
from studies.papers.verdicts import derived

ROADS = (1.0, 0.3)  # theta: dry, slippery
PRINTED_UNITS = {"kappa": "s/m", "z": "dimensionless"}  # Table I
CORRECTED_UNITS = {"kappa": "1/m", "z": "m"}
PATCH = 7.0 / 6.0  # kappa = 7/(6 L) for a contact patch of length L


def consistent(units: dict[str, str], registry: pint.UnitRegistry[float]) -> bool:
    """Whether every term of z' = v_r - kappa R_e |omega| z has one dimension."""
    rolling = registry.Quantity(1.0, units["kappa"]) * registry.Quantity(1.0, "m") * registry.Quantity(1.0, "rad/s")
    terms = [
        registry.Quantity(1.0, units["z"]) / registry.Quantity(1.0, "s"),
        registry.Quantity(1.0, "m/s"),
        rolling * registry.Quantity(1.0, units["z"]),
    ]
    return all(term.check(terms[0].dimensionality) for term in terms)


def steady_curve(setting: Setting = PRINTED) -> Finding:
    """P3-lugre."""
    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    printed, corrected = consistent(PRINTED_UNITS, registry), consistent(CORRECTED_UNITS, registry)
    tire = setting.parameters.tire
    stiffness = {d: tire[d].sigma0.value / tire[d].kappa.value for d in DIRECTIONS}
    small = 1e-7  # m/s: the slope at the origin, over the slip v / (R_e omega)
    travel = setting.parameters.vehicle["effective_radius"].value * SPEED
    slope = float(steady(setting, "longitudinal", small, 1.0).force) / small * travel
    viscous = tire["longitudinal"].sigma2.value * travel
    peaks = {f"{road:g}": list(peak(setting, "longitudinal", road)) for road in ROADS}
    v = np.linspace(-FASTEST, FASTEST, 6001)
    bounded = all(
        bool((np.abs(steady(setting, d, v, road).disturbance) <= np.abs(v) * (1 + 1e-12)).all())
        for d in DIRECTIONS
        for road in ROADS
    )
    patch = {d: PATCH / tire[d].kappa.value for d in DIRECTIONS}
    holds = corrected and not printed and bounded and abs(slope - viscous - stiffness["longitudinal"]) < 1e-4
    return Finding(
        {
            "slip_stiffness": stiffness,
            "slope_at_origin": slope,
            "peak_velocity_and_force_by_road": peaks,
            "disturbance_at_most_slip_velocity": bounded,
            "contact_patch_m": patch,
            "printed_units_consistent": printed,
            "corrected_units_consistent": corrected,
        },
        derived(holds),
        f"At {SPEED:g} rad/s the steady longitudinal force rises with sigma0/kappa = {stiffness['longitudinal']:.2f} "
        "per unit of slip and peaks at "
        + " and ".join(f"{f:.3f} at {at:.2f} m/s (theta = {road})" for road, (at, f) in peaks.items())
        + ". The friction term never exceeds the slip velocity, so it is a bounded disturbance. kappa must be in 1/m "
        "and z in m: with the printed units s/m and 1 (1) adds unlike quantities.",
    )


CLAIMS: dict[str, ClaimFunction] = {"P3-lugre": steady_curve}
