r"""The norms that a channel of a design may be measured in, and the inequalities of the two that are no L2 gain.

With V the Lyapunov function of the design (x'Q^-1 x of a feedback law, e'P e of an observer), g the level of the channel:

    H-infinity       energy of z below g^2 times the energy of d
    generalised H2   the largest |z| (Euclidean) below g times the root of the energy of d (Rotea 1993): V' < g |d|^2, |z|^2 < g V
    H2               energies of z after an impulse in each d, added up, below g^2: V' < -|z|^2/g, the sum of V after them below g

Energies are integrals over time. A law that runs once a sample holds d over it, and |z|^2 counts for its length T: there g is
1/sqrt(T) times what sums over samples give.

One V serves all channels. Several L2 gains weigh in it by 1/g each. Where other norms are among them, whose levels have other
units, V is that of the minimised channel, and every bounded one weighs as much as serves best: an unknown number of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from synthesis.lmi.problem import LmiProblem
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block

Norm = Literal["H-infinity", "generalised H2", "H2"]
NORMS: tuple[Norm, ...] = get_args(Norm)
CLAIMED: dict[Norm, str] = {  # as claims name them
    "H-infinity": "gain",
    "generalised H2": "energy to peak",
    "H2": "H2 norm",
}


@dataclass(frozen=True)
class ChannelSizes:
    """Name and norm of a channel, the degree of unknowns of its own, and its level: `inner` for d, `outer` for z, 1 x 1 each."""

    name: str
    norm: Norm
    degree: int | tuple[int, ...]
    inner: MatrixPolynomial
    outer: MatrixPolynomial


def compact_form(norms: Sequence[Norm]) -> bool:
    """Whether the square of the least level is minimised: of one channel, and where not all are L2 gains."""
    return len(norms) == 1 or any(norm != "H-infinity" for norm in norms)


def levels(
    problem: LmiProblem, name: str, bounded: bool, ratio: float | None, compact: bool
) -> tuple[MatrixPolynomial, MatrixPolynomial]:
    """What stands for a channel at its near end and at its far end, 1 x 1 each: 1 and g^2, w and w g^2, or g and g.

    `ratio` is the level in the units of the problem, None where it is minimised; w is the weight of a bounded channel in V.
    """
    objective = "gamma^2" if compact else "gamma"
    if ratio is None:
        found = problem.scalar(objective)
        problem.minimise(objective)
    else:
        found = problem.constant(np.array([[ratio**2 if compact else ratio]]))
    if not compact:
        return found, found
    near = problem.scalar(f"weight {name}") if bounded else problem.constant(np.ones((1, 1)))
    return near, found.scaled_by(near)


def per_sample(norm: Norm, sample_time: float) -> float:
    """A level over samples is this many times that in continuous time."""
    return 1.0 if norm == "H-infinity" else float(np.sqrt(sample_time))


def require_energy(
    problem: LmiProblem,
    channel: ChannelSizes,
    falling: MatrixPolynomial,
    force: MatrixPolynomial,
    seen: MatrixPolynomial,
    lyapunov: MatrixPolynomial,
    below: MatrixPolynomial,
    clock: float,
) -> None:
    """In continuous time: [falling, -force, -seen'; *, inner, 0; *, *, outer] > 0 would bound the L2 gain, with V of `lyapunov`.

    `force` (n, k) and `seen` (m, n); all but `lyapunov` are multiplied by the denominator `below`. Time is counted in units of
    1/`clock` s, which a level with a root of time in it feels.
    """
    root = float(np.sqrt(clock))
    outer = _sized(problem, channel.outer.scaled_by(below), seen.shape[0])
    if channel.norm == "generalised H2":
        inner = _sized(problem, channel.inner.scaled_by(below), force.shape[1])
        problem.require(f"stored energy {channel.name}", symmetric_block([[falling, -force], [None, inner]]))
        problem.require(
            f"peak {channel.name}", symmetric_block([[lyapunov.scaled_by(below), seen.T * root], [None, outer]])
        )
        return
    problem.require(f"observed energy {channel.name}", symmetric_block([[falling, -seen.T], [None, outer]]))
    after = after_impulses(problem, channel, force.shape[1])
    stored = lyapunov.scaled_by(below, 2)
    problem.require(f"impulses {channel.name}", symmetric_block([[after, force.T * root], [None, stored]]))


def require_sampled_energy(
    problem: LmiProblem,
    channel: ChannelSizes,
    later: MatrixPolynomial,
    moved: MatrixPolynomial,
    now: MatrixPolynomial,
    force: MatrixPolynomial,
    seen: MatrixPolynomial,
    through: MatrixPolynomial | None = None,
    over: Callable[[MatrixPolynomial], MatrixPolynomial] = lambda matrix: matrix,
) -> None:
    """V goes from `now` to `later` by `moved`; d adds `force` (n, k), and to z = `seen` `through` (m, k) at once.

    All of them are multiplied by one positive polynomial, and `over` multiplies by it.
    """
    outer = over(_sized(problem, channel.outer, seen.shape[0]))
    direct = None if through is None else through.T
    if channel.norm == "generalised H2":
        inner = over(_sized(problem, channel.inner, force.shape[1]))
        stored = symmetric_block([[later, moved, force], [None, now, None], [None, None, inner]])
        shown = symmetric_block([[now, None, seen.T], [None, inner, direct], [None, None, outer]])
        problem.require(f"stored energy {channel.name}", stored)
        problem.require(f"peak {channel.name}", shown)
        return
    observed = symmetric_block([[later, moved, None], [None, now, seen.T], [None, None, outer]])
    problem.require(f"observed energy {channel.name}", observed)
    after = after_impulses(problem, channel, force.shape[1])
    impulses = symmetric_block([[after, force.T, direct], [None, later, None], [None, None, outer]])
    problem.require(f"impulses {channel.name}", impulses)


def after_impulses(problem: LmiProblem, channel: ChannelSizes, inputs: int) -> MatrixPolynomial:
    """An unknown W (k, k) with tr W below the level, for what impulses leave in V."""
    W = problem.symmetric(f"W {channel.name}{problem.suffix}", inputs, channel.degree)
    rows = [problem.constant(np.eye(inputs)[i : i + 1]) for i in range(inputs)]
    total = -channel.inner
    for row in rows:
        total = total + row @ W @ row.T
    problem.require(f"H2 norm {channel.name}", -total)
    return W


def _sized(problem: LmiProblem, size: MatrixPolynomial, count: int) -> MatrixPolynomial:
    return problem.constant(np.eye(count)).scaled_by(size)
