"""Model files: read to the model that is meant, written and read back, and refused with line, column and remedy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from estimators.errors import GainsmithError
from synthesis.errors import ModelError
from synthesis.exchange.model_file import load_model
from synthesis.exchange.model_text import model_text, save_model
from synthesis.exchange.model_units import check_units
from synthesis.models.catalogue.longitudinal_speed import longitudinal_speed_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import load_parameter_set

TEXT = """\
name = "mass-spring" # by Newton
source = "Newton"
states = [{ name = "position", unit = "m" }, { name = "velocity", unit = "m/s" }]
inputs = [{ name = "push", unit = "N" }]
outputs = [
  { name = "measured", unit = "m" },
]
disturbances = [{ name = "force", unit = "N" }, { name = "noise", unit = "m" }]

[[parameters]]
name = "stiffness"
unit = "N/m"
min = 10.0
max = 40.0
rate = [-50.0, 20.0]

[constants]
mass = { value = 2.1, unit = "kg", source = "scale" }
damping.value = 1.0
damping.unit = "N*s/m"
damping.source = 'data sheet'

[definitions]
square = "stiffness/mass"
pull = "-2*square + square"

[matrices]
A = [[0, 1],
     ["pull", "-damping/mass"]]
B = [[0], [ "1 / mass"]]
C = [[1, 0]]
E = [[0, 0], ["1/mass", 0]]
F = [[0, 1]]
"""


def load(text: str, folder: Path) -> LpvModel:
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    return load_model(path)


def test_a_file_is_the_model_that_it_says(tmp_path: Path) -> None:
    model = load(TEXT, tmp_path)
    mass, damping, stiffness = sp.symbols("mass damping stiffness")
    assert sp.Matrix([[0, 1], [-stiffness / mass, -damping / mass]]) == model.A
    assert sp.Matrix([[0, 0], [1 / mass, 0]]) == model.E and sp.zeros(1, 1) == model.D
    (parameter,) = model.parameters
    assert (parameter.rate_minimum, parameter.rate_maximum, parameter.unit) == (-50.0, 20.0, "N/m")
    assert model.constants["damping"].source == "data sheet"
    np.testing.assert_allclose(model.on([21.0]).A[0], [[0.0, 1.0], [-10.0, -1.0 / 2.1]], rtol=1e-14)


def same(one: LpvModel, other: LpvModel) -> bool:
    """The same signals, parameters, constants, and exactly the same numbers."""
    parts = ("name", "source", "states", "inputs", "outputs", "disturbances", "parameters")
    return (
        all(getattr(one, part) == getattr(other, part) for part in parts)
        and dict(one.constants) == dict(other.constants)
        and all(one.exact.matrices[key].terms == other.exact.matrices[key].terms for key in "ABCDEF")
    )


def test_written_and_read_back(tmp_path: Path) -> None:
    """Also a catalogue model of two parameters, one of which jumps."""
    for model in (load(TEXT, tmp_path), longitudinal_speed_model(load_parameter_set("longitudinal-speed"))):
        save_model(model, tmp_path / "back.toml")
        back = load_model(tmp_path / "back.toml")
        assert same(model, back)
        assert model_text(back) == model_text(model)
    assert not same(load(TEXT.replace("2.1", "2.2"), tmp_path), load(TEXT, tmp_path))


def test_models_built_in_python_are_checked_on_request() -> None:
    """The longitudinal speed model fits; with its radius in newtons it does not."""
    model = longitudinal_speed_model(load_parameter_set("longitudinal-speed"))
    check_units(model)
    wrong = {**model.constants, "effective_radius": replace(model.constants["effective_radius"], unit="N")}
    with pytest.raises(
        ModelError, match=r"matrices\.A\[0\]\[0\]: .* has the unit kilogram.*, its place needs second\^-1"
    ):
        check_units(replace(model, constants=wrong))


REFUSED = {  # what is changed, into what, where the refusal points to (empty: to the file), and its words
    "mass in metres": ('unit = "kg"', 'unit = "m"', 'pull", ', "kilogram.*place needs"),
    "position in newtons": ('"position", unit = "m"', '"position", unit = "N"', '1],', "place needs"),
    "sum of units": ('square = "stiffness/mass"', 'square = "stiffness/mass + damping"', 'damping"', "adds second"),
    "misspelt": ('"-damping/mass"', '"-damping/mas"', 'mas"]', "'mas' is neither .* did you mean mass"),
    "cycle": ('square = "stiffness/mass"', 'square = "pull*3"', "", "needs itself .*pull -> "),
    "unused constant": ('"-damping/mass"', "0", "damping.value", "constants.damping: is used in no matrix"),
    "unused definition": ("[matrices]", 'idle = "mass"\n\n[matrices]', 'mass"\n\n[mat', "definitions.idle: is used in no"),
    "no formula": ('"-damping/mass"', '"-(damping/mass"', '(damping', "is not a formula"),
    "code": ('"-damping/mass"', '"-exit(mass)"', "exit", "is not allowed in a formula"),
    "half power": ('"-damping/mass"', '"-damping/mass**0.5"', "0.5", "exponents are integers"),
    "zero": ('"-damping/mass"', '"-damping/(mass - mass)"', "-damping/(", "divides by zero"),
    "columns": ("C = [[1, 0]]", "C = [[1, 0, 0]]", "[1, 0, 0]", "row 1 of C has 3 entries; 2 states need 2"),
    "rows": ('[[0], [ "1 / mass"]]', "[[0]]", "[[0]]", "B has 1 rows; 2 states need 2"),
    "range": ("max = 40.0", "max = 4.0", "[[parameters]]", "empty or reversed"),
    "rates": ("[-50.0, 20.0]", "[-50.0]", "[-50.0]", "neither a bound nor a pair"),
    "no rate": ("rate = [-50.0, 20.0]", "", "[[parameters]]", r"rate: missing; add it, such as rate = 5\.0"),
    "key": ('"noise", unit', '"noise", unt', 'm" }]\n\n', "unknown key 'unt'; did you mean unit"),
    "number in quotes": ("value = 2.1", 'value = "2.1"', '2.1"', "is not a number; write one without quotes"),
    "truth value": ("C = [[1, 0]]", "C = [[true, 0]]", "true", "True is neither a number nor a formula"),
    "name twice": ('name = "force"', 'name = "damping"', "damping.value", "'damping' is the name of one of the disturbances"),
    "keyword": ("mass = {", "lambda = {", "{ value = 2.1", "has a name that a formula cannot use"),
    "unit": ('"position", unit = "m"', '"position", unit = "mtr"', '{ name = "position"', "'mtr' is not a unit"),
    "zero mass": ("value = 2.1", "value = 0.0", "", r"A\[1,0\] = -stiffness/mass divides by zero: mass = 0"),
    "no ASCII": ("mass = {", '"m\u00e4ss" = {', "{ value = 2.1", "needs a name of letters, digits and underscores"),
    "grows": ('"-2*square + square"', '"-((((2*square)**16)**16)**16)"', "(2*square)**16", "grows beyond 5000 operations"),
    "not TOML": ("[matrices]", "[matrices", "", "not a TOML file"),
    "specification": ("[matrices]", "[design]", "", "is a specification, not a model"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused_with_place_and_remedy(case: str, tmp_path: Path) -> None:
    """Line and column are those of the text in the file, counted from 1."""
    old, new, pointed, words = REFUSED[case]
    text = TEXT.replace(old, new, 1)
    assert text != TEXT
    before = text[: text.index(pointed)]
    place = rf"{before.count(chr(10)) + 1}:{len(before) - before.rfind(chr(10))}: " if pointed else ""
    with pytest.raises(GainsmithError, match=rf"^own\.toml:{place}.*({words})") as caught:
        load(text, tmp_path)
    assert "\n" not in str(caught.value)


def test_doubling_definitions_are_refused_at_once(tmp_path: Path) -> None:
    """Thirty of them would be 2^30 operations."""
    doubling = "\n".join(f'd{i} = "d{i - 1} + d{i - 1}"' for i in range(1, 31))
    text = TEXT.replace("[matrices]", f'd0 = "square"\n{doubling}\n\n[matrices]').replace('"pull"', '"d30 + pull"')
    with pytest.raises(ModelError, match=r"definitions\.d1[12]: .* grows beyond 5000 operations"):
        load(text, tmp_path)


def test_a_denominator_that_vanishes_names_the_value(tmp_path: Path) -> None:
    """stiffness = 20 N/m lies inside the range: 5 N/m does not, and is a model."""
    reference = 'limit = { value = 20.0, unit = "N/m", source = "test" }\n'
    text = TEXT.replace("[definitions]", reference + "[definitions]").replace(
        '"-damping/mass"', '"-damping/mass*limit/(stiffness - limit)"'
    )
    with pytest.raises(ModelError, match=r"^own\.toml: .*vanishes inside the range, near stiffness = 20 N/m"):
        load(text, tmp_path)
    load(text.replace("value = 20.0", "value = 5.0"), tmp_path)


def test_a_normalised_model_has_no_units_to_check(tmp_path: Path) -> None:
    text = TEXT
    for unit in ("m/s", "N/m", "N*s/m", "kg", "m", "N"):
        text = text.replace(f'unit = "{unit}"', 'unit = "1"')
    load(text, tmp_path)
    with pytest.raises(ModelError, match=r"adds|place needs"):
        load(text.replace('mass = { value = 2.1, unit = "1"', 'mass = { value = 2.1, unit = "kg"'), tmp_path)
