"""Saving and restoring the state of a step-by-step object, as plain arrays."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.arrays import AnyArray
from estimators.errors import EstimatorError

Saved = dict[str, AnyArray]


class Memory:
    """What an object remembers from step to step: arrays named in `memory`, and parts that remember themselves.

    Arrays are replaced or written in place by the steps, but keep shape and type.
    """

    memory: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    unknowns: tuple[str, ...] = ()  # arrays of `memory` in which NaN means "never seen"

    def save(self) -> Saved:
        """Everything needed to continue later, as plain arrays; what belongs to a part carries its name and a dot."""
        saved: Saved = {name: np.array(getattr(self, name)) for name in self.memory}
        for part in self.parts:
            saved |= {f"{part}.{name}": array for name, array in getattr(self, part).save().items()}
        return saved

    def restore(self, saved: Mapping[str, AnyArray]) -> None:
        """Continues from `save`, bit for bit.

        Raises:
            EstimatorError: incomplete, of another batch shape or type, or not finite; nothing is changed then.
        """
        self._check(saved)
        before = self.save()
        try:
            self._take(saved)
        except EstimatorError:  # a part has conditions of its own, and found it after others had taken theirs
            self._take(before)
            raise

    def _check(self, saved: Mapping[str, AnyArray], prefix: str = "") -> None:
        for name, own in self.save().items():
            key = prefix + name
            if key not in saved:
                raise EstimatorError(f"saved state lacks '{key}'")
            array = np.asarray(saved[key])
            if array.shape != own.shape or array.dtype != own.dtype:
                found = f"{array.dtype} {array.shape}"
                raise EstimatorError(f"saved '{key}' is {found}, expected {own.dtype} {own.shape}: another estimator?")
            unknown = name.rpartition(".")[2] in self._all_unknowns()
            if array.dtype.kind == "f" and not unknown and not np.isfinite(array).all():
                raise EstimatorError(f"saved '{key}' is not finite")

    def _all_unknowns(self) -> set[str]:
        found = set(self.unknowns)
        for part in self.parts:
            owner = getattr(self, part)
            if isinstance(owner, Memory):
                found |= owner._all_unknowns()
        return found

    def _take(self, saved: Mapping[str, AnyArray]) -> None:
        for name in self.memory:
            setattr(self, name, np.array(saved[name]))
        for part in self.parts:
            lead = f"{part}."
            getattr(self, part).restore({k.removeprefix(lead): v for k, v in saved.items() if k.startswith(lead)})
