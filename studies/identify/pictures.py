"""Plots of an identification: force over slip with the fitted stiffness, and the residual with its correlation."""

from __future__ import annotations

from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.drives.pictures import STYLE, Save, new_figure, save_figure
from studies.identify.identify import Identification
from studies.identify.slip_limit import LimitedFit
from studies.report.colours import BLUE

USED, LEFT_OUT, LINE = BLUE, "0.8", "#d1495b"
NAMES = {
    "longitudinal": ("front left", "front right", "rear left", "rear right", "mean of the corners"),
    "lateral": ("front axle", "rear axle"),
}


def figures(found: Identification) -> dict[str, Save]:
    """Every plot by file stem: a function that writes it to a path, in the format of its suffix."""
    with mpl.rc_context(STYLE):
        drawn = {f"residual_{direction}": residual(found, limited) for direction, limited in found.fits.items()}
    return {name: partial(save_figure, figure) for name, figure in drawn.items()}


def residual(found: Identification, limited: LimitedFit) -> Figure:
    """Force over slip, residual over time, residual over force, and autocorrelation of the residual of one direction."""
    figure = new_figure(9.0, 6.4)
    axes = figure.subplots(2, 2)
    _force(axes[0, 0], limited)
    mu, _ = limited.model.force_and_speed()
    for k, name in enumerate(NAMES[limited.model.direction]):
        error = limited.fit.residual[:, k]
        if np.isfinite(error).any():
            axes[0, 1].plot(found.data.inputs.time, error, linewidth=0.9, label=name)
            axes[1, 0].plot(mu[:, k], error, ".", markersize=2, alpha=0.5)
    _label(axes[0, 1], "time (s)", "slip velocity: measured − asked (m/s)")
    _label(axes[1, 0], "normalised force (1)", "slip velocity: measured − asked (m/s)")
    _correlation(axes[1, 1], limited, found.drive.sample_time)
    if axes[0, 1].lines:
        axes[0, 1].legend(frameon=False, fontsize=7)
    fit = limited.fit
    state = "identified" if fit.excited["slip_stiffness"] else "NOT excited, prior shown"
    figure.suptitle(
        f"{found.drive.name}: {limited.model.direction} slip stiffness {fit.value('slip_stiffness'):.3g} ({state}), "
        f"slip below {limited.limit:g}, residual {1e3 * fit.rms:.2g} mm/s",
        fontsize=10, x=0.01, ha="left",
    )  # fmt: skip
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    return figure


def _force(ax: Axes, limited: LimitedFit) -> None:
    """Normalised force over slip of all samples within twice the limit, used ones in colour; the fitted origin."""
    values = limited.fit.values()
    slip = limited.model.slip(values)
    mu = limited.model.force_and_speed()[0][:, : slip.shape[1]]
    used = limited.mask[:, : slip.shape[1]]
    near = np.abs(slip) <= 2 * limited.limit
    ax.plot(slip[near & ~used], mu[near & ~used], ".", color=LEFT_OUT, markersize=2, label="left out")
    ax.plot(slip[used], mu[used], ".", color=USED, markersize=2, label="used")
    force = np.linspace(-1.5, 1.5, 601)
    left = 1 - values["saturation"] * np.abs(force) - values["bend"] * force**2
    steady = force / (values["slip_stiffness"] * np.maximum(left, 0.1))
    shown = np.abs(steady) <= limited.limit
    ax.plot(steady[shown], force[shown], color=LINE, label="fit, steady")
    _label(ax, "slip (1)", "normalised force (1)")
    ax.legend(frameon=False, fontsize=7, markerscale=4)


def _correlation(ax: Axes, limited: LimitedFit, step: float) -> None:
    """Autocorrelation of the summed residual up to 0.5 s."""
    error = np.nan_to_num(limited.fit.residual).sum(axis=1)
    power = float(error @ error)
    lags = np.arange(min(len(error) - 1, round(0.5 / step)) + 1)
    if power > 0:
        ax.plot(lags * step, [float(error[: len(error) - k] @ error[k:]) / power for k in lags], color=USED)
    ax.axhline(0.0, color="0.1", linewidth=0.8)
    _label(ax, "lag (s)", f"autocorrelation (1 of {limited.fit.correlation:.3g} rows counts)")


def _label(ax: Axes, x: str, y: str) -> None:
    ax.set_xlabel(x)
    ax.set_ylabel(y, fontsize=8)
