"""The parts of a drive file that describe log files: their columns, clocks and form, and what these must agree in."""

from __future__ import annotations

import codecs
from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from estimators.errors import unknown
from studies.drives import quantities as si
from studies.drives.quantities import factor_to, wheel_factor
from synthesis.toml_file import StrictTable


def _a_time(unit: str) -> str:
    factor_to(unit, "s")
    return unit


def _an_encoding(name: str) -> str:
    try:
        codecs.lookup(name)
    except (LookupError, ValueError):
        raise ValueError(f"unknown encoding '{name[:40]}'; use one such as utf-8, utf-16, cp1252") from None
    return name


class Column(StrictTable):
    """One log column: value in SI = factor * sign * (column in ``unit``)."""

    column: str = Field(min_length=1, examples=["omega_fl"])
    unit: str = Field(min_length=1, examples=["rad/s"])
    log: str | None = None
    sign: Literal["positive", "negative"] = "positive"
    factor: float = Field(default=1.0, examples=[0.5])
    radius: si.Length | None = Field(default=None, examples=["0.34 m"])

    def scale(self, si_unit: str, radius: float | None = None) -> float:
        """The number that turns the column into ``si_unit`` with the sign of this project (x forward, y left, z up).

        With a ``radius``, m, of a wheel a speed along the road becomes one about the axle; the column's own radius comes first.
        """
        return self.factor_of(self.unit, si_unit, radius) * self.factor * (-1.0 if self.sign == "negative" else 1.0)

    def factor_of(self, unit: str, si_unit: str, radius: float | None = None) -> float:
        """What a number in ``unit``, the column's own or another, is multiplied by to be in ``si_unit``; see `scale`."""
        radius = self.radius or radius
        return factor_to(unit, si_unit) if radius is None or si_unit != "rad/s" else wheel_factor(unit, radius)


class Align(StrictTable):
    """Estimate a clock offset: the derivative of ``velocity`` must look like ``acceleration`` (:mod:`.align`)."""

    to: str = Field(examples=["imu"])
    velocity: str = "vx"
    acceleration: str = "ax"
    search: si.Duration | None = None


class LogFile(StrictTable):
    """One log file: its form, its clock, its rate, and the longest pause that may be bridged by interpolation.

    ``time_format = "iso"``: stamps are text, dates of ISO 8601 or times of day. An epoch is a number with its ``time_unit``.
    For text files: ``delimiter``, ``decimal``, ``thousands`` (between groups of three digits), ``encoding``, ``header_line`` (the
    line that holds the names, from 1) and ``units_row`` (a line of units behind it).
    """

    name: str = Field(min_length=1, examples=["car"])
    rate: si.Rate = Field(examples=["200 Hz"])
    file: str | None = None
    time: str = "time"
    time_unit: Annotated[str, AfterValidator(_a_time)] = "s"
    time_format: Literal["number", "iso"] = "number"
    delimiter: str = Field(default=",", min_length=1, max_length=1)
    decimal: Literal[".", ","] = "."
    thousands: Literal["", ",", ".", " ", "'"] = ""
    encoding: Annotated[str, AfterValidator(_an_encoding)] = "utf-8"
    header_line: int = Field(default=1, ge=1, le=10_000)
    units_row: bool = False
    max_gap: si.Duration | None = None
    duplicates: Literal["mean", "last", "refuse"] = "mean"
    sort: bool = False
    clock_offset: si.Offset = 0.0
    align: Align | None = None

    @model_validator(mode="after")
    def _readable(self) -> Self:
        if self.delimiter == self.decimal:
            raise ValueError('decimal: the comma also separates columns; set delimiter, such as ";"')
        if self.thousands == self.decimal:
            raise ValueError(f"thousands: '{self.thousands}' is the decimal sign as well; correct one of the two")
        return self

    @property
    def allowed_gap(self) -> float:
        """The longest spacing of samples that is interpolated over, s (five nominal periods if the file names none)."""
        return self.max_gap if self.max_gap is not None else 5.0 / self.rate


def check_logs(logs: Sequence[LogFile]) -> None:
    """Every log has a name of its own."""
    names = [log.name for log in logs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"log: two entries are called '{name}'; give every log its own name")


def check_alignment(columns: Mapping[str, Column], logs: Sequence[LogFile]) -> None:
    """A log is aligned to one with a clock of its own: velocity in one of the two, acceleration in the other."""
    for log in logs:
        if log.align is None:
            continue
        place, align = f"log '{log.name}'.align", log.align
        others = [other.name for other in logs if other.name != log.name and other.align is None]
        if align.to not in others:
            raise ValueError(f"{place}.to: {unknown('log', align.to, others)} (a log with a clock of its own)")
        if log.clock_offset != 0:
            raise ValueError(f"{place}: clock_offset is given as well; keep one of the two")
        for role in (align.velocity, align.acceleration):
            if role not in columns:
                raise ValueError(f"{place}: {unknown('signal', role, columns)}")
        if {columns[align.velocity].log, columns[align.acceleration].log} != {log.name, align.to}:
            roles = f"one of {align.velocity}, {align.acceleration}"
            raise ValueError(f"{place}: {roles} must be in log '{log.name}', the other in '{align.to}'")
