"""A gain schedule as the runtime uses it: L(p) from the stored table, and the plant it was proved for."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arrays import FloatArray
from estimators.errors import EstimatorError, RangeError, ScheduleError
from estimators.interpolate import PiecewiseLinear
from estimators.schedule.check import SHAPES, SIGNALS, check_content, check_depth
from estimators.schedule.checker import shown
from estimators.schedule.files import check_seal, read_content, sealed
from estimators.schedule.plant import PlantPolynomial, plant_polynomial
from estimators.schedule.upgrade import FIRST_FORMAT, upgraded

SHIPPED = Path(__file__).parents[1] / "schedules"
Update = Literal["held", "sampled"]


class Signal(NamedTuple):
    """A state, an input, an output or a disturbance."""

    name: str
    unit: str


@dataclass(frozen=True)
class SchedulingParameter:
    """The measured quantity that the gains follow, and the box of values and rates for which they were proved."""

    name: str
    unit: str
    min: float
    max: float
    rate_min: float  # unit per second
    rate_max: float
    absolute: bool  # gains and plant depend on the magnitude


class PlantMatrices(NamedTuple):
    """xdot = A x + B u, y = C x + D u at given parameters; leading axes as the parameters."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray


@dataclass(frozen=True, eq=False)
class GainSchedule:
    """Gains over one scheduling parameter, with the plant, the units and the update that they are proved for.

    `table` has the shape (breakpoints, states, outputs); arrays are read-only. The plant is xdot = A x + B u + E d,
    y = C x + D u + F d. `sample_time` in s. `update` "held": the gains L belong to the continuous-time observer, integrated
    exactly with y held over a sample; "sampled": the gains K correct once a sample (see `LpvVelocityObserver`).

    >>> schedule = GainSchedule.shipped("corner-estimation-longitudinal")
    >>> schedule.parameter.name, schedule.gain(35.0).shape, schedule.gain_units
    ('wheel_speed', (2, 1), (('m/s',), ('m/s^2',)))
    """

    name: str
    parameter: SchedulingParameter
    breakpoints: FloatArray
    table: FloatArray
    sample_time: float
    update: Update
    plant: Mapping[str, PlantPolynomial]
    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    disturbances: tuple[Signal, ...]
    sha256: str

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> GainSchedule:
        """Reads a schedule file.

        Raises:
            ScheduleError: unreadable, edited, truncated, wrong version or structure; names the place.
        """
        return cls.from_content(read_content(path), os.fspath(path))

    @classmethod
    def shipped(cls, name: str) -> GainSchedule:
        """A schedule that comes with the package, by name.

        Raises:
            ScheduleError: no such schedule; lists those there are.
        """
        names = sorted(path.stem for path in SHIPPED.glob("*.json"))
        if name not in names:
            raise ScheduleError(f"no shipped schedule '{name}'; there are: {', '.join(names) or 'none'}")
        return cls.load(SHIPPED / f"{name}.json")

    @classmethod
    def from_content(cls, content: Mapping[str, Any], where: str = "schedule content") -> GainSchedule:
        """From content in memory, sealed (then its digests must match) or not yet sealed.

        Raises:
            ScheduleError: names `where` and the place.
        """
        check_depth(content, where)
        if isinstance(content, Mapping) and ("sha256" in content or "section_sha256" in content):
            check_seal(content, where)
        if isinstance(content, Mapping) and content.get("schema") == FIRST_FORMAT:
            content = upgraded(content, where)
        check_content(content, where)
        return _build(content if "sha256" in content else sealed(content), where)

    @property
    def gain_units(self) -> tuple[tuple[str, ...], ...]:
        """Units of the gains, one for every state and output: (state/s)/output where held, state/output where sampled."""
        rate = "/s" if self.update == "held" else ""
        return tuple(
            tuple(_quotient(state.unit, rate, output.unit) for output in self.outputs) for state in self.states
        )

    def gain(self, parameter: npt.ArrayLike) -> FloatArray:
        """L(p), linear between the stored breakpoints: shape (*parameter.shape, states, outputs).

        Raises:
            RangeError: a value outside the certified range or not finite; names the first such sample.
        """
        values = self.certified(parameter)
        table = self.table.reshape(len(self.breakpoints), -1)
        found = PiecewiseLinear(self.breakpoints, table)(values.reshape(-1))
        return np.ascontiguousarray(found.T).reshape(*values.shape, *self.table.shape[1:])

    def plant_at(self, parameter: npt.ArrayLike) -> PlantMatrices:
        """A, B, C, D at the parameters, leading axes as `parameter`.

        Raises:
            RangeError: as `gain`.
        """
        values = self.certified(parameter)
        return PlantMatrices(*(self.plant[key].at(values) for key in "ABCD"))

    def certified(self, parameter: npt.ArrayLike) -> FloatArray:
        """The parameter as gains and plant depend on it (its magnitude if so declared), refused outside the range."""
        try:
            raw = np.asarray(parameter, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise EstimatorError(f"{self.parameter.name} is not an array of numbers: {error}") from error
        values: FloatArray = np.abs(raw) if self.parameter.absolute else raw
        good = (values >= self.parameter.min) & (values <= self.parameter.max)
        if not good.all():
            first = tuple(int(axis[0]) for axis in np.nonzero(~np.atleast_1d(good)))
            place = "" if raw.ndim == 0 else f" (sample {first[0] if raw.ndim == 1 else first})"
            raise RangeError(outside_range(self.parameter, float(np.atleast_1d(raw)[first]), place))
        return values


def outside_range(parameter: SchedulingParameter, value: float, place: str) -> str:
    """The sentence that refuses a parameter value."""
    box = f"[{parameter.min:g}, {parameter.max:g}] {parameter.unit}"
    return f"{parameter.name} = {value:.12g} {parameter.unit} is outside the certified range {box}{place}"


def _quotient(unit: str, rate: str, below: str) -> str:
    above = _per_second(unit) if rate else unit
    return above if below == "1" else f"({above})/({below})"


def _per_second(unit: str) -> str:
    if unit == "1":
        return "1/s"
    if unit.endswith("/s"):
        return f"{unit}^2"
    return f"({unit})/s" if any(c in unit for c in "*/") else f"{unit}/s"


def _frozen(value: Any, shape: tuple[int, ...]) -> FloatArray:
    array = np.array(value, dtype=np.float64).reshape(shape)
    array.flags.writeable = False
    return array


def _build(content: Mapping[str, Any], where: str) -> GainSchedule:
    """From checked and sealed content."""
    if len(content["scheduling"]) != 1:
        names = shown(", ".join(entry["name"] for entry in content["scheduling"]), 120)
        raise ScheduleError(
            f"{where}: scheduling: {len(content['scheduling'])} parameters ({names}); the runtime interpolates over one"
        )
    model, entry = content["model"], dict(content["scheduling"][0])
    breakpoints = entry.pop("breakpoints")
    for key in ("min", "max", "rate_min", "rate_max"):
        entry[key] = float(entry[key])
    signals = {kind: tuple(Signal(signal["name"], signal["unit"]) for signal in model[kind]) for kind in SIGNALS}
    sizes = {kind: len(found) for kind, found in signals.items()}
    plant = {
        key: plant_polynomial(content["plant"][key], entry["min"], entry["max"], (sizes[rows], sizes[columns]))
        for key, (rows, columns) in SHAPES.items()
    }
    return GainSchedule(
        name=content["name"],
        parameter=SchedulingParameter(**entry),
        breakpoints=_frozen(breakpoints, (len(breakpoints),)),
        table=_frozen(content["gain"]["table"], (len(breakpoints), sizes["states"], sizes["outputs"])),
        sample_time=float(content["update"]["sample_time"]),
        update=content["update"]["kind"],
        plant=plant,
        sha256=content["sha256"],
        **signals,
    )
