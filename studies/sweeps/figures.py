"""The figures of a sweep: single numbers with the place they come from, and the summary that holds them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

UNPROVED = "constants outside the certificate"  # today's constants that are not those the schedule was proved for
Kind = Literal["value", "index", "count"]


@dataclass(frozen=True)
class Figure:
    """One number. `value` figures belong to a measure and have parameters `at` which they are taken; `index` figures are shares
    of variance with a `confidence` half-width (95 %); `count` figures are numbers of designs."""

    subject: str
    measure: str
    name: str
    value: float
    unit: str = "1"
    kind: Kind = "value"
    at: Mapping[str, float] = field(default_factory=dict)
    confidence: float | None = None
    design: int | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        """Subject, measure and name: what makes two figures the same."""
        return self.subject, self.measure, self.name


@dataclass(frozen=True)
class Summary:
    """All figures of a sweep, and `notes`: what could not be said, and why."""

    sweep: str
    form: str
    figures: tuple[Figure, ...]
    notes: tuple[str, ...]

    def of(self, subject: str, measure: str, name: str) -> Figure | None:
        """One figure, if there is one."""
        return next((f for f in self.figures if f.key == (subject, measure, name)), None)

    def content(self) -> dict[str, Any]:
        """Plain data for a strict JSON file; infinite numbers as words."""
        rows = [{key: _plain(value) for key, value in asdict(figure).items()} for figure in self.figures]
        return {"sweep": self.sweep, "form": self.form, "figures": rows, "notes": list(self.notes)}

    @classmethod
    def of_content(cls, content: Mapping[str, Any]) -> Summary:
        """Back from plain data."""
        rows = [{**row, "value": float(row["value"])} for row in content["figures"]]
        return cls(content["sweep"], content["form"], tuple(Figure(**row) for row in rows), tuple(content["notes"]))


def number(value: float, digits: int = 6) -> str:
    """A number for people: six significant digits."""
    return f"{value:.{digits}g}"


def _plain(value: Any) -> Any:
    return repr(value) if isinstance(value, float) and not math.isfinite(value) else value
