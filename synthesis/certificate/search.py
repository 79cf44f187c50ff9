"""For one claim about a loop: the P that proves it with the largest margin, or the best level that some P proves.

The inequalities are those that `synthesis.certificate.verify` proves; here they are solved for, on a few points of every cell.
Nothing that comes out is believed: P is rounded, and the claim is proved for the rounded P, or it is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from estimators.arrays import FloatArray
from synthesis.certificate.claims import ERROR_EQUATION, WITH_CHANNEL, Claim, ClaimChannel, rows_of
from synthesis.certificate.inequalities import Question, inequalities
from synthesis.certificate.rounding import LYAPUNOV_DIGITS, rounded_lyapunov
from synthesis.certificate.unknowns import Unknowns, in_scaled_states
from synthesis.certificate.verify import MOST_REGIONS, Names, Outcome, Verifier
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult
from synthesis.lmi.scaling import error_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.loop.loop import Loop
from synthesis.loop.motion import one_sample_later, rates, time_derivative
from synthesis.loop.system import Region, System
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.matrix import variable

POINTS_PER_CELL = 5
ANGLES = np.concatenate([[0.0], np.geomspace(1e-3, np.pi, 15)])  # per sample, where the size of a gain is looked for


@dataclass(frozen=True)
class Wish:
    """A claim to be solved for; `level` None: the least gain that can be had."""

    kind: str
    level: float | None
    channel: ClaimChannel | None = None


@dataclass(frozen=True)
class Search:
    """Searches claims about one loop; P has the given degree in the parameters, or one degree for each of them.

    `points` of every cell and parameter are where the solver sees the inequalities; `size` is a guess of the levels of gains, by
    which they are divided (None: from frequency responses in the middle of the range). P is rounded to `digits`.
    """

    loop: Loop
    names: Names
    parameters: tuple[SchedulingParameter, ...]
    degree: int | tuple[int, ...] = 1
    settings: LmiSettings = field(default_factory=LmiSettings)
    points: int = POINTS_PER_CELL
    size: float | None = None
    digits: int = LYAPUNOV_DIGITS
    most_regions: int = MOST_REGIONS

    @cached_property
    def verifier(self) -> Verifier:
        """Of the same loop: cells are worked out once for both."""
        return Verifier(self.loop, self.names, self.most_regions)

    @cached_property
    def scale(self) -> FloatArray:
        """Diagonal balancing of the error matrix in the middle of the range."""
        cells = list(self.loop.cells())
        middle = self.loop.system(cells[len(cells) // 2], self.loop.time)
        if middle is None:
            return np.ones(self.loop.plant.states)
        A = _value(in_scaled_states(middle, np.ones(self.loop.plant.states)).A)
        # Balancing looks at the diagonal, too; that of an update is near one whatever the units of the states are.
        return error_scale(A - np.eye(len(A)) if middle.time == "discrete" else A)

    def prove(self, wish: Wish) -> tuple[Claim | None, Outcome | None]:
        """A proved claim, or the outcome of the proof that failed (None if the solver found nothing to prove)."""
        found = self.solve(wish)
        if found is None or not np.isfinite(found.decisions).all():
            return None, None
        unit = 1.0 if wish.channel is None else self._output_unit(wish)
        P = rounded_lyapunov(
            found.values["P"].coefficients[..., 0] * unit**2, self.scale, len(self.parameters), self.digits
        )
        claim = Claim(wish.kind, float(wish.level or 0.0), P, wish.channel)
        outcome = self.verifier.prove(claim)
        return (claim, outcome) if outcome.proved else (None, outcome)

    def least_gain(self, wish: Wish) -> float:
        """The least level of a gain, as the solver sees it on the points; inf if it found none. Not proved."""
        found = self.solve(replace(wish, level=None))
        if (
            found is None
            or found.objective is None
            or found.objective <= 0.0
            or not found.report.status.endswith("Solved")
        ):
            return np.inf
        return float(np.sqrt(found.objective)) * self._unit(wish)

    def solve(self, wish: Wish) -> LmiResult | None:
        """Solve for P; None where a cell cannot be enclosed. With a level a common margin is maximised."""
        problem = LmiProblem(self.parameters, maximise_margin=wish.level is not None)
        size, count = self.loop.plant.states, len(self.parameters)
        discrete = wish.kind not in ERROR_EQUATION
        P = problem.symmetric("P", size, self._degrees(discrete) or 0)
        square = problem.scalar("gamma^2") if wish.level is None else None
        if square is not None:
            problem.minimise("gamma^2")
        elif wish.channel is None:
            problem.require("P < 1", problem.constant(np.eye(size)) - P, strict=False)
        one = problem.constant(np.ones((1, 1)))
        period = (
            int(self.loop.sample_time.p) / int(self.loop.sample_time.q) if discrete and self.loop.sample_time else 0.0
        )
        u = [variable(i, 2 * count) for i in range(2 * count)]  # and r
        jump = (lambda i: (u[count + i] - u[i]) * (1.0 / period)) if period else None
        speeds = rates(self.loop.plant.axes, P, one, lambda i: u[count + i], lambda x: int(x.p) / int(x.q), jump)
        later = one_sample_later(P, speeds, period) if discrete else time_derivative(P, speeds)
        question = self._question(wish, period, square)
        cells = list(self.loop.cells())
        for number, region in enumerate(cells):
            system = self.loop.system(region, "discrete" if discrete else "continuous")
            if system is None:
                return None
            offset, factor = (np.array([int(x.p) / int(x.q) for x in side]) for side in (region.offset, region.factor))
            here = [matrix.affine(offset, factor) for matrix in (P, later)]
            named = inequalities(question, in_scaled_states(system, self.scale), here[0], here[1], Unknowns())
            for name, matrix in named:
                problem.require_on(f"{name}, cell {number}", matrix, offset, factor)
        longest = max((len(points) - 1 for points in self.loop.breakpoints), default=1)
        settings = replace(self.settings, relaxation="grid", points=self.points * longest, verify=False)
        return solve(problem, settings)

    def _degrees(self, discrete: bool) -> tuple[int, ...]:
        """Of P in every parameter: none in one that may jump, unless it does so between samples only."""
        given = (self.degree,) * len(self.parameters) if isinstance(self.degree, int) else self.degree
        return tuple(0 if p.may_jump and not discrete else k for p, k in zip(self.parameters, given, strict=True))

    def _question(self, wish: Wish, period: float, square: object) -> Question:
        """Errors in the unit of `_output_unit`, inputs in one that makes the least gain a number near one."""
        if wish.channel is None:
            return Question(wish.kind, float(wish.level or 0.0), period=period)
        group, size = WITH_CHANNEL[wish.kind], self._unit(wish)
        Z, W = self._errors(wish) / self._output_unit(wish), self._sizes(wish.channel, wish.kind)
        level = None if wish.level is None else wish.level / size
        return Question(wish.kind, level, group, W * (self._output_unit(wish) / size), Z, period, square)

    def _errors(self, wish: Wish) -> FloatArray:
        assert wish.channel is not None
        errors = list(self.names.errors)
        return np.eye(len(errors))[[errors.index(name) for name in wish.channel.errors]]

    def _output_unit(self, wish: Wish) -> float:
        """The errors of the channel are numbers near one in it when the scaled states are."""
        region = next(iter(self.loop.cells()))
        found = self.loop.system(region, "discrete" if wish.kind not in ERROR_EQUATION else "continuous")
        if found is None:
            return 1.0
        C = in_scaled_states(found, self.scale).C.coefficients
        return float(np.abs(self._errors(wish) @ np.abs(C).sum(axis=tuple(range(C.ndim - 3)))[..., 0]).max()) or 1.0

    def _sizes(self, channel: ClaimChannel, kind: str) -> FloatArray:
        inputs: Sequence[str] = self.names.disturbances if WITH_CHANNEL[kind] == "disturbances" else self.names.states
        places, sizes = rows_of(inputs, channel)
        return np.asarray(np.eye(len(inputs))[:, places] * np.array(sizes))

    def _unit(self, wish: Wish) -> float:
        """The largest gain of the channel over a few frequencies in the middle of the range: the size of the answer.

        Not the static gain alone: noise of a position, say, leaves the velocity error of an integrator alone at rest.
        """
        assert wish.channel is not None
        if self.size is not None:
            return self.size
        cells = list(self.loop.cells())
        region: Region = cells[len(cells) // 2]
        found = self.loop.system(region, "discrete" if wish.kind not in ERROR_EQUATION else "continuous")
        if found is None:
            return 1.0
        system: System = in_scaled_states(found, self.scale)
        A, B = _value(system.A), _value(system.B[WITH_CHANNEL[wish.kind]]) @ self._sizes(wish.channel, wish.kind)
        ZC = self._errors(wish) @ _value(system.C)
        if system.denominator is not None:
            below = float(_value(system.denominator)[0, 0])
            A, B = A / below, B / below
        if system.time == "discrete":
            points = np.exp(1j * ANGLES)
        else:
            points = 1j * np.concatenate([[0.0], np.linalg.norm(A, 2) * np.geomspace(1e-3, 10.0, len(ANGLES) - 1)])
        resolvent = points[:, None, None] * np.eye(len(A)) - A
        try:
            answer = ZC @ np.linalg.solve(resolvent, B[None].astype(complex))
            size = float(np.linalg.norm(answer, 2, axis=(-2, -1)).max())
        except np.linalg.LinAlgError:
            size = 0.0
        step = float(np.linalg.norm(ZC @ B))
        return next((x for x in (size, step) if 0.0 < x < np.inf), 1.0)


def _value(matrix: object) -> FloatArray:
    """A known matrix polynomial in the middle of its region."""
    coefficients = matrix.coefficients  # type: ignore[attr-defined]
    return np.asarray(coefficients[(0,) * matrix.variables][..., 0])  # type: ignore[attr-defined]
