"""The statistics of a sweep: single numbers with the place they come from, and the summary that holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from studies.execution.files import plain

UNPROVED = "constants outside the certificate"  # today's constants that are not those the schedule was proved for
Kind = Literal["value", "index", "count"]


@dataclass(frozen=True)
class Statistic:
    """One number. Those of kind `value` belong to a measure and have parameters `at` which they are taken, an `index` is a share
    of variance with a `confidence` half-width (95 %), a `count` is a number of designs."""

    observer: str
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
        """Observer, measure and name: what makes two statistics the same."""
        return self.observer, self.measure, self.name

    def where(self, digits: int = 4) -> str:
        """The parameters at which it is taken, in words."""
        return ", ".join(f"{name} = {number(value, digits)}" for name, value in self.at.items())


@dataclass(frozen=True)
class Summary:
    """All statistics of a sweep, and `notes`: what could not be said, and why."""

    sweep: str
    form: str
    statistics: tuple[Statistic, ...]
    notes: tuple[str, ...]

    def of(self, observer: str, measure: str, name: str) -> Statistic | None:
        """One statistic, if there is one."""
        return next((f for f in self.statistics if f.key == (observer, measure, name)), None)

    def content(self) -> Any:
        """Plain data for a strict JSON file; infinite numbers as words."""
        rows = [{"subject": s.observer, **asdict(s)} for s in self.statistics]
        for row in rows:
            del row["observer"]  # the word of the files is another
        return plain({"sweep": self.sweep, "form": self.form, "figures": rows, "notes": self.notes}, "summary")

    @classmethod
    def of_content(cls, content: Mapping[str, Any]) -> Summary:
        """Back from plain data."""
        found = []
        for row in content["figures"]:
            others = {key: value for key, value in row.items() if key != "subject"}
            found.append(Statistic(row["subject"], **{**others, "value": float(row["value"])}))
        return cls(content["sweep"], content["form"], tuple(found), tuple(content["notes"]))


def number(value: float, digits: int = 6) -> str:
    """A number for people: six significant digits."""
    return f"{value:.{digits}g}"
