"""One sentence about a result: a template, such as those of ``claims.toml``, filled from what was computed.

A field is ``{path}`` or ``{path:how}``. A path is keys joined by ``/``; an index chooses from a list, ``*`` takes every entry,
``.`` is the whole value. How the value is written:

====================== =================================================================
``4`` (the default 4)  significant digits; whole numbers are written out
``% 3``                the value times 100, to be followed by the sign
``min 3``, ``max 3``   the smallest or largest number found below the path
``list 3``             entries joined by commas
``count``              how many entries there are
``tally``              of truth values: ``3 of 4``
``words|other words``  for a truth value
====================== =================================================================
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

FIELD = re.compile(r"\{([^{}:]+)(?::([^{}]*))?\}")
HOW = re.compile(r"(%|min|max|list)? ?(\d+)?")
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
NARROW = "\u202f"  # a narrow space that does not break


def fill(template: str, computed: Any) -> str:
    """The sentence. Raises ValueError that names a field which ``computed`` does not have or cannot be written so."""

    def written(field: re.Match[str]) -> str:
        try:
            return _written(list(_entries(computed, field[1])), field[2] or "")
        except (LookupError, TypeError, ValueError) as error:
            raise ValueError(f"{field[0]}: {error}") from error

    return FIELD.sub(written, template)


def shown(value: float, digits: int = 4) -> str:
    """A number for readers: 1,473,000 as 1 473 000, 9.278e9 as 9.278×10⁹; a whole number in full."""
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else "infinite" if value > 0 else "minus infinite"
    whole = isinstance(value, int) and not isinstance(value, bool)
    rounded = float(value) if whole else float(f"{value:.{digits}g}")
    if not whole and rounded != 0.0 and not 1e-4 <= abs(rounded) < 1e7:
        mantissa, _, exponent = f"{rounded:.{digits - 1}e}".partition("e")
        return f"{_trimmed(mantissa)}×10{str(int(exponent)).translate(RAISED)}".replace("-", "−")
    places = 0 if whole or rounded == 0.0 else max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)
    text = f"{value if whole else rounded:,.{places}f}"
    if abs(rounded) < 1e4:
        text = text.replace(",", "")
    return _trimmed(text).replace(",", NARROW).replace("-", "−")


def _trimmed(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text


def _entries(value: Any, path: str) -> Iterator[Any]:
    """What stands at ``path``. A key may hold a slash: the longest one that fits is taken."""
    if path in ("", "."):
        yield value
        return
    inside = _inside(value)
    if path == "*" or path.startswith("*/"):
        for entry in inside.values():
            yield from _entries(entry, path[2:])
        return
    fitting = [key for key in inside if path == key or path.startswith(f"{key}/")]
    if not fitting:
        raise LookupError(f"there is no such value, there are {', '.join(inside) or 'none'}")
    key = max(fitting, key=len)
    yield from _entries(inside[key], path[len(key) + 1 :])


def _inside(value: Any) -> dict[str, Any]:
    """Entries by key, those of a list by index; nothing inside a number or a text."""
    if isinstance(value, Mapping):
        return {str(key): entry for key, entry in value.items()}
    plain = value.tolist() if hasattr(value, "tolist") else value  # numpy has not become JSON yet
    if isinstance(plain, Sequence) and not isinstance(plain, str):
        return {str(index): entry for index, entry in enumerate(plain)}
    return {}


def _written(found: list[Any], how: str) -> str:
    leaves = [leaf for entry in found for leaf in _leaves(entry)]
    if "|" in how:
        (truth,) = leaves
        if not isinstance(truth, bool):
            raise TypeError(f"{truth!r} is no truth value")
        return how.split("|")[0 if truth else 1]
    if how == "tally":
        return f"{sum(leaf is True for leaf in leaves)} of {len(leaves)}"
    if how == "count":
        (entries,) = found
        return str(len(_inside(entries)))
    form = HOW.fullmatch(how)
    if form is None:
        raise ValueError(f"'{how}' is no way to write a value")
    digits = int(form[2] or 4)
    if form[1] in ("min", "max"):
        return shown((min if form[1] == "min" else max)(leaves), digits)
    if form[1] == "list":
        return ", ".join(_one(leaf, digits) for leaf in leaves)
    (leaf,) = leaves
    return shown(100.0 * leaf, digits) if form[1] == "%" else _one(leaf, digits)


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, Mapping | Sequence) and not isinstance(value, str):
        for entry in _inside(value).values():
            yield from _leaves(entry)
    else:
        plain = value.tolist() if hasattr(value, "tolist") else value
        yield from _leaves(plain) if isinstance(plain, list) else (plain,)


def _one(value: Any, digits: int) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is neither a number nor a text")
    return shown(value, digits)
