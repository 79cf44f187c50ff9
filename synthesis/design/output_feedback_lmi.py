r"""Linear inequalities of full-order output feedback (Scherer, Gahinet, Chilali 1997; Apkarian, Adams 1998).

    xk' = Ak xk + Bk y,   u = Ck xk + Dk y,     V = xi'P xi,  xi = [x; xk],  P = [X N; N' *],  P^-1 = [Y M; M' *],  M N' = I - Y X

With Bh = N Bk + X B Dk, Ch = Ck M' + Dk C Y, Dh = Dk and Ah = N Ak M' + N Bk C Y + X B Ck M' + X (A + B Dk C) Y the congruence
with [Y I; M' 0] makes of the closed loop

    A_c = [A Y + B Ch, A + B Dh C; Ah, X A + Bh C],  B_c = [E + B Dh F; X E + Bh F],  C_c = [Cz Y + Dzu Ch, Cz + Dzu Dh C]
    D_c = Dzd + Dzu Dh F,   P_c = [Y I; I X],   dP/dt: [-dY/dt, -(X dY/dt + N dM'/dt)'; *, dX/dt]

The off-diagonal term is the only place where Ak would need the rate. It vanishes if Y stands still (with M = Y) or if X does
(with N = -X): so one of both depends on no moving parameter. A parameter whose rate bounds are zero counts as standing still.

    coupling       P_c > 0
    channel        [A_c + A_c' + dP/dt, B_c, C_c'; *, -g I, D_c'; *, *, -g I] < 0          L2 gain at most g
    decay          A_c + A_c' + dP/dt + 2 alpha P_c < 0
    fastest pole   [r P_c, A_c; A_c', r P_c] > 0                                           every frozen pole within a disc
    regions        as in `synthesis.design.pole_regions`, with V = P_c and M = A_c
    other norms    as in `synthesis.design.norms`, with V of P_c, where D_c = 0

A channel of bound g weighs in V by w/g: g is w g for its d and g/w for its z. Among L2 gains all w are one; with other norms,
whose V has other units, they are sought (`synthesis.design.output_feedback`).

The halves of Y and of X are written in coordinates of their own, with J for I (`synthesis.design.halves`). Ah enters the upper
right block of one inequality only where nothing else is asked for: then it is eliminated (projection lemma: both diagonal parts,
each with its own share of the rest, suffice) and worked out place by place from the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.generalised_plant import ChannelPlant
from synthesis.design.halves import Halves
from synthesis.design.norms import ChannelSizes, require_energy
from synthesis.design.pole_regions import PoleRegions, require_regions
from synthesis.lmi.problem import LmiProblem
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.half_spaces import HalfSpaces
from synthesis.polynomials.matrix import MatrixPolynomial, across, over, symmetric_block

Box = tuple[FloatArray, FloatArray]  # offset and factor
Still = Literal["X", "Y"]  # which of both does not move


@dataclass(frozen=True)
class Wanted:
    """What is asked of the closed loop, in the units of the frame: rates in its clock, bounds in its unit."""

    degree: int
    decay: float  # 0: none
    radius: float | None  # of the disc of the poles
    feedthrough: bool
    still: Still
    clock: float  # rates of parameters are given in 1/s
    regions: PoleRegions  # in 1/s
    reserve: float  # of these
    weights: tuple[float, ...]  # w of every channel

    def eliminated(self, channels: Sequence[ChannelPlant]) -> bool:
        """Whether there is one inequality in Ah only: that of one L2 gain."""
        alone = len(channels) == 1 and channels[0].channel.norm == "H-infinity"
        return alone and self.radius is None and not self.decay and not self.regions


def build(
    plants: Sequence[tuple[Box, Halves]],
    parameters: tuple[SchedulingParameter, ...],
    wanted: Wanted,
    levels: dict[FeedbackChannel, float | None],
    maximise_margin: bool = False,
    floor: float = 0.0,
    half_spaces: HalfSpaces = (),
) -> LmiProblem:
    """The problem in the coordinates of the halves; a level of None is the unknown `gamma` that is minimised.

    `plants` are those of the pieces of a model, each on its box (`LmiProblem.on_cell`).
    """
    problem = LmiProblem(parameters, maximise_margin, least_norm=floor > 0.0, floor=floor, half_spaces=half_spaces)
    first = plants[0][1]
    unknowns = _unknowns(problem, first, wanted)
    J = problem.constant(first.joint)
    problem.require("coupling", symmetric_block([[unknowns["Y"], J], [None, unknowns["X"]]]))
    level = [
        _sizes(part.channel, wanted, weight, _level(problem, levels[part.channel]))
        for part, weight in zip(first.filter.channels, wanted.weights, strict=True)
    ]
    for number, (box, plant) in enumerate(plants):
        problem.on_cell(number, box)
        _require(problem, _Loop(problem, plant, wanted, unknowns), plant, wanted, level)
    problem.on_cell()
    return problem


def _require(problem: LmiProblem, loop: _Loop, plant: Halves, wanted: Wanted, levels: Sequence[ChannelSizes]) -> None:
    """What is asked of one piece."""
    parts = [
        ({"Y": first, "X": second}, sizes)
        for first, second, sizes in zip(plant.regulator.channels, plant.filter.channels, levels, strict=True)
    ]
    if wanted.eliminated(plant.filter.channels):
        ((part, sizes),) = parts
        for half, word in (("Y", "regulator"), ("X", "filter")):
            block = loop.gain(part[half], sizes, loop.rate(half), loop.input(part, half), loop.output(part, half).T)
            problem.require(f"gain {part[half].channel.name}, {word}", -block)
        return
    rate = symmetric_block([[loop.rate("Y"), loop.cross], [None, loop.rate("X")]])
    if wanted.decay:
        problem.require(
            "decay rate", -(rate + loop.weighted(loop.coupling).scaled_by(loop.below) * (2.0 * wanted.decay))
        )
    if wanted.radius is not None:
        disc = loop.coupling.scaled_by(loop.below) * wanted.radius
        problem.require("fastest pole", symmetric_block([[disc, loop.closed_loop()], [None, disc]]))
    if wanted.regions:
        lyapunov = loop.coupling.scaled_by(loop.below)
        require_regions(problem, wanted.regions, wanted.reserve, wanted.clock, loop.closed_loop(), lyapunov)
    for part, sizes in parts:
        inputs = over(loop.input(part, "Y"), loop.input(part, "X"))
        outputs = over(loop.output(part, "Y").T, loop.output(part, "X").T)
        if sizes.norm == "H-infinity":
            problem.require(f"gain {sizes.name}", -loop.gain(part["X"], sizes, rate, inputs, outputs))
            continue
        lyapunov = loop.weighted(loop.coupling)
        require_energy(problem, sizes, -rate, inputs, outputs.T, lyapunov, loop.below, wanted.clock)


def _unknowns(problem: LmiProblem, plant: Halves, wanted: Wanted) -> dict[str, MatrixPolynomial]:
    """X, Y, Bh, Ch and, where they are, Dh and `cross`: what stands in the upper right of A_c + A_c'.

    That is Ah' and the known part that would only have to be cancelled.
    """
    n, m, k = len(plant.joint), plant.regulator.B.shape[-1], plant.filter.C.shape[-2]
    degree = {half: _degrees(problem, wanted, half) for half in "YX"}
    found = {half: problem.symmetric(half, n, degree[half]) for half in "XY"}
    found["Bh"] = problem.matrix("Bh", n, k, wanted.degree)
    found["Ch"] = problem.matrix("Ch", m, n, wanted.degree)
    if wanted.feedthrough:
        found["Dh"] = problem.matrix("Dh", m, k, wanted.degree)
    if not wanted.eliminated(plant.filter.channels):
        found["cross"] = problem.matrix("cross", n, n, wanted.degree)
    return found


def _level(problem: LmiProblem, level: float | None) -> MatrixPolynomial:
    if level is not None:
        return problem.constant(np.array([[level]]))
    unknown = problem.scalar("gamma")
    problem.minimise("gamma")
    return unknown


def _sizes(channel: FeedbackChannel, wanted: Wanted, weight: float, level: MatrixPolynomial) -> ChannelSizes:
    return ChannelSizes(channel.name, channel.norm, wanted.degree, level * weight, level * (1.0 / weight))


Pair = dict[str, ChannelPlant]  # a channel in the coordinates of both halves


class _Loop:
    """The closed loop after the congruence, affine in the unknowns, over `below`; rows of rates are weighted.

    `below` is the denominator of the plant, and its square where B Dh C is a product of two quotients.
    """

    def __init__(
        self, problem: LmiProblem, plant: Halves, wanted: Wanted, unknowns: dict[str, MatrixPolynomial]
    ) -> None:
        self.problem, self.clock = problem, wanted.clock
        self.A = {half: self._known(plant.half(half).A) for half in "YX"}
        self.B, self.C = self._known(plant.regulator.B), self._known(plant.filter.C)
        denominator = self._known(plant.filter.denominator)
        self.lift = denominator if wanted.feedthrough and any(denominator.degrees) else None
        self.below, self.joint = self._over(denominator), problem.constant(plant.joint)
        self.weights = {half: problem.constant(np.diag(plant.weights[half])) for half in "YX"}
        self.lifts = {half: problem.constant(np.diag(1.0 / plant.weights[half])) for half in "YX"}
        self.moved = {half: problem.here(problem.time_derivative(unknowns[half])) for half in "XY"}
        here = {name: problem.here(matrix) for name, matrix in unknowns.items()}
        self.unknown, self.Bh, self.Ch, self.Dh = here, here["Bh"], here["Ch"], here.get("Dh")
        self.cross = self._over(here["cross"]) if "cross" in here else None

    def _known(self, coefficients: FloatArray) -> MatrixPolynomial:
        return self.problem.here(self.problem.scaled(coefficients))

    @property
    def coupling(self) -> MatrixPolynomial:
        """[Y J; J' X]."""
        return symmetric_block([[self.unknown["Y"], self.joint], [None, self.unknown["X"]]])

    def weighted(self, whole: MatrixPolynomial) -> MatrixPolynomial:
        """A matrix of both halves with its rows and columns weighted."""
        n = self.joint.shape[0]
        zero = self.problem.constant(np.zeros((n, n)))
        both = over(across(self.weights["Y"], zero), across(zero, self.weights["X"]))
        return both @ whole @ both

    def closed(self, half: str) -> MatrixPolynomial:
        """A Y + B Ch or X A + Bh C."""
        if half == "Y":
            return self._over(self.A["Y"]) @ self.unknown["Y"] + self._over(self.B) @ self.Ch
        return self.unknown["X"] @ self._over(self.A["X"]) + self.Bh @ self._over(self.C)

    def rate(self, half: str) -> MatrixPolynomial:
        """One diagonal block of A_c + A_c' + dP/dt."""
        closed = self.closed(half)
        moved = self.moved[half].scaled_by(self.below) * (1.0 / self.clock)
        total = closed + closed.T + (moved * -1.0 if half == "Y" else moved)
        return self.weights[half] @ total @ self.weights[half]

    def closed_loop(self) -> MatrixPolynomial:
        """A_c."""
        assert self.cross is not None
        right = self._with_feedthrough(self.A["Y"] @ self.joint, self.B, self.C)
        cross = self.lifts["Y"] @ self.cross @ self.lifts["X"]
        return over(across(self.closed("Y"), right), across(cross.T - right.T, self.closed("X")))

    def input(self, part: Pair, half: str) -> MatrixPolynomial:
        """E + B Dh F or X E + Bh F."""
        E, F = self._known(part[half].E), self._known(part[half].F)
        if half == "Y":
            return self.weights[half] @ self._with_feedthrough(E, self.B, F)
        return self.weights[half] @ (self.unknown["X"] @ self._over(E) + self.Bh @ self._over(F))

    def output(self, part: Pair, half: str) -> MatrixPolynomial:
        """Cz Y + Dzu Ch or Cz + Dzu Dh C."""
        Cz, Dzu = self._known(part[half].Cz), self._known(part[half].Dzu)
        if half == "X":
            return self._with_feedthrough(Cz, Dzu, self.C) @ self.weights[half]
        return (self._over(Cz) @ self.unknown["Y"] + self._over(Dzu) @ self.Ch) @ self.weights[half]

    def gain(
        self, part: ChannelPlant, sizes: ChannelSizes, rate: MatrixPolynomial, inputs: MatrixPolynomial,
        outputs: MatrixPolynomial,
    ) -> MatrixPolynomial:  # fmt: skip
        """The block of a channel; `outputs` is C_c'."""
        direct = self._with_feedthrough(*(self._known(m) for m in (part.Dzd, part.Dzu, part.F)))
        w, z = (
            self.problem.constant(np.eye(count)).scaled_by(level.scaled_by(self.below))
            for count, level in ((direct.shape[1], sizes.inner), (direct.shape[0], sizes.outer))
        )
        return symmetric_block([[rate, inputs, outputs], [None, -w, direct.T], [None, None, -z]])

    def _with_feedthrough(
        self, own: MatrixPolynomial, left: MatrixPolynomial, right: MatrixPolynomial
    ) -> MatrixPolynomial:
        """own + left Dh right of three numerators."""
        return own if self.Dh is None else self._over(own) + left @ self.Dh @ right

    def _over(self, numerator: MatrixPolynomial) -> MatrixPolynomial:
        return numerator if self.lift is None else numerator.scaled_by(self.lift)


def _degrees(problem: LmiProblem, wanted: Wanted, name: str) -> tuple[int, ...]:
    """Of X or Y in every parameter: none in one that may jump; of the one that stands still none in one that moves."""

    def moves(p: SchedulingParameter) -> bool:
        return p.rate_minimum < 0.0 or p.rate_maximum > 0.0

    return tuple(0 if p.may_jump or (name == wanted.still and moves(p)) else wanted.degree for p in problem.parameters)
