"""For one claim about a loop: the P that proves it with the largest margin, or the best level that some P proves.

The inequalities are those that `synthesis.certificate.verify` proves; here they are solved for by exchange: on a few places of
the table, then looked at on all, and where the proof itself fails that place joins them. Nothing that comes out is believed: P
is rounded, and the claim is proved for the rounded P, or it is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from estimators.arrays import FloatArray
from synthesis.certificate.claims import ERROR_EQUATION, GAINS, WITH_CHANNEL, Claim, ClaimChannel, rows_of
from synthesis.certificate.families import Asked, below_one, rate_places
from synthesis.certificate.frozen import frozen_level
from synthesis.certificate.inequalities import POSITIVE, Question, inequalities
from synthesis.certificate.rounding import LYAPUNOV_DIGITS, rounded_lyapunov
from synthesis.certificate.sampled_loop import SampledLoop
from synthesis.certificate.unknowns import in_scaled_states, middle_of
from synthesis.certificate.verify import MOST_REGIONS, Names, Outcome, Verifier
from synthesis.lmi.clarabel_backend import RawAnswer
from synthesis.lmi.exchange import Family, Memory, corners, exchange, recall, remember
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.samples import Samples, Sampling
from synthesis.lmi.scaling import error_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.loop import Loop
from synthesis.loop.motion import one_sample_later, rates, time_derivative
from synthesis.loop.system import Region, System, Time
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.matrix import MatrixPolynomial, variable
from synthesis.polynomials.rational import as_float

ANGLES = np.concatenate([[0.0], np.geomspace(1e-3, np.pi, 15)])  # per sample, where the size of a gain is looked for
ACCURACY = 1e-4  # relative, of a least gain or a largest margin: what holds is proved afterwards
STALLED = (1.0005, 1.002, 1.01, 1.05, 1.2)  # times the level that a stalled solve names
BENDS, PATIENCE = (
    2,
    6,
)  # P of a higher degree gives way between few places: levels rest for some rounds before they rise
PROOFS = 3  # of one wish: a place where one fails is solved for, too


@dataclass(frozen=True)
class Wish:
    """A claim to be solved for; `level` None: the least gain that can be had."""

    kind: str
    level: float | None
    channel: ClaimChannel | None = None
    centre: float | None = None


@dataclass(frozen=True)
class Search:
    """Searches claims about one loop; P has the given degree in the parameters, or one degree for each of them.

    `points` of every cell and parameter are where the inequalities are looked at (None: few); `size` is a guess of the levels of
    gains, by which they are divided (None: from frequency responses in the middle of the range). P is rounded to `digits`.
    """

    loop: Loop
    names: Names
    parameters: tuple[SchedulingParameter, ...]
    degree: int | tuple[int, ...] = 1
    settings: LmiSettings = field(default_factory=LmiSettings)
    points: int | None = None
    size: float | None = None
    digits: int = LYAPUNOV_DIGITS
    most_regions: int = MOST_REGIONS
    _least: dict[tuple[str, str], float] = field(default_factory=dict, repr=False, compare=False)
    _loops: dict[str, SampledLoop] = field(default_factory=dict, repr=False, compare=False)
    _memory: dict[str, Memory] = field(default_factory=dict, repr=False, compare=False)

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
            return np.ones(self.loop.states)
        A = middle_of(in_scaled_states(middle, np.ones(self.loop.states)).A)
        # Balancing looks at the diagonal, too; that of an update is near one whatever the units of the states are.
        return error_scale(A - np.eye(len(A)) if middle.time == "discrete" else A)

    def prove(self, wish: Wish) -> tuple[Claim | None, Outcome | None]:
        """A proved claim, or the outcome of the proof that failed (None if the solver found nothing to prove)."""
        asked = self._asked(wish)
        if asked is None:
            return None, None
        unit = 1.0 if wish.channel is None else self._output_unit(wish)
        outcome: Outcome | None = None
        for _ in range(PROOFS):
            found = self._solved(asked, wish)
            index = asked.problem.margin_index
            if found.infeasible or not np.isfinite(found.decisions).all():
                return None, outcome
            if index is not None and not found.decisions[index] > 0.0:
                return None, outcome
            coefficients = asked.P.substitute(found.decisions).coefficients[..., 0]
            P = rounded_lyapunov(coefficients * unit**2, self.scale, len(self.parameters), self.digits)
            claim = Claim(wish.kind, float(wish.level or 0.0), P, wish.channel, wish.centre)
            outcome = self.verifier.prove(claim)
            if outcome.proved:
                return claim, outcome
            place = np.array([as_float(x) for x in outcome.place])
            if not len(place) or not asked.add(outcome.inequality, place):
                break
        return None, outcome

    def largest_margin(self, wish: Wish) -> float:
        """The common margin of the inequalities as the solver sees it; -inf if it found none. Not proved."""
        asked = self._asked(wish)
        if asked is None or asked.problem.margin_index is None:
            return -np.inf
        margin = float(self._solved(asked, wish).decisions[asked.problem.margin_index])
        return margin if np.isfinite(margin) else -np.inf

    def least_gain(self, wish: Wish) -> float:
        """The least level of a gain, as the solver sees it on the points; inf if it found none. Not proved."""
        key = wish.kind, repr(wish.channel)
        if key not in self._least:
            asked = self._asked(replace(wish, level=None))
            found = None if asked is None else self._solved(asked, wish)
            square = np.nan if found is None or asked is None else float(asked.problem.cost @ found.decisions)
            named = float(np.sqrt(square)) * self._unit(wish) if 0.0 < square < np.inf else np.inf
            solved = found is not None and found.status.endswith("Solved")
            self._least[key] = named if solved else self._held_level(wish, named)
        return self._least[key]

    def frozen_level(self, wish: Wish) -> float:
        """What no level of a claim about an update is below, whatever P: that of parameters that stand still, in floats."""
        assert wish.channel is not None
        return frozen_level(self.loop, self._sizes(wish.channel, wish.kind), self._errors(wish), wish.kind)

    def _held_level(self, wish: Wish, named: float) -> float:
        """The first level above one that a stalled solve named where all inequalities have a margin; inf if none of a few has."""
        if wish.kind.startswith("sampled"):
            named = max(named if np.isfinite(named) else 0.0, self.frozen_level(wish))
        levels = (named * step for step in STALLED) if np.isfinite(named) else ()
        return next((x for x in levels if self.largest_margin(replace(wish, level=x)) > 0.0), np.inf)

    def _solved(self, asked: Asked, wish: Wish) -> RawAnswer:
        beyond = np.inf if wish.level is None or asked.problem.margin_index is None else 0.0  # no margin at all
        patience = PATIENCE if max(asked.P.degrees, default=0) > BENDS else 1
        settings = replace(self.settings, verify=False)
        found = exchange(asked.problem, asked.families, settings, ACCURACY, beyond, patience)
        if not found.infeasible and np.isfinite(found.decisions).all():
            remember(asked.families, found.decisions, self._memory.setdefault(wish.kind, {}))
        return found

    def _asked(self, wish: Wish) -> Asked | None:
        """The problem for P; None where a cell cannot be enclosed. With a level a common margin is maximised."""
        time: Time = "continuous" if wish.kind in ERROR_EQUATION else "discrete"
        sampled = self._sampled(time)
        if sampled.grid is None:
            return None
        problem = LmiProblem(self.parameters, wish.level is not None, half_spaces=self.loop.plant.half_spaces)
        size, count = self.loop.states, len(self.parameters)
        discrete = time == "discrete"
        P = problem.symmetric("P", size, self._degrees(discrete) or 0)
        square = problem.scalar("gamma^2") if wish.level is None else None
        if square is not None:
            problem.minimise("gamma^2")
        one = problem.constant(np.ones((1, 1)))
        period = 0.0 if self.loop.sample_time is None else as_float(self.loop.sample_time)
        u = [variable(i, 2 * count) for i in range(2 * count)]  # and r
        jump = (lambda i: (u[count + i] - u[i]) * (1.0 / period)) if discrete and period else None
        speeds = rates(self.loop.plant.axes, P, one, lambda i: u[count + i], as_float, jump)
        later = one_sample_later(P, speeds, period) if discrete else time_derivative(P, speeds)
        places = rate_places(sampled.grid, later, count)
        question = self._question(wish, period, None)

        last: dict[bool, tuple[tuple[bytes, bytes], dict[str, FloatArray]]] = {}

        def named(chosen: FloatArray, decisions: FloatArray | None, name: str = "") -> dict[str, FloatArray]:
            """All inequalities there: the families ask for them one by one. P itself needs nothing of the loop."""
            key = chosen.tobytes(), b"" if decisions is None else decisions.tobytes()
            if (decisions is not None) in last and last[decisions is not None][0] == key:
                return last[decisions is not None][1]

            def at(matrix: MatrixPolynomial) -> FloatArray:
                return (matrix if decisions is None else matrix.substitute(decisions)).at(chosen)

            if name == POSITIVE:
                return {name: at(P)}
            now, then = Samples(at(P)), Samples(at(later))
            level = None if square is None else Samples(at(square)[:1])  # a number, too, where decisions are known
            found = inequalities(replace(question, square=level), sampled.at(chosen[:, :count]), now, then, Sampling())
            out = {name: np.broadcast_to(m.values, (len(chosen), *m.values.shape[1:])) for name, m in found}
            last[decisions is not None] = key, out
            return out

        margin = problem.margin_index

        def family(name: str) -> Family:
            def rows(chosen: FloatArray) -> FloatArray:
                values = named(chosen, None, name)[name]
                values = np.pad(values, [*[(0, 0)] * 3, (0, problem.decisions + 1 - values.shape[-1])])
                values = 0.5 * (values + np.swapaxes(values, 1, 2))
                if margin is not None:
                    values[..., 1 + margin] -= np.eye(values.shape[1])
                return values

            def known(decisions: FloatArray, chosen: FloatArray) -> FloatArray:
                values = named(chosen, decisions, name)[name]
                values = values[..., 0] + values[..., 1:] @ decisions[: values.shape[-1] - 1]
                values = 0.5 * (values + np.swapaxes(values, 1, 2))
                return values if margin is None else values - decisions[margin] * np.eye(values.shape[1])

            return Family(name, places, rows, known, corners(places, count))

        families = [family(name) for name in named(places[:1], None)]
        if wish.level is not None and wish.channel is None:
            families.append(below_one(P, places, count))
        recall(families, self._memory.get(wish.kind, {}))
        return Asked(problem, P, families)

    def _sampled(self, time: Time) -> SampledLoop:
        if time not in self._loops:
            self._loops[time] = SampledLoop(self.loop, self.scale, time, self.points, self.verifier.boxes)
        return self._loops[time]

    def _degrees(self, discrete: bool) -> tuple[int, ...]:
        """Of P in every parameter: none in one that may jump, unless it does so between samples only."""
        given = (self.degree,) * len(self.parameters) if isinstance(self.degree, int) else self.degree
        return tuple(0 if p.may_jump and not discrete else k for p, k in zip(self.parameters, given, strict=True))

    def _question(self, wish: Wish, period: float, square: object) -> Question:
        """Errors in the unit of `_output_unit`, inputs in one that makes the least gain a number near one."""
        if wish.channel is None:
            return Question(wish.kind, float(wish.level or 0.0), period=period, centre=wish.centre)
        group, size = WITH_CHANNEL[wish.kind], self._unit(wish)
        Z, W = self._errors(wish) / self._output_unit(wish), self._sizes(wish.channel, wish.kind)
        level = None if wish.level is None else wish.level / size
        return Question(wish.kind, level, group, W * (self._output_unit(wish) / size), Z, period, square)

    def _errors(self, wish: Wish) -> FloatArray:
        assert wish.channel is not None
        errors = list(self.names.errors)
        chosen = np.eye(len(errors))[[errors.index(name) for name in wish.channel.errors]]
        return np.asarray(chosen / np.array(wish.channel.error_sizes)[:, None])

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
        period = 1.0 if self.loop.sample_time is None else as_float(self.loop.sample_time)
        root = np.sqrt(period) if wish.kind.startswith("sampled") and wish.kind not in GAINS else 1.0
        cells = list(self.loop.cells())
        region: Region = cells[len(cells) // 2]
        found = self.loop.system(region, "discrete" if wish.kind not in ERROR_EQUATION else "continuous")
        if found is None:
            return 1.0
        system: System = in_scaled_states(found, self.scale)
        group, W, Z = WITH_CHANNEL[wish.kind], self._sizes(wish.channel, wish.kind), self._errors(wish)
        A, B = middle_of(system.A), middle_of(system.B[group]) @ W
        ZC, ZD = Z @ middle_of(system.C), Z @ middle_of(system.D[group]) @ W
        if system.denominator is not None:
            below = float(middle_of(system.denominator)[0, 0])
            A, B = A / below, B / below
            ZC, ZD = (ZC / below, ZD / below) if system.shared else (ZC, ZD)
        if system.time == "discrete":
            points = np.exp(1j * ANGLES)
        else:
            points = 1j * np.concatenate([[0.0], np.linalg.norm(A, 2) * np.geomspace(1e-3, 10.0, len(ANGLES) - 1)])
        resolvent = points[:, None, None] * np.eye(len(A)) - A
        try:
            answer = ZC @ np.linalg.solve(resolvent, B[None].astype(complex)) + ZD
            size = float(np.linalg.norm(answer, 2, axis=(-2, -1)).max())
        except np.linalg.LinAlgError:
            size = 0.0
        step = float(np.linalg.norm(ZC @ B))
        return next((x / root for x in (size, step) if 0.0 < x < np.inf), 1.0)
