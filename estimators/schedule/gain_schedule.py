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
from estimators.display import Display
from estimators.errors import EstimatorError, RangeError, ScheduleError
from estimators.interpolate import Multilinear, PiecewiseLinear
from estimators.schedule.check import SHAPES, SIGNALS, check_content, check_depth
from estimators.schedule.checker import shown
from estimators.schedule.constraints import ParameterSet, parameter_set
from estimators.schedule.files import check_seal, read_content, sealed
from estimators.schedule.gain_signals import gain_signals, per_second, quotient
from estimators.schedule.plant import PlantPolynomial, PlantPolynomials, plant_of
from estimators.schedule.plant_cells import PlantByCells, plant_by_cells
from estimators.schedule.quotient import PlantQuotient, quotients
from estimators.schedule.upgrade import FIRST_FORMAT, upgraded

SHIPPED = Path(__file__).parents[1] / "schedules"
Update = Literal["held", "sampled"]  # of an observer
Kind = Literal["held", "sampled", "feedback"]
Limit = tuple[float, float] | None
AnyPlant = PlantPolynomial | PlantPolynomials | PlantQuotient | PlantByCells


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
    rate_min: float  # unit per second; -inf and inf: it may jump
    rate_max: float
    absolute: bool  # gains and plant depend on the magnitude


