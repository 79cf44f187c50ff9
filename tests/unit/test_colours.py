"""Colours of the figures have names, and what is drawn together can be told apart."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from studies.plots import Figure, Line, Panel, colours
from tests.support.study_checks import nameless


def test_a_colour_without_a_name_is_found() -> None:
    """`check_result` asks it of every figure of every study."""

    def figure(*marks: Line) -> Figure:
        return Figure("name", "caption", "alternative", Panel(marks))

    assert not nameless(figure(Line([0.0], [0.0], color=colours.RED), Line([0.0], [0.0], color="0.4", edge="white")))
    assert nameless(figure(Line([0.0], [0.0], color="#123456"))) == {"#123456"}
    assert nameless(figure(Line([0.0], [0.0], edge="tab:blue"))) == {"tab:blue"}


@pytest.mark.parametrize("group", [colours.CURVES, colours.CORNERS, colours.SETTINGS, colours.ROADS, (
    colours.TRUTH, colours.FUSION, colours.OWN_OBSERVERS, colours.SCHEDULE, colours.SECOND_FILTER, colours.PIPELINE,
    colours.MEAN_WHEEL_SPEED, colours.INTEGRATED_ACCELERATION,
)])  # fmt: skip
def test_what_is_drawn_together_differs(group: tuple[str, ...]) -> None:
    for one, other in combinations(map(to_rgb, group), 2):
        assert sum(abs(a - b) for a, b in zip(one, other, strict=True)) > 0.2


DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
PROTANOPIA = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
"""On linear RGB: Machado, Oliveira and Fernandes, 2009, severity 1."""
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def seen(colour: str, eye: Any) -> Any:
    """CIE L*a*b* of a colour as an eye sees it."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(eye @ linear, 0.0, 1.0) / (0.9505, 1.0, 1.089)
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def least(group: tuple[str, ...]) -> float:
    """The smallest distance of two colours to any eye."""
    eyes = (np.eye(3), DEUTERANOPIA, PROTANOPIA)
    return min(float(np.linalg.norm(seen(a, e) - seen(b, e))) for e in eyes for a, b in combinations(group, 2))


def test_drives_and_sweeps_are_read_by_the_colour_blind_and_in_grey() -> None:
    curves = (
        colours.TRUTH,
        colours.OWN_OBSERVERS,
        colours.PIPELINE,
        colours.MEAN_WHEEL_SPEED,
        colours.INTEGRATED_ACCELERATION,
    )
    for group in (curves, (colours.BELOW, colours.ABOVE), (colours.NOMINAL, colours.WORST, colours.BEST)):
        assert least(group) > 15.0
    assert least((colours.PIPELINE, "#8a8a8a")) < 15.0 and least(("#c1272d", "#4d9a2a")) < 15.0  # as they were once
    ends = [seen(colour, np.eye(3))[0] for colour in (colours.LOWER_END, colours.MIDDLE, colours.UPPER_END)]
    assert np.diff(ends).min() > 30.0  # dark to light
    below, above = (seen(colour, np.eye(3))[0] for colour in (colours.BELOW, colours.ABOVE))
    assert abs(below - above) > 20.0
