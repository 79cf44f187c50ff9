"""Values and texts of a result as the page shows them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from studies.report.mathml import squared, typeset

MISSING = "–"
UNITS = {
    "_rad_per_s": "rad/s", "_rad_s": "rad/s", "_m_per_s": "m/s", "_m_s2": "m/s²", "_m_s": "m/s", "_1_s": "1/s",
    "_per_s": "1/s", "_1_m": "1/m", "_percent": "%", "_deg": "deg", "_Hz": "Hz", "_N": "N", "_ms": "ms",
}  # fmt: skip
NUMERIC_TEXT = re.compile(r"[\s±+\-−<>≤≥≈~]*\d")


def number(value: float, digits: int = 7) -> str:
    """``value`` with ``digits`` significant ones, exponents short: 1.5e9, not 1.5e+09."""
    text = str(value) if isinstance(value, int) else f"{value + 0.0:.{digits}g}"  # -0.0 becomes 0
    return re.sub(r"e\+?(-?)0*(\d)", r"e\1\2", text)


def cell(value: Any, digits: int = 5) -> str:
    """A cell of a table."""
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(value, digits) if isinstance(value, int | float) else squared(str(value))


def brief(value: Any, length: int = 110, digits: int = 7) -> str:
    """Any JSON value on one line of at most ``length`` characters, cut where an entry or at least a word ends."""
    text = _line(value, digits)
    if len(text) <= length:
        return text
    ends = [text.rfind(mark, 0, length) for mark in ("; ", ", ", " ")]
    return text[: next((end for end in ends if end > length // 2), length - 1)].rstrip(" ,;:") + " …"


def fits(value: Any, length: int = 160) -> bool:
    """Whether ``value`` reads well on a line: short, and no dictionaries inside dictionaries."""
    nested = isinstance(value, dict) and any(isinstance(entry, dict) for entry in value.values())
    return not nested and len(_line(value, 7)) <= length


def label(key: str) -> str:
    """The name of a value as words, its unit in brackets: ``decay_rate_1_s`` is decay rate [1/s]."""
    for ending, unit in UNITS.items():
        if key.endswith(ending) and len(key) > len(ending):
            return f"{key.removesuffix(ending).replace('_', ' ')} [{unit}]"
    return key.replace("_", " ")


def _line(value: Any, digits: int) -> str:
    if isinstance(value, dict):
        return "; ".join(f"{label(key)}: {_line(entry, digits)}" for key, entry in value.items())
    if isinstance(value, list):
        inside = ", ".join(_line(entry, digits) for entry in value)
        return f"[{inside}]" if any(isinstance(entry, list) for entry in value) else inside
    return cell(value, digits)


def prose(text: str) -> Markup:
    """Escaped text with its formulas set; what stands between backticks is set as code."""
    pieces = text.split("`")
    if len(pieces) % 2 == 0:  # an odd backtick is just a character
        pieces = [text]
    marked = [Markup("<code>{}</code>").format(p) if i % 2 else Markup(typeset(p)) for i, p in enumerate(pieces)]
    return Markup("").join(marked)


def counted(**things: int) -> str:
    """``3 figures, 1 table``; nothing for none."""
    names = {name: name.replace("_", " ") for name in things}
    return ", ".join(f"{n} {names[k].removesuffix('s') if n == 1 else names[k]}" for k, n in things.items() if n)


def alignments(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    """``number`` for columns that hold numbers alone (or texts that begin with one), else ``text``."""
    return ["number" if rows and all(_numeric(row[i]) for row in rows) else "text" for i in range(len(columns))]


def _numeric(value: Any) -> bool:
    if isinstance(value, str):
        return NUMERIC_TEXT.match(value) is not None or value in ("", MISSING, "inf", "-inf")
    return not isinstance(value, bool)


def anchor(text: str) -> str:
    """``text`` as a name that links can point to."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", text)
