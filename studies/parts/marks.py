"""Fingerprints of studies, parts and preparations: each of what it really imports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from studies.execution.fingerprint import PACKAGES, SOURCE_ROOT, Sources, traits
from studies.registry import Registry
from studies.study import Part, Preparation, Scope

STORE = "studies.parts.store"  # how a result is written belongs to it


@dataclass(frozen=True)
class Marks:
    """The fingerprints of one run with ``scope``; ``given`` sources stand in for the project's own (in tests)."""

    registry: Registry
    scope: Scope
    given: Sources | None = None

    @cached_property
    def sources(self) -> Sources:
        """The project's own packages, and those of the registry's modules."""
        others = {module.partition(".")[0] for module in self.registry.modules.values()}
        return self.given or Sources(SOURCE_ROOT, {*PACKAGES, *others})

    def study(self, study_id: str) -> str:
        """Of the study's module, which reaches all parts: none of them needs to be loaded for it."""
        return self.sources.fingerprint(self.scope, [self.registry.modules[study_id].partition(":")[0], STORE])

    def part(self, part: Part) -> str:
        """Of the functions of the part and of its needs: the modules that define them, and what they are bound to."""
        return self._of(part.run, *(need.run for need in part.needs))

    def preparation(self, need: Preparation) -> str:
        """Of its function."""
        return self._of(need.run)

    def _of(self, *functions: Callable[..., Any]) -> str:
        modules, values = zip(*(traits(function) for function in functions), strict=True)
        return self.sources.fingerprint((self.scope, values), {STORE}.union(*modules))
