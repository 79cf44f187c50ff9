"""What the runtimes of a schedule have in common: their options, and a memory that says which schedule it belongs to."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.arrays import AnyArray
from estimators.errors import EstimatorError
from estimators.memory import Renewable, Saved
from estimators.schedule.gain_schedule import GainSchedule


def check_options(outside: str, stale_after: int | None) -> None:
    """What every runtime may be given.

    Raises:
        EstimatorError: an option that means nothing.
    """
    if outside not in ("flag", "refuse"):
        raise EstimatorError(f"outside = {outside!r} is not known; use 'flag' or 'refuse'")
    if stale_after is not None and stale_after < 1:
        raise EstimatorError(f"stale_after = {stale_after} samples must be at least 1, or None")


class SavedWithSchedule(Renewable):
    """Memory of a runtime of one schedule: it is restored only into a runtime of the same."""

    schedule: GainSchedule

    def save(self) -> Saved:
        """Everything needed to continue later, and the digest of the schedule, as plain arrays."""
        return super().save() | {"schedule_sha256": np.array(self.schedule.sha256)}

    def _check(self, saved: Mapping[str, AnyArray]) -> None:
        if "schedule_sha256" in saved and str(saved["schedule_sha256"]) != self.schedule.sha256:
            raise EstimatorError(f"saved with another schedule than '{self.schedule.name}' {self.schedule.sha256[:12]}")
        super()._check(saved)
