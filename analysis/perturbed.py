"""A model as vectorised functions of its constants and parameters: symbolic once, arrays ever after."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from analysis.checks import as_stack
from analysis.errors import AnalysisError
from analysis.norms.observer_error import checked_gain
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.models.extract import MATRICES
from synthesis.models.lpv import LpvModel


@dataclass(frozen=True)
class Matrices:
    """A (..., nx, nx), B (..., nx, nu), C (..., ny, nx), D, E (..., nx, nd), F (..., ny, nd) over the samples' shape."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    E: FloatArray
    F: FloatArray

    def error_dynamics(self, gain: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A_e = A - L C and B_e = E - L F; gain (..., nx, ny) broadcasts against the samples."""
        return self.A - gain @ self.C, self.E - gain @ self.F


@dataclass(frozen=True, repr=False)
class PerturbedModel(Display):
    """An LpvModel compiled over all its symbols, so that thousands of perturbed copies cost one array expression.

    `names` lists scheduling parameters first, then constants; `nominal` holds the values of the constants.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> list(PerturbedModel(model).nominal)
    ['sigma0', 'sigma1', 'sigma2', 'kappa', 'effective_radius']
    """

    model: LpvModel
    names: tuple[str, ...] = field(init=False)
    nominal: Mapping[str, float] = field(init=False)
    _functions: Mapping[str, Callable[..., Any]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.model.refuse_tables("a sweep over constants")
        scheduled = [p.name for p in self.model.parameters]
        names = (*scheduled, *self.model.constants)
        symbols = [sp.Symbol(name) for name in names]
        functions = {
            key: sp.lambdify(symbols, list(sp.Matrix(getattr(self.model, key))), modules="numpy", cse=True)
            for key in MATRICES
        }
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "nominal", {key: c.value for key, c in self.model.constants.items()})
        object.__setattr__(self, "_functions", functions)

    def at(self, **values: ArrayLike) -> Matrices:
        """All matrices at samples given by name; arrays broadcast, constants that are not named keep their value.

        Scheduling parameters must all be given and lie in the model's range (constants may take any finite value).
        Raises AnalysisError for unknown or missing names, values out of range, and denominators that vanish.
        """
        arguments = self._arguments(values)
        shape = np.broadcast_shapes(*(a.shape for a in arguments))
        out = {}
        for key, function in self._functions.items():
            rows, columns = getattr(self.model, key).shape
            array = np.empty((*shape, rows * columns))
            with np.errstate(divide="ignore", invalid="ignore"):
                for k, entry in enumerate(function(*arguments)):
                    array[..., k] = entry
            if not np.isfinite(array).all():
                raise AnalysisError(
                    f"model '{self.model.name}': {key} is not finite at a sample; a denominator vanishes there"
                )
            out[key] = array.reshape(*shape, rows, columns)
        return Matrices(**out)

    def _arguments(self, values: Mapping[str, ArrayLike]) -> list[FloatArray]:
        for name in values:
            if name not in self.names:
                raise AnalysisError(f"model '{self.model.name}': {unknown('parameter or constant', name, self.names)}")
        for p in self.model.parameters:
            if p.name not in values:
                raise AnalysisError(f"model '{self.model.name}': give values of {p.name} [{p.unit}]")
            array = as_stack(p.name, values[p.name], ndim=0)
            if array.size and (array.min() < p.minimum or array.max() > p.maximum):
                worst = array.min() if array.min() < p.minimum else array.max()
                raise AnalysisError(
                    f"{p.name} = {worst:.6g} {p.unit} is outside [{p.minimum:g}, {p.maximum:g}] {p.unit}"
                )
        given = [as_stack(name, values.get(name, self.nominal.get(name, 0.0)), ndim=0) for name in self.names]
        try:
            np.broadcast_shapes(*(a.shape for a in given))
        except ValueError:
            shapes = ", ".join(f"{name} {np.shape(v)}" for name, v in values.items())
            raise AnalysisError(f"samples do not broadcast: {shapes}; make their shapes equal or 1") from None
        return given


def error_measure(
    family: PerturbedModel,
    gain: ArrayLike,
    measure: Callable[[FloatArray, FloatArray], ArrayLike],
    **fixed: ArrayLike,
) -> Callable[[Mapping[str, FloatArray]], FloatArray]:
    """A measure for `analysis.sensitivity`: perturbed constants -> measure(A_e, B_e) of the observer with this gain.

    `fixed` values (wheel_speed = 141 numbers, say) become trailing axes of the result; samples are the leading axis.

    >>> import numpy as np
    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> family = PerturbedModel(model)
    >>> slowest = error_measure(family, [[0.68], [183.1]], lambda A, B: stability_margin(A), wheel_speed=[10.0, 100.0])
    >>> slowest({"sigma0": np.array([150.0, 180.0, 210.0])}).shape  # three copies at two speeds
    (3, 2)
    """
    L = checked_gain(family.model, gain)
    held = {name: as_stack(name, value, ndim=0) for name, value in fixed.items()}
    trailing = np.broadcast_shapes(*(value.shape for value in held.values())) if held else ()

    def evaluate(samples: Mapping[str, FloatArray]) -> FloatArray:
        shaped = {name: as_stack(name, v, ndim=0).reshape(-1, *(1,) * len(trailing)) for name, v in samples.items()}
        return np.asarray(measure(*family.at(**held, **shaped).error_dynamics(L)))

    return evaluate
