"""Good guesses of where a frequency response peaks: only guesses, the proof of the level decides."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from estimators.arrays import BoolArray, FloatArray, IndexArray

AROUND = np.array([[-1.0], [0.0], [1.0]])  # of the parabolas through three points, in steps
FIRST, LAST, LEAP, STEPS = 0.4, 4e-5, 4.0, 9  # first and smallest step in half-widths, steps in one move, and moves
BESIDE = np.array([-0.7, 0.7])[:, None, None]  # half-widths from a resonance, where feedthrough may move a peak
SLOW = 0.03  # share of systems that the others do not wait for: the proof finds them


class Response(Protocol):
    """Gains of a stack of systems with the poles -decay +- j turn (k, g)."""

    @property
    def decay(self) -> FloatArray: ...  # noqa: D102
    @property
    def turn(self) -> FloatArray: ...  # noqa: D102

    def pick(self, index: IndexArray | BoolArray) -> Response:
        """Some of the systems."""

    def gain(self, frequency: FloatArray) -> FloatArray:
        """sigma_max at frequencies (j, g)."""


def resonances(parts: Response) -> FloatArray:
    """Where each mode would peak alone, (k, g): |lambda| sqrt(1 - 2 z^2) of a damping ratio z, its corner for a mode that
    does not."""
    square = (parts.turn - parts.decay) * (parts.turn + parts.decay)
    return np.asarray(np.sqrt(np.where(square > 0.0, square, parts.decay**2 + parts.turn**2)))


def distance(parts: Response, frequency: FloatArray) -> FloatArray:
    """From j omega (g,) to the nearest pole, (g,)."""
    return np.asarray(np.sqrt((parts.decay**2 + (parts.turn - frequency) ** 2).min(axis=0)))


def first_guess(parts: Response, direct: FloatArray, band: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The largest gain at the ends of the band (2, g) and near the tallest resonance or between two, and where: (g,), (g,).

    `direct` (g,) is the gain at infinite frequency.
    """
    endless = ~np.isfinite(band[1])
    ends = np.where(np.isfinite(band), band, 0.0)
    tops = np.sort(resonances(parts), axis=0)
    between = np.sqrt(np.concatenate([0.1 * tops[:1], tops]) * np.concatenate([tops, 10.0 * tops[-1:]]))
    beside = (parts.turn[None] + BESIDE * parts.decay).reshape(-1, tops.shape[1])
    frequency = np.concatenate([ends, np.clip(np.concatenate([tops, between, beside]), band[0], band[1])])
    gain = parts.gain(frequency)
    gain[1] = np.where(endless, direct, gain[1])
    frequency[1] = band[1]
    best, columns = gain.argmax(axis=0), np.arange(gain.shape[1])
    gain, at = gain[best, columns], frequency[best, columns]
    swinging = np.flatnonzero(best > 1)
    if len(swinging):
        finer, where = climbed(parts.pick(swinging), at[swinging], band[:, swinging])
        better = finer > gain[swinging] * (1.0 + 1e-13)  # a plateau keeps its simplest frequency
        gain[swinging[better]], at[swinging[better]] = finer[better], where[better]
    return gain, at


def climbed(parts: Response, frequency: FloatArray, band: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The largest gain on the way up from frequencies (g,) by parabolas through three points, and where."""
    width = distance(parts, frequency)
    h, best, at = FIRST * width, np.zeros(len(width)), frequency
    for _ in range(STEPS):
        low, middle, high = parts.gain(np.clip(frequency + AROUND * h, band[0], band[1]))
        better = middle > best
        best, at = np.where(better, middle, best), np.where(better, frequency, at)
        bend = low - 2.0 * middle + high
        move = np.where(bend < 0.0, 0.5 * (low - high) / np.where(bend < 0.0, bend, 1.0), np.sign(high - low) * LEAP)
        move = np.clip(move, -LEAP, LEAP)
        frequency = np.clip(frequency + h * move, band[0], band[1])
        if np.count_nonzero(np.abs(h * move) > LAST * width) <= SLOW * len(width):
            break
        h = np.clip(0.5 * np.abs(h * move), LAST * width, h * LEAP)
    last = parts.gain(frequency[None])[0]
    return np.maximum(last, best), np.where(last > best, frequency, at)
