r"""Prove claims about a loop without a solver: the inequalities of `synthesis.certificate.inequalities`, in ball arithmetic.

Read this together with `synthesis.polynomials.enclosure` and `.definite`. On every cell of the table the closed loop is a
polynomial (with an enclosed remainder where it holds a matrix exponential), so every inequality is a symmetric matrix polynomial
M(t, r), t the place in the cell, r the place of the rates between their bounds. All its Bernstein coefficients positive definite
proves M > 0 on the cell. A cell that decides nothing is halved. Where inequalities between the
parameters cut a cell, it is proved whole or by pieces, those outside the set left out, or on the part inside
(`synthesis.polynomials.multiplier`). Every number is a ball of 128 bits around the
exact one: a sign counts only if it is certain, whatever processor computed it. Cells with room to spare are proved before, all
at once, in float64 with a bound of everything that it rounds (`synthesis.certificate.quick`).

A failed proof says only that this P does not do. What the loop itself does is asked separately (`synthesis.certificate.refute`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from synthesis.certificate.claims import ERROR_EQUATION, WITH_CHANNEL, Claim, rows_of
from synthesis.certificate.cut_cell import positive_inside
from synthesis.certificate.inequalities import Question, inequalities
from synthesis.certificate.quick import quickly_proved
from synthesis.loop.loop import Loop
from synthesis.loop.motion import one_sample_later, rates, time_derivative
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials.definite import sign_on_box
from synthesis.polynomials.enclosure import PolynomialMatrix, block, constant, identity, variable
from synthesis.polynomials.half_spaces import corners_of
from synthesis.polynomials.rational import decimal

DEPTH = 14  # halvings of a cell before a proof gives up
MOST_REGIONS = 400  # open or done, for one claim on one cell
FEW = 8  # pieces that float64 left: more of them say that it is tight, and balls would take long
LESS = 8  # times fewer, for every parameter but one, on a cell that the border of the set cuts: each costs more
ORDER = 8  # total degree of the inequalities that is kept; products of exponentials have twice that, of no weight


@dataclass(frozen=True)
class Names:
    """The signals of a loop in order; the outputs of an observer's error are its states, and are not named again.

    Of a feedback loop they are the plant's states, outputs and inputs (`synthesis.loop.feedback`).
    """

    states: tuple[str, ...]
    disturbances: tuple[str, ...]
    outputs: tuple[str, ...] = ()

    @property
    def errors(self) -> tuple[str, ...]:
        """The rows of C."""
        return self.outputs or self.states


@dataclass(frozen=True)
class Outcome:
    """Proved on the whole range and rate box; or the inequality that fails and the scaled place (u, r) where it does."""

    proved: bool
    inequality: str = ""
    place: tuple[fmpq, ...] = ()


class Balls:
    """Ball arithmetic for the inequalities."""

    def eye(self, size: int, like: Any) -> PolynomialMatrix:
        """The unit matrix."""
        return identity(size, like.variables)

    def known(self, rows: Any, like: Any) -> PolynomialMatrix:
        """A matrix of rationals."""
        return constant(rows, like.variables).balls()

    def block(self, rows: Any) -> PolynomialMatrix:
        """A symmetric block matrix."""
        return block(rows)

    def trace(self, matrix: PolynomialMatrix) -> PolynomialMatrix:
        """The sum of the diagonal, 1 x 1."""
        terms = {k: arb_mat([[sum((m[i, i] for i in range(m.nrows())), arb(0))]]) for k, m in matrix.terms.items()}
        return PolynomialMatrix(terms, (1, 1), matrix.variables)

    def exp(self, exponent: Any) -> arb:
        """e^x."""
        return arb(exponent).exp()

    def cos(self, angle: Any) -> arb:
        """The cosine."""
        return arb(angle).cos()


@dataclass(frozen=True)
class _Task:
    """One claim as it is proved: `later` is dP/dt or P one sample later, in (u, r)."""

    question: Question
    time: Time
    P: PolynomialMatrix
    later: PolynomialMatrix
    dual: bool


@dataclass(frozen=True)
class Verifier:
    """Proves claims about one loop; what the loop is on a cell is worked out once and shared by all claims."""

    loop: Loop
    names: Names
    most_regions: int = MOST_REGIONS
    balls: Balls = field(default_factory=Balls)
    boxes: dict[str, System | None] = field(default_factory=dict, repr=False, compare=False)

    def prove(self, claim: Claim, dual: bool = False) -> Outcome:
        """Every inequality of the claim on every cell.

        In the dual form V = e'P^-1 e, and A P + P A' - dP/dt takes the place of A'P + P A + dP/dt.
        """
        time: Time = "continuous" if claim.kind in ERROR_EQUATION else "discrete"
        plant = self.loop.plant
        axes, count = plant.axes, len(plant.axes)
        P = claim.P.in_variables(2 * count)
        one = constant(fmpq_mat([[1]]), 2 * count)
        period = self.loop.sample_time if time == "discrete" else None
        u = [variable(i, 2 * count) for i in range(2 * count)]  # and r
        jump = None if period is None else lambda i: (u[count + i] - u[i]) * (1 / period)
        speeds = rates(axes, P, one, lambda i: u[count + i], lambda x: x, jump)
        later = time_derivative(P, speeds) if time == "continuous" else one_sample_later(P, speeds, period)
        if dual:
            later = -later
        question = self.question(claim)
        task, ones = _Task(question, time, P, later, dual), (fmpq(1),) * count
        if plant.half_spaces:  # corners of the set are where most claims about it fail
            broken = self._fails_in_a_corner([Region.between(tuple(-x for x in ones), ones)], task)
            if broken is not None:
                return broken
        done_at_once, left = quickly_proved(self.loop, question, time, P, speeds, dual, self.boxes)
        for number, cell in enumerate(self.loop.cells()):
            broken = None if done_at_once[number] else self._broken(cell, task, left.get(number, []))
            if broken is not None:
                return broken
        return Outcome(True)

    def _broken(self, cell: Region, task: _Task, pieces: list[Region]) -> Outcome | None:
        """Where the claim fails on a cell, or where its proof gives up; None if it is proved there.

        `pieces` are what float64 left of the cell, where it is known: they are taken if the whole cell decides nothing.
        """
        plant, P = self.loop.plant, task.P
        count, discrete = cell.parameters, task.time == "discrete"
        broken = self._fails_in_a_corner([cell], task) if count > 1 else None
        if broken is not None:
            return broken
        waiting, done = [(cell, 0)], 0
        cut = any(not h.contains(cell.offset, cell.factor) for h in plant.half_spaces)
        bounded = sum(
            any(h.normal[i] for h in plant.half_spaces) for i in range(count)
        )  # by the border: the others are as cheap
        most = self.most_regions // LESS ** (bounded - 1) if cut else self.most_regions
        while waiting:
            region, depth = waiting.pop()
            if cut and plant.misses(region.offset, region.factor):
                continue
            done += 1
            named = self._named(region, task)
            failed, undecided = (None, "matrix exponential") if named is None else _failure(named)
            if failed is not None and failed[1] is not None and plant.admits(region.point(failed[1])):
                return Outcome(False, failed[0], region.point(failed[1]))
            if undecided is None or (cut and named and positive_inside(named, region, plant.half_spaces, ORDER)):
                continue
            if depth == DEPTH * count or done > most:
                place = plant.place_in(region.offset, region.factor)
                if place is None:
                    continue  # outside, though of no single inequality
                return Outcome(False, undecided, (*place, *region.offset[count:]))
            if pieces:
                broken = self._fails_in_a_corner(pieces[:FEW], task)
                if broken is not None or len(pieces) > FEW:
                    place = plant.place_in(pieces[0].offset, pieces[0].factor) or pieces[0].offset[:count]
                    return broken or Outcome(False, undecided, (*place, *pieces[0].offset[count:]))
                waiting, pieces = [(piece, 0) for piece in pieces], []
                continue
            axis = _axis(depth, P, count if discrete else 0)
            waiting += [(half, depth + 1) for half in reversed(region.halves(axis))]
        return None

    def _named(self, region: Region, task: _Task) -> list[tuple[str, PolynomialMatrix]] | None:
        """All inequalities on a region; None where its system cannot be enclosed."""
        system = self.loop.system(region, task.time)
        if system is None:
            return None
        here = [m.affine(region.offset, region.factor).balls() for m in (task.P, task.later)]
        acting = replace(system, A=system.A.T) if task.dual else system
        return inequalities(task.question, acting, here[0], here[1], self.balls)

    def _fails_in_a_corner(self, cells: Sequence[Region], task: _Task) -> Outcome | None:
        """The corner of a cell (of its part in the set), and of the rates, where the claim certainly fails.

        Numbers are quicker than polynomials.
        """
        count = cells[0].parameters
        moving = [i for i in range(count) if task.later.degrees[count + i]]
        for cell in cells:
            corners = corners_of(cell.offset[:count], cell.factor[:count], self.loop.plant.half_spaces)
            for corner, signs in product(corners, product((-1, 1), repeat=len(moving))):
                rest = list(cell.offset[count:])
                for i, sign in zip(moving, signs, strict=True):
                    rest[i] += sign * cell.factor[count + i]
                point = Region((*corner, *rest), (fmpq(0),) * (2 * count))
                named = self._named(point, task)
                if named is None:
                    return None
                failed, _ = _failure(named)
                if failed is not None and failed[1] is not None:
                    return Outcome(False, failed[0], point.offset)
        return None

    def question(self, claim: Claim) -> Question:
        """The numbers of a claim, exact."""
        level, period = decimal(claim.level), self.loop.sample_time
        if claim.channel is None:
            centre = None if claim.centre is None else decimal(claim.centre)
            return Question(claim.kind, level, period=period, centre=centre)
        group = WITH_CHANNEL[claim.kind]
        inputs = self.names.disturbances if group == "disturbances" else self.names.states
        places, sizes = rows_of(inputs, claim.channel)
        W = fmpq_mat(len(inputs), len(places), [
            decimal(size) if i == place else fmpq(0)
            for i in range(len(inputs)) for place, size in zip(places, sizes, strict=True)
        ])  # fmt: skip
        channel = claim.channel
        Z = fmpq_mat([
            [1 / decimal(size) if name == error else fmpq(0) for name in self.names.errors]
            for error, size in zip(channel.errors, channel.error_sizes, strict=True)
        ])  # fmt: skip
        return Question(claim.kind, level, group, W, Z, period)


def _failure(named: Sequence[tuple[str, PolynomialMatrix]]) -> tuple[Any, str | None]:
    """(inequality, corner) that certainly fails, and the name of one that is not decided."""
    undecided = None
    for name, matrix in named:
        sign = sign_on_box(matrix.truncated(ORDER))
        if sign.fails_at is not None:
            return (name, sign.fails_at), name
        if not sign.positive:
            undecided = name
    return None, undecided


def _axis(depth: int, P: PolynomialMatrix, rates: int) -> int:
    """Which variable to halve: the parameters in turn, and of the first `rates` rates those that P is not affine in."""
    count = P.variables // 2
    axes = list(range(count)) + [count + i for i in range(rates) if P.degrees[i] > 1]
    return axes[depth % len(axes)]
