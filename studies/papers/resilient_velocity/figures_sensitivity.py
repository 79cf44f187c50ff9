"""Figs 3 to 5: deviations of stability margin and norm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.sensitivity import OneAtATime
from studies.papers.resilient_velocity.deviations import FACTORS, margin_deviations, norm_deviations
from studies.papers.resilient_velocity.ink import SPEED_LABEL, sheet
from studies.papers.resilient_velocity.setting import DIRECTIONS, HIGHEST_SPEED, PRINTED, Setting
from studies.plots.colours import BLUE, GREEN, GREY, ORANGE, RED
from studies.study import Drawing
from synthesis.polynomials.matrix import FloatArray

SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 281)
NAMES = {"sigma0": "σ₀", "sigma1": "σ₁", "sigma2": "σ₂", "kappa": "κ"}
GROUPS = (("sigma1",), ("sigma0", "sigma2", "kappa"))
INKS = {"sigma1": RED, "sigma0": BLUE, "sigma2": GREEN, "kappa": ORANGE}
DASHES = ((0, (5, 2)), "-")  # lower, higher
Deviations = Callable[[Setting, Any, FloatArray], OneAtATime]


def _panels(setting: Setting, measure: Deviations, unit: str) -> Figure:
    """Rows: direction; columns: sigma_1, which outweighs the rest, and the other constants on a scale of their own."""
    figure = sheet(9.2, 5.8)
    grid = figure.subplots(2, 2, sharex=True)
    for row, direction in zip(grid, DIRECTIONS, strict=True):
        found = measure(setting, direction, SPEEDS)
        for axis, names, title in zip(row, GROUPS, ("σ₁", "the other constants"), strict=True):
            axis.axhline(0.0, color=GREY, lw=0.8)
            for name in names:
                for factor, dash in zip(FACTORS, DASHES, strict=True):
                    curve = found.deviations.at(parameter=name, factor=factor).values
                    axis.plot(
                        SPEEDS, curve, color=INKS[name], ls=dash, lw=1.7, label=f"{NAMES[name]} {factor - 1:+.0%}"
                    )
            axis.set_xlim(0.0, HIGHEST_SPEED)
            axis.set_title(f"{direction}, {title}", loc="left")
        row[0].set_ylabel(f"deviation [{unit}]")
    for axis in grid[-1]:
        axis.set_xlabel(SPEED_LABEL)
    lines = [line for axis in grid[0] for line in axis.get_legend_handles_labels()[0]]
    figure.legend(handles=lines, loc="outside lower center", ncols=4)
    return figure


def margin_figure(setting: Setting = PRINTED) -> Drawing:
    """Figs 3 (longitudinal) and 4 (lateral)."""
    return Drawing(
        "figs-3-4-margin-deviation",
        "Figs 3 and 4 regenerated: how far the stability margin, the largest real part of the eigenvalues of the "
        "error dynamics (about -327 1/s longitudinally, -13.8 1/s laterally), moves when one tire constant is 20 % "
        "lower (dashed) or higher (solid) than in the design. Positive is towards instability. Only σ₁ matters; "
        "the kink of the lateral curve is where two real eigenvalues meet and become a pair. Mind the scales.",
        "Four panels; sigma 1 moves the margin by up to 73 per second longitudinally and 33 laterally, the other "
        "constants by less than 0.7.",
        _panels(setting, margin_deviations, "1/s"),
    )


def norm_figure(setting: Setting = PRINTED) -> Drawing:
    """Fig. 5."""
    return Drawing(
        "fig-5-norm-deviation",
        "Fig. 5 regenerated: how far the H∞ norm from both disturbances to both errors (near 1) moves when one "
        "tire constant is 20 % lower (dashed) or higher (solid) than in the design. All deviations stay below "
        "0.006, with one exception that a static analysis misses: with σ₁ 20 % higher the lateral error dynamics "
        "resonate above 126 rad/s and the norm rises by up to 0.048. Curves of σ₂ and κ coincide. Mind the scales.",
        "Four panels of small, nearly straight deviations; in the lateral panel of sigma 1 the curve for plus 20 "
        "per cent turns up steeply above 126 rad/s.",
        _panels(setting, norm_deviations, "1"),
    )
