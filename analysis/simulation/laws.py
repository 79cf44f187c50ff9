"""What runs beside the plant: the runtime of a schedule as it ships."""

from __future__ import annotations

from estimators.arrays import FlagArray, FloatArray
from estimators.lpv.observer import LpvObserver
from estimators.schedule import GainSchedule
from estimators.velocity.lpv import LpvVelocityObserver


class RuntimeObserver:
    """`LpvObserver`, or `LpvVelocityObserver` for two states, one input and one output, with one entry for every run."""

    def __init__(self, schedule: GainSchedule, runs: int, velocity: bool = False) -> None:
        self.any_size = None if velocity else LpvObserver(schedule, (runs,))
        self.two_states = LpvVelocityObserver(schedule, (runs,)) if velocity else None

    def start(self, estimate: FloatArray) -> None:
        """Set the estimates (runs, nx)."""
        for observer in (self.any_size, self.two_states):
            if observer is not None:
                observer.reset(state=estimate)

    def step(self, u: FloatArray, y: FloatArray, p: FloatArray) -> tuple[FloatArray, FlagArray]:
        """Estimates (runs, nx) at the end of the sample, and flags (runs,)."""
        if self.two_states is not None:
            two = self.two_states.step(u[:, 0], y[:, 0], p[:, 0])
            return two.estimate, two.flags
        assert self.any_size is not None
        found = self.any_size.step(u, y, p)
        return found.estimate, found.flags
