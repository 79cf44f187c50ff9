"""Which parameters a sweep varies, and how far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from analysis.errors import AnalysisError
from analysis.sensitivity.box import Box, around
from estimators.errors import unknown
from studies.sweeps.observer import Observer
from studies.sweeps.plant import Parameter
from synthesis.errors import SpecError
from synthesis.models.param import check_unit, same_unit
from synthesis.toml_file import StrictTable

ALL = "constants"  # the name that stands for every parameter of the plant


class RangeSpec(StrictTable):
    """`relative` to the nominal value, or a `range` in the parameter's own unit, which `unit` may state to be checked.

    >>> RangeSpec(relative=0.2).relative
    0.2
    """

    relative: float | None = Field(default=None, gt=0)
    range: tuple[float, float] | None = Field(default=None, strict=False)
    unit: str | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.relative is None) == (self.range is None):
            raise ValueError("give either relative = 0.2 or range = [minimum, maximum]")
        return self


@dataclass(frozen=True)
class ParameterRange:
    """A parameter with the range it is swept over; `relative` ranges follow the nominal value when it changes."""

    name: str
    unit: str
    nominal: float
    low: float
    high: float
    relative: bool


def box_of(ranges: Sequence[ParameterRange]) -> Box:
    """The box of designs."""
    low, high, nominal = np.array([(r.low, r.high, r.nominal) for r in ranges]).T
    return Box(tuple(r.name for r in ranges), low, high, nominal)


def parameter_ranges(observer: Observer, table: Mapping[str, RangeSpec]) -> tuple[ParameterRange, ...]:
    """The parameters of one observer, in the order of its own list. Raises SpecError for unknown names and bad ranges."""
    if not table:
        raise SpecError(f"subject '{observer.name}': nothing to vary; give [vary] at least one parameter")
    chosen: dict[str, RangeSpec] = {}
    if ALL in table:
        chosen = dict.fromkeys(observer.plant.parameters, table[ALL])
    for name, vary in table.items():
        if name != ALL:
            if name not in observer.parameters:
                raise SpecError(f"subject '{observer.name}': {unknown('parameter', name, observer.parameters)}")
            chosen[name] = vary
    return tuple(
        _parameter_range(observer, observer.parameters[name], chosen[name])
        for name in observer.parameters
        if name in chosen
    )


def _parameter_range(observer: Observer, parameter: Parameter, vary: RangeSpec) -> ParameterRange:
    where = f"subject '{observer.name}': vary.{parameter.name}"
    if vary.unit is not None and not same_unit(check_unit(vary.unit, where), parameter.unit):
        raise SpecError(f"{where}: unit '{vary.unit}' is not '{parameter.unit}', in which the parameter is given")
    try:
        if vary.relative is not None:
            low, high = around({parameter.name: parameter.nominal}, vary.relative)[parameter.name]
        else:
            box = Box.of({parameter.name: vary.range or (0.0, 0.0)})
            low, high = float(box.low[0]), float(box.high[0])
    except AnalysisError as error:
        raise SpecError(f"{where}: {error}") from None
    return ParameterRange(parameter.name, parameter.unit, parameter.nominal, low, high, vary.relative is not None)
