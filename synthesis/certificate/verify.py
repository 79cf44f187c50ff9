r"""Prove claims about a loop without a solver: the inequalities of `synthesis.certificate.inequalities`, in ball arithmetic.

Read this together with `synthesis.polynomials.enclosure` and `.definite`. On every cell of the table the closed loop is a
polynomial (with an enclosed remainder where it holds a matrix exponential), so every inequality is a symmetric matrix polynomial
M(t, r), t the place in the cell, r the place of the rates between their bounds. All its Bernstein coefficients positive definite
proves M > 0 on the cell. A cell that decides nothing is halved. Every number is a ball of 128 bits around the exact one: a sign
counts only if it is certain, whatever processor computed it. Cells with room to spare are proved before, all at once, in float64
with a bound of everything that it rounds (`synthesis.certificate.quick`).

A failed proof says only that this P does not do. What the loop itself does is asked separately (`synthesis.certificate.refute`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from synthesis.certificate.claims import ERROR_EQUATION, WITH_CHANNEL, Claim, rows_of
from synthesis.certificate.inequalities import Question, inequalities
from synthesis.certificate.quick import quickly_proved
from synthesis.loop.loop import Loop
from synthesis.loop.motion import one_sample_later, rates, time_derivative
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials.definite import sign_on_box
from synthesis.polynomials.enclosure import PolynomialMatrix, block, constant, identity, variable
from synthesis.polynomials.rational import decimal

DEPTH = 14  # halvings of a cell before a proof gives up
MOST_REGIONS = 400  # open or done, for one claim on one cell
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
        axes, count = self.loop.plant.axes, len(self.loop.plant.axes)
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
        done_at_once = quickly_proved(self.loop, question, time, P, speeds, dual, self.boxes)
        for number, cell in enumerate(self.loop.cells()):
            if done_at_once[number]:
                continue
            broken = self._fails_in_a_corner(cell, question, time, P, later, dual) if count > 1 else None
            if broken is not None:
                return broken
            waiting, done = [(cell, 0)], 0
            while waiting:
                region, depth = waiting.pop()
                done += 1
                system = self.loop.system(region, time)
                failed, undecided = ("matrix exponential", None), None
                if system is not None:
                    here = [m.affine(region.offset, region.factor).balls() for m in (P, later)]
                    acting = replace(system, A=system.A.T) if dual else system
                    named = inequalities(question, acting, here[0], here[1], self.balls)
                    failed, undecided = _judge(named)
                    if failed is not None and failed[1] is not None:
                        return Outcome(False, failed[0], region.point(failed[1]))
                    if undecided is None:
                        continue
                if depth == DEPTH * count or done > self.most_regions:
                    return Outcome(False, undecided or "matrix exponential", region.offset)
                waiting += [
                    (half, depth + 1)
                    for half in reversed(region.halves(_axis(depth, P, count if time == "discrete" else 0)))
                ]
        return Outcome(True)

    def _fails_in_a_corner(
        self, cell: Region, question: Question, time: Time, P: PolynomialMatrix, later: PolynomialMatrix, dual: bool
    ) -> Outcome | None:
        """The corner of the cell, and of the rates, where the claim certainly fails: numbers are quicker than polynomials."""
        count = cell.parameters
        moving = [i for i in range(count) if later.degrees[count + i]]
        for signs in product((-1, 1), repeat=count + len(moving)):
            local = [*signs[:count], *(0,) * count]
            for i, sign in zip(moving, signs[count:], strict=True):
                local[count + i] = sign
            point = Region(cell.point(tuple(local)), (fmpq(0),) * (2 * count))
            system = self.loop.system(Region((*point.offset[:count], *(fmpq(0),) * count), point.factor), time)
            if system is None:
                return None
            here = [m.affine(point.offset, point.factor).balls() for m in (P, later)]
            acting = replace(system, A=system.A.T) if dual else system
            failed, _ = _judge(inequalities(question, acting, here[0], here[1], self.balls))
            if failed is not None and failed[1] is not None:
                return Outcome(False, failed[0], point.offset)
        return None

    def question(self, claim: Claim) -> Question:
        """The numbers of a claim, exact."""
        level, period = decimal(claim.level), self.loop.sample_time
        if claim.channel is None:
            return Question(claim.kind, level, period=period)
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


def _judge(named: Sequence[tuple[str, PolynomialMatrix]]) -> tuple[Any, str | None]:
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
