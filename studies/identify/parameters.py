"""From fits to named values with unit, interval and source: what the reports and the parameter file are made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from studies.identify.estimate import Estimate
from studies.identify.identify import Identification, yaw_inertia_prior
from studies.identify.mounting import ANGLES, ARMS
from studies.identify.slip_limit import LimitedFit
from synthesis.models.parameter_set import quantities


@dataclass(frozen=True)
class Identified:
    """One parameter: ``interval`` is None where the value is not from the log; ``half_width`` is what the log allowed, relative
    (of a mounting: in its unit)."""

    value: float
    unit: str
    interval: tuple[float, float] | None
    excited: bool
    samples: int
    source: str
    half_width: float | None = None


def tire_parameters(found: Identification, direction: str) -> dict[str, Identified]:
    """slip_stiffness = sigma0/kappa, kappa, sigma0, sigma1, sigma2 and the saturation of one direction.

    Not excited: the value of the base set, with two dependent ones that follow the identified ones: sigma0 = C*kappa keeps an
    identified ratio, and sigma1 = T1*sigma0 keeps the damping time of the bristles (a sigma1 made for another sigma0 is
    another tire: at sigma0/sigma1 = kappa R|w| bristles leave the output, P1 notes 11 item 18).
    """
    tire, base, prior = found.base.tire[direction], found.base.id, f"prior: {found.base.id}"
    limited = found.fits.get(direction)
    if limited is None:
        why = f"{prior}; {found.absent.get(direction, 'not fitted')}"
        out = {n: Identified(q.value, q.unit, None, False, 0, why) for n, q in quantities(tire).items()}
        ratio = tire.sigma0.value / tire.kappa.value
        return {"slip_stiffness": Identified(ratio, "1", None, False, 0, why), **out}
    fit, where = limited.fit, _place(found, limited)
    stiff, relaxed = fit.excited["slip_stiffness"], fit.excited["relaxation_length"]
    damped = fit.excited["damping_time"] and stiff and relaxed
    ratio = fit.value("slip_stiffness") if stiff else tire.sigma0.value / tire.kappa.value
    kappa = 1.0 / fit.value("relaxation_length") if relaxed else tire.kappa.value
    time = fit.value("damping_time") if damped else tire.sigma1.value / tire.sigma0.value
    low, high = fit.interval("relaxation_length")

    def entry(value: float, unit: str, interval: tuple[float, float], yes: bool, half: float, else_: str) -> Identified:
        source = where if yes else f"not excited by {', '.join(found.logs)}; {else_}"
        return Identified(value, unit, interval if yes else None, yes, fit.samples, source, _finite(half))

    factor = max(fit.factors[name] for name in ("slip_stiffness", "relaxation_length"))
    half0 = factor * fit.deviation(slip_stiffness=1.0, relaxation_length=-1.0)
    if not (stiff and relaxed):
        half0 = max(fit.half["slip_stiffness"], fit.half["relaxation_length"])
    sigma0 = ratio * kappa
    kept = f"sigma0/kappa = {ratio:.4g} identified, times kappa of {base}"
    follows = kept if stiff else f"kappa times ratio of {base}"
    half1 = fit.half["damping_time"] / max(fit.value("damping_time"), 1e-12)
    keeps = f"sigma1/sigma0 = {1e3 * time:.3g} ms of {base}, times sigma0"
    return {
        "slip_stiffness": entry(ratio, "1", fit.interval("slip_stiffness"), stiff, fit.half["slip_stiffness"], prior),
        "kappa": entry(kappa, "1/m", (1 / high, 1 / max(low, 1e-9)), relaxed, fit.half["relaxation_length"], prior),
        "sigma0": entry(
            sigma0, "1/m", (sigma0 * math.exp(-half0), sigma0 * math.exp(min(half0, 300.0))), stiff and relaxed, half0,
            follows if stiff != relaxed else prior,
        ),
        "sigma1": entry(time * sigma0, "s/m", _times(fit.interval("damping_time"), sigma0), damped, half1, keeps),
        "sigma2": Identified(
            tire.sigma2.value, "s/m", None, False, fit.samples,
            f"{prior}; viscous friction acts like slip stiffness and is not told from it",
        ),
        "saturation": Identified(
            fit.value("saturation") if fit.excited["saturation"] else 0.0, "1",
            fit.interval("saturation") if fit.excited["saturation"] else None, fit.excited["saturation"], fit.samples,
            "1/(theta g) of this road, if the tire bends as LuGre does" if fit.excited["saturation"]
            else "not told from 0; the curve bends with the square of the force",
        ),
    }  # fmt: skip


def vehicle_parameters(found: Identification) -> dict[str, Identified]:
    """Effective radius per axle, wheel inertia, yaw inertia: identified, or as the drive file has them."""
    car, name, logs = found.drive.vehicle, f"drive file '{found.drive.name}'", ", ".join(found.logs)
    along, spin, across = found.fits["longitudinal"], found.inertia, found.fits.get("lateral")

    def fitted(fit: Estimate, own: str, unit: str, prior: float, given: str, where: str) -> Identified:
        """A radius is fitted relative to its ``prior``, everything else as it is; ``given`` says where the prior is from."""
        yes, factor = fit.excited[own], prior if unit == "m" else 1.0
        source = where if yes else f"not excited by {logs}; prior: {given}"
        interval = _times(fit.interval(own), factor) if yes else None
        value = factor * fit.value(own) if yes else prior
        return Identified(value, unit, interval, yes, fit.samples, source, _finite(fit.half[own]))

    out: dict[str, Identified] = {}
    for axle, nominal in (("front", car.effective_radius_front), ("rear", car.effective_radius_rear)):
        where = _place(found, along)
        out[f"effective_radius_{axle}"] = fitted(along.fit, f"radius_{axle}", "m", nominal, name, where)
    plain, prior = f"identified from {logs}", name if car.wheel_inertia is not None else found.base.id
    if spin is None:
        source = f"not excited: no torques; prior: {prior}"
        out["wheel_inertia"] = Identified(found.wheel_inertia, "kg*m^2", None, False, 0, source)
    else:
        out["wheel_inertia"] = fitted(spin, "wheel_inertia", "kg*m^2", found.wheel_inertia, prior, plain)
    if across is not None:
        guess, given = yaw_inertia_prior(found.drive), "m L_f L_r" if car.yaw_inertia is None else name
        out["yaw_inertia"] = fitted(across.fit, "yaw_inertia", "kg*m^2", guess, given, plain)
    return out


def mounting_parameters(found: Identification) -> dict[str, Identified]:
    """Lever arm, m, and angles, rad, of the inertial unit: identified, or as the drive file has them; none without a fit."""
    fit, logs, out = found.mounting.fit, ", ".join(found.logs), dict[str, Identified]()
    if fit is None:
        return out
    for name in (*ARMS, *ANGLES):
        yes = fit.excited[name]
        source = f"identified from {logs}: {fit.samples} rows" if yes else f"not excited by {logs}; prior: drive file"
        value = fit.value(name) if yes else float(getattr(found.mounting.given, name))
        interval = fit.interval(name) if yes else None
        out[name] = Identified(
            value, "m" if name in ARMS else "rad", interval, yes, fit.samples, source, fit.half[name]
        )
    return out


def _place(found: Identification, limited: LimitedFit) -> str:
    logs = ", ".join(found.logs)
    return f"identified from {logs}: {limited.model.direction} fit, slip below {limited.limit:g}, {limited.fit.samples} rows"


def _times(interval: tuple[float, float], factor: float) -> tuple[float, float]:
    return interval[0] * factor, interval[1] * factor


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
