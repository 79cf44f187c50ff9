r"""Proof that no gain of a stack of systems reaches a level, by Taylor bounds over intervals of the frequency.

With r = min(p, m) <= 2, x = omega^2 and the invariants of `analysis.norms.invariants`,

    h(x) = det(I - G^* G / gamma^2) = 1 - |G|_F^2 / gamma^2 + (sum of squared minors) / gamma^4
         = h_inf + sum_k c_k / (x + lambda_k^2).

With gamma above the gains at the ends of a band, h > 0 on all of it is the statement that gamma is never reached. On an
interval around x_0 the sum is its Taylor polynomial of degree two and a remainder below sum_k |c_k| |u_k|^4 / (1 - |u_k| d)
d^3 with u_k = 1/(x_0 + lambda_k^2) and d the largest distance: a peak of the gain is proved in a few intervals of the size of
its width. What rounding may do to h is subtracted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.norms.invariants import Invariants
from analysis.norms.modal import EPS
from analysis.norms.peak_search import distance, resonances
from estimators.arrays import BoolArray, FloatArray, IndexArray

CUTS = np.array([0.0, 0.05, 0.3, 0.7, 0.95, 1.0])  # of an interval that is not decided: finer at both ends
AROUND = np.array([-2.0, -0.45, 0.45, 2.0])  # half-widths of the peak
NEAR = 0.7**2  # of a distance in units of that to the pole, squared
DEPTH = 6
BLOCK = 3_072  # poles times intervals


@dataclass(frozen=True)
class Level:
    """h of a stack: constant (g,), residues (k, g) and what rounding does to the constant (g,) and the residues (k, g)."""

    parts: Invariants
    constant: FloatArray
    real: FloatArray
    imag: FloatArray
    rounding: FloatArray
    slack: FloatArray


def level_of(parts: Invariants, gamma: FloatArray) -> Level:
    """h at the level gamma (g,)."""
    first, second = gamma**-2.0, gamma**-4.0
    return Level(
        parts,
        1.0 - first * parts.constant[0] + second * parts.constant[1],
        second * parts.real[1] - first * parts.real[0],
        second * parts.imag[1] - first * parts.imag[0],
        16.0 * EPS * (1.0 + first * parts.constant[0] + second * parts.constant[1]),
        16.0 * len(parts.decay) * EPS * (first * parts.error[0] + second * parts.error[1]),
    )


def level_proof(
    parts: Invariants, gamma: FloatArray, peak: FloatArray, band: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """Whether gamma (g,) is proved not to be reached inside the band (2, g), and otherwise a frequency that speaks against
    it.

    gamma must lie above the gains at the ends of the band; `peak` (g,) is where the largest gain was found. Not proved is no
    proof of the contrary.
    """
    level = level_of(parts, gamma)
    far = np.clip(8.0 * np.sqrt((parts.decay**2 + parts.turn**2).max(axis=0)), band[0], band[1])
    ended, against = _tail(level, far)
    ended |= np.isfinite(band[1])
    proved = np.ones(len(gamma), bool)
    top = np.where(np.isfinite(peak), peak, far)
    marks = np.concatenate([resonances(parts), top[None], top + AROUND[:, None] * distance(parts, top)])
    marks = np.sort(np.concatenate([band[:1], np.clip(marks, band[0], far), far[None]]), axis=0)
    place, member = np.nonzero(marks[1:] > marks[:-1])
    low, high = marks[place, member], marks[place + 1, member]
    middle = 0.5 * (low + high)
    for end in (low, high):
        middle = np.where(end == top[member], end, middle)
    for depth in range(DEPTH):
        bound, here = _in_blocks(level, member, low, middle, high)
        open_ = ~(bound > 0.0)
        reached = open_ & ((here <= 0.0) | (depth == DEPTH - 1))  # the level is reached there, or nothing helps
        lowest = np.flatnonzero(reached)[
            np.argsort(-here[reached])
        ]  # of several points of a member the lowest comes last, and stays
        proved[member[lowest]] = False
        against[member[lowest]] = middle[lowest]
        open_ &= proved[member]
        if not open_.any():
            break
        low, high = low[open_], high[open_]
        member = np.tile(member[open_], len(CUTS) - 1)
        cuts = low + CUTS[:, None] * (high - low)
        cuts[-1] = high
        centre = 0.5 * (cuts[:-1] + cuts[1:])
        centre[0], centre[-1] = cuts[0], cuts[-1]
        low, middle, high = cuts[:-1].ravel(), centre.ravel(), cuts[1:].ravel()
    return proved & ended, against


def _in_blocks(
    level: Level, member: IndexArray, low: FloatArray, middle: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """`_lower_bound` of as many intervals at once as a cache holds."""
    step = max(1, BLOCK // len(level.real))
    if len(member) <= step:
        return _lower_bound(level, member, low, middle, high)
    parts = [slice(start, start + step) for start in range(0, len(member), step)]
    found = [_lower_bound(level, member[i], low[i], middle[i], high[i]) for i in parts]
    return np.concatenate([bound for bound, _ in found]), np.concatenate([here for _, here in found])


def _lower_bound(
    level: Level, member: IndexArray, low: FloatArray, middle: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A bound below h on intervals of the frequency around `middle`, and h there; rounding is subtracted from the first."""
    with np.errstate(all="ignore"):
        decay, turn = level.parts.decay.take(member, axis=1), level.parts.turn.take(member, axis=1)
        cr, ci = level.real.take(member, axis=1), level.imag.take(member, axis=1)
        # the ends are those of neighbours, rounded: a little more than the interval
        ulp = 4.0 * EPS * high * high
        left = (low - middle) * (low + middle) * (1.0 + 1e-9) - ulp
        right = (high - middle) * (high + middle) * (1.0 + 1e-9) + ulp
        reach = np.maximum(-left, right)
        # u = 1/(x + lambda^2) = ur + j ui
        ur = decay * decay - (turn - middle) * (turn + middle)
        ui = decay * turn * 2.0
        square = 1.0 / (ur * ur + ui * ui)
        weight, slack = np.sqrt(cr * cr + ci * ci), level.slack.take(member, axis=1)
        # a pole too near for a Taylor polynomial stands aside with the most that it can do
        aside = np.maximum(np.maximum(ur + left, -ur - right), 0.0)
        near = square * reach * reach > NEAR
        here = level.constant[member] + ((cr * ur - ci * ui) * square).sum(axis=0)
        most = (near * (weight + slack) / np.sqrt(aside * aside + ui * ui)).sum(axis=0)
        far = square * ~near
        ur *= far
        ui *= far
        size = np.sqrt(square)
        magnitude = weight * size
        cr, ci = cr * ur - ci * ui, cr * ui + ci * ur
        h0 = level.constant[member] + cr.sum(axis=0)
        cr, ci = cr * ur - ci * ui, cr * ui + ci * ur
        h1 = -cr.sum(axis=0)
        h2 = (cr * ur - ci * ui).sum(axis=0)
        bent = h2 - reach * (magnitude * far * size / (1.0 - np.minimum(size * reach, 0.9))).sum(axis=0)
        lost = (4.0 * slack * size + 16.0 * EPS * magnitude).sum(axis=0)
        ends = np.minimum((h1 + bent * left) * left, (h1 + bent * right) * right)
        vertex = -0.5 * h1 / bent
        inside = (bent > 0.0) & (vertex > left) & (vertex < right)
        least = np.minimum(np.where(inside, 0.5 * h1 * vertex, ends), 0.0)
        bound = h0 - most - level.rounding[member] - lost + least
    return np.where(np.isfinite(bound), bound, -1.0), here


def _tail(level: Level, far: FloatArray) -> tuple[BoolArray, FloatArray]:
    """h > 0 from the frequency `far` on: h >= h_inf + (sum c - sum |c lambda^2| / (x - |lambda|^2)) / x.

    Also the frequency where h may be lowest there.
    """
    with np.errstate(all="ignore"):
        x, square = far * far, level.parts.decay**2 + level.parts.turn**2
        size = np.sqrt(level.real**2 + level.imag**2)
        lost = (size * (square / (x - square) + 16.0 * EPS) + 2.0 * level.slack).sum(axis=0)
        first = level.real.sum(axis=0)
        proved = level.constant - level.rounding + np.minimum(first - lost, 0.0) / x > 0.0
        # h = h_inf + first / x + second / x^2 + ... has its minimum at x = -2 second / first
        decay, turn = level.parts.decay, level.parts.turn
        second = (2.0 * decay * turn * -level.imag - (decay * decay - turn * turn) * level.real).sum(axis=0)
        lowest = -2.0 * second / first
        return proved, np.where(lowest > x, np.sqrt(lowest), far)
