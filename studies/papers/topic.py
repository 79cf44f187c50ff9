"""One topic of a study: what it computes for claims, tables and figures stands in one file and is registered there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

from studies.claim import Claim, ClaimFunction, JsonValue
from studies.papers.published import printed, published_claims
from studies.plots import Figure
from studies.study import Cell, Part, PartFunction, PartResult, Preparation, Scope, Table
from synthesis.errors import SpecError
from synthesis.models.parameter_set import load_parameter_set, quantities

C = TypeVar("C", bound=ClaimFunction)
P = TypeVar("P", bound=PartFunction)


@dataclass(frozen=True)
class Topic:
    """Claims by id and parts in order; ``package`` is the study's folder, whose ``claims.toml`` holds what is printed."""

    package: str
    claims: dict[str, ClaimFunction] = field(default_factory=dict)
    parts: list[Part] = field(default_factory=list)

    def claim(self, name: str) -> Callable[[C], C]:
        """Register what computes the claim ``name``: a decorator, or called with a `functools.partial`.

        Raises SpecError for an id that ``claims.toml`` does not hold, or that is registered already.
        """
        if name not in published_claims(self.package) or name in self.claims:
            known = "twice" if name in self.claims else "but claims.toml does not hold it"
            raise SpecError(f"{self.package}: claim '{name}' is computed {known}")

        def register(compute: C) -> C:
            self.claims[name] = compute
            return compute

        return register

    def part(
        self, name: str, title: str, cost: float = 1.0, needs: tuple[Preparation, ...] = (), quick: bool = True
    ) -> Callable[[P], P]:
        """Register a part (`studies.study.Part`) as a decorator."""

        def register(run: P) -> P:
            self.parts.append(Part(name, title, run, cost, needs, quick))
            return run

        return register

    def show(
        self, name: str, title: str, cost: float = 1.0, claims: Sequence[str] = (),
        tables: Sequence[Callable[[], Table]] = (), figures: Sequence[Callable[[], Figure]] = (), notes: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Register a part that is its claims (see `found`) and what makes its tables and figures, whatever the scope."""
        found = self.found

        def run(_: Scope) -> PartResult:
            return PartResult(found(*claims), [make() for make in tables], [make() for make in figures], notes)

        first = next(iter(self.claims.values()))
        # The runner reads from a part's module whose code decides whether a stored result is still good.
        run.__module__ = getattr(first, "func", first).__module__
        self.parts.append(Part(name, title, run, cost))

    def found(self, *names: str) -> list[Claim]:
        """The claims ``names`` of this topic, all of them without a name, computed now."""
        return [Claim(published_claims(self.package)[name], self.claims[name]()) for name in names or self.claims]

    def printed(self, name: str) -> JsonValue:
        """What the paper prints for the claim ``name``."""
        return printed(self.package, name)


def constants_part(parameters: str, caption: str) -> Part:
    """Table I: every constant of the shipped set ``parameters``, with the place where it is printed."""
    return Part("parameters", "Table I: vehicle and tire", partial(_constants, parameters, caption), 0.1)


def _constants(parameters: str, caption: str, _: Scope) -> PartResult:
    found = load_parameter_set(parameters)
    entries = {name.replace("_", " "): quantity for name, quantity in found.vehicle.items()}
    for direction, tire in found.tire.items():
        entries |= {f"{name}, {direction}": quantity for name, quantity in quantities(tire).items()}
    rows: list[tuple[Cell, ...]] = [(name, q.value, q.unit, q.source) for name, q in entries.items()]
    return PartResult(tables=[Table("table-1", caption, ("quantity", "value", "unit", "printed in"), rows)])
