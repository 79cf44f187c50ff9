"""What search and proof ask of a loop: its plant, its cells, and the linear system on a region of a cell."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from flint import fmpq

from synthesis.loop.plant import Plant
from synthesis.loop.system import Region, System, Time


class Loop(Protocol):
    """A law in closed loop with its plant (`ObserverLoop`, `FeedbackLoop`), or a system as it is given (`GivenLoop`)."""

    @property
    def plant(self) -> Plant:
        """Its parameters as axes."""

    @property
    def states(self) -> int:
        """Number of states of the loop."""

    @property
    def breakpoints(self) -> tuple[tuple[fmpq, ...], ...]:
        """Of every parameter, its ends among them: between them the loop is one polynomial."""

    @property
    def sample_time(self) -> fmpq | None:
        """Length of a sample; None in continuous time."""

    @property
    def time(self) -> Time:
        """The time in which its states are balanced for the solver."""

    def cells(self) -> Iterator[Region]:
        """The boxes between neighbouring breakpoints that are not wholly outside the set of the parameters."""

    def system(self, region: Region, time: Time) -> System | None:
        """The loop on a region of one cell; None where a matrix exponential is too large to be enclosed."""
