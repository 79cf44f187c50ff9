"""Units of formulas: every shipped model fits, and no single unit of it can be another one."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pint
import pytest

from synthesis.certificate.units import NUMBER, check_dimensions, check_entry, dimension
from synthesis.errors import ModelError
from synthesis.models.param import check_unit

ROOT = Path(__file__).parents[2]
DATA = Path(__file__).parent / "data"
FILES = [*sorted((ROOT / "estimators" / "schedules").glob("*.json")), DATA / "heated-spring.json"]
OTHERS = (
    "m",
    "ft",
    "mm",
    "m/s",
    "ft/s",
    "km/h",
    "m/s^2",
    "ft/s^2",
    "1/s",
    "1/min",
    "rad/s",
    "rpm",
    "kg",
    "N",
    "K",
    "%",
    "s",
    "1",
    "deg",
)
registry = pint.UnitRegistry()


def content(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return found


def check(data: dict[str, Any]) -> None:
    check_dimensions(data["model"], data["scheduling"], "here")


def holders(data: dict[str, Any]) -> list[dict[str, Any]]:
    model = data["model"]
    signals = [s for kind in ("states", "inputs", "outputs", "disturbances") for s in model[kind]]
    return [*signals, *model["constants"].values(), *data["scheduling"]]


def same(unit: str, other: str) -> bool:
    """By pint, angles being numbers."""
    a, b = (registry.Quantity(1.0, text).to_base_units() for text in (unit, other))
    powers = [{k: v for k, v in dict(q.unit_items()).items() if k != "radian"} for q in (a, b)]
    return powers[0] == powers[1] and abs(a.magnitude / b.magnitude - 1.0) < 1e-9


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_stored_models_fit(path: Path) -> None:
    check(content(path))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_no_single_unit_can_be_another(path: Path) -> None:
    """Signals, parameter and constants, one at a time: refused unless the unit is the same in other words."""
    changed = 0
    for place in range(len(holders(content(path)))):
        for unit in OTHERS:
            data = content(path)
            before, holders(data)[place]["unit"] = holders(data)[place]["unit"], unit
            if same(before, unit):
                check(data)
                continue
            with pytest.raises(ModelError, match=r"here: model\.matrices\.[A-F]\[\d\]\[\d\]: "):
                check(data)
            changed += 1
    assert changed > 100


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_no_single_name_can_be_another_of_another_unit(path: Path) -> None:
    """A constant in the place of another one is refused where their units differ."""
    data = content(path)
    units = {name: entry["unit"] for name, entry in data["model"]["constants"].items()}
    for key, rows in data["model"]["matrices"].items():
        for i, row in enumerate(rows):
            for j, text in enumerate(row):
                if text not in units:
                    continue
                for name, unit in units.items():
                    other = copy.deepcopy(data)
                    other["model"]["matrices"][key][i][j] = name
                    if same(unit, units[text]):
                        check(other)
                    else:
                        with pytest.raises(ModelError, match="its place needs"):
                            check(other)


def test_angles_are_numbers_and_words_are_free() -> None:
    assert dimension("rad/s", "here").same(dimension("1/s", "here"))
    assert dimension("N*m", "here").same(dimension("kg*m^2/s^2", "here")) and dimension("m/s/s", "here").same(
        dimension("m/s^2", "here")
    )
    assert not dimension("deg/s", "here").same(dimension("rad/s", "here"))
    assert not dimension("km", "here").same(dimension("m", "here"))
    assert dimension("1", "here") is NUMBER and dimension("%", "here").factor == pytest.approx(0.01)


NAMES = {
    "length": dimension("m", "here"),
    "span": dimension("mm", "here"),
    "time": dimension("s", "here"),
    "share": NUMBER,
}


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("length", "m", ""),
        ("2*length", "m", ""),
        ("length*length/length", "m", ""),
        ("length**2/time**2", "m^2/s^2", ""),
        ("length**-1", "1/m", ""),
        ("-share + 1", "1", ""),
        ("length - 3*length", "m", ""),
        ("0", "kg", ""),
        ("0.0*1", "kg", ""),
        ("-4", "1/s^2", ""),
        ("1", "1", ""),
        ("-1", "m/m", ""),
        ("0.5", "1", ""),
        ("length", "mm", "has the unit meter, its place needs 0.001 meter"),
        ("length", "s", "has the unit meter, its place needs second"),
        ("length + time", "m", "adds meter to second"),
        ("length - 1", "m", "adds meter to 1"),
        ("length + span", "m", "adds meter to 0.001 meter"),
        ("length*time", "m", "has the unit meter*second"),
        ("share", "m", "has the unit 1, its place needs meter"),
        ("share**0", "m", "has the unit 1, its place needs meter"),
        ("1", "1/s", "is a pure number, its place needs second^-1"),
        ("-1", "m", "is a pure number, its place needs meter"),
        ("2 - 1", "m", "is a pure number, its place needs meter"),
        ("0.3048", "ft/m", "is a pure number, its place needs 0.3048 1"),
        ("5", "%", "is a pure number, its place needs 0.01 1"),
        ("mass", "kg", "'mass' is neither a constant nor a scheduling parameter"),
    ],
)
def test_entries(text: str, unit: str, words: str) -> None:
    wanted = dimension(unit, "here")
    if not words:
        check_entry(text, NAMES, wanted, "here")
        return
    with pytest.raises(ModelError) as caught:
        check_entry(text, NAMES, wanted, "here")
    assert str(caught.value).startswith("here: ") and words in str(caught.value)


def test_a_normalised_model_is_not_checked() -> None:
    """All units 1, time included; a single other one ends that."""
    data = content(FILES[0])
    for holder in holders(data):
        holder["unit"] = "1"
    check(data)
    holders(data)[0]["unit"] = "m"
    with pytest.raises(ModelError):
        check(data)


def test_units_beyond_all_numbers_are_not_the_same() -> None:
    """1e240 times 1e240 is infinite in float64; so is twice that, and they are not equal."""
    large = dimension("km^80", "here")
    assert (large * large).factor == float("inf")
    assert not (large * large).same(large * large)


@pytest.mark.parametrize(
    "unit",
    [
        "degC",
        "degF",
        "dB",
        "m**101",
        "9**9**9",
        "m**9**9",
        "m**(9**9)",
        "2*m",
        "1e9",
        "",
        " ",
        "proved",
        "m + m",
        "m" * 65,
    ],
)
def test_what_is_no_unit_is_refused_at_once(unit: str) -> None:
    with pytest.raises(ModelError) as caught:
        dimension(unit, "here")
    assert str(caught.value).startswith("here: ") and str(caught.value).isprintable() and len(str(caught.value)) < 250


@pytest.mark.parametrize(
    "unit",
    [
        "1",
        "m",
        "m/s^2",
        "m/s/s",
        "rad/s",
        "kg*m^2",
        "N m",
        "m**2",
        "m**-2",
        "m^(1/2)",
        "m^0.5",
        "µm",
        "%",
        "°",
        "km/h",
        "(m/s)/(1)",
        "m^+2",
        "K^12",
    ],
)
def test_what_people_write_is_a_unit(unit: str) -> None:
    assert check_unit(unit, "here") == unit
    dimension(unit, "here")
