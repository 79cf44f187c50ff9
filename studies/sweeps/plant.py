"""The plant of a sweep as arrays over (designs, grid): from a symbolic model, or from what a schedule file holds of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from analysis.perturbed import Matrices, PerturbedModel
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule, PlantPolynomial, PlantQuotient
from estimators.schedule.plant_cells import PlantByCells
from synthesis.models.extract import MATRICES
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal


@dataclass(frozen=True)
class Parameter:
    """A number that can be varied: a `constant` of the model, an `entry` of a matrix (a factor), or a gain."""

    name: str
    unit: str
    nominal: float
    kind: str = "constant"


@dataclass(frozen=True, eq=False)
class Grid:
    """Values (g, p) of the scheduling parameters at which every design is looked at."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    points: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    def place(self, index: int) -> dict[str, float]:
        """The parameters of one grid point by name; nothing for a measure without place (index -1)."""
        if index < 0:
            return {}
        return {name: float(value) for name, value in zip(self.names, self.points[index], strict=True)}


@dataclass(frozen=True, eq=False)
class Plant:
    """What can be varied by name, the scheduling parameters, and signals; matrices of a symbolic `model` or of `polynomials`."""

    parameters: Mapping[str, Parameter]
    box: tuple[SchedulingParameter, ...]
    states: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    disturbances: tuple[Signal, ...]
    model: LpvModel | None = None
    polynomials: Mapping[str, PlantPolynomial | PlantQuotient] | None = None

    def __getstate__(self) -> dict[str, Any]:  # compiled functions are made anew where they are needed
        return {name: value for name, value in vars(self).items() if name != "_family"}

    @cached_property
    def _family(self) -> PerturbedModel | None:
        return None if self.model is None else PerturbedModel(self.model)

    def at(self, columns: Mapping[str, FloatArray], grid: Grid) -> Matrices:
        """Matrices over (n, g) of some designs, (n,) by name; those not named keep their nominal value.

        Raises AnalysisError where a denominator vanishes.
        """
        if self._family is not None:
            scheduled = {name: grid.points[:, i] for i, name in enumerate(grid.names)}
            found = self._family.at(**scheduled, **{name: column[:, None] for name, column in columns.items()})
            return found if columns else Matrices(*(getattr(found, key)[None] for key in MATRICES))
        count = max((len(column) for column in columns.values()), default=1)
        polynomials = self.polynomials or {}
        out = {key: np.repeat(polynomials[key].at(grid.points[:, 0])[None], count, axis=0) for key in MATRICES}
        for name, column in columns.items():
            key, row, entry = name.split("_")
            out[key][:, :, int(row) - 1, int(entry) - 1] *= column[:, None]
        return Matrices(**out)


def model_plant(model: LpvModel) -> Plant:
    """A symbolic model; its constants are the parameters."""
    constants = {name: Parameter(name, c.unit, float(c.value)) for name, c in model.constants.items()}
    return Plant(constants, model.parameters, model.states, model.outputs, model.disturbances, model)


def polynomial_plant(schedule: GainSchedule) -> Plant:
    """The plant that a schedule of one parameter carries, whatever model it came from; factors on single entries are varied.

    `A_2_1` multiplies the entry in row 2, column 1 of A, at every value of the scheduling parameter.
    """
    entries, p = {}, schedule.parameter
    if isinstance(schedule.plant["A"], PlantByCells):
        _ = schedule.polynomials  # refuses
    found = {key: m for key, m in schedule.plant.items() if isinstance(m, PlantPolynomial | PlantQuotient)}
    for key in "ACEF":
        present = found[key].largest > 0.0
        for row, column in np.argwhere(present):
            name = f"{key}_{row + 1}_{column + 1}"
            entries[name] = Parameter(name, "1", 1.0, "entry")
    states, outputs, disturbances = (
        tuple(Signal(s.name, s.unit) for s in signals)
        for signals in (schedule.states, schedule.outputs, schedule.disturbances)
    )
    box = (SchedulingParameter(p.name, p.unit, p.min, p.max, p.rate_min, p.rate_max),)
    return Plant(entries, box, states, outputs, disturbances, polynomials=found)
