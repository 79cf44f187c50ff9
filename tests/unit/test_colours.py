"""Colours of the figures have names, and what is drawn together can be told apart."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import pytest
from matplotlib.colors import to_rgb

import studies
from studies.plots import colours

ROOT = Path(studies.__file__).parent
NAMELESS = re.compile(r"[\"'](#[0-9a-fA-F]{3,8}|tab:\w+)[\"']")


@pytest.mark.parametrize("room", ["papers", "beyond", "trials", "drives", "identify", "sweeps", "commands"])
def test_figures_of_the_studies_take_colours_by_name(room: str) -> None:
    found = [path.name for path in (ROOT / room).rglob("*.py") if NAMELESS.search(path.read_text(encoding="utf-8"))]
    assert not found
    assert NAMELESS.search((ROOT / "plots" / "colours.py").read_text(encoding="utf-8"))  # the search does find some


@pytest.mark.parametrize("group", [colours.CURVES, colours.CORNERS, colours.SETTINGS, colours.ROADS, (
    colours.TRUTH, colours.FUSION, colours.OWN_OBSERVERS, colours.SCHEDULE, colours.SECOND_FILTER, colours.PIPELINE,
    colours.MEAN_WHEEL_SPEED, colours.INTEGRATED_ACCELERATION,
)])  # fmt: skip
def test_what_is_drawn_together_differs(group: tuple[str, ...]) -> None:
    for one, other in combinations(map(to_rgb, group), 2):
        assert sum(abs(a - b) for a, b in zip(one, other, strict=True)) > 0.2
