r"""H-infinity norms of stacks of systems with two states and min(p, m) <= 2 in real arithmetic, without eigenvalue problems.

With a(s) = s^2 - tau s + d, every entry of G and every 2 x 2 minor is (k a + y s + z)/a: with x = omega^2, delta = x - d

    |a|^2 = delta^2 + tau^2 x,    |k a + y s + z|^2 = (z - k delta)^2 + x (y - k tau)^2

and P(x) = |a|^2 det(gamma^2 I - G^* G) is a parabola. Above the gains at the ends of a band, gamma is reached inside if and
only if the vertex of P lies inside and P there is not positive; the gain at the vertex is the next gamma (superlinear,
[Dinkelbach1967]). tau and d are free of cancellation, and the parabola is written around d for resonances: damping ratios of
1e-8 cost no digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from analysis.norms.compensated import determinant, expanded
from analysis.norms.frequency_response import Systems
from analysis.norms.invariants import available, minors
from analysis.norms.modal import EPS
from estimators.arrays import BoolArray, FloatArray, IndexArray

ROUNDS = 16
TRIED = (0.3, 3.0)  # of the squared corner frequency, before the search
APART = 1e3
TRUSTED = 1e-5  # relative loss by cancellation from which on another formula is taken
Parabola: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]  # of 1, t, t^2; or k, y, z of k a + y s + z


@dataclass(frozen=True)
class Planar:
    """|a|^2, |N|_F^2 and the minors' squares as parabolas in t = x - centre = delta + rest; what rounding adds to N: (g,)."""

    centre: FloatArray
    rest: FloatArray
    below: Parabola
    trace: Parabola
    area: Parabola
    loss: FloatArray
    rate_loss: FloatArray

    def pick(self, index: IndexArray) -> Planar:
        """Some of the systems."""
        below, trace, area = (tuple(c[index] for c in part) for part in (self.below, self.trace, self.area))
        return Planar(self.centre[index], self.rest[index], below, trace, area, self.loss[index], self.rate_loss[index])  # type: ignore[arg-type]

    def gain(self, t: FloatArray) -> FloatArray:
        """sigma_max at t (g,); a pole gives inf."""
        with np.errstate(all="ignore"):
            below = _at(self.below, t)
            f, k = _at(self.trace, t) / below, _at(self.area, t) / below
            return np.asarray(np.sqrt(0.5 * (f + np.sqrt(np.maximum(f * f - 4.0 * k, 0.0)))))


def handles(systems: Systems) -> bool:
    """Whether this form is for systems of this size."""
    return systems.A.shape[-1] == 2 and available(*systems.D.shape[-2:])


