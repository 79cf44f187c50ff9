"""Fig. 6 and the transformations that (20) would need."""

from __future__ import annotations

import numpy as np

from studies.papers.resilient_velocity.claims_markov import STAY_NORMAL, margins
from studies.papers.resilient_velocity.claims_switching import common_function_from, windows
from studies.papers.resilient_velocity.ink import SERIES, SPEED_LABEL, sheet
from studies.papers.resilient_velocity.setting import HIGHEST_SPEED, PRINTED, Setting
from studies.plots.colours import BLUE, GREY, RED
from studies.study import Drawing

STAYS = np.linspace(0.0, 1.0, 101)
SPEEDS = np.array([1.0, 20.0, 40.0, 80.0, 140.0])
ALL_SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 281)


def markov_figure(setting: Setting = PRINTED) -> Drawing:
    """Margin over the stay probability, and what is left of it beside 1 minus that probability."""
    figure = sheet(9.2, 3.7)
    left, right = figure.subplots(1, 2)
    found = margins(setting, STAYS, SPEEDS)
    for column, speed, (colour, dash) in zip(found.T, SPEEDS, SERIES, strict=True):
        left.plot(STAYS, column, color=colour, ls=dash, lw=1.6, label=f"{speed:g} rad/s")
        right.plot(STAYS, column - (1.0 - STAYS), color=colour, ls=dash, lw=1.6)
    left.plot(STAYS, 1.0 - STAYS, color=GREY, lw=0.8, label="1 − γ̄")
    left.set_ylabel("margin 1 − ρ [1]")
    right.set_ylabel("margin − (1 − γ̄) [1]")
    right.axhline(0.0, color=GREY, lw=0.8)
    for axis in (left, right):
        axis.set_xlabel("probability γ̄ of staying in high slip [1]")
        axis.set_xlim(0.0, 1.0)
    left.set_ylim(0.0, 1.0)
    left.legend(loc="upper right")
    return Drawing(
        "fig-6-markov-margin",
        "Fig. 6 regenerated: margin 1 − ρ of mean-square stability when the gain switches between [1.18, 387] "
        f"(stays with probability {STAY_NORMAL:g}) and the high-slip gain [0.22, 0.1] (stays with probability γ̄), "
        "longitudinal observer at 200 Hz, five wheel speeds. Left: the margin is positive everywhere and close to "
        "1 − γ̄. Right: the difference from 1 − γ̄, which tells the wheel speeds apart. At γ̄ = 1 a margin of "
        f"{found[-1].min():.4f} to {found[-1].max():.4f} remains, that of the high-slip gain alone.",
        "Left: five almost coinciding straight lines falling from about 0.95 to zero. Right: their difference from "
        "one minus the probability, at most 0.06 below it, at 1 rad/s.",
        figure,
    )


def window_figure(setting: Setting = PRINTED) -> Drawing:
    """Which gamma of T = diag(gamma, 1) proves which gain, over the wheel speed."""
    figure = sheet(7.2, 4.0)
    axis = figure.subplots()
    (normal, high) = windows(setting, ALL_SPEEDS)
    axis.fill_between(ALL_SPEEDS, *normal, color=BLUE, alpha=0.25, lw=0, label="normal gain [1.18, 387] proved")
    axis.fill_between(
        ALL_SPEEDS, *high, color=RED, alpha=0.35, lw=0, hatch="///", label="high-slip gain [0.22, 0.1] proved"
    )
    axis.axhline(setting.similarity, color="0.1", lw=1.2, label=f"γ = {setting.similarity:g} of Proposition 1")
    threshold = common_function_from(setting)
    if threshold is not None:
        axis.axvline(threshold, color=GREY, lw=1.0, ls=":")
        axis.annotate(
            f"no common quadratic\nfunction of any kind\nbelow {threshold:.1f} rad/s",
            (threshold, 1.4e5),
            (6, -8),
            textcoords="offset points",
            va="top",
            fontsize=8,
        )
    axis.set_yscale("log")
    axis.set_xlim(0.0, HIGHEST_SPEED)
    axis.set_xlabel(SPEED_LABEL)
    axis.set_ylabel("γ of T = diag(γ, 1) [1/s]")
    figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return Drawing(
        "eq-20-windows",
        "Why (20) fails: values of γ for which T = diag(γ, 1) makes the symmetric part of the transformed error "
        "matrix negative definite, over the wheel speed, for either gain. The two bands never meet, so no diagonal "
        "T proves both gains, and the printed γ = 9000 proves the normal one only. Left of the dotted line the "
        "exact test excludes every common quadratic Lyapunov function of the two continuous modes.",
        "Two bands on a logarithmic scale: the upper one from about 125 to 200000, the lower one below 17; a "
        "horizontal line at 9000 runs inside the upper one.",
        figure,
    )
