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
e' = (A - L C) e + (E - L F) d.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise, product
from typing import Any, Literal

import numpy as np
from flint import arb, fmpq, fmpq_mat

from synthesis.errors import ProblemError
from synthesis.loop.on_boxes import HIGHEST, MOST_BOXES, gains, local, rounding_of, unit
from synthesis.loop.plant import Plant
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials import box_exponential
from synthesis.polynomials import exponential as exponentials
from synthesis.polynomials.enclosure import PolynomialMatrix, Powers, identity

Update = Literal["held", "sampled"]
ROUNDING = fmpq(1, 2**50)  # of float64, with room: every rounding below costs at most 2^-53 of what is rounded
ORDER = 8  # total degree in the local parameters that products of exponentials keep


@dataclass(frozen=True)
class ObserverLoop:
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

    def cells(self) -> Iterator[Region]:
        """The boxes between neighbouring breakpoints."""
        edges = [
            [(axis.scaled(low), axis.scaled(high)) for low, high in pairwise(points)]
            for axis, points in zip(self.plant.axes, self.breakpoints, strict=True)
        ]
        for cell in product(*edges):
            yield Region.between(tuple(low for low, _ in cell), tuple(high for _, high in cell))

    def system(self, region: Region, time: Literal["continuous", "discrete"]) -> System | None:
        """The error on a region (of one cell of the table): the error equation, or its update over a sample.

        None where the matrix exponential is too large to be enclosed. Raises ProblemError for a discrete system without a
        sample time, or of a rational plant.
        """
        box = (region.offset[: region.parameters], region.factor[: region.parameters], time)
        if box not in self._systems:
            self._systems[box] = self._error_equation(region) if time == "continuous" else self._error_update(region)
        return self._systems[box]

    def local(self, matrix: PolynomialMatrix, region: Region) -> PolynomialMatrix:
        """A polynomial in u in the local variables (t, r) of a region."""
        return region.local(matrix)

    def gain(self, region: Region) -> PolynomialMatrix:
        """The multilinear gain on a region that lies in one cell."""
        axes, count = self.plant.axes, region.parameters
        cell, weights = [], []
        for i, (axis, points) in enumerate(zip(axes, self.breakpoints, strict=True)):
            middle = region.offset[i] * axis.half + axis.middle
            k = next(j for j in range(len(points) - 1) if middle <= points[j + 1])
            cell.append(k)
            low, high = axis.scaled(points[k]), axis.scaled(points[k + 1])
            ends = (region.offset[i] - low) / (high - low), region.factor[i] / (high - low)
            weights.append(((1 - ends[0], -ends[1]), ends))
        terms: dict[Powers, fmpq_mat] = {}
        for corner in product((0, 1), repeat=count):
            value = self.table[tuple(k + c for k, c in zip(cell, corner, strict=True))]
            for powers in product((0, 1), repeat=count):
                factor = fmpq(1)
                for i in range(count):
                    factor *= weights[i][corner[i]][powers[i]]
                if factor != 0:
                    place = (*powers, *(0,) * count)
                    terms[place] = terms[place] + value * factor if place in terms else value * factor
        nx, ny = self.plant.states, self.plant.matrices["C"].shape[0]
        found = PolynomialMatrix(terms, (nx, ny), 2 * count).balls()
        return found.blurred(lambda i, j: self._gain_rounding[i, j].abs_upper()) if self.rounded else found

    @cached_property
    def _gain_rounding(self) -> Any:
        """What interpolation in float64 may be off: of the values, and of slopes times rounded distances."""
        nx, ny = self.plant.states, self.plant.matrices["C"].shape[0]
        steepest = fmpq(1)
        for axis, points in zip(self.plant.axes, self.breakpoints, strict=True):
            narrow = min(b - a for a, b in pairwise(points))
            steepest += max(abs(axis.low), abs(axis.high)) / narrow
        largest = [[max(abs(gain[i, j]) for gain in self.table.values()) for j in range(ny)] for i in range(nx)]
        return {(i, j): arb(largest[i][j] * steepest * ROUNDING * 4) for i in range(nx) for j in range(ny)}

    @cached_property
    def _plant(self) -> dict[str, PolynomialMatrix]:
        """Plant matrices in u, as balls; uncertain by what the runtime's evaluation in float64 may be off."""
        matrices = {key: matrix.balls() for key, matrix in self.plant.matrices.items()}
        if not self.rounded:
            return matrices
        # u = (p - middle) / half of a float64 p: the rounding of `middle` is felt in units of `half`.
        axes = self.plant.axes
        argument = [ROUNDING * (1 + max(abs(axis.low), abs(axis.high)) / axis.half) for axis in axes]
        out = {}
        for key, matrix in self.plant.matrices.items():
            out[key] = matrices[key].blurred(_evaluation_error(matrix, argument))
        return out

    def on_boxes(self, time: Time, cells: Sequence[Region]) -> System | None:
        """`system` on many regions at once, every matrix `Boxes`; None where they are too many or too large for that."""
        axes = self.plant.axes
        if not 1 <= len(axes) <= max(HIGHEST) or len(cells) > MOST_BOXES:
            return None
        plant = {key: local(self._plant[key], cells) for key in "ACEF"}
        shape = self.plant.states, self.plant.matrices["C"].shape[0]
        rounding = rounding_of(self._gain_rounding, shape) if self.rounded else np.zeros(shape)
        gain = gains(self.table, self.breakpoints, axes, cells, rounding)
        if time == "discrete":
            return self._updated(plant, gain, unit(self.plant.states, axes), box_exponential)
        below = None if self.plant.is_polynomial else local(self.plant.denominator, cells)
        return self._equation(plant, gain, unit(self.plant.states, axes), below)

    def _error_equation(self, region: Region) -> System:
        plant = {key: self.local(self._plant[key], region) for key in "ACEF"}
        below = None if self.plant.is_polynomial else self.local(self.plant.denominator, region)
        return self._equation(plant, self.gain(region), identity(self.plant.states, 2 * region.parameters), below)

    def _error_update(self, region: Region) -> System | None:
        plant = {key: self.local(self._plant[key], region) for key in "ACEF"}
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
        if self.sample_time is None or not self.plant.is_polynomial:
            raise ProblemError("an update over a sample needs a sample time and a polynomial plant")
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


def _evaluation_error(matrix: PolynomialMatrix, argument: Sequence[fmpq]) -> Any:
    """Bound, entry by entry, of coefficients, powers and argument in float64 for |u| <= 1."""
    count = (sum(matrix.degrees) + 1) ** 2

    def radius(i: int, j: int) -> Any:
        total = fmpq(0)
        for powers, entries in matrix.terms.items():
            size = abs(entries[i, j])
            total += size * (ROUNDING * count + sum((k * a for k, a in zip(powers, argument, strict=True)), fmpq(0)))
        return arb(total).abs_upper()

    return radius
