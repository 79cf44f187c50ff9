r"""The observer law in closed loop with its plant: a table of gains on a grid, multilinear between its breakpoints.

Two ways to run it at a sample time T, with u and y held over a sample and A, C, the gains at the parameter of its start:

    held     xhat+ = e^M xhat + T phi(M) (B u + L (y - D u)),  M = T (A - L C),  phi(M) = int_0^1 e^(M s) ds
    sampled  xhat+ = e^(TA) xhat + T phi(TA) B u + K (y - C xhat - D u)

The first is the continuous-time observer xhat' = A xhat + B u + L (y - C xhat - D u), integrated exactly with y held. The error
e = x - xhat of either, with d held as well and x' the plant's own motion at the start of the sample:

    held     e+ = e^M e + T phi(M) (E - L F) d + T (phi(TA) - phi(M)) x'
    sampled  e+ = (e^(TA) - K C) e + (T phi(TA) E - K F) d

What float64 rounds when the runtime evaluates plant and gains is inside the balls of these matrices; that it then computes phi
and adds up in float64 leaves an error of about 1e-15 of the states, which no claim speaks of. While no measurement comes in,
both are e+ = e^(TA) e + T phi(TA) E d. Between samples the error of `held` obeys, if nothing is held, the error equation
e' = (A - L C) e + (E - L F) d. A rational plant keeps its denominator there; an update takes its matrices divided by it
(`synthesis.polynomials.quotient`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Literal

from flint import fmpq, fmpq_mat

from synthesis.errors import ProblemError
from synthesis.loop.on_boxes import local, unit
from synthesis.loop.plant import Plant
from synthesis.loop.system import Region, System, Time
from synthesis.loop.tabulated import Tabulated
from synthesis.polynomials import box_exponential
from synthesis.polynomials import exponential as exponentials
from synthesis.polynomials.enclosure import identity

Update = Literal["held", "sampled"]
ORDER = 8  # total degree in the local parameters that products of exponentials keep


@dataclass(frozen=True)
class ObserverLoop(Tabulated):
    """Plant, gains and update. `breakpoints` one tuple for every parameter; `table` maps a grid index to L or K (nx, ny).

    `sample_time` None: only the error equation is meant. With `rounded` the plant and the gains are balls that hold what the
    runtime computes of them in float64; without it they are exact.
    """

    plant: Plant
    breakpoints: tuple[tuple[fmpq, ...], ...]
    table: Mapping[tuple[int, ...], fmpq_mat]
    update: Update = "held"
    sample_time: fmpq | None = None
    rounded: bool = True
    _systems: dict[Any, System | None] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def constant_gain(cls, plant: Plant, gain: fmpq_mat) -> ObserverLoop:
        """One gain on the whole range, without a runtime: the table has one cell."""
        corners = list(product(*((0, 1) for _ in plant.axes)))
        return cls(
            plant, tuple((axis.low, axis.high) for axis in plant.axes), dict.fromkeys(corners, gain), rounded=False
        )

    @property
    def time(self) -> Time:
        """Continuous for an observer that is integrated, discrete for one that corrects once a sample."""
        return "continuous" if self.update == "held" else "discrete"

    @property
    def states(self) -> int:
        """Those of the plant: the loop is that of the estimation error."""
        return self.plant.states

    def system(self, region: Region, time: Literal["continuous", "discrete"]) -> System | None:
        """The error on a region (of one cell of the table): the error equation, or its update over a sample.

        None where the matrix exponential is too large to be enclosed, or a denominator not certainly positive. Raises
        ProblemError for a discrete system without a sample time.
        """
        box = (region.offset[: region.parameters], region.factor[: region.parameters], time)
        if box not in self._systems:
            self._systems[box] = self._error_equation(region) if time == "continuous" else self._error_update(region)
        return self._systems[box]

    def on_boxes(self, time: Time, cells: Sequence[Region]) -> System | None:
        """`system` on many regions at once, every matrix `Boxes`; None where they are too many or too large for that."""
        found = self._at_once(cells, "ACEF", time == "discrete")
        if found is None:
            return None
        (plant, gain), axes = found, self.plant.axes
        if time == "discrete":
            return self._updated(plant, gain, unit(self.plant.states, axes), box_exponential)
        below = None if self._below is None else local(self._below, cells)
        return self._equation(plant, gain, unit(self.plant.states, axes), below)

    def _error_equation(self, region: Region) -> System:
        plant = self.plant_on(region, "ACEF", False)
        assert plant is not None  # only a quotient may be none
        below = None if self._below is None else region.local(self._below)
        return self._equation(plant, self.gain(region), identity(self.plant.states, 2 * region.parameters), below)

    def _error_update(self, region: Region) -> System | None:
        plant = self.plant_on(region, "ACEF", True)
        if plant is None:
            return None
        return self._updated(plant, self.gain(region), identity(self.plant.states, 2 * region.parameters), exponentials)

    def _equation(self, plant: dict[str, Any], gain: Any, eye: Any, below: Any) -> System:
        return System(
            "continuous",
            A=plant["A"] - gain @ plant["C"],
            B={"disturbances": plant["E"] - gain @ plant["F"]},
            C=eye,
            D={"disturbances": plant["E"] * 0},
            coasting=plant["A"],
            denominator=below,
        )

    def _updated(self, plant: dict[str, Any], gain: Any, eye: Any, ring: Any) -> System | None:
        """The update over a sample; `ring` knows phi and the exponential of its matrices."""
        if self.sample_time is None:
            raise ProblemError("an update over a sample needs a sample time")
        period = self.sample_time
        TA = plant["A"] * period
        coast = ring.phi(TA)
        if coast is None:
            return None
        coasting = ring.exponential(TA, coast)
        forced = (coast @ plant["E"]).truncated(ORDER) * period
        if self.update == "sampled":
            A = (coasting - gain @ plant["C"]).truncated(ORDER)
            B = {"disturbances": forced - gain @ plant["F"]}
        else:
            M = TA - gain @ plant["C"] * period
            closed = ring.phi(M)
            if closed is None:
                return None
            A = ring.exponential(M, closed)
            driven = plant["E"] - gain @ plant["F"]
            B = {
                "disturbances": (closed @ driven).truncated(ORDER) * period,
                "motion": (coast - closed) * period,
            }
        none = {name: matrix * 0 for name, matrix in B.items()}
        return System("discrete", A, B, eye, none, coasting)
