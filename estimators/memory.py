"""Saving and restoring the state of a step-by-step object, as plain arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from estimators.arguments import LIMIT
from estimators.arithmetic import Arithmetic, Number
from estimators.arrays import AnyArray, BoolArray, FlagArray
from estimators.display import Display
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag

Saved = dict[str, AnyArray]


class Memory(Display):
    """What an object remembers from step to step: values named in `memory`, and parts that remember themselves.

    A value is an array, a number, or a list of these; steps replace it or write to it, but keep its shape and type. A part
    is such an object, a list of them, or None. An underscore in front of a name is not part of its key.
    """

    memory: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    unknowns: tuple[str, ...] = ()  # values of `memory` in which NaN means "never seen"

    def summary(self) -> tuple[str, ...]:
        """Its kind, and what it has of a schedule, a batch, a sample time and a count of samples."""
        facts = (
            ("schedule", getattr(getattr(self, "schedule", None), "name", None)),
            ("batch shape", getattr(self, "batch_shape", None)),
            ("sample time [s]", getattr(self, "sample_time", None)),
            ("samples so far", getattr(self, "samples", None)),
        )
        return (type(self).__name__, *(f"{what}: {value}" for what, value in facts if value is not None))

    def save(self) -> Saved:
        """Everything needed to continue later, as plain arrays; what belongs to a part carries its name and a dot."""
        saved: Saved = {name.lstrip("_"): np.array(getattr(self, name)) for name in self.memory}
        for lead, part in self._members():
            saved |= {lead + name: array for name, array in part.save().items()}
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

    def _check(self, saved: Mapping[str, AnyArray]) -> None:
        unknowns = self._all_unknowns()
        for key, own in self.save().items():
            if key not in saved:
                raise EstimatorError(f"saved state lacks '{key}'")
            array = np.asarray(saved[key])
            if array.shape != own.shape or array.dtype.kind != own.dtype.kind:
                found = f"{array.dtype} {array.shape}"
                raise EstimatorError(f"saved '{key}' is {found}, expected {own.dtype} {own.shape}: another estimator?")
            known = array.dtype.kind == "f" and key.rpartition(".")[2] not in unknowns
            if known and not (np.absolute(array) <= LIMIT).all():
                raise EstimatorError(f"saved '{key}' is not finite")

    def _all_unknowns(self) -> set[str]:
        found = {name.lstrip("_") for name in self.unknowns}
        return found.union(*(part._all_unknowns() for _, part in self._members() if isinstance(part, Memory)))

    def _take(self, saved: Mapping[str, AnyArray]) -> None:
        for name in self.memory:
            setattr(self, name, _as(getattr(self, name), np.array(saved[name.lstrip("_")])))
        for lead, part in self._members():
            part.restore({key.removeprefix(lead): array for key, array in saved.items() if key.startswith(lead)})
        self._recall()

    def _recall(self) -> None:
        """What follows from the memory, after a restore."""

    def _members(self) -> Iterator[tuple[str, Any]]:
        for name in self.parts:
            part = getattr(self, name)
            if isinstance(part, list):
                yield from ((f"{name.lstrip('_')}.{place}.", each) for place, each in enumerate(part))
            elif part is not None:
                yield f"{name.lstrip('_')}.", part


def _as(own: Any, array: AnyArray) -> Any:
    """A saved array in the form of the value `own`."""
    if isinstance(own, np.ndarray):
        return array
    if isinstance(own, list | tuple):
        return [_as(each, np.array(part)) for each, part in zip(own, array, strict=True)]
    return array.item()


class CarsMemory(Memory):
    """Memory of which every value is a `Number` or `Signals` of a kit: 0, among the unknowns NaN, when a car starts afresh."""

    kit: Arithmetic

    def forget(self, where: Number) -> None:
        """Starts the cars `where` afresh."""
        for name in self.memory:
            value, nothing = getattr(self, name), np.nan if name in self.unknowns else 0.0
            setattr(self, name, self.kit.replaced(where, nothing, value))


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

    def _recall(self) -> None:
        self._any_renewed = bool(self.renewed.any())
