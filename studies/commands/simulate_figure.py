"""The pictures of a simulation: what every run reaches of a certified level, and the worst run as the runtime sees it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.simulation.amplification import Amplification, replayed
from analysis.simulation.trajectories import random_trajectories
from estimators.schedule import GainSchedule
from studies.plots import DASHES, Axis, Figure, Level, Line, Mark, Panel, dots
from studies.plots.colours import BLUE, GREY, RED

MOST_DRAWN = 4  # claims, each a figure of its own
RANDOM_DRAWN = 3
COLOURS = (BLUE, RED, GREY)


def simulation_figures(schedule: GainSchedule, found: Sequence[Amplification]) -> list[Figure]:
    """One figure for every claim about disturbances."""
    gains = [one for one in found if one.kind == "sampled gain"][:MOST_DRAWN]
    return [_figure(schedule, one, number) for number, one in enumerate(gains, 1)]


def _figure(schedule: GainSchedule, one: Amplification, number: int) -> Figure:
    run = replayed(schedule, one)
    time = run.time
    shares = np.sort(one.every) / one.level
    reached: list[Mark] = [
        Level(y=1.0, label="certified", color=RED),
        Level(y=one.share, label="worst found", color=BLUE, dash="dashed"),
        dots(np.arange(1, len(shares) + 1), shares, "random trajectories", GREY, size=3.0),
    ]
    panels = [Panel(reached, "run, in order", "share of the certified level", "What runs reach", "lower right")]
    low, high = (np.array([getattr(p, key) for p in schedule.parameters]) for key in ("min", "max"))
    some = random_trajectories(schedule, len(time) - 1, RANDOM_DRAWN)
    marks: list[Mark] = [Line(time, (path[:, 0] - low[0]) / (high - low)[0], "", GREY, width=0.6) for path in some]
    for i, (p, color, dash) in enumerate(zip(schedule.parameters, COLOURS, DASHES, strict=False)):
        marks.append(Line(time, (run.parameter[0, :, i] - low[i]) / (high - low)[i], p.name, color, dash))
    y = Axis("parameter, its range = 0..1", -0.05, 1.05)
    panels.append(Panel(marks, "time [s]", y, "Worst trajectory; three random ones", "upper right"))
    errors: list[Mark] = [Level(y=0.0)]
    word = "signal" if schedule.update == "feedback" else "error"
    for name, color in zip(one.errors, COLOURS, strict=False):
        value = run.of(name)[0] if schedule.update == "feedback" else run.error[0, :, run.states.index(name)]
        errors.append(Line(time[: len(value)], value / max(float(np.abs(value).max()), 1e-300), name, color))
    panels.append(
        Panel(errors, "time [s]", f"{word}, its largest = 1", "The runtime along it, worst input", "upper right")
    )
    return Figure(
        f"{schedule.name}-simulation-{number}",
        f"{one.claim}: certified {one.level:g} {one.unit}, worst found {one.worst:.4g}.",
        "Amplification of random runs as a share of the certified level; the worst parameter trajectory; the runtime along it.",
        panels, size=(12.6, 3.9), title=f"{schedule.name}: {one.claim}",
    )  # fmt: skip
