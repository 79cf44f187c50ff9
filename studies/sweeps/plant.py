"""The plant of a sweep as arrays over (designs, grid): from a symbolic model, or from the polynomials of a schedule file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from analysis.perturbed import Matrices, PerturbedModel
from estimators.arrays import FloatArray
from estimators.schedule import PlantPolynomial
from synthesis.errors import SpecError
from synthesis.models.extract import MATRICES
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Signal


@dataclass(frozen=True)
class Parameter:
    """A number of the subject that can be varied: a `constant` of the model, an `entry` of a matrix (a factor), or a gain."""

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


@dataclass(frozen=True)
class Box:
    """A scheduling parameter with its range."""

    name: str
    unit: str
    minimum: float
    maximum: float


class Plant(Protocol):
    """What a subject needs of its plant; leading axes of all matrices are (designs, grid)."""

    @property
    def parameters(self) -> dict[str, Parameter]:
        """What can be varied, by name."""
        ...

    @property
    def box(self) -> tuple[Box, ...]:
        """The scheduling parameters."""
        ...

    @property
    def states(self) -> tuple[Signal, ...]:
        """The states."""
        ...

    @property
    def outputs(self) -> tuple[Signal, ...]:
        """The outputs."""
        ...

    @property
    def disturbances(self) -> tuple[Signal, ...]:
        """The disturbances."""
        ...

    def at(self, columns: Mapping[str, FloatArray], grid: Grid) -> Matrices:
        """The matrices of some designs, (n,) by name; those not named keep their nominal value."""
        ...


@dataclass(frozen=True, eq=False)
class ModelPlant:
    """A symbolic model; its constants are the parameters."""

    model: LpvModel

    def __getstate__(self) -> dict[str, Any]:
        return {"model": self.model}  # compiled functions are made anew where they are needed

    @cached_property
    def family(self) -> PerturbedModel:
        """The model compiled over its constants."""
        return PerturbedModel(self.model)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every constant with unit and value."""
        return {name: Parameter(name, c.unit, float(c.value)) for name, c in self.model.constants.items()}

    @property
    def box(self) -> tuple[Box, ...]:
        """The scheduling parameters."""
        return tuple(Box(p.name, p.unit, p.minimum, p.maximum) for p in self.model.parameters)

    @property
    def states(self) -> tuple[Signal, ...]:
        """As in the model."""
        return self.model.states

    @property
    def outputs(self) -> tuple[Signal, ...]:
        """As in the model."""
        return self.model.outputs

    @property
    def disturbances(self) -> tuple[Signal, ...]:
        """As in the model."""
        return self.model.disturbances

    def at(self, columns: Mapping[str, FloatArray], grid: Grid) -> Matrices:
        """Matrices over (n, g). Raises AnalysisError where a denominator vanishes."""
        scheduled = {name: grid.points[:, i] for i, name in enumerate(grid.names)}
        found = self.family.at(**scheduled, **{name: column[:, None] for name, column in columns.items()})
        return found if columns else Matrices(*(getattr(found, key)[None] for key in MATRICES))


@dataclass(frozen=True, eq=False)
class PolynomialPlant:
    """The polynomials of a schedule file whose model is in no catalogue; the parameters are factors on single entries.

    `A_2_1` multiplies the entry in row 2, column 1 of A, at every value of the scheduling parameter.
    """

    polynomials: Mapping[str, PlantPolynomial]
    box: tuple[Box, ...]
    states: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    disturbances: tuple[Signal, ...]
    parameters: dict[str, Parameter] = field(init=False)

    def __post_init__(self) -> None:
        found = {}
        for key in "ACEF":
            present = np.abs(self.polynomials[key].coefficients).max(axis=0, initial=0.0) > 0.0
            for row, column in np.argwhere(present):
                name = f"{key}_{row + 1}_{column + 1}"
                found[name] = Parameter(name, "1", 1.0, "entry")
        object.__setattr__(self, "parameters", found)

    def at(self, columns: Mapping[str, FloatArray], grid: Grid) -> Matrices:
        """Matrices over (n, g)."""
        if len(self.box) != 1:
            raise SpecError("the plant of a schedule file has one scheduling parameter")
        count = max((len(column) for column in columns.values()), default=1)
        out = {}
        for key in MATRICES:
            nominal = self.polynomials[key].at(grid.points[:, 0])
            out[key] = np.repeat(nominal[None], count, axis=0)
        for name, column in columns.items():
            key, row, entry = name.split("_")
            out[key][:, :, int(row) - 1, int(entry) - 1] *= column[:, None]
        return Matrices(**out)
