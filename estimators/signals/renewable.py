"""Which entries were started afresh: the next step flags them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.arrays import AnyArray, BoolArray, FlagArray
from estimators.faults import Flag, raise_flag
from estimators.signals.memory import Memory


class Renewable(Memory):
    """Memory with the flag RESET for entries that `reset` chose; a subclass names "renewed" in its `memory`.

    Args:
        batch_shape: one entry each.
    """

    memory: tuple[str, ...] = ("renewed",)

    def __init__(self, batch_shape: tuple[int, ...]) -> None:
        self.batch_shape = batch_shape
        self.renewed: BoolArray = np.zeros(batch_shape, dtype=np.bool_)
        self._any_renewed = False

    def _renew(self, chosen: BoolArray) -> None:
        """To be flagged at the next step."""
        self.renewed = self.renewed | chosen
        self._any_renewed = bool(self.renewed.any())

    def _flag_renewed(self, flags: FlagArray) -> None:
        """Flags them, once."""
        if self._any_renewed:
            raise_flag(flags, self.renewed, Flag.RESET)
            self.renewed, self._any_renewed = np.zeros(self.batch_shape, dtype=np.bool_), False

    def _take(self, saved: Mapping[str, AnyArray]) -> None:
        super()._take(saved)
        self._any_renewed = bool(self.renewed.any())
