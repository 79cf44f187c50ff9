"""What every check of a foreign JSON value is made of: kinds, sizes, names, numbers, each refused with its place."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NoReturn

from estimators.errors import ScheduleError, printable

LARGEST = 1e100
LONGEST_TEXT = 2000
LONGEST_NAME = 64
DEEPEST = 40  # nesting of JSON
_LONGEST_PLACE, _LONGEST_REASON = 90, 200  # characters of a refusal
_LEAVES = {float, int, str, bool, type(None)}
_MANY = 100_000
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_UNIT = re.compile(r"[A-Za-z0-9_%°µ*/^(). +-]+\Z")


def shown(value: Any, most: int = 60) -> str:
    """A foreign value for a message: text as it is but `printable`, containers by their kind."""
    if isinstance(value, str):
        return printable(value, most)
    if isinstance(value, int) and abs(value) >= 10**most:
        return "an integer of many digits"
    if value is None or isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, Mapping):
        return "an object"
    return "a list" if isinstance(value, (list, tuple)) else type(value).__name__


def quoted(value: Any) -> str:
    """As `shown`, text in quotation marks: "632" is no number."""
    return f"'{shown(value)}'" if isinstance(value, str) else shown(value)


def too_deep(value: Any) -> bool:
    """Whether lists and objects are nested beyond `DEEPEST`; without recursion, also where they contain themselves."""
    level = [value]
    for _ in range(DEEPEST + 1):
        level = [one for entry in level for one in _inside(entry) if type(one) not in _LEAVES]
        if len(level) > _MANY:
            level = list({id(one): one for one in level}.values())
    return bool(level)


def _inside(value: Any) -> Iterable[Any]:
    if isinstance(value, (list, tuple)):
        return value
    return value.values() if isinstance(value, Mapping) else ()


class Checker:
    """Checks with the file name in every message.

    Raises:
        ScheduleError: `where`, the JSON place such as `gain.table[3]`, and what was expected there; one short line.
    """

    def __init__(self, where: str) -> None:
        self.where = where

    def fail(self, place: str, why: str) -> NoReturn:
        """Refuse."""
        raise ScheduleError(f"{self.where}: {printable(place, _LONGEST_PLACE)}: {printable(why, _LONGEST_REASON)}")

    def mapping(self, value: Any, place: str, most: int | None = None) -> None:
        """An object, of a largest size."""
        if not isinstance(value, Mapping):
            self.fail(place or "content", f"expected an object, got {quoted(value)}")
        if most is not None and len(value) > most:
            self.fail(place, f"has {len(value)} entries; at most {most} are read")

    def keys(
        self, value: Any, place: str, expected: Sequence[str], optional: Sequence[str] = (), closed: bool = True
    ) -> None:
        """An object with exactly these keys (and some of the optional ones; any others if it is not closed)."""
        self.mapping(value, place)
        prefix = f"{place}." if place else ""
        for key in expected:
            if key not in value:
                self.fail(f"{prefix}{key}", "missing")
        for key in value if closed else ():
            if key not in expected and key not in optional:
                self.fail(f"{prefix}{shown(key, 40)}", f"unknown key; known: {', '.join((*expected, *optional))}")

    def items(self, value: Any, place: str, count: int | None = None, most: int | None = None) -> Sequence[Any]:
        """A list, of a given length or of a largest one."""
        if not isinstance(value, (list, tuple)):
            self.fail(place, f"expected a list, got {quoted(value)}")
        if count is not None and len(value) != count:
            self.fail(place, f"has {len(value)} entries, expected {count}")
        if most is not None and len(value) > most:
            self.fail(place, f"has {len(value)} entries; at most {most} are read")
        return value

    def text(self, value: Any, place: str, empty: bool = False, most: int = LONGEST_TEXT) -> str:
        """Printable text on one line."""
        if not isinstance(value, str) or not (value or empty):
            self.fail(place, f"expected {'a' if empty else 'a non-empty'} text, got {quoted(value)}")
        if len(value) > most:
            self.fail(place, f"'{shown(value, 40)}' has {len(value)} characters; at most {most} are read")
        if not value.isprintable():
            self.fail(place, f"'{shown(value, 40)}' holds control characters")
        return value

    def name(self, value: Any, place: str) -> str:
        """A name of letters, digits and underscores."""
        self.text(value, place, most=LONGEST_NAME)
        if not _NAME.match(value):
            self.fail(place, f"'{shown(value)}' is not a name of letters, digits and underscores")
        return str(value)

    def unit(self, value: Any, place: str) -> str:
        """A unit as a product of powers; what it means is for those to check who use it."""
        self.text(value, place, most=LONGEST_NAME)
        if not _UNIT.match(value) or value != value.strip():
            self.fail(place, f"'{shown(value)}' is not a unit; write for example 'rad/s', 'm/s^2' or '1'")
        return str(value)

    def number(self, value: Any, place: str) -> float:
        """A finite number that float64 holds exactly, within what a physical quantity may be."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fail(place, f"expected a number, got {quoted(value)}")
        try:
            exact = float(value)
        except OverflowError:
            exact = math.inf
        if not math.isfinite(exact) or exact != value:
            self.fail(place, f"{shown(value)} is not a finite number that float64 holds exactly")
        if abs(exact) > LARGEST:
            self.fail(place, f"{exact!r} is beyond {LARGEST:g}: no physical quantity, and products would overflow")
        return exact

    def positive(self, value: Any, place: str) -> float:
        """A positive number."""
        number = self.number(value, place)
        if not number > 0.0:
            self.fail(place, f"{number} must be positive")
        return number

    def array(self, value: Any, place: str, shape: tuple[int, ...]) -> list[float]:
        """The numbers of a nested list of this shape, in order."""
        found: list[float] = []
        for index, entry in enumerate(self.items(value, place, shape[0])):
            if len(shape) > 1:
                found += self.array(entry, f"{place}[{index}]", shape[1:])
            elif type(entry) is float and -LARGEST <= entry <= LARGEST:  # what most are, without a place made for each
                found.append(entry)
            else:
                found.append(self.number(entry, f"{place}[{index}]"))
        return found

    def polynomial(self, value: Any, place: str, parameters: int, shape: tuple[int, int], order: int) -> None:
        """Chebyshev coefficient matrices by their orders: {"orders": [[0], [1]], "coefficients": [matrix, matrix]}."""
        self.keys(value, place, ("orders", "coefficients"))
        seen = set()
        for index, orders in enumerate(self.items(value["orders"], f"{place}.orders", most=(order + 1) ** parameters)):
            spot = f"{place}.orders[{index}]"
            for one in self.items(orders, spot, parameters):
                if isinstance(one, bool) or not isinstance(one, int) or not 0 <= one <= order:
                    self.fail(spot, f"orders are integers from 0 to {order}, got {quoted(one)}")
            if tuple(orders) in seen:
                self.fail(spot, f"the order {list(orders)} appears twice")
            seen.add(tuple(orders))
        self.array(value["coefficients"], f"{place}.coefficients", (len(seen), *shape))

    def plain(self, value: Any, place: str, most: int) -> int:
        """Anything that JSON can hold and other readers read alike: finite numbers, text without control characters.

        At most so many entries; returns how many more there may be.
        """
        most -= 1
        if most < 0:
            self.fail(place, "is one entry too many here")
        if isinstance(value, Mapping):
            for key, entry in value.items():
                if not isinstance(key, str) or not key.isprintable():
                    self.fail(f"{place}.{shown(key, 40)}", "is not a key of printable text")
                most = self.plain(entry, f"{place}.{shown(key, 40)}", most)
        elif isinstance(value, (list, tuple)):
            for index, entry in enumerate(value):
                most = self.plain(entry, f"{place}[{index}]", most)
        elif isinstance(value, str):
            if not value.isprintable():
                self.fail(place, f"'{shown(value, 40)}' holds control characters")
        elif value is not None and not isinstance(value, bool):
            self.number(value, place)
        return most
