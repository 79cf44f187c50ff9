"""The observer as a continuous law: what the error equation says, without a sample time in the law."""

from __future__ import annotations

from typing import Literal

import numpy as np

from analysis.errors import AnalysisError
from analysis.simulation.flow import held, moving
from analysis.simulation.plants import matrices_of, times
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.schedule import GainSchedule

ESTIMATE = "_estimate"  # ends the name of what the law thinks of a state


class ContinuousLoop(Display):
    """xhat' = A xhat + B u + L(p) (y - C xhat - D u) beside x' = A x + B u + E d, one plant of the states (x, xhat).

    States of the law are called NAME_estimate. u and d are held over a sample, y is not; `between` as in `simulate`. The table of
    gains is multilinear: steps across a breakpoint are of a lower order. Raises AnalysisError for a schedule whose gains correct
    once a sample: they are no L.

    >>> ContinuousLoop(GainSchedule.shipped("longitudinal-speed")).states[2:]
    ('bristle_deflection_estimate', 'relative_velocity_estimate')
    """

    def __init__(self, schedule: GainSchedule, between: Literal["held", "moving"] = "moving", parts: int = 2) -> None:
        if schedule.update != "held":
            raise AnalysisError(f"'{schedule.name}' corrects once a sample; a continuous law needs the update 'held'")
        self.schedule, self.name = schedule, schedule.name
        self.parts = parts if between == "moving" else 0
        own = tuple(s.name for s in schedule.states)
        self.count, self.states = len(own), (*own, *(f"{name}{ESTIMATE}" for name in own))
        self.inputs = tuple(s.name for s in schedule.inputs)
        self.outputs = tuple(s.name for s in schedule.outputs)
        self.disturbances = tuple(s.name for s in schedule.disturbances)
        self.parameters = tuple(p.name for p in schedule.parameters)

    def output(self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray) -> FloatArray:
        """C x + D u + F d of the plant's own states."""
        _, _, C, D, _, F = matrices_of(self.schedule, p)
        return times(C, x[:, : self.count]) + times(D, u) + times(F, d)

    def advance(
        self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray, p_next: FloatArray, period: float
    ) -> FloatArray:
        """Both states one sample later."""

        def rates(at: FloatArray) -> tuple[FloatArray, FloatArray]:
            A, B, C, _, E, F = matrices_of(self.schedule, at)
            gain = self.schedule.gain(at[:, 0] if len(self.parameters) == 1 else at)
            correction = gain @ C
            both = np.concatenate(
                [
                    np.concatenate([A, np.zeros_like(A)], axis=-1),
                    np.concatenate([correction, A - correction], axis=-1),
                ],
                axis=-2,
            )
            driven = times(B, u)
            return both, np.concatenate([driven + times(E, d), driven + times(gain @ F, d)], axis=-1)

        if not self.parts:
            return held(rates, x, p, period)
        return moving(rates, x, p, p_next, period, self.parts)
