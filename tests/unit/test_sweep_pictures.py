"""Pictures of a sweep as data: neither side of a bar hides the other, every bar has its number, nothing changed is said."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from matplotlib.text import Text

from studies.plots import Axis, Bars, Figure, Panel, Words
from studies.plots.draw import draw
from studies.plots.fit import fitted
from studies.sweeps.change import Change, change_panel
from studies.sweeps.measures import Measure
from studies.sweeps.tornado import Bar, round_ticks, told_apart, tornado_panel

MEASURE = cast(Measure, SimpleNamespace(name="noise_norm", unit="1/s", better="smaller", sign=1.0))
LEVELS = np.array([-0.2, -0.1, 0.1, 0.2])


def bars(*values: list[float]) -> list[Bar]:
    return [Bar(f"p{i}", LEVELS, np.array(v), 1.0) for i, v in enumerate(values)]


def words(panel: Panel) -> list[str]:
    return [mark.text for mark in panel.marks if isinstance(mark, Words)]


def test_bars_to_one_side_stand_side_by_side_with_their_numbers() -> None:
    panel = tornado_panel(MEASURE, bars([1.3, 1.2, 1.1, 1.4], [1.0, 1.0, 1.0, 1.0], [0.999, 1.0, 1.0, 1.001]))
    below, above = (mark for mark in panel.marks if isinstance(mark, Bars))
    width = below.width
    assert isinstance(below.color, str) and below.color != above.color
    assert np.all(np.abs(np.asarray(below.places) - np.asarray(above.places)) >= width)
    assert words(panel) == ["1.3", "no change", "0.999", "1.4", "no change", "1.001"]
    assert isinstance(panel.x, Axis) and panel.x.label == "noise norm [1/s], nominal 1"


def test_a_small_bar_has_a_number_that_differs_from_the_nominal_one() -> None:
    assert [told_apart(value, 0.7450641) for value in (0.7450641 + 8e-7, 0.739, 0.74511)] == [
        "0.745065",
        "0.739",
        "0.74511",
    ]


def test_unstable_designs_are_named() -> None:
    panel = tornado_panel(MEASURE, bars([np.inf, 1.2, 1.1, 1.0]))
    assert "unstable" in words(panel) and "inf" not in words(panel)


@pytest.mark.parametrize(
    ("low", "high"), [(-12.9, -5.1), (0.7389, 0.7561), (0.0, 1.0), (1e-9, 3e-9), (99_990.0, 100_010.0)]
)
def test_ticks_are_few_round_and_inside(low: float, high: float) -> None:
    ticks = np.array(round_ticks(low, high))
    assert 3 <= len(ticks) <= 6 and np.all((low <= ticks) & (ticks <= high))
    steps = np.diff(ticks)
    assert np.ptp(steps) < 1e-6 * steps[0]


def result(names: tuple[str, ...]) -> Any:
    return SimpleNamespace(
        sweep=SimpleNamespace(tolerances={}, tolerance=0.01, observers=[SimpleNamespace(name=n) for n in names])
    )


def test_where_nothing_changed_the_picture_says_so_with_the_values() -> None:
    changes = [Change(0, "nominal", 1e-5, -85.4, "1/s"), Change(0, "worst", 0.0, -61.59, "1/s")]
    panel = change_panel(result(("one",)), MEASURE, changes)
    assert panel.title == "noise norm [1/s]: all 2 statistics are unchanged" and panel.bare
    assert words(panel) == ["nominal", "quantile 99 %", "worst", "one", "−85.4", "−61.59"]
    sheet = draw(Figure("still", "c", "a", panel, size=(5.6, 1.5), legend="below"))
    sheet.draw_without_rendering()
    assert not sheet.axes[0].axison and not sheet.legends
    inside = sheet.axes[0].get_window_extent()
    boxes = sorted((text.get_window_extent() for text in sheet.axes[0].texts), key=lambda box: (-round(box.y0), box.x0))
    assert all(inside.x0 - 1 <= box.x0 and box.x1 <= inside.x1 + 1 for box in boxes)
    assert not any(a.overlaps(b) for a, b in pairwise(boxes))


def test_changes_are_counted_and_written_and_statistics_do_not_cover_each_other() -> None:
    names = ("nominal", "median", "quantile 95 %", "quantile 99 %", "worst")
    changes = [
        Change(0, name, percent, 1.0, "1") for name, percent in zip(names, (0.0, -4.8, 3.1, -0.5, 0.0), strict=True)
    ]
    panel = change_panel(result(("one",)), MEASURE, changes)
    assert panel.title == "noise norm: 1 shrank, 3 moved" and words(panel) == ["−4.8", "+3.1", "−0.5"]
    assert len({change.y for change in changes}) == 5


def test_titles_and_labels_of_panels_are_broken_where_they_do_not_fit_and_only_there() -> None:
    long = cast(
        Measure,
        SimpleNamespace(name="second_moment_radius p 0.25 hold-last-value", unit="1", better="smaller", sign=1.0),
    )
    panels = [tornado_panel(measure, bars([1.3, 1.2, 1.1, 1.4])) for measure in (long, MEASURE)]
    sheet = draw(Figure("tiles", "c", "a", panels, size=(8.8, 2.6), legend="below"))
    sheet.draw_without_rendering()
    first, second = (
        next(text for text in axes.findobj(Text) if text.get_text() == axes.get_title(loc="left"))
        for axes in sheet.axes
    )
    for axes, title in zip(sheet.axes, (first, second), strict=True):
        for text in (title, axes.xaxis.label):
            box = text.get_window_extent()
            assert sheet.bbox.x0 <= box.x0 and box.x1 <= sheet.bbox.x1
    assert (
        first.get_window_extent().x1 < sheet.bbox.x1 / 2 and "\n" in first.get_text() and "\n" not in second.get_text()
    )
    assert fitted("$\\alpha$ as it is, a formula of any length that nobody breaks", 1.0, 9.0).count("\n") == 0


@pytest.mark.parametrize("columns", [1, 2])
def test_long_titles_stay_inside_the_sheet(columns: int) -> None:
    panel = tornado_panel(MEASURE, bars([1.3, 1.2, 1.1, 1.4]))
    title = "resilient-velocity-longitudinal: one parameter at a time, worst over the grid of wheel speeds and rates"
    sheet = draw(Figure("long", "c", "a", [panel] * columns, size=(4.8 * columns, 2.0), title=title, legend="below"))
    sheet.draw_without_rendering()
    assert sheet.get_suptitle().replace("\n", " ") == title
    (shown,) = [text for text in sheet.texts if text.get_text() == sheet.get_suptitle()]
    assert shown.get_window_extent().x1 <= sheet.bbox.x1
