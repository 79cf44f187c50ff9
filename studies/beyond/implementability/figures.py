"""Maps and curves of where the discretisations break."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.beyond.implementability.break_rates import BreakCurve, break_curve
from studies.beyond.implementability.designs import WHEEL_SPEED, Design, printed_designs, shipped_designs
from studies.beyond.implementability.simulate import RUNTIME, STEPS, launch, run
from studies.beyond.implementability.updates import BREAKABLE, LASTING, UPDATES, exact_closed_loop, spectral_radius
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE, RED
from studies.study import Drawing

PAPER_RATE = 200.0  # Hz, P1 and P3
COLOURS = (BLUE, RED, ORANGE, GREEN, PURPLE)
RATE_TICKS = (20, 50, 100, 200, 500, 1000, 2000)


def break_curves(points: int = 141) -> tuple[Drawing, dict[tuple[str, str], BreakCurve]]:
    """Break rate over the wheel speed, one panel for each scheme; also the curves by design and scheme."""
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    axes = figure.subplots(1, len(BREAKABLE), sharey=True)
    found = {}
    for axis, scheme in zip(axes, BREAKABLE, strict=True):
        for designs, dashes, width in ((printed_designs(), "-", 1.8), (shipped_designs(), "--", 1.1)):
            for design, color in zip(designs, COLOURS, strict=True):
                curve = found[design.name, scheme] = break_curve(design, scheme, points)
                axis.semilogy(curve.wheel_speed, curve.rate, dashes, color=color, lw=width, label=design.name)
        axis.axhline(PAPER_RATE, color="black", lw=0.9, ls=":")
        axis.set_title(scheme, loc="left")
        axis.set_xlabel("wheel speed [rad/s]")
        axis.set_xlim(*WHEEL_SPEED)
        axis.set_ylim(20.0, 1200.0)
        _rate_ticks(axis, RATE_TICKS[:-1])
    axes[1].text(2.0, PAPER_RATE * 1.02, "200 Hz", fontsize=8)
    axes[0].set_ylabel("sample rate below which it is unstable [Hz]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=7.5)
    caption = (
        "Sample rate below which the error of the observer grows, over the wheel speed (held constant), for the "
        "gains printed by P1 and P3 (solid) and the five shipped schedules (dashed). Forward Euler is limited by "
        "the fastest pole; a sampled innovation breaks at low speed, where the tire force is stiffest; predicting "
        "and then adding T·L breaks at high speed. Above the dotted line a curve means unstable at the 200 Hz of "
        "the papers. Tustin, backward Euler and the exact closed-loop update of the runtime have no curve: they "
        "never break."
    )
    alternative = (
        "Three panels of break rate over wheel speed on a logarithmic scale; longitudinal gains lie between 100 and "
        "900 Hz, lateral ones mostly below 200 Hz except for the third scheme."
    )
    return Drawing("break-rates", caption, alternative, figure), found


def maps(designs: Sequence[Design], name: str, points: int = 141) -> Drawing:
    """Spectral radius over wheel speed and sample rate: one row for each design, one column for each scheme."""
    figure = Figure(figsize=(9.6, 1.0 + 1.95 * len(designs)), layout="constrained")
    axes = figure.subplots(len(designs), len(BREAKABLE), sharex=True, sharey=True, squeeze=False)
    speed, rate = np.linspace(*WHEEL_SPEED, points), np.geomspace(20.0, 2000.0, points)
    mesh = None
    for place, (row, design) in enumerate(zip(axes, designs, strict=True)):
        A, L, C = design.matrices(speed)
        for axis, (scheme, update) in zip(row, BREAKABLE.items(), strict=True):
            radius = spectral_radius(update(A[:, None], L[:, None], C[:, None], 1.0 / rate)).T
            mesh = axis.pcolormesh(
                speed, rate, np.log10(np.clip(radius, 0.1, 10.0)), cmap="RdBu_r", vmin=-1, vmax=1, shading="gouraud"
            )
            mesh.set_rasterized(True)
            axis.contour(speed, rate, radius, levels=[1.0], colors="black", linewidths=1.3)
            axis.axhline(PAPER_RATE, color="black", lw=0.9, ls=":")
            axis.set_yscale("log")
            axis.grid(visible=False)
            _rate_ticks(axis, RATE_TICKS)
            if place == 0:
                axis.set_title(scheme, loc="left")
            if place == len(designs) - 1:
                axis.set_xlabel("wheel speed [rad/s]")
        row[0].set_ylabel(f"{design.name.removeprefix('schedule ')}\nsample rate [Hz]", fontsize=8)
    if mesh is not None:
        figure.colorbar(mesh, ax=axes, label="log₁₀ of the spectral radius [1]", shrink=0.6, aspect=40)
    kind = "printed gains" if designs[0].kind == "printed" else "shipped schedules"
    return Drawing(
        name,
        f"Spectral radius of one sample of the observer error for {kind}, over wheel speed and sample rate, in "
        "three discretisations. Red: the error grows; blue: it shrinks; black line: radius 1; dotted: the 200 Hz "
        "of the papers. The wheel speed is held constant.",
        "Grid of colour maps, red below a black line at low sample rates and blue above it; the line rises or "
        "falls with wheel speed depending on the scheme.",
        figure,
    )


def lasting_schemes(designs: Sequence[Design], points: int = 121) -> Drawing:
    """What the schemes that never break do to the slowest pole."""
    figure = Figure(figsize=(9.6, 3.7), layout="constrained")
    axes = figure.subplots(1, len(designs), sharey=True)
    rate = np.geomspace(20.0, 2000.0, points)
    for axis, design in zip(axes, designs, strict=True):
        A, L, C = design.matrices(design.grid(29))
        slowest = (-np.log(spectral_radius(exact_closed_loop(A, L, C, 1e-4)))).min() / 1e-4
        for (scheme, update), color in zip(LASTING.items(), COLOURS, strict=False):
            radius = spectral_radius(update(A[:, None], L[:, None], C[:, None], 1.0 / rate)).max(axis=0)
            axis.semilogx(rate, -np.log(radius) * rate / slowest, color=color, lw=1.6, label=scheme)
        axis.axvline(PAPER_RATE, color="black", lw=0.9, ls=":")
        axis.set_title(design.name.removeprefix("schedule "), loc="left", fontsize=8.5)
        axis.set_xlabel("sample rate [Hz]")
        axis.set_xticks(RATE_TICKS, [f"{tick:g}" for tick in RATE_TICKS], fontsize=7)
        axis.minorticks_off()
        axis.set_ylim(0.0, 1.6)
    axes[0].set_ylabel("worst decay rate / continuous one [1]")
    axes[0].legend(loc="upper left")
    return Drawing(
        "lasting-schemes",
        "Discretisations that are stable at every sample rate, and what they keep of the designed convergence: "
        "slowest decay rate over all wheel speeds, divided by that of the continuous observer. The exact "
        "closed-loop update keeps it by construction; backward Euler is slower; Tustin maps poles faster than two "
        "samples close to minus one, so the error rings and decays more slowly. Dotted: 200 Hz.",
        "One panel for each design with three curves over the sample rate; the exact one is constant at one, the "
        "others fall towards zero at low rates.",
        figure,
    )


def launches(designs: Sequence[Design], seconds: float = 8.0) -> Drawing:
    """Errors of the estimated relative velocity while the wheel speeds up, 200 Hz."""
    figure = Figure(figsize=(9.8, 4.2), layout="constrained")
    axes = figure.subplots(1, len(designs), sharey=True)
    palette = dict(zip((*STEPS, RUNTIME), (*COLOURS, "black"), strict=True))
    for axis, design in zip(axes, designs, strict=True):
        motion = launch(design, 1.0 / PAPER_RATE, seconds)
        for scheme in (*STEPS, RUNTIME):
            found = run(design, scheme, motion, np.array([0.0, 0.5]))
            error = np.abs(found[:, 1] - motion.states[:, 1])
            label = f"{scheme} (runtime)" if scheme == RUNTIME else scheme
            axis.semilogy(
                motion.wheel_speed,
                np.clip(error, 1e-7, 1e9),
                color=palette[scheme],
                lw=1.8 if scheme == RUNTIME else 1.1,
                label=label,
            )
        axis.set_title(design.name.removeprefix("schedule "), loc="left", fontsize=9)
        axis.set_xlabel("wheel speed, rising with time [rad/s]")
        axis.set_xlim(*WHEEL_SPEED)
        axis.set_ylim(1e-7, 1e9)
        axis.axhline(0.3, color="0.5", lw=0.9, ls=":")
    axes[0].set_ylabel("error of the relative velocity [m/s]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize=7.5)
    return Drawing(
        "launch",
        f"The observers at 200 Hz while the wheel speeds up through the whole range in {seconds:g} s and its "
        "relative velocity swings by 0.3 m/s (dotted); the estimate starts 0.5 m/s off, measurements are exact. "
        "Schemes that are unstable at a wheel speed diverge there and recover only if they become stable early "
        "enough; the runtime's exact update converges at once. Its remaining error of a few mm/s is half a sample "
        "of delay: the measurement of the beginning is held over the sample.",
        "Panels of the estimation error on a logarithmic scale over the rising wheel speed; several curves shoot "
        "up by many decades, the black runtime curve stays low.",
        figure,
    )


def _rate_ticks(axis: Axes, ticks: Sequence[int]) -> None:
    axis.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.minorticks_off()


ALL = tuple(UPDATES)
