"""Tables of a model: written in model files, made from grids of matrices, and refused where they are none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

from estimators.errors import GainsmithError
from synthesis.errors import ModelError
from synthesis.exchange.model_file import load_model
from synthesis.exchange.model_text import save_model
from synthesis.exchange.model_units import check_units
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.models.table import LookupTable

TEXT = """name = "pitch"
source = "test"
states = [{ name = "speed", unit = "rad/s" }]
outputs = [{ name = "seen", unit = "rad/s" }]
inputs = [{ name = "pitch", unit = "rad" }]

[[parameters]]
name = "wind"
unit = "m/s"
min = 4.0
max = 20.0
rate = 1.0

[[parameters]]
name = "air"
unit = "kg/m^3"
min = 1.0
max = 1.3
rate = 0.0

[constants]
rated = { value = 1.2, unit = "kg/m^3", source = "test" }

[tables.damping]
unit = "1/s"
source = "test"
over = ["wind"]
breakpoints = [3.0, 8.0, 12.0, 12.0, 25.0]
values = [0.1, 0.4, 0.2, 0.3, 0.9]

[tables.effect]
unit = "1/s^2"
source = "test"
over = ["wind", "air"]
breakpoints = [[0.0, 11.0, 25.0], [1.0, 1.3]]
values = [[0.0, 0.0], [1.0, 1.5], [4.0, 6.0]]

[matrices]
A = [["-damping*air/rated"]]
B = [["-effect"]]
C = [[1]]
"""


def load(text: str, folder: Path) -> LpvModel:
    (folder / "own.toml").write_text(text, encoding="utf-8")
    return load_model(folder / "own.toml")


def test_a_model_file_is_read_evaluated_and_written_back(tmp_path: Path) -> None:
    model = load(TEXT, tmp_path)
    assert model.cells.lines == ((4.0, 8.0, 11.0, 12.0, 20.0), (1.0, 1.3))
    draw = np.random.default_rng(1).uniform((4.0, 1.0), (20.0, 1.3), (40, 2))
    wind, air = draw.T
    damping = np.where(wind < 12.0, np.interp(wind, [3, 8, 12], [0.1, 0.4, 0.2]), np.interp(wind, [12, 25], [0.3, 0.9]))
    effect = np.interp(wind, [0, 11, 25], [0, 1, 4]) * (1.0 + 0.5 * (air - 1.0) / 0.3)
    found = model.on(draw)
    np.testing.assert_allclose(found.A[:, 0, 0], -damping * air / 1.2, rtol=1e-12)
    np.testing.assert_allclose(found.B[:, 0, 0], -effect, rtol=1e-12)
    check_units(model)
    save_model(model, tmp_path / "copy.toml")
    again = load_model(tmp_path / "copy.toml")
    assert again.A == model.A and again.summary() == model.summary()
    assert all((again.tables[key].values == table.values).all() for key, table in model.tables.items())


LINEAR = """[[constraints]]
formula = "wind/one_wind + air/rated"
max = 15.0

[constants.one_wind]
value = 1.0
unit = "m/s"
source = "test"

