"""How the gains follow what is asked of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from estimators.schedule import GainSchedule
from studies.beyond.well_posed_design.achieved import printed_achieved
from studies.beyond.well_posed_design.cases import Case
from studies.beyond.well_posed_design.gain_plane import gain_plane
from studies.beyond.well_posed_design.literal import Approach, explicit_family
from studies.beyond.well_posed_design.sweeps import Sweep
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE, RED
from studies.study import Drawing

COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
MOST_TICKS = 7
NICE = (0.001, 0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 300.0, 600.0, 1000.0, 2000.0)  # ticks
GAIN_LABELS = ("$L_1$ [m/s]", "$L_2$ [m/s²]")


def ill_posed(
    cases: Sequence[Case], literal: Mapping[tuple[str, int], Approach], posed: Mapping[str, Approach]
) -> Drawing:
    """Least gains on the way to the infimum, literal and well-posed; and the explicit family."""
    figure = Figure(figsize=(10.0, 3.9), layout="constrained")
    axes = figure.subplots(1, 3)
    for axis, case in zip(axes, cases, strict=False):
        degrees = sorted(degree for name, degree in literal if name == case.name)
        for degree, color in zip(degrees, COLOURS, strict=False):
            found = literal[case.name, degree]
            axis.loglog(
                found.backoffs, found.gains[:, 1], "o-", color=color, ms=3.5, lw=1.3, label=f"literal, degree {degree}"
            )
        well = posed[case.name]
        axis.loglog(well.backoffs, well.gains[:, 1], "s--", color="black", ms=3.5, lw=1.3, label="well-posed, degree 1")
        axis.axhline(case.printed[1], color=RED, lw=1.0, ls=":")
        axis.text(0.11, case.printed[1] * 1.06, "printed", color=RED, fontsize=8, ha="left")
        axis.set_xlim(0.13, 8e-4)
        axis.set_title(case.title, loc="left")
        axis.set_xlabel("distance from the infimum, γ/γ* − 1 [1]")
        axis.set_ylabel("largest $|L_2|$ that is needed [m/s²]")
        low, high = axis.get_ylim()
        axis.set_ylim(low, high * 12.0)
        axis.legend(loc="upper left", fontsize=7.5)
    second = np.geomspace(1.0, 1e7, 43)
    for case, color in zip(cases, (BLUE, RED), strict=False):
        axes[2].loglog(second, explicit_family(case, second) - 1.0, color=color, lw=1.5, label=case.title)
        ratio = case.model.constants["sigma2"].value / case.model.constants["sigma0"].value
        axes[2].axhline(0.5 * ratio**2, color=color, lw=0.9, ls=":")
    axes[2].set_xlabel("$L_2$ with $L_1 = 1/σ_1$ [m/s²]")
    axes[2].set_ylabel("γ − 1 at constant wheel speed [1]")
    axes[2].set_title("explicit gains", loc="left")
    axes[2].legend(loc="upper right", fontsize=7.5)
    return Drawing(
        "ill-posed",
        "Minimising the gain of (30) to (32) alone does not determine gains. Left and middle: the least gains that "
        "come within a given distance of the infimum γ* = 1 grow without bound as the distance shrinks, for every "
        "degree of P and L; with the pole band and the channel bounds of the shipped design (black, distance from "
        "its own optimum) they settle. Right: the gains L = [1/σ₁, L₂] come as close to 1 as one likes (dotted: "
        "the exact floor), so at any γ above 1 all large L₂ are equally good.",
        "Two panels with rising curves for the literal problem and a flat black curve for the well-posed one; a "
        "third with two curves falling over ten decades to a floor.",
        figure,
    )  # fmt: skip


def demand_figure(name: str, demand: str, sweeps: Sequence[Sweep], what: str, offset: float = 0.0) -> Drawing:
    """Gains, proved bound and noise over one demand (less `offset`): a row for each case."""
    figure = Figure(figsize=(10.6, 2.7 * len(sweeps) + 0.4), layout="constrained")
    axes = figure.subplots(len(sweeps), 4, squeeze=False)
    for place, (row, sweep) in enumerate(zip(axes, sweeps, strict=True)):
        _demand_row(row, sweep, offset)
        if place == len(sweeps) - 1:
            for axis in row:
                axis.set_xlabel(demand)
    shown = {text: handle for axis in axes.flat for handle, text in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=4, fontsize=8)
    return Drawing(
        name,
        f"{what} Blue: smallest to largest gain over the wheel speeds; red: what P1 prints. Green: bound on the "
        "gain from force noise to the velocity error, from its lower bound to the proved one (one Lyapunov matrix "
        "for all demands, any motion of the wheel speed); black: what the same gains have at constant wheel speed. "
        "Purple: H₂ gain, the price in broadband noise. Grey: no gains of this degree meet the demand.",
        "Two rows of four panels over the varied demand: bands of both gains, the proved noise bound, and the "
        "broadband noise, with red lines for the printed gains.",
        figure,
    )  # fmt: skip


def _demand_row(row: Sequence[Axes], sweep: Sweep, offset: float) -> None:
    case, good, demand = sweep.case, sweep.feasible, sweep.demand - offset
    reference, x = printed_achieved(case), demand[good]
    printed: Any = {"color": RED, "lw": 1.1, "ls": "--", "label": "printed gains"}
    for i, axis in enumerate(row[:2]):
        low, high = sweep.gains[good, :, i].min(axis=1), sweep.gains[good, :, i].max(axis=1)
        axis.fill_between(x, low, high, color=BLUE, alpha=0.35, lw=0)
        axis.plot(x, low, color=BLUE, lw=1.2)
        axis.plot(x, high, color=BLUE, lw=1.2, label="design, least and largest over the wheel speeds")
        axis.axhspan(*case.printed_range[i], color=RED, alpha=0.10, lw=0, label="printed range")
        axis.axhline(case.printed[i], **printed)
        axis.set_ylabel(f"{case.title}\n{GAIN_LABELS[i]}" if i == 0 else GAIN_LABELS[i])
    row[2].fill_between(x, sweep.gamma_lower[good], sweep.gamma[good], color=GREEN, alpha=0.35, lw=0)
    row[2].plot(x, sweep.gamma[good], "o-", color=GREEN, ms=3, lw=1.2, label="proved bound, any motion")
    row[2].plot(x, sweep.achieved.noise[good], color="black", lw=1.6, label="the same gains, constant wheel speed")
    row[2].axhline(float(reference.noise), **printed)
    row[2].set_ylabel("gain to the velocity error [m/s]")
    row[3].plot(x, sweep.achieved.noise_density[good], "o-", color=PURPLE, ms=3, lw=1.2, label="H₂ gain of the design")
    row[3].axhline(float(reference.noise_density), **printed)
    row[3].set_ylabel("H₂ gain, force noise [m/s·√Hz]")
    low, high = float(demand.min()), float(demand.max())
    ticks = [tick for tick in NICE if low * 0.99 <= tick <= high * 1.01]
    if len(ticks) > MOST_TICKS:
        ticks = [tick for tick in ticks if float(np.log10(tick)).is_integer()]
    for axis in row:
        axis.set_xscale("log")
        axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontsize=8)
        axis.minorticks_off()
        for missing in demand[~good]:
            axis.axvline(missing, color="0.6", lw=4.0, alpha=0.4)


def plane(cases: Sequence[Case], points: int = 61) -> Drawing:
    """Decay, fastest pole and noise of constant gains, with printed and shipped gains."""
    figure = Figure(figsize=(10.0, 3.9 * ((len(cases) + 1) // 2)), layout="constrained")
    axes = figure.subplots((len(cases) + 1) // 2, 2, squeeze=False)
    for axis, case in zip(axes.flat, cases, strict=True):
        found = gain_plane(case, points)
        x, y = found.first, found.second
        darkest = 3.0 * float(printed_achieved(case).noise_density)
        mesh = axis.pcolormesh(
            x, y, found.fields.noise_density.T, cmap="Greys", shading="gouraud", vmin=0.0, vmax=darkest
        )
        mesh.set_rasterized(True)
        figure.colorbar(mesh, ax=axis, label="H₂ gain, force noise [m/s·√Hz]", pad=0.01)
        fastest = float(case.design.fastest_pole or 0.0)
        decay = case.design.decay_rate
        for field, levels, color, dashes in (
            (found.fields.slowest, [decay * f for f in (0.25, 0.5, 1.0, 2.0, 4.0)], BLUE, "solid"),
            (found.fields.fastest, [fastest * f for f in (0.5, 1.0, 2.0)], ORANGE, "dashed"),
            (found.fields.friction, [1.001, 1.1], GREEN, "dotted"),
        ):
            lines = axis.contour(x, y, field.T, levels=levels, colors=color, linestyles=dashes, linewidths=1.2)
            axis.clabel(lines, fmt="%g", fontsize=6.5)
        (a, b), (c, d) = case.printed_range
        axis.add_patch(Rectangle((a, c), b - a, d - c, fill=False, ec=RED, lw=1.2, label="printed range"))
        axis.plot(*case.printed, "*", color=RED, ms=12, mec="white", label="printed gains")
        table = GainSchedule.shipped(case.name).table[:, :, 0]
        axis.plot(table[:, 0], table[:, 1], "o-", color="black", ms=3, lw=1.3, label="shipped schedule")
        axis.plot(table[0, 0], table[0, 1], "o", color="white", mec="black", ms=6, label="shipped, at standstill")
        axis.set_yscale("log")
        axis.set_title(case.title, loc="left")
        axis.set_xlabel(GAIN_LABELS[0])
        axis.set_ylabel(GAIN_LABELS[1])
        axis.grid(visible=False)
    axes.flat[0].legend(loc="lower right", fontsize=7, frameon=True)
    return Drawing(
        "gain-plane",
        "Constant gains and what they do at the worst constant wheel speed between 0 and 140 rad/s. Blue: slowest "
        "pole, the decay rate [1/s]; orange: fastest pole [1/s]; green: gain from friction to the velocity error, "
        "which has the floor 1; grey: H₂ gain from white force noise. L₂ sets the decay and the noise, L₁ the fast "
        "pole, and friction hardly tells gains apart: between the dotted lines it is at its floor. White: "
        "unstable. Star and box: printed gains and ranges; black: the shipped schedules.",
        "Four maps over L1 and L2 (logarithmic) with blue contours of the decay rate, nearly horizontal at low L2, "
        "orange contours of the fastest pole, a red star for the printed gains and a black curve for the shipped "
        "schedule.",
        figure,
    )  # fmt: skip
