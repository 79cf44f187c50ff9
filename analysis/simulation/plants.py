"""What is simulated: a linear plant over parameters, or the nonlinear truth, each for a batch of runs."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from analysis.simulation.flow import held, moving
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from synthesis.models.lpv import LpvModel

Matrices = tuple[FloatArray, ...]


class SimulatedPlant(Protocol):
    """States x (runs, nx), inputs u (runs, nu), disturbances d (runs, nd), parameters p (runs, p); u and d held over a sample."""

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    disturbances: tuple[str, ...]
    parameters: tuple[str, ...]

    def output(self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray) -> FloatArray:
        """Measurements (runs, ny)."""
        ...

    def advance(
        self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray, p_next: FloatArray, period: float
    ) -> FloatArray:
        """States one sample later."""
        ...


class LinearPlant:
    """x' = A(p) x + B(p) u + E(p) d, y = C(p) x + D(p) u + F(p) d, of a schedule file or a model.

    `parts` 0: p stands still over a sample, as the claims about an update say. Otherwise it moves linearly through it, and the
    sample is integrated in so many steps of order four.
    """

    def __init__(self, system: GainSchedule | LpvModel, parts: int = 0) -> None:
        self.system, self.parts, self.name = system, parts, system.name
        self.states = tuple(s.name for s in system.states)
        self.inputs = tuple(s.name for s in system.inputs)
        self.outputs = tuple(s.name for s in system.outputs)
        self.disturbances = tuple(s.name for s in system.disturbances)
        self.parameters = tuple(p.name for p in system.parameters)
        self._last: tuple[FloatArray, Matrices] | None = None

    def matrices(self, p: FloatArray) -> Matrices:
        """A, B, C, D, E, F at parameters (g, p), stacked; outputs and motion of a sample ask for the same."""
        if self._last is None or not np.array_equal(self._last[0], p):
            self._last = p.copy(), matrices_of(self.system, p)
        return self._last[1]

    def output(self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray) -> FloatArray:
        """C x + D u + F d."""
        _, _, C, D, _, F = self.matrices(p)
        return times(C, x) + times(D, u) + times(F, d)

    def advance(
        self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray, p_next: FloatArray, period: float
    ) -> FloatArray:
        """By matrix exponentials."""

        def rates(at: FloatArray) -> tuple[FloatArray, FloatArray]:
            A, B, _, _, E, _ = self.matrices(at)
            return A, times(B, u) + times(E, d)

        if not self.parts:
            return held(rates, x, p, period)
        return moving(rates, x, p, p_next, period, self.parts)


def matrices_of(system: GainSchedule | LpvModel, p: FloatArray) -> Matrices:
    """A, B, C, D, E, F at parameters (g, p), stacked (g, rows, columns)."""
    if isinstance(system, LpvModel):
        model = system.on(p)
        return model.A, model.B, model.C, model.D, model.E, model.F
    at = p[:, 0] if len(system.parameters) == 1 else p
    return tuple(system.plant[key].at(at) for key in "ABCDEF")


def times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """M v of stacks."""
    return np.asarray((matrix @ vector[..., None])[..., 0])