def planar_peaks(
    systems: Systems, band: FloatArray, tolerance: float
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Norm, its frequency, an upper bound, and whether that is proved, over a band (2, g) of the continuous frequency.

    Poles on the boundary must have been sorted out; stable ones are not asked for.
    """
    form = _planar(systems)
    ends = band**2 - form.centre
    endless = ~np.isfinite(band[1])
    low, high = form.gain(ends[0]), form.gain(np.where(endless, 0.0, ends[1]))
    f, k = form.trace[2], form.area[2]
    high = np.where(endless, np.sqrt(0.5 * (f + np.sqrt(np.maximum(f * f - 4.0 * k, 0.0)))), high)
    gain, at = np.maximum(low, high), np.where(high > low, ends[1], ends[0])
    corner = np.abs(form.centre + form.rest)  # |d|
    # where |a|^2 is least, and around the corner frequency
    for first in (-0.5 * form.below[1], *(corner * factor - form.centre for factor in TRIED)):
        t = np.clip(first, ends[0], np.where(endless, np.finfo(float).max, ends[1]))
        found = form.gain(t)
        better = found > gain * (1.0 + 1e-13)  # a plateau keeps its simplest frequency
        gain, at = np.where(better, found, gain), np.where(better, t, at)
    proved = np.zeros(len(gain), bool)
    index = np.flatnonzero(gain > 0.0)
    for _ in range(ROUNDS):
        if not len(index):
            break
        part = form if len(index) == len(gain) else form.pick(index)
        vertex, product, clear, crossed = _level(part, gain[index] * (1.0 + tolerance), ends[:, index])
        proved[index[clear]] = True
        index = index[crossed]
        part = form.pick(index)
        tried = _inside(part, vertex[crossed], product[crossed], ends[:, index])
        found = np.stack([part.gain(t) for t in tried])
        best = found.argmax(axis=0)[None]
        found, t = np.take_along_axis(found, best, 0)[0], np.take_along_axis(tried, best, 0)[0]
        raised = found > gain[index]
        index = index[raised]
        gain[index], at[index] = found[raised], t[raised]
    frequency = np.sqrt(np.maximum(at + form.centre, 0.0))
    with np.errstate(all="ignore"):
        point = np.where(np.isfinite(at), at, 0.0)
        loss = np.where(
            np.isfinite(at),
            (form.loss + form.rate_loss * frequency) / np.sqrt(_at(form.trace, point)),
            form.rate_loss / np.sqrt(form.trace[2]),
        )
    upper = gain * (1.0 + tolerance) * (1.0 + loss)
    # ends of a band far below the centre of the parabola lose their digits in t
    for end in band:
        proved &= ~((end > 0.0) & np.isfinite(end) & (form.centre > APART * end * end))
    return gain, np.where(at == -form.centre, 0.0, frequency), upper, proved & (loss < TRUSTED)


def _inside(form: Planar, vertex: FloatArray, product: FloatArray, ends: FloatArray) -> FloatArray:
    """The vertex of P and the geometric and harmonic means of its roots x_1, x_2, which a level above a plateau at infinity
    needs."""
    x = vertex + form.centre
    square = np.maximum(product + form.centre * (2.0 * vertex + form.centre), 0.0)  # x_1 x_2
    means = np.stack([np.sqrt(square), square / np.where(x > 0.0, x, 1.0)]) - form.centre
    return np.concatenate([vertex[None], np.clip(means, ends[0], ends[1])])


def _level(form: Planar, gamma: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray]:
    """Vertex of P at a level, product of its roots, whether P > 0 on the band beyond rounding, and P <= 0 at a vertex inside."""
    square = gamma * gamma
    with np.errstate(all="ignore"):
        c0, c1, c2 = (square * (square * b - f) + k for b, f, k in zip(form.below, form.trace, form.area, strict=True))
        vertex = -0.5 * c1 / c2
        least = c0 + 0.5 * c1 * vertex
        inside = (c2 > 0.0) & (vertex > ends[0]) & (vertex < ends[1])
        v = np.abs(np.where(inside, vertex, 0.0))
        size = sum(
            level * (np.abs(part[0]) + v * (np.abs(part[1]) + v * np.abs(part[2])))
            for level, part in ((square * square, form.below), (square, form.trace), (1.0, form.area))
        )
    # with a negative c2 the ends, which are below the level, are the lowest points
    certain = np.where(np.isfinite(ends[1]), True, c2 > 0.0)
    return vertex, c0 / c2, certain & (~inside | (least > 64.0 * EPS * size)), inside & (least <= 0.0)


def _planar(systems: Systems) -> Planar:
    a11, a12, a21, a22 = np.ascontiguousarray(systems.A.reshape(-1, 4).T)
    B, C, D = (np.ascontiguousarray(np.moveaxis(M, 0, -1)) for M in (systems.B, systems.C, systems.D))
    p, m = D.shape[:2]
    tau, d = a11 + a22, determinant(a11, a12, a21, a22)
    # (A - tau I) B without cancellation: [[-a22, a12], [a21, -a11]] B
    b1, b2 = B
    moved = -a22 * b1 + a12 * b2, a21 * b1 - a11 * b2
    sizes = np.abs(a22 * b1) + np.abs(a12 * b2), np.abs(a21 * b1) + np.abs(a11 * b2)
    c1, c2 = C[:, 0, None], C[:, 1, None]
    first, zeroth = c1 * b1 + c2 * b2, c1 * moved[0] + c2 * moved[1]
    c1, c2 = np.abs(c1), np.abs(c2)
    rate_loss, loss = _length(c1 * np.abs(b1) + c2 * np.abs(b2)), _length(c1 * sizes[0] + c2 * sizes[1])
    entries = [(D[i, j], first[i, j], zeroth[i, j]) for i in range(p) for j in range(m)]
    areas: list[Parabola] = []
    if min(p, m) == 2:
        for a, b, c, e in minors(p, m):
            k, y, z = (tuple(entry[i] for entry in (entries[a], entries[b], entries[c], entries[e])) for i in range(3))
            rows = (a // m, c // m), (a % m, b % m)
            crossed = _det(C[rows[0][0]], C[rows[0][1]]) * _det(B[:, rows[1][0]], B[:, rows[1][1]])
            areas.append((_mix(k, k) * 0.5, _mix(k, y), _mix(k, z) + crossed))
    if systems.discrete:
        plus, minus, open_ = (expanded(a11, a12, a21, a22, *signs) for signs in ((1, 1), (1, -1), (-1, 0)))
        entries, areas = ([_mapped(item, plus, minus, open_) for item in part] for part in (entries, areas))
        tau, d = 2.0 * open_ / plus, minus / plus
        loss = 4.0 * (loss + rate_loss) / np.abs(plus)  # of the direct gain, which the others hold times d and tau
        loss, rate_loss = loss * (1.0 + np.abs(d)), loss * (1.0 + np.abs(tau))
    swinging = (d > 0.0) & (tau * tau < 2.0 * d)
    centre = np.where(swinging, d, 0.0)
    rest = np.where(swinging, 0.0, d)  # delta = t - rest
    below = rest * rest + tau * tau * centre, tau * tau - 2.0 * rest, np.ones_like(tau)
    trace, area = (_total(part, tau, rest, centre) for part in (entries, areas))
    direct = _length(D) if not systems.discrete else np.sqrt(trace[2])
    return Planar(
        centre,
        rest,
        below,
        trace,
        area,
        8.0 * EPS * (loss + direct * np.abs(d)),
        8.0 * EPS * (rate_loss + direct * np.abs(tau)),
    )


def _total(parts: list[Parabola], tau: FloatArray, rest: FloatArray, centre: FloatArray) -> Parabola:
    """Sum of (z - k delta)^2 + x (y - k tau)^2 over items (k, y, z), in t with delta = t - rest and x = t + centre."""
    zero = np.zeros_like(tau)
    c0, c1, c2 = zero, zero, zero
    for k, y, z in parts:
        shifted, rate = z + k * rest, y - k * tau
        rate = rate * rate
        c0, c1, c2 = c0 + shifted * shifted + centre * rate, c1 + rate - 2.0 * k * shifted, c2 + k * k
    return c0, c1, c2


def _mapped(item: Parabola, plus: FloatArray, minus: FloatArray, open_: FloatArray) -> Parabola:
    """(k, y, z) of z -> k a(z) + y z + z_0 after z = (1 + s)/(1 - s); plus, minus, open_ = a(-1), a(1), d - 1."""
    k, y, z = item
    ahead = (z - y) / plus
    return k + ahead, -2.0 * z / plus + ahead * (2.0 * open_ / plus), (z + y) / plus - ahead * (minus / plus)


def _mix(left: tuple[FloatArray, ...], right: tuple[FloatArray, ...]) -> FloatArray:
    """The part of det(left + right) of 2 x 2 matrices that is linear in both; twice the determinant for equal ones."""
    return np.asarray(left[0] * right[3] + left[3] * right[0] - left[1] * right[2] - left[2] * right[1])


def _det(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(first[0] * second[1] - first[1] * second[0])


def _length(M: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt((M * M).sum(axis=(0, 1))))


def _at(parabola: Parabola, t: FloatArray) -> FloatArray:
    return np.asarray(parabola[0] + t * (parabola[1] + t * parabola[2]))
