"""Colours of the figures have names, and what is drawn together can be told apart."""

from __future__ import annotations

from itertools import combinations

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
