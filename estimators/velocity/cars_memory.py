"""What the parts of the fusion remember of every car: plain numbers of one, arrays of many."""

from __future__ import annotations

from collections.abc import Mapping

from estimators.arrays import AnyArray
from estimators.signals.memory import Memory
from estimators.velocity.arithmetic import Arithmetic, Number


class CarsMemory(Memory):
    """Memory whose entries are a `Number` each, zero for a car that starts afresh."""

    kit: Arithmetic

    def _take(self, saved: Mapping[str, AnyArray]) -> None:
        for name in self.memory:
            setattr(self, name, self.kit.own(saved[name].copy()))

    def forget(self, where: Number) -> None:
        """Starts the cars `where` afresh."""
        for name in self.memory:
            setattr(self, name, self.kit.where(where, 0.0, getattr(self, name)))
