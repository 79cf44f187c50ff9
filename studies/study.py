"""A study: named parts, each of which computes claims, tables and figures and can be run, stored and resumed alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from estimators.display import Display, displayed
from studies.claim import Claim
from studies.plots import Figure

Cell = str | int | float | bool | None


@dataclass(frozen=True)
class Scope:
    """How much is computed: ``seeds`` Monte Carlo runs, coarse grids when ``quick``.

    ``prepared``: the folder with what the preparations of a run left; None outside of a run.

    >>> Scope(quick=True, seeds=12).seeds
    12
    """

    quick: bool = False
    seeds: int = 200
    prepared: Path | None = field(default=None, compare=False, repr=False)  # where it lies changes no result


QUICK = Scope(quick=True, seeds=12)


@dataclass(frozen=True, repr=False)
class Table(Display):
    """A table with a caption that stands on its own; units belong into the column names: ``speed [m/s]``.

    >>> Table("sums", "Sums of numbers", ["a [1]", "b [1]", "sum [1]"], [[2, 2, 4]]).rows
    [[2, 2, 4]]
    """

    name: str
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True, repr=False)
class PartResult(Display):
    """What one part found; ``notes`` are paragraphs of the report, ``measures`` single numbers for machines.

    >>> PartResult(notes=["2 + 2 = 4"], measures={"sum": 4.0}).measures
    {'sum': 4.0}
    """

    claims: Sequence[Claim] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    notes: Sequence[str] = ()
    measures: dict[str, float] = field(default_factory=dict)


PartFunction = Callable[[Scope], PartResult]


@dataclass(frozen=True)
class Preparation:
    """What several parts read, computed once before them: ``run`` fills the folder ``scope.prepared / name`` that it is given.

    Parts of all studies share a preparation by its name, which belongs to it alone.
    """

    name: str
    run: Callable[[Scope, Path], None]
    cost: float = 1.0


@dataclass(frozen=True, repr=False)
class Part(Display):
    """A named piece of a study; ``cost`` in rough seconds of one core lets the runner start the longest first.

    ``quick`` is False for a part that a quick run leaves out, because another one shows the same on fewer drives.

    >>> Part("sum", "Sum", lambda scope: PartResult(notes=["2 + 2 = 4"])).run(Scope(quick=True)).notes
    ['2 + 2 = 4']
    """

    name: str
    title: str
    run: PartFunction
    cost: float = 1.0
    needs: tuple[Preparation, ...] = ()
    quick: bool = True


@displayed({})
@dataclass(frozen=True, repr=False)
class Study:
    """A study as users select it by ``id``; ``paper`` is P1..P5, or empty for studies beyond the papers.

    >>> Study("sums", "Sums", "", "What is two and two?", (Part("sum", "Sum", lambda scope: PartResult()),)).id
    'sums'
    """

    id: str
    title: str
    paper: str
    summary: str
    parts: tuple[Part, ...]

    def chosen(self, scope: Scope) -> tuple[Part, ...]:
        """The parts that a run with ``scope`` computes."""
        return tuple(part for part in self.parts if part.quick or not scope.quick)
