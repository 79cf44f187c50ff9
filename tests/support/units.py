"""The same plant with its signals in other units."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Signal

DECADES = 6


@dataclass(frozen=True)
class Units:
    """By what the numbers of every signal are multiplied."""

    states: FloatArray
    inputs: FloatArray
    outputs: FloatArray
    disturbances: FloatArray


def same_units(model: LpvModel) -> Units:
    return Units(*(np.ones(len(getattr(model, kind.name))) for kind in fields(Units)))


def random_units(model: LpvModel, draw: np.random.Generator) -> Units:
    """Six decades up or down for every signal."""
    numbers = (draw.integers(-DECADES, DECADES + 1, len(getattr(model, kind.name))) for kind in fields(Units))
    return Units(*(10.0**number for number in numbers))


def in_units(model: LpvModel, units: Units) -> LpvModel:
    x, u, y, d = (sp.diag(*(sp.Rational(repr(float(f))) for f in getattr(units, kind.name))) for kind in fields(Units))
    left = {"A": x, "B": x, "E": x, "C": y, "D": y, "F": y}
    right = {"A": x, "C": x, "B": u, "D": u, "E": d, "F": d}
    given = {key: sp.Matrix(getattr(model, key)) for key in left}
    matrices = {key: left[key] * M * right[key].inv() if 0 not in M.shape else M for key, M in given.items()}
    names = {kind.name: tuple(Signal(s.name, "1") for s in getattr(model, kind.name)) for kind in fields(Units)}
    return replace(model, **matrices, **names)
