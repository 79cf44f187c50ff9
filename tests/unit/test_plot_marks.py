"""Figures as data are drawn: every mark, shared axes and bars, the same bytes from the same data, each file format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.plots import (
    ZERO,
    Axis,
    Band,
    Bars,
    Box,
    ColouredDots,
    Contours,
    ErrorBars,
    Figure,
    Level,
    Line,
    Map,
    Mark,
    Panel,
    Shade,
    Words,
    dots,
)
from studies.plots.draw import draw, draw_mark
from studies.plots.save import save_as, save_figure

X = np.linspace(0.0, 1.0, 5)
Z = np.outer(X, X)
MARKS: dict[str, Mark] = {
    "line": Line(X, X**2, "line", steps=True, marker="o", hollow=True),
    "dots": dots(X, X, "dots", marker="^"),
    "legend alone": dots([], [], "legend alone"),
    "band": Band(X, 0.0, X, "band"),
    "zero": ZERO,
    "cross": Level(0.5, 0.5, "cross", dash="dotted"),
    "shade": Shade(0.2, 0.4, "x", "shade"),
    "words": Words(0.5, 0.5, "words", relative=True),
    "bars": Bars([0, 1], [1.0, 2.0], "bars", numbers="%g"),
    "lying bars": Bars([0, 1], [1.0, 2.0], "lying bars", flat=True, start=[-1.0, 0.0]),
    "error bars": ErrorBars(X, X, 0.1 * X, 0.2 * X, "error bars"),
    "map": Map(X, X, Z, "map [1]"),
    "cells": Map(X, np.arange(2), Z[:2], smooth=False),
    "coloured dots": ColouredDots(X, X, X, "coloured dots [1]", low=0.1, high=0.9),
    "contours": Contours(X, X, Z, [0.2, 0.5]),
    "filled contours": Contours(X, X, Z, [0.2, 0.5], filled=True),
    "box": Box((0.2, 0.4), (0.2, 0.6), "box"),
}


def one(*marks: Mark, **options: object) -> Figure:
    return Figure("one", "caption", "alternative", Panel(marks, "x [m]", "y [s]"), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", MARKS)
def test_every_mark_is_drawn(name: str) -> None:
    sheet = draw(one(MARKS[name], legend="below"))
    sheet.draw_without_rendering()
    axes = sheet.axes[0]
    assert axes.has_data() or axes.texts
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [s]")
    label = getattr(MARKS[name], "label", "")
    if "map" in name or "coloured" in name:
        assert sheet.axes[1].get_ylabel() == label  # of the colour bar
    elif label:
        assert [text.get_text() for text in sheet.legends[0].get_texts()] == [label]


def test_what_is_no_mark_is_refused() -> None:
    with pytest.raises(TypeError, match="str is no mark"):
        draw_mark("line", None)  # type: ignore[arg-type]


def test_panels_in_rows_with_empty_places_shared_axes_and_one_bar() -> None:
    shade = Map(X, X, Z, low=0.0, high=1.0)
    rows = [[Panel([shade], title="first"), None], [Panel([shade], Axis("x [m]", 1.0, 0.0)), Panel([Line(X, X)])]]
    sheet = draw(Figure("rows", "caption", "alternative", rows, share_x="all", bar="z [1]", title="rows"))
    sheet.draw_without_rendering()
    first, empty, *_ = sheet.axes
    assert not empty.get_visible()
    assert first.get_xlim() == (1.0, 0.0)  # shared, and turned round
    assert [axes.get_ylabel() for axes in sheet.axes[4:]] == ["z [1]"]


def test_ticks_scales_and_headings() -> None:
    x, y = Axis("x [m]", ticks={0.0: "none", 1.0: "all"}), Axis("y [s]", scale="symlog", linear=0.1)
    panel = Panel([Line(X, X, "line")], x, y, legend="best", heading="kinds")
    (axes,) = draw(Figure("one", "caption", "alternative", panel)).axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ["none", "all"]
    legend = axes.get_legend()
    assert axes.get_yscale() == "symlog" and legend is not None and legend.get_title().get_text() == "kinds"


def test_the_same_data_give_the_same_bytes_in_every_format(tmp_path: Path) -> None:
    figure = one(*MARKS.values(), legend="below")
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        save_figure(figure, tmp_path / folder)
        save_as(figure, tmp_path / folder / "other.pdf")
    names = {"one.svg": b"<?xml", "one.png": b"\x89PNG", "other.pdf": b"%PDF"}
    assert {path.name for path in (tmp_path / "first").iterdir()} == set(names)
    for name, start in names.items():
        content = (tmp_path / "first" / name).read_bytes()
        assert content.startswith(start) and content == (tmp_path / "second" / name).read_bytes()
