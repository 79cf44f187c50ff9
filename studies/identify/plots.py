"""Figures of an identification: force over slip with the fitted stiffness, and the residual with its correlation."""

from __future__ import annotations

import numpy as np

from studies.identify.identify import Identification
from studies.identify.slip_limit import LimitedFit
from studies.plots import ZERO, Figure, Line, Mark, Panel, dots
from studies.plots.colours import BLUE, FITTED, LEFT_OUT

NAMES = {
    "longitudinal": ("front left", "front right", "rear left", "rear right", "mean of the corners"),
    "lateral": ("front axle", "rear axle"),
}


def figures(found: Identification) -> list[Figure]:
    """One figure for each direction, named as its files."""
    return [residual(found, direction, limited) for direction, limited in found.fits.items()]


def residual(found: Identification, direction: str, limited: LimitedFit) -> Figure:
    """Force over slip, residual over time, residual over force, and autocorrelation of the residual of one direction."""
    mu, _ = limited.model.force_and_speed()
    over_time, over_force = list[Mark](), list[Mark]()
    for k, name in enumerate(NAMES[limited.model.direction]):
        error = limited.fit.residual[:, k]
        if np.isfinite(error).any():
            colour = f"C{k}"
            over_time.append(Line(found.data.inputs.time, error, name, colour, width=0.9))
            over_force.append(Line(mu[:, k], error, "", colour, "none", marker=".", size=2.0, alpha=0.5))
    fit, label = limited.fit, "slip velocity: measured − asked (m/s)"
    state = "identified" if fit.excited["slip_stiffness"] else "NOT excited, prior shown"
    title = (
        f"{found.drive.name}: {limited.model.direction} slip stiffness {fit.value('slip_stiffness'):.3g} ({state}), "
        f"slip below {limited.limit:g}, residual {1e3 * fit.rms:.2g} mm/s"
    )
    counted = f"autocorrelation (1 of {fit.correlation:.3g} rows counts)"
    return Figure(
        f"residual_{direction}",
        title,
        "Normalised force over slip with the fitted line, and the residual over time, over force and over its lag.",
        [
            [
                Panel(_force(limited), "slip (1)", "normalised force (1)", legend="best"),
                Panel(over_time, "time (s)", label, legend="best" if over_time else ""),
            ],
            [
                Panel(over_force, "normalised force (1)", label),
                Panel(_correlation(limited, found.drive.sample_time), "lag (s)", counted),
            ],
        ],
        size=(9.0, 6.4), title=title,
    )  # fmt: skip


def _force(limited: LimitedFit) -> list[Mark]:
    """Normalised force over slip of all samples within twice the limit, used ones in colour; the fitted origin."""
    values = limited.fit.values()
    slip = limited.model.slip(values)
    mu = limited.model.force_and_speed()[0][:, : slip.shape[1]]
    used = limited.mask[:, : slip.shape[1]]
    near = np.abs(slip) <= 2 * limited.limit
    force = np.linspace(-1.5, 1.5, 601)
    left = 1 - values["saturation"] * np.abs(force) - values["bend"] * force**2
    steady = force / (values["slip_stiffness"] * np.maximum(left, 0.1))
    shown = np.abs(steady) <= limited.limit
    return [  # dots of the legend are larger than those of the samples
        dots(slip[near & ~used], mu[near & ~used], "", LEFT_OUT, ".", 2.0),
        dots(slip[used], mu[used], "", BLUE, ".", 2.0),
        *(dots([], [], name, colour) for name, colour in (("left out", LEFT_OUT), ("used", BLUE))),
        Line(steady[shown], force[shown], "fit, steady", FITTED),
    ]


def _correlation(limited: LimitedFit, step: float) -> list[Mark]:
    """Autocorrelation of the summed residual up to 0.5 s."""
    error = np.nan_to_num(limited.fit.residual).sum(axis=1)
    power = float(error @ error)
    lags = np.arange(min(len(error) - 1, round(0.5 / step)) + 1)
    if power == 0:
        return [ZERO]
    return [Line(lags * step, [float(error[: len(error) - k] @ error[k:]) / power for k in lags]), ZERO]
