"""The picture of a model: its poles over the range, and where observability and controllability are lost."""

from __future__ import annotations

import numpy as np
import sympy as sp

from analysis.observability.matrix import rate_symbol
from studies.commands.model_overview import Overview, Side
from studies.plots import Axis, Box, ColouredDots, Contours, Figure, Level, Line, Mark, Panel
from studies.plots.colours import BLUE, RED
from synthesis.models.param import SchedulingParameter

BEYOND = 0.25  # of the range is drawn on either side of it
POINTS = 301


def model_figure(found: Overview) -> Figure:
    """Poles in the complex plane; and for each side the plane in which its rank is lost, the admissible box drawn in it."""
    model = found.model
    panels = [_poles(found), _plane(found, found.observability, "Observability")]
    if model.inputs:
        panels.append(_plane(found, found.controllability, "Controllability"))
    title = f"{model.name}: frozen poles, and where rank is lost"
    return Figure(
        model.name, title, "Poles over the first parameter; curves on which rank is lost beside the admissible box.",
        panels, size=(4.3 * len(panels), 3.9), title=title,
    )  # fmt: skip


def _poles(found: Overview) -> Panel:
    """In the complex plane; real ones over the first parameter."""
    poles, parameters = found.line_poles, found.model.parameters
    if parameters and not np.abs(poles.imag).any():
        first = parameters[0]
        marks: list[Mark] = [Level(y=0.0), Line(found.line[:, 0], poles.real, "", BLUE)]
        x = Axis(_label(first.name, first.unit), first.minimum, first.maximum)
        return Panel(marks, x, Axis("pole [1/s]", margin=0.08), "Poles, all real")
    values = np.broadcast_to(found.line[:, :1] if parameters else np.zeros((1, 1)), poles.shape)
    label = _label(parameters[0].name, parameters[0].unit) if parameters else ""
    dots = ColouredDots(poles.real.ravel(), poles.imag.ravel(), values.ravel(), label, size=7.0)
    real, imaginary = Axis("real part [1/s]", margin=0.08), Axis("imaginary part [1/s]", margin=0.08)
    return Panel([Level(x=0.0), Level(y=0.0), dots], real, imaginary, "Poles")


def _plane(found: Overview, side: Side, title: str) -> Panel:
    parameters = found.model.parameters
    if not parameters:
        return Panel([], title=f"{title}\n{_note(side)}", grid=False)
    first = parameters[0]
    symbol, free = sp.Symbol(first.name), side.rank.loss.condition.free_symbols if side.rank.loss else set()
    second = next((p for p in parameters[1:] if sp.Symbol(p.name) in free), None)
    if second is not None:
        other, x, y = sp.Symbol(second.name), _wide(first), _wide(second)
        box = (second.minimum, second.maximum)
        y_label = _label(second.name, second.unit)
    else:
        low, high = (first.rate_minimum, first.rate_maximum) if not first.may_jump else (-1.0, 1.0)
        other, x, y = rate_symbol(first.name), _wide(first), _around(low, high)
        box, y_label = (low, high), f"its rate [({first.unit})/s]"
    marks: list[Mark] = [Box((first.minimum, first.maximum), box, "admissible", BLUE)]
    shown = False
    if side.rank.loss is not None:
        rest = {s: sp.Float(_middle(parameters, str(s))) for s in free - {symbol, other}}
        for factor in side.rank.loss.factors:
            z = np.broadcast_to(
                sp.lambdify((symbol, other), factor.subs(rest), "numpy")(x[None, :], y[:, None]), (len(y), len(x))
            ).astype(float)
            if z.min() < 0.0 < z.max():
                marks.append(Contours(x, y, z / np.abs(z).max(), [0.0], RED, width=1.6, numbers=""))
                shown = True
    held = free - {symbol, other} if shown else set()
    heading = f"{title}\n{_note(side, shown)}" + (", other rates zero" if held else "")
    return Panel(marks, Axis(_label(first.name, first.unit), x[0], x[-1]), Axis(y_label, y[0], y[-1]), heading)


def _note(side: Side, shown: bool = False) -> str:
    text = {
        "full": "full rank in the box, proved", "lost": "rank is lost on the red curve", "never": "never of full rank",
        "open": "not decided",
    }[side.rank.verdict]  # fmt: skip
    return text + ("; lost on the red curve" if shown and side.rank.verdict != "lost" else "")


def _middle(parameters: tuple[SchedulingParameter, ...], name: str) -> float:
    return next((p.middle for p in parameters if p.name == name), 0.0)  # rates are held at zero


def _wide(p: SchedulingParameter) -> np.ndarray:
    return _around(p.minimum, p.maximum)


def _around(low: float, high: float) -> np.ndarray:
    margin = BEYOND * (high - low) or 1.0
    return np.linspace(low - margin, high + margin, POINTS)


def _label(name: str, unit: str) -> str:
    return f"{name.replace('_', ' ')} [{unit}]"
