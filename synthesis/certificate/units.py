"""Do the formulas of a model have the units that their places need? Read with pint, sums and products one by one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from synthesis.errors import ModelError
from synthesis.models.formula import parse, read, shown, used
from synthesis.models.param import check_unit, registry

PLACES = {  # unit of an entry of a matrix: row / (column times per)
    "A": ("states", "states", "s"), "B": ("states", "inputs", "s"), "C": ("outputs", "states", "1"),
    "D": ("outputs", "inputs", "1"), "E": ("states", "disturbances", "s"), "F": ("outputs", "disturbances", "1"),
}  # fmt: skip


@dataclass(frozen=True)
class Dimension:
    """A unit as a factor and powers of base units."""

    factor: float
    powers: tuple[tuple[str, float], ...]

    def __mul__(self, other: Dimension) -> Dimension:
        powers = dict(self.powers)
        for name, power in other.powers:
            powers[name] = powers.get(name, 0.0) + power
        return Dimension(self.factor * other.factor, _sorted(powers))

    def __truediv__(self, other: Dimension) -> Dimension:
        return self * Dimension(1.0 / other.factor, tuple((name, -power) for name, power in other.powers))

    def __add__(self, other: Dimension) -> Dimension:
        if not self.same(other):
            raise ModelError(f"adds {self.words} to {other.words}")
        return self

    __sub__ = __add__

    def same(self, other: Dimension) -> bool:
        """Whether a number in one unit is the same number in the other."""
        known = 0.0 < self.factor < math.inf and 0.0 < other.factor < math.inf
        return known and self.powers == other.powers and math.isclose(self.factor, other.factor, rel_tol=1e-9)

    @property
    def words(self) -> str:
        """For a message."""
        parts = [f"{name}^{power:g}" if power != 1.0 else name for name, power in self.powers]
        size = "" if math.isclose(self.factor, 1.0, rel_tol=1e-9) else f"{self.factor:g} "
        return size + ("*".join(parts) or "1")


NUMBER = Dimension(1.0, ())


def dimension(unit: str, where: str) -> Dimension:
    """What a unit means. Raises ModelError for text that is no unit, or a unit with an offset (degC)."""
    check_unit(unit, where)
    if unit == "1":
        return NUMBER
    units: Any = registry()
    try:
        parsed = units.parse_units(unit)
        factor, base = units.get_base_units(parsed)
        powers = dict(base._units.items())
        if not units.Quantity(1.0, parsed)._is_multiplicative:
            raise ValueError
    except Exception:  # pint raises overflow and key errors alike
        raise ModelError(f"{where}: '{shown(unit)}' is no unit that numbers can be multiplied by") from None
    return Dimension(float(factor), _sorted({name: float(power) for name, power in powers.items() if name != "radian"}))


def check_dimensions(model: Mapping[str, Any], scheduling: Any, where: str) -> None:
    """Every formula of `model.matrices` has the unit of its place.

    A plain 1 says that two quantities are the same, so its place needs the unit 1; so does every plain number in a place without
    dimension (there 0.3048 would hide a change of units). Any other plain number has the unit that its place needs.
    A model in which everything has the unit 1 is a normalised one, time included, and is not checked.
    Raises ModelError naming the entry.
    """
    units = {s["name"]: s["unit"] for kind in ("states", "inputs", "outputs", "disturbances") for s in model[kind]}
    named = {p["name"]: p["unit"] for p in scheduling}
    named |= {name: entry["unit"] for kind in ("constants", "tables") for name, entry in model.get(kind, {}).items()}
    if all(unit == "1" for unit in (*units.values(), *named.values())):
        return
    names = {name: dimension(unit, f"{where}: unit of {name}") for name, unit in named.items()}
    for key, (above, beside, per) in PLACES.items():
        for i, row in enumerate(model["matrices"][key]):
            for j, text in enumerate(row):
                place = f"{where}: model.matrices.{key}[{i}][{j}]"
                top, bottom = model[above][i], model[beside][j]
                wanted = dimension(top["unit"], place) / dimension(bottom["unit"], place) / dimension(per, place)
                check_entry(text, names, wanted, place)


def check_entry(text: str, names: Mapping[str, Dimension], wanted: Dimension, place: str) -> None:
    """One formula against the unit of its place."""
    tree = parse(text, place)
    if not used(tree):
        value = read(tree, text.strip(), {}, Fraction, place)
        if value != 0 and (abs(value) == 1 or not wanted.powers) and not wanted.same(NUMBER):
            words = f"is a pure number, its place needs {wanted.words}; write a constant with that unit"
            raise ModelError(f"{place}: '{shown(text)}' {words}")
        return
    try:
        found = read(tree, text.strip(), names, _number, place)
    except ModelError as error:
        words = str(error)
        raise ModelError(words if words.startswith(place) else f"{place}: '{shown(text)}' {words}") from None
    if not found.same(wanted):
        raise ModelError(f"{place}: '{shown(text)}' has the unit {found.words}, its place needs {wanted.words}")


def _number(_: Fraction) -> Dimension:
    return NUMBER


def _sorted(powers: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((name, power) for name, power in powers.items() if power != 0.0))
