"""The report of schedules: levels at constant parameters against closed forms, and a page that says what fails."""

from __future__ import annotations

from copy import deepcopy
from functools import cache
from html import unescape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from estimators.schedule import SHIPPED, read_content, write_content
from studies.plots import Line, Panel, Shade
from studies.plots.draw import draw
from studies.report.frozen_levels import FrozenLevel, frozen_levels
from studies.report.schedule_figures import gain_figure, levels_figure
from studies.report.schedules import schedules_page
from studies.schedules import ScheduleRun
from synthesis.certificate.proof import prove

NAME = "longitudinal-speed"


@cache
def content() -> Any:
    return read_content(SHIPPED / f"{NAME}.json")


@cache
def levels() -> dict[str, FrozenLevel]:
    return {level.claim: level for level in frozen_levels(content())}


def error_matrix(k: int) -> Any:
    """A - L C at breakpoint k, from the printed formulas of P3 (8)."""
    at = content()["scheduling"][0]["breakpoints"][k]
    c = {name: entry["value"] for name, entry in content()["model"]["constants"].items()}
    a = c["kappa"] * c["effective_radius"] * at
    A = np.array([[-a, 1.0], [0.0, 0.0]])
    C = np.array([[c["sigma0"] - c["sigma1"] * a, c["sigma1"] + c["sigma2"]]])
    return A - np.array(content()["gain"]["table"][k]) @ C, at


@pytest.mark.parametrize("k", [0, 3, 7])
def test_poles_are_those_of_the_formulas(k: int) -> None:
    matrix, at = error_matrix(k)
    poles = np.linalg.eigvals(matrix).real
    for claim, expected in (
        ("error equation: decay rate", -poles.max()),
        ("error equation: fastest pole", -poles.min()),
    ):
        level = levels()[claim]
        (i,) = np.flatnonzero(np.isclose(level.points[:, 0], at))
        assert level.values[i] == pytest.approx(expected, rel=1e-9)


def test_the_gain_from_friction_is_the_floor_that_no_gain_lowers() -> None:
    level = levels()["error equation: gain friction -> relative_velocity"]
    c = {name: entry["value"] for name, entry in content()["model"]["constants"].items()}
    a = c["kappa"] * c["effective_radius"] * level.points[:, 0]
    np.testing.assert_allclose(level.values, c["sigma0"] / (c["sigma0"] + c["sigma2"] * a), rtol=1e-6)
    assert level.points[level.tightest, 0] == 0.0 and level.slack == pytest.approx(1.0 - 1.0 / level.level, rel=1e-6)


def test_no_proved_level_is_better_than_what_constant_parameters_allow() -> None:
    assert len(levels()) == 10 and all(0.0 < level.slack < 1.0 for level in levels().values())


def test_an_overstated_level_shows() -> None:
    overstated = deepcopy(content())
    for claim in overstated["claims"]:
        claim["level"] *= 1.3 if claim["kind"] in ("decay rate", "drop probability", "internal update") else 0.7
    assert all(level.slack < 0.0 for level in frozen_levels(overstated))


def test_figures_have_units_and_shade_what_is_excluded() -> None:
    figure = levels_figure(content(), list(levels().values()))
    panels = [panel for row in figure.rows for panel in row if isinstance(panel, Panel)]
    assert len(panels) == 10
    for panel, level in zip(panels, levels().values(), strict=True):
        (shade,) = [mark for mark in panel.marks if isinstance(mark, Shade)]
        (curve,) = [mark for mark in panel.marks if isinstance(mark, Line) and mark.label == "at constant parameters"]
        assert not np.any((shade.low < np.asarray(curve.y)) & (np.asarray(curve.y) < shade.high)), level.claim
    draw(figure).draw_without_rendering()
    sheet = draw(gain_figure(content(), [(0.4, 0.9), (50.0, 210.0)]))
    assert [axes.get_ylabel() for axes in sheet.axes] == ["$L$$_{1}$ [m/s]", "$L$$_{2}$ [m/s²]"]


@cache
def run(failing: bool) -> ScheduleRun:
    made = deepcopy(content())
    if failing:
        made["claims"][0]["level"] = 95.0
        with TemporaryDirectory() as folder:
            write_content(Path(folder) / "overstated.json", made)  # sealed again
            made = read_content(Path(folder) / "overstated.json")
    proofs = tuple(prove(made))
    state, message = ("drift", "'error equation: decay rate' is not proved") if failing else ("same", "")
    return ScheduleRun(NAME, state, 0.1, message, made, proofs)


def test_the_page_says_what_holds_and_where_it_is_tightest() -> None:
    page = unescape(schedules_page([run(False)]))
    assert (
        "All 10 claims are proved for every wheel speed from 0 to 140 rad/s and its rates from −800 to 800 rad/s²."
        in page
    )
    assert page.count("<img ") == 2 and "No claim fails." in page and "Tightest is '" in page
    assert page.count('<td class="text">proved</td>') == 10 and len(page) < 2_000_000
    assert f">{content()['gain']['table'][0][0][0]:.6g}</td>" in page


def test_the_page_says_what_fails_and_what_could_not_be_made() -> None:
    failed = ScheduleRun("no-design", "failed", 0.1, "no gain meets <both> bounds")
    page = schedules_page([run(True), failed])
    assert (
        "No claim fails." not in page
        and "9 of 10 claims are proved" in page
        and "no gain meets &lt;both&gt; bounds" in page
    )
    assert ">refuted</td>" in page or ">not proved</td>" in page