"""
REFUSED = {
    "unknown": ('over = ["wind"]', 'over = ["wnd"]', r"24:1: .*unknown parameter 'wnd'; did you mean wind"),
    "falls": ("[3.0, 8.0, 12.0, 12.0", "[3.0, 8.0, 7.0, 12.0", "24:1: .*must rise"),
    "thrice": ("[3.0, 8.0, 12.0, 12.0", "[3.0, 12.0, 12.0, 12.0", "twice is a jump"),
    "at an end": ("[3.0, 8.0, 12.0, 12.0", "[3.0, 3.0, 8.0, 12.0", "jumps at an end"),
    "shape": ("[0.1, 0.4, ", "[0.4, ", r"shape \(4,\) do not fit 5 breakpoints of wind"),
    "ragged": ("[1.0, 1.5]", "[1.0]", "must be numbers, a value for every breakpoint"),
    "range": ("min = 4.0", "min = 2.0", r"covers wind from 3 to 25 m/s, its range is \[2, 20\]"),
    "unit": ('"1/s^2"', '"1/s"', r"'-effect' has the unit second\^-1, its place needs second\^-2"),
    "idle": ('"-effect"', '"-rated*rated"', "place needs"),
    "not used": ('"-damping*air/rated"', "0", "constants.rated: is used in no matrix"),
    "divides": ('"-damping*air/rated"', '"-damping*rated/air"', "divides by a parameter or a table"),
    "name": ("[tables.effect]", "[tables.rated]", "'rated' is the name of one of the constants already"),
    "constraints": ("[matrices]", LINEAR + "[matrices]", "constraints between its parameters; one of both is supported"),
    "source": ('unit = "1/s^2"\nsource = "test"', 'unit = "1/s^2"', "source: missing"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused_with_one_line(case: str, tmp_path: Path) -> None:
    old, new, words = REFUSED[case]
    text = TEXT.replace(old, new, 1)
    assert text != TEXT
    with pytest.raises(GainsmithError, match=words) as caught:
        load(text, tmp_path)
    assert "\n" not in str(caught.value)


SIGNALS: dict[str, Any] = {
    "states": (Signal("x", "m"), Signal("v", "m/s")), "outputs": (Signal("y", "m"),), "inputs": (Signal("push", "N"),),
}  # fmt: skip
SPEED, LOAD = (
    SchedulingParameter("speed", "m/s", 0.0, 2.0, -1.0, 1.0),
    SchedulingParameter("load", "kg", 1.0, 2.0, 0, 0),
)


def test_a_grid_of_matrices_is_met_exactly_with_nothing_left_over() -> None:
    """A peak that no polynomial through four points follows; an entry is a table over what moves it alone."""
    lines = {"speed": [0.0, 0.5, 0.8, 2.5], "load": [1.0, 2.0]}
    stiff = np.array([1.0, 3.0, 1.2, 1.1])
    A, B = np.zeros((4, 2, 2, 2)), np.zeros((4, 2, 2, 1))
    A[..., 0, 1], A[..., 1, 0], A[..., 1, 1] = 1.0, -stiff[:, None], -stiff[:, None] * np.array([1.0, 2.0])
    B[..., 1, 0] = np.array([1.0, 0.5])
    model = LpvModel.from_grid("m", "test", (SPEED, LOAD), lines, A=A, B=B, C=[[1.0, 0.0]], fit="table", **SIGNALS)
    assert model.disturbances == ()
    assert {key: table.over for key, table in model.tables.items()} == {
        "A_2_1": ("speed",), "A_2_2": ("speed", "load"), "B_2_1": ("load",),
    }  # fmt: skip
    check_units(model)
    draw = np.random.default_rng(0).uniform((0.0, 1.0), (2.0, 2.0), (30, 2))
    wanted = -np.interp(draw[:, 0], lines["speed"], stiff)
    np.testing.assert_allclose(model.on(draw).A[:, 1], np.stack([wanted, wanted * draw[:, 1]], -1), rtol=1e-12)
    np.testing.assert_allclose(model.on(draw).B[:, 1, 0], 1.5 - 0.5 * draw[:, 1], rtol=1e-12)
    with pytest.raises(ModelError, match="bend more than a polynomial"):
        LpvModel.from_grid(
            "m", "test", (SPEED, LOAD), lines, A=A, B=B, C=[[1.0, 0.0]], fit="piecewise-linear", **SIGNALS
        )
    with pytest.raises(ModelError, match="a table has no degree"):
        LpvModel.from_grid("m", "test", (SPEED, LOAD), lines, A=A, C=[[1.0, 0.0]], fit="table", degree=1, **SIGNALS)


def test_a_grid_line_with_a_value_twice_is_a_jump() -> None:
    A = np.zeros((4, 2, 2))
    A[:, 0, 1], A[:, 1, 0] = 1.0, [-1.0, -2.0, -3.0, -4.0]
    given: dict[str, Any] = {"A": A, "C": [[1.0, 0.0]], **SIGNALS, "inputs": ()}
    model = LpvModel.from_grid("m", "test", (SPEED,), {"speed": [0.0, 1.0, 1.0, 2.0]}, fit="table", **given)
    assert "jumps: A_2_1 at speed = 1 m/s" in model.summary()[-1]
    with pytest.raises(ModelError, match="does not rise"):
        LpvModel.from_grid("m", "test", (SPEED,), {"speed": [0.0, 1.0, 1.0, 2.0]}, **given)


def test_too_many_cells_are_refused_at_once() -> None:
    line = tuple(np.linspace(0.0, 2.0, 100).tolist())
    table = LookupTable("1", "test", ("p", "q"), (line, line), np.ones((100, 100)))
    axes = tuple(SchedulingParameter(name, "1", 0.0, 2.0, 0.0, 0.0) for name in "pq")
    one = (Signal("x", "1"),)
    with pytest.raises(ModelError, match="9801 cells, at most 4096"):
        LpvModel(
            "m", "test", one, (Signal("y", "1"),), axes, sp.Matrix([[sp.Symbol("a")]]), sp.eye(1), tables={"a": table}
        )
