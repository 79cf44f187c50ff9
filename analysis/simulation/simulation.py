"""The result of a simulation: every signal over samples and runs, by name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from estimators.arrays import FlagArray, FloatArray
from estimators.display import Display
from estimators.errors import unknown


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Display):
    """N samples of R runs. `time` (N+1,) in s; `state`, `estimate`, `parameter` (R, N+1, ..); held over each sample:
    `input`, `disturbance`, `measurement` (R, N, ..), `flags` (R, N).

    `estimate` is None without an observer. `parameter` at the last instant is where a next sample would begin.
    """

    time: FloatArray
    state: FloatArray
    estimate: FloatArray | None
    parameter: FloatArray
    input: FloatArray
    disturbance: FloatArray
    measurement: FloatArray
    flags: FlagArray
    states: tuple[str, ...]
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    disturbances: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def error(self) -> FloatArray:
        """State less estimate (R, N+1, nx). Raises AnalysisError without an observer."""
        if self.estimate is None:
            raise AnalysisError("nothing was estimated in this simulation; give simulate() the schedule of an observer")
        return self.state - self.estimate

    def of(self, name: str) -> FloatArray:
        """One signal by name, (R, N+1) or (R, N). Raises AnalysisError for a name that is none."""
        groups = (
            (self.states, self.state), (self.parameters, self.parameter), (self.inputs, self.input),
            (self.disturbances, self.disturbance), (self.outputs, self.measurement),
        )  # fmt: skip
        for names, values in groups:
            if name in names:
                return np.asarray(values[..., names.index(name)])
        raise AnalysisError(unknown("signal", name, [name for names, _ in groups for name in names]))
