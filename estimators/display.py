"""How objects show themselves in a terminal and in a notebook: the essential in five lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cached_property
from html import escape
from typing import Any, ClassVar, TypeVar

import numpy as np

LONGEST = 110  # characters of a line
MOST_LINES = 4  # below the heading
FEW = 4  # entries that are written out
SHORT = 60  # characters of a value


class Display:
    """`summary` is the text of `repr` and of the notebook: a heading, then lines "what: how much".

    A subclass writes its own, or leaves it to its fields: the first ones that fit, numbers in six digits with the unit that
    `shown_units` has for a field, arrays by their shape and their ends.
    """

    shown_units: ClassVar[Mapping[str, str]] = {}

    def summary(self) -> tuple[str, ...]:
        """At most five lines."""
        return of_fields(self, self.shown_units)

    def __repr__(self) -> str:
        return text(self.summary())

    def _repr_html_(self) -> str:
        return html(self.summary())


Shown = TypeVar("Shown")


def displayed(units: Mapping[str, str]) -> Callable[[type[Shown]], type[Shown]]:
    """A class that cannot be a `Display` shows itself like one: by its own `summary`, or its fields with their `units`."""

    def shows(kind: type[Shown]) -> type[Shown]:
        own: Callable[[Any], tuple[str, ...]] = getattr(kind, "summary", lambda shown: of_fields(shown, units))
        for name, form in (("__repr__", text), ("__str__", text), ("_repr_html_", html)):
            setattr(kind, name, lambda shown, form=form: form(own(shown)))
        return kind

    return shows


def text(lines: tuple[str, ...]) -> str:
    """Lines as a terminal shows them."""
    return "\n  ".join(shortened(line) for line in lines)


def html(lines: tuple[str, ...]) -> str:
    """Lines as a notebook shows them."""
    heading, *rest = lines
    rows = []
    for line in rest:
        what, colon, value = line.partition(": ")
        cells = (what, value) if colon else ("", line)
        rows.append("<tr>" + "".join(f'<td style="text-align:left">{escape(cell)}</td>' for cell in cells) + "</tr>")
    return f"<strong>{escape(heading)}</strong><table>{''.join(rows)}</table>"


def of_fields(shown: Any, units: Mapping[str, str]) -> tuple[str, ...]:
    """The kind (and name) of an object, and its fields: a line each, or several to a line where there are more than four."""
    facts = list(_facts(shown, units))
    name = getattr(shown, "name", None) if "name" in _names(shown) else None
    heading = type(shown).__name__ + (f" '{name}'" if isinstance(name, str) else "")
    if len(facts) <= MOST_LINES:
        return (heading, *(f"{what}: {value}" for what, value in facts))
    lines: list[str] = []
    left = [f"{what} {value}" for what, value in facts]
    while left and len(lines) < MOST_LINES:
        line = left.pop(0)
        while left and len(line) + 2 + len(left[0]) <= LONGEST:
            line += f"; {left.pop(0)}"
        lines.append(line)
    if left:
        lines[-1] = f"{lines[-1][: LONGEST - 4].rstrip(' ;')} ..."
    return (heading, *lines)


def _facts(shown: Any, units: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    for name in _names(shown):
        if name != "name" and not name.startswith("_"):
            value = getattr(shown, name)
            unit = f" {units[name]}" if name in units and value is not None else ""
            yield name.replace("_", " "), f"{brief(value)}{unit}"


def _names(shown: Any) -> list[str]:
    """Fields of a data class, of a tuple with names, of a table of a file; else the attributes that were given."""
    if is_dataclass(shown):
        return [f.name for f in fields(shown) if f.repr]
    kind = type(shown)
    declared = getattr(kind, "_fields", None) or getattr(kind, "model_fields", None)
    if declared is not None:
        return list(declared)
    return [name for name in vars(shown) if not isinstance(getattr(kind, name, None), cached_property)]


def brief(value: Any) -> str:
    """A value in a few words: numbers in six digits, arrays by shape and ends, collections by what they hold or how much."""
    if isinstance(value, Enum):
        return str(value)
    if isinstance(value, np.generic):
        return brief(value.item())
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "none"}[value]
    if isinstance(value, float | complex):
        return f"{value:.6g}"
    if isinstance(value, str):
        return value if len(value) <= SHORT else f"{value[: SHORT - 4]} ..."
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, Mapping):
        few = len(value) <= FEW and all(isinstance(v, int | float | str) for v in value.values())
        return (
            ", ".join(f"{k} = {brief(v)}" for k, v in value.items()) if few and value else counted(len(value), "entry")
        )
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        few = len(value) <= FEW and all(isinstance(v, int | float | complex | str | None) for v in value)
        return (
            f"({', '.join(map(brief, value))}{',' if len(value) == 1 else ''})" if few else counted(len(value), "entry")
        )
    if isinstance(value, Display):
        return value.summary()[0]
    if callable(value):
        return getattr(value, "__name__", type(value).__name__)
    if hasattr(value, "shape"):
        return f"{type(value).__name__} {value.shape}"
    if is_dataclass(value) or len(said := str(value)) > SHORT or "\n" in said:
        return type(value).__name__
    return said


def _array(array: np.ndarray[Any, Any]) -> str:
    if array.ndim == 0:
        return brief(array[()])
    if array.ndim == 1 and 0 < array.size <= FEW:
        return f"[{', '.join(brief(entry) for entry in array.tolist())}]"
    shape = f"array {array.shape}"
    if array.size == 0 or array.dtype.kind not in "iuf":
        return shape
    return f"{shape}, {ends(array)}"


def ends(values: Any) -> str:
    """A number in six digits, or the smallest and the largest finite one of an array."""
    array = np.asarray(values)
    if array.ndim == 0:
        return brief(array.item())
    finite = array[np.isfinite(array)]
    if not finite.size:
        return "no finite number"
    low, high = f"{finite.min():.4g}", f"{finite.max():.4g}"
    return low if low == high else f"{low} to {high}"


def shortened(line: str) -> str:
    """Cut where a line would not fit a terminal, without line breaks."""
    flat = " ".join(line.split("\n"))
    return flat if len(flat) <= LONGEST else f"{flat[: LONGEST - 4]} ..."


def counted(number: int, what: str) -> str:
    """1 state, 2 states; 1 entry, 2 entries."""
    many = f"{what[:-1]}ies" if what.endswith("y") else f"{what}s"
    return f"{number} {what if number == 1 else many}"
