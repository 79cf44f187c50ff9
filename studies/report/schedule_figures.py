"""Figures of a schedule: the curve of each gain, and every proved level over the parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Shade, Words, dots
from studies.plots.colours import BLUE, CURVES, DEPLOYED, FORBIDDEN, NOMINAL, PRINTED_BAND
from studies.report.frozen_levels import FrozenLevel
from studies.sentence import shown

Range = tuple[float, float]
MOST_PANELS, ACROSS = 12, 3  # of gains
LETTERS = 52  # of a panel's title in a line
SHARE = 0.12  # of the span of a panel, as room above and below


def gain_figure(content: Mapping[str, Any], published: Sequence[Range] | None = None, title: str = "") -> Figure:
    """Every gain as it is deployed (points and straight lines), the published range shaded behind it.

    Of several parameters the first runs along x; a curve each stands for the ends and the middle of the second, the others being
    in their middle. Of more than twelve gains the first twelve are drawn.
    """
    units, symbol = (
        GainSchedule.from_content(content).gain_units,
        "$L$" if content["update"]["kind"] == "held" else "$K$",
    )
    first, curves = content["scheduling"][0], curves_of(content)
    height, columns = curves[0][1].shape[1:]
    panels = []
    for i, j in list(np.ndindex(height, columns))[:MOST_PANELS]:
        marks: list[Mark] = [
            Line(first["breakpoints"], gains[:, i, j], label, DEPLOYED if len(curves) == 1 else CURVES[k], marker="o")
            for k, (label, gains) in enumerate(curves)
        ]
        if published is not None and columns == 1:
            low, high = published[i]
            marks.insert(0, Shade(low, high, "y", f"published range {low:g} to {high:g}", PRINTED_BAND))
        index = f"_{{{i + 1}}}" if columns == 1 else f"_{{{i + 1},{j + 1}}}"
        least = 0.0 if all(gains[:, i, j].min() >= 0.0 for _, gains in curves) else None
        y = Axis(f"{symbol}${index}$ [{units[i][j].replace('^2', '²')}]", low=least)
        panels.append(Panel(marks, _parameter(content), y, legend="best"))
    across = min(ACROSS, len(panels)) if len(panels) != 4 else 2
    rows: list[list[Panel | None]] = [list(panels[k : k + across]) for k in range(0, len(panels), across)]
    return Figure(
        f"{content['name']}-gains" if not title else content["name"],
        title or f"Gains of {content['name']} over {_words(first['name'])}: breakpoints and straight lines.",
        "Each gain as straight lines between its breakpoints, over the published range where there is one.",
        rows,
        size=(4.4 * across, 0.4 + 3.0 * len(rows)), title=title,
    )  # fmt: skip


def curves_of(content: Mapping[str, Any]) -> list[tuple[str, FloatArray]]:
    """Label and gains (breakpoints, rows, columns) of every curve."""
    table, others = np.array(content["gain"]["table"]), content["scheduling"][1:]
    if not others:
        return [("deployed, proved", table)]
    for p in others[1:]:
        table = np.take(table, len(p["breakpoints"]) // 2, axis=2)
    second, count = others[0], len(others[0]["breakpoints"])
    return [
        (
            f"{second['name'].replace('_', ' ')} {second['breakpoints'][k]:g} {second['unit']}".removesuffix(" 1"),
            table[:, k],
        )
        for k in dict.fromkeys((0, count // 2, count - 1))
    ]


def levels_figure(content: Mapping[str, Any], levels: Sequence[FrozenLevel]) -> Figure:
    """A panel for each claim: what a constant parameter allows, the level that is proved for every motion, the tightest place."""
    panels = [_level_panel(content, level) for level in levels]
    across = min(2, len(panels))
    rows: list[list[Panel | None]] = [list(panels[k : k + across]) for k in range(0, len(panels), across)]
    return Figure(
        f"{content['name']}-levels",
        "Every proved level beside what constant parameter values allow: no motion can do better than the curve, the proof "
        "says that none does worse than the line. The mark is where the two are nearest; shaded is what the proof excludes.",
        "Curves over the parameter, each with a horizontal line for the proved level and a mark at the tightest place.",
        rows,
        size=(4.7 * across, 2.45 * len(rows) + 0.5), legend="below",
    )  # fmt: skip


def _level_panel(content: Mapping[str, Any], level: FrozenLevel) -> Panel:
    x, best = level.points[:, 0], level.values
    finite = best[np.isfinite(best)]
    ends = np.array([finite.min(initial=level.level), finite.max(initial=level.level)])
    room = SHARE * float(np.ptp(ends)) or SHARE * abs(level.level)
    low, high = float(ends[0]) - room, float(ends[1]) + room
    at = level.tightest
    excluded = (low, level.level) if level.larger_is_better else (level.level, high)
    right = bool(x[at] > 0.6 * x.max())
    marks: list[Mark] = [
        Shade(*excluded, "y", "excluded by the proof", FORBIDDEN, 0.6),
        Level(y=level.level, label="proved for every motion", color=NOMINAL, dash="dashed", width=1.2),
        Line(x, np.where(np.isfinite(best), best, np.nan), "at constant parameters", BLUE),
        dots([x[at]], [best[at]], "tightest place", DEPLOYED, "D"),
        Words(0.98 if right else 0.02, 0.5, f"{shown(100.0 * level.slack, 2)} % left", size=7.5, relative=True,
              horizontal="right" if right else "left"),
    ]  # fmt: skip
    return Panel(marks, _parameter(content), Axis(f"[{level.unit.replace('^2', '²')}]", low, high), _title(level))


def _title(level: FrozenLevel) -> str:
    return fill(f"{_words(level.claim).replace(' -> ', ' → ')}: {shown(level.level)}", LETTERS)


def _parameter(content: Mapping[str, Any]) -> Axis:
    first = content["scheduling"][0]
    edge = 0.02 * (first["max"] - first["min"])  # marks at the ends stay whole
    return Axis(f"{_words(first['name'])} [{first['unit']}]", first["min"] - edge, first["max"] + edge)


def _words(name: str) -> str:
    return name.replace("_", " ")
