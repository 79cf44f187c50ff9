"""Published values as data: the shipped sets against the printed tables, and files that cannot be used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from synthesis.errors import SpecError
from synthesis.models.parameter_set import load_parameter_set, quantities

# Printed tables: P1 Table I and section IV, P3 Table I, P2 Table I and section IV (R_e of the text, 0.35 m).
TIRES = {
    ("corner-estimation", "longitudinal"): (632.1, 0.76, 0.0016, 8.32),
    ("corner-estimation", "lateral"): (181.5, 0.81, 0.001, 12.84),
    ("resilient-velocity", "longitudinal"): (641.0, 0.85, 0.0016, 8.1),
    ("resilient-velocity", "lateral"): (131.5, 0.82, 0.001, 13.4),
    ("longitudinal-speed", "longitudinal"): (612.0, 0.87, 0.0016, 8.0),
}
VEHICLES = {
    "corner-estimation": {"mass": 2270, "wheel_inertia": 1.68, "wheel_base": 2.85, "effective_radius": 0.33},
    "resilient-velocity": {"mass": 2330, "wheel_inertia": 1.65, "effective_radius": 0.33, "friction_sliding": 0.85},
    "longitudinal-speed": {"mass": 2270, "wheel_inertia": 1.68, "front_track": 1.62, "effective_radius": 0.35},
}
GAINS = {
    ("corner-estimation", "longitudinal"): ((0.68, 183.1), ((0.5, 0.9), (60, 210))),
    ("corner-estimation", "lateral"): ((1.11, 16.7), ((0.8, 1.3), (6, 19))),
    ("resilient-velocity", "longitudinal"): ((1.18, 387), None),
    ("resilient-velocity", "lateral"): ((1.21, 16.8), None),
}


@pytest.mark.parametrize(("name", "direction"), list(TIRES))
def test_tires_are_as_printed(name: str, direction: str) -> None:
    tire = load_parameter_set(name).tire[direction]
    found = quantities(tire)
    assert tuple(quantity.value for quantity in found.values()) == TIRES[name, direction]
    assert tuple(quantity.unit for quantity in found.values()) == ("1/m", "s/m", "s/m", "1/m")
    if (name, direction) in GAINS:
        assert tire.published is not None
        assert (tire.published.gains, tire.published.gain_box) == GAINS[name, direction]


@pytest.mark.parametrize("name", list(VEHICLES))
def test_vehicles_are_as_printed_and_every_value_has_a_source(name: str) -> None:
    found = load_parameter_set(name)
    assert {key: found.vehicle[key].value for key in VEHICLES[name]} == VEHICLES[name]
    every = [*found.vehicle.values(), *(q for tire in found.tire.values() for q in quantities(tire).values())]
    assert all(quantity.source.startswith(("P1", "P2", "P3")) for quantity in every)


def test_printed_matrices_keep_their_digits() -> None:
    """(29) and (41) of P1 are strings: judged exactly, they must not pass through binary fractions."""
    published = load_parameter_set("corner-estimation").tire["longitudinal"].published
    assert published is not None
    assert published.lyapunov is not None
    assert published.lyapunov[1] == (("-0.0011", "-0.2227"), ("-0.2227", "-67.969"))


GOOD = """
id = "own"
citation = "measured"
[vehicle]
effective_radius = { value = 0.31, unit = "m", source = "tape" }
[tire.longitudinal]
sigma0 = { value = 500, unit = "1/m", source = "fit" }
sigma1 = { value = 0.7, unit = "s/m", source = "fit" }
sigma2 = { value = 0.001, unit = "s/m", source = "fit" }
kappa = { value = 9, unit = "1/m", source = "fit" }
"""


def test_own_set_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(GOOD)
    assert load_parameter_set(path).tire["longitudinal"].sigma0.value == 500.0
    assert load_parameter_set(str(path)).vehicle["effective_radius"].value == 0.31


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("value = 500,", "value = nan,", ("tire.longitudinal.sigma0.value", "finite number")),
        ("value = 500,", "value = inf,", ("tire.longitudinal.sigma0.value", "finite number")),
        ("value = 500,", 'value = "many",', ("tire.longitudinal.sigma0.value", "'many' is not a number")),
        ("value = 500,", "", ("tire.longitudinal.sigma0.value: missing",)),
        ('unit = "1/m", source = "fit" }\nsigma1', 'source = "fit" }\nsigma1', ("sigma0.unit: missing",)),
        ('unit = "1/m"', 'unit = "1/metre2z"', ("'1/metre2z' is not a unit",)),
        ("kappa = {", "kapa = {", ("tire.longitudinal: unknown key 'kapa'; did you mean kappa? (and 1 more)",)),
        ('citation = "measured"', "", ("citation: missing; add it",)),
        ("[vehicle]", "[vehicle", ("own.toml",)),
        ('id = "own"', 'id = "own"\nid = "twice"', ("own.toml",)),
    ],
)
def test_bad_files_are_refused_with_the_place(tmp_path: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    assert old in GOOD
    path = tmp_path / "own.toml"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(SpecError) as error:
        load_parameter_set(path)
    message = str(error.value)
    assert "\n" not in message
    for word in ("own.toml", *words):
        assert word in message


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(
        SpecError,
        match=r"^absent\.toml: cannot be read \(No such file or directory\); give the path of a parameter file",
    ):
        load_parameter_set(tmp_path / "absent.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00id")
    with pytest.raises(SpecError, match=r"binary\.toml"):
        load_parameter_set(binary)
    empty = tmp_path / "empty.toml"
    empty.write_text(GOOD.split("[tire", maxsplit=1)[0] + "[tire]\n")
    with pytest.raises(SpecError, match="tire"):
        load_parameter_set(empty)


@pytest.mark.parametrize("name", ["corner-estimaton", "../parameters/corner-estimation", ""])
def test_unknown_sets_are_refused_with_a_hint(name: Any) -> None:
    with pytest.raises(SpecError, match="unknown parameter set") as error:
        load_parameter_set(name)
    assert "corner-estimation" in str(error.value)