class PlantMatrices(NamedTuple):
    """xdot = A x + B u, y = C x + D u at given parameters; leading axes as the parameters."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class GainSchedule(Display):
    """Gains over scheduling parameters, with the plant, the units and the update that they are proved for.

    `table` has the shape (breakpoints of each parameter, states, outputs), `grid` the breakpoints (b_i,) of each parameter;
    arrays are read-only. One parameter is given as an array of any shape; several as arrays whose last axis holds them in
    order. The plant is xdot = A x + B u + E d, y = C x + D u + F d. `sample_time` in s. `update` "held": the gains L belong
    to the continuous-time observer, integrated exactly with y held over a sample; "sampled": the gains K correct once a
    sample (see `LpvVelocityObserver`); "feedback": a law of `order` states from the `measured` signals to the plant's inputs,
    each within its `limits` (min, max) or None (see `LpvController`); its table has the shape (breakpoints, order + inputs,
    order + measured).

    >>> schedule = GainSchedule.shipped("corner-estimation-longitudinal")
    >>> schedule.parameter.name, schedule.gain(35.0).shape, schedule.gain_units
    ('wheel_speed', (2, 1), (('m/s',), ('m/s^2',)))
    """

    name: str
    parameters: tuple[SchedulingParameter, ...]
    grid: tuple[FloatArray, ...]
    table: FloatArray
    sample_time: float
    update: Kind
    plant: Mapping[str, AnyPlant]
    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    disturbances: tuple[Signal, ...]
    sha256: str
    measured: Literal["states", "outputs"] = "outputs"
    order: int = 0
    limits: tuple[Limit, ...] = ()
    constraints: ParameterSet | None = None  # between the parameters, beside their ranges

    def summary(self) -> tuple[str, ...]:
        """Scheduling with range and rates, gains with their units, how it is run."""
        rows, columns = self.gain_signals
        scheduling = [
            f"{p.name} {p.min:g} to {p.max:g} {p.unit}, {p.rate_min:g} to {p.rate_max:g} {per_second(p.unit)}, {len(b)} points"
            for p, b in zip(self.parameters, self.grid, strict=True)
        ]
        gains = [
            f"{row.name}{f' by {column.name}' if len(columns) > 1 else ''} {entry.min():.4g} to {entry.max():.4g} {unit}"
            for i, (row, units) in enumerate(zip(rows, self.gain_units, strict=True))
            for j, (column, unit) in enumerate(zip(columns, units, strict=True))
            for entry in (self.table[..., i, j],)
        ]
        return (
            f"GainSchedule '{self.name}'",
            f"scheduling: {'; '.join([*scheduling, *(self.constraints.words if self.constraints else ())]) or 'none'}",
            f"gains: {'; '.join(gains)}",
            f"update: {self.update}, every {1e3 * self.sample_time:g} ms",
            f"sha256: {self.sha256[:16]}",
        )

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
    def parameter(self) -> SchedulingParameter:
        """The only parameter.

        Raises:
            ScheduleError: there are several.
        """
        self._only_one()
        return self.parameters[0]

    @property
    def breakpoints(self) -> FloatArray:
        """Those of the only parameter.

        Raises:
            ScheduleError: there are several.
        """
        self._only_one()
        return self.grid[0]

    @property
    def polynomials(self) -> dict[str, PlantPolynomial]:
        """The plant as polynomials of the only parameter.

        Raises:
            ScheduleError: there are several, or the plant is divided by one or is a plant by cells.
        """
        self._only_one()
        if isinstance(self.plant["A"], PlantQuotient | PlantByCells):
            _ = self.plant["A"].coefficients  # refuses
        return {key: matrix for key, matrix in self.plant.items() if isinstance(matrix, PlantPolynomial)}

    def _only_one(self) -> None:
        if len(self.parameters) != 1:
            names = shown(", ".join(parameter.name for parameter in self.parameters), 120)
            raise ScheduleError(
                f"schedule '{self.name}' follows {len(self.parameters)} parameters ({names}), what uses it here follows one; "
                "take LpvObserver"
            )

    @property
    def observer_update(self) -> Update:
        """How the gains of an observer are run.

        Raises:
            ScheduleError: the gains are those of a feedback law.
        """
        if self.update == "feedback":
            raise ScheduleError(
                f"schedule '{shown(self.name, 60)}' is a feedback law, what uses it here is an observer; take LpvController"
            )
        return self.update

    @property
    def gain_signals(self) -> tuple[tuple[Signal, ...], tuple[Signal, ...]]:
        """What the rows and the columns of the table stand for: see `gain_signals` of this folder."""
        if self.update != "feedback":
            return self.states, self.outputs
        own = tuple(Signal(f"law_state_{k + 1}", "1") for k in range(self.order))
        return own + self.inputs, own + (self.states if self.measured == "states" else self.outputs)

    @property
    def gain_units(self) -> tuple[tuple[str, ...], ...]:
        """Units of the gains, one for every row and column: (state/s)/output where held, state/output where sampled.

        Of a feedback law input/measurement; its own states are numbers without unit.
        """
        rows, columns = self.gain_signals
        return tuple(
            tuple(quotient(row.unit, self.update == "held", column.unit) for column in columns) for row in rows
        )

    def gain(self, parameter: npt.ArrayLike) -> FloatArray:
        """L(p), multilinear between the stored breakpoints: shape (*parameter.shape, states, outputs).

        With several parameters the last axis of `parameter` goes.

        Raises:
            RangeError: a value outside the certified range or not finite; names the first such sample.
        """
        values = self.certified(parameter)
        if len(self.parameters) > 1:
            found = Multilinear(self.grid, self.table)(values.reshape(-1, len(self.parameters)))
            return found.reshape(*values.shape[:-1], *self.table.shape[-2:])
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
        """The parameter as gains and plant depend on it (its magnitude if so declared), refused outside range and set."""
        names = ", ".join(entry.name for entry in self.parameters)
        try:
            raw = np.asarray(parameter, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise EstimatorError(f"{names} is not an array of numbers: {error}") from error
        if len(self.parameters) == 1:
            return _certified(self.parameter, raw)
        if raw.ndim == 0 or raw.shape[-1] != len(self.parameters):
            raise EstimatorError(f"parameters of shape {raw.shape}; the last axis must hold {names}")
        values = np.stack([_certified(entry, raw[..., i]) for i, entry in enumerate(self.parameters)], axis=-1)
        if self.constraints is not None and (outside := self.constraints.outside(values)).any():
            first = np.argwhere(np.atleast_1d(outside))[0]
            place = "" if raw.ndim == 1 else f" (sample {first[0] if raw.ndim == 2 else tuple(map(int, first))})"
            raise RangeError(self.constraints.refusal([p.name for p in self.parameters], values[outside][0], place))
        return values


def _certified(parameter: SchedulingParameter, raw: FloatArray) -> FloatArray:
    values: FloatArray = np.abs(raw) if parameter.absolute else raw
    good = (values >= parameter.min) & (values <= parameter.max)
    if not good.all():
        first = tuple(int(axis[0]) for axis in np.nonzero(~np.atleast_1d(good)))
        place = "" if raw.ndim == 0 else f" (sample {first[0] if raw.ndim == 1 else first})"
        raise RangeError(outside_range(parameter, float(np.atleast_1d(raw)[first]), place))
    return values


def outside_range(parameter: SchedulingParameter, value: float, place: str) -> str:
    """The sentence that refuses a parameter value."""
    box = f"[{parameter.min:g}, {parameter.max:g}] {parameter.unit}"
    return f"{parameter.name} = {value:.12g} {parameter.unit} is outside the certified range {box}{place}"


def _frozen(value: Any, shape: tuple[int, ...]) -> FloatArray:
    array = np.array(value, dtype=np.float64).reshape(shape)
    array.flags.writeable = False
    return array


def _build(content: Mapping[str, Any], where: str) -> GainSchedule:
    """From checked and sealed content."""
    model = content["model"]
    parameters, grid = [], []
    for stored in content["scheduling"]:
        entry = dict(stored)
        breakpoints = entry.pop("breakpoints")
        for key, free in (("min", 0.0), ("max", 0.0), ("rate_min", -np.inf), ("rate_max", np.inf)):
            entry[key] = free if entry[key] is None else float(entry[key])
        parameters.append(SchedulingParameter(**entry))
        grid.append(_frozen(breakpoints, (len(breakpoints),)))
    signals: dict[str, Any] = {
        kind: tuple(Signal(signal["name"], signal["unit"]) for signal in model[kind]) for kind in SIGNALS
    }
    sizes = {kind: len(found) for kind, found in signals.items()}
    ranges = [(parameter.min, parameter.max) for parameter in parameters]
    shapes = {key: (sizes[rows], sizes[columns]) for key, (rows, columns) in SHAPES.items()}
    plant: Mapping[str, AnyPlant]
    if "cells" in content["plant"]:
        plant = plant_by_cells(content["plant"], shapes)
    else:
        plant = numerators = {key: plant_of(content["plant"][key], ranges, shape) for key, shape in shapes.items()}
    if "denominator" in content["plant"]:
        below = plant_of(content["plant"]["denominator"], ranges, (1, 1))
        plant = quotients(numerators, below, [parameter.name for parameter in parameters], where)
    return GainSchedule(
        name=content["name"],
        parameters=tuple(parameters),
        grid=tuple(grid),
        table=_frozen(content["gain"]["table"], (*map(len, grid), *map(len, gain_signals(content)))),
        sample_time=float(content["update"]["sample_time"]),
        update=content["update"]["kind"],
        plant=plant,
        sha256=content["sha256"],
        constraints=parameter_set(content.get("constraints"), [parameter.name for parameter in parameters]),
        **signals,
        **_law(content["update"]),
    )


def _law(update: Mapping[str, Any]) -> dict[str, Any]:
    """What a feedback law says beside its gains."""
    if update["kind"] != "feedback":
        return {}
    limits = tuple(None if pair is None else (float(pair[0]), float(pair[1])) for pair in update.get("limits", ()))
    return {"measured": update["measured"], "order": update["order"], "limits": limits}
