"""One question about a given LPV system: which inputs, which outputs, in which time; its matrices exact and in floats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from flint import fmpq, fmpq_mat

from analysis.errors import AnalysisError
from analysis.state_space import flag
from estimators.arrays import FloatArray
from estimators.errors import unknown
from synthesis.certificate.claims import ClaimChannel, rows_of
from synthesis.certificate.verify import Names
from synthesis.loop.from_model import plant_of
from synthesis.loop.given import GivenLoop, beside
from synthesis.loop.plant import Axis
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.enclosure import PolynomialMatrix, constant, zero
from synthesis.polynomials.exponential import balance
from synthesis.polynomials.half_spaces import HalfSpaces
from synthesis.polynomials.rational import as_float, decimal

Inputs = Sequence[str] | Mapping[str, float]


class Searched(Protocol):
    """What a search for bad parameter trajectories needs to know of a system, in floats."""

    @property
    def discrete(self) -> bool:
        """Whether a sample is the unit of time."""
        ...

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The parameters as axes u in [-1, 1]; rates per unit of time."""
        ...

    @property
    def half_spaces(self) -> HalfSpaces:
        """Inequalities between the scaled parameters beside."""
        ...

    @property
    def order(self) -> int:
        """Number of points that a Taylor series of the system along a line needs; continuous time only."""
        ...

    def frozen(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A, B, C, D at scaled parameters u (g, p), stacked."""
        ...


@dataclass(frozen=True)
class Question:
    """x' or x+ = A x + B w, z = C x + D w over the parameters of a model; w and z are those of `channel`."""

    model: LpvModel
    channel: ClaimChannel
    discrete: bool

    @cached_property
    def loop(self) -> GivenLoop:
        """What search and proof work on."""
        return GivenLoop(plant_of(self.model), "discrete" if self.discrete else "continuous")

    @cached_property
    def names(self) -> Names:
        """States, all inputs, all outputs."""
        states, inputs, disturbances, outputs = (
            tuple(s.name for s in signals)
            for signals in (self.model.states, self.model.inputs, self.model.disturbances, self.model.outputs)
        )
        return Names(states, inputs + disturbances, outputs)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The parameters as axes u in [-1, 1]."""
        return self.loop.plant.axes

    @property
    def half_spaces(self) -> HalfSpaces:
        """Inequalities between the scaled parameters beside."""
        return self.loop.plant.half_spaces

    @property
    def rational(self) -> bool:
        """Whether a parameter stands in a denominator."""
        return not self.loop.plant.is_polynomial

    @cached_property
    def exact(self) -> dict[str, PolynomialMatrix]:
        """A, B, C, D of the channel and `denominator` (1 x 1, under all of them), polynomials in u; states balanced.

        The units of the states are changed by powers of two, which is exact and leaves every norm as it is.
        """
        plant = self.loop.plant
        places, sizes = rows_of(self.names.disturbances, self.channel)
        shown = [self.names.errors.index(name) for name in self.channel.errors]
        rows, inputs = len(self.names.errors), len(self.names.disturbances)
        W = zero((inputs, max(1, len(places))))  # without inputs: one that does nothing
        for column, (place, size) in enumerate(zip(places, sizes, strict=True)):
            W[place, column] = decimal(size)
        Z = fmpq_mat(len(shown), rows, [fmpq(int(j == i)) for i in shown for j in range(rows)])
        weights, n = balance(plant.matrices["A"]), plant.states
        unit = [fmpq_mat(n, n, [w[i] if i == j else fmpq(0) for i in range(n) for j in range(n)])
                for w in (weights, [1 / w for w in weights])]  # fmt: skip
        left, right, into, back = (constant(matrix, len(self.axes)) for matrix in (Z, W, *unit))
        m = plant.matrices
        return {
            "A": into @ m["A"] @ back,
            "B": into @ beside(m["B"], m["E"]) @ right,
            "C": left @ m["C"] @ back,
            "D": left @ beside(m["D"], m["F"]) @ right,
            "denominator": plant.denominator,
        }

    @property
    def order(self) -> int:
        """One more than the degree of a polynomial along a line; enough for a rational system."""
        return 1 + (8 if self.rational else max(sum(m.degrees) for m in self.exact.values()))

    def frozen(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A, B, C, D in floats at scaled parameters u (g, p), stacked."""
        found = {key: at_points(matrix, u) for key, matrix in self.exact.items()}
        below = found.pop("denominator")
        return found["A"] / below, found["B"] / below, found["C"] / below, found["D"] / below

    def physical(self, u: FloatArray) -> FloatArray:
        """Parameter values of scaled ones, (.., p)."""
        middle, half = (np.array([as_float(getattr(axis, key)) for axis in self.axes]) for key in ("middle", "half"))
        return np.asarray(middle + half * u)


def ask(
    model: LpvModel, inputs: Inputs | None = None, outputs: Sequence[str] | None = None, discrete: object = False
) -> Question:
    """The question, with names checked.

    `inputs` are names among the model's inputs and disturbances, or names with the size that counts as one; None: all of them.
    `outputs` are names of its outputs; None: all. Raises AnalysisError for unknown or repeated names, sizes that are not
    positive and finite, and a model that is no LpvModel.
    """
    if not isinstance(model, LpvModel):
        raise AnalysisError(f"the system is a {type(model).__name__}; give an LpvModel")
    known = [s.name for s in (*model.inputs, *model.disturbances)]
    shown = [s.name for s in model.outputs]
    given = dict(inputs) if isinstance(inputs, Mapping) else dict.fromkeys(known if inputs is None else inputs, 1.0)
    chosen = tuple(shown if outputs is None else outputs)
    for what, names, there in (("input", given, known), ("output", chosen, shown)):
        for name in names:
            if name not in there:
                raise AnalysisError(f"model '{model.name}': {unknown(what, name, there)}")
    if len(set(chosen)) < len(chosen):
        raise AnalysisError(f"outputs {', '.join(chosen)}: a name stands twice")
    for name, size in given.items():
        if not 0.0 < float(size) < np.inf:
            raise AnalysisError(f"input '{name}' has the size {size}; give a positive finite number")
    sizes = {name: float(size) for name, size in given.items()}
    return Question(model, ClaimChannel(sizes, chosen), bool(flag("discrete", discrete)))


def require_box(question: Question) -> None:
    """Raise AnalysisError where constraints between the parameters cut the box: what is asked is about all of it."""
    if question.model.constraints:
        words = ", ".join(constraint.words for constraint in question.model.constraints)
        raise AnalysisError(
            f"model '{question.model.name}' has constraints between its parameters ({words}), this analysis is about boxes; "
            "worst_case_gain, lpv_l2_gain and lpv_decay_rate keep to the set, or shrink the ranges"
        )


def require_channel(question: Question) -> None:
    """Raise AnalysisError if there is no input: a gain needs one."""
    if not question.channel.inputs:
        raise AnalysisError(f"model '{question.model.name}' has neither inputs nor disturbances; a gain needs one")


def at_points(matrix: PolynomialMatrix, u: FloatArray) -> FloatArray:
    """Values of an exact polynomial in floats at (g, p) points, (g, rows, columns)."""
    total = np.zeros((len(u), *matrix.shape))
    for powers, entries in matrix.terms.items():
        weight = np.prod(u ** np.array(powers, int), axis=1) if powers else np.ones(len(u))
        numbers = np.array([as_float(x) for x in entries.entries()]).reshape(matrix.shape)
        total += weight[:, None, None] * numbers
    return total
