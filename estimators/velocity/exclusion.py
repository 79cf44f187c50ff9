"""Fault exclusion: how long a signal is not believed, and by how much an error that stays counts more."""

from __future__ import annotations

from estimators.arithmetic import Number
from estimators.memory import CarsMemory
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.signal_vote import Verdict


class Exclusion(CarsMemory):
    """What a_x on one side, a_y and yaw rate on the other have in common."""

    settings: FusionSettings

    def left(self, elapsed: Number, verdict: Verdict, before: Number) -> Number:
        """s for which a signal is not believed from now on; `before`: at the last sample."""
        kit = self.kit
        held = verdict.contradicted | kit.no(verdict.supported)
        fades = kit.where(held, before, kit.maximum(before - elapsed, 0.0))
        return kit.where(verdict.wrong, kit.maximum(self.settings.error_memory, before), fades)

    def grown(self, age: Number, elapsed: Number) -> Number:
        """By how much a deviation counts more in the integral, after `age` s of the same error."""
        return self.kit.sqrt(self.kit.maximum(2.0 * age / elapsed - 1.0, 1.0))
