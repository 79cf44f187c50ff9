"""Points of the unit cube by index, without the points before them: what lets any worker make any chunk.

Every function takes the indices (m,) of the points wanted and gives (m, d) in [0, 1), the same whoever asks.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from estimators.arrays import FloatArray, IntArray

Integers = NDArray[np.uint64]
BITS = 30  # of a Sobol coordinate: what scipy's generator has, enough for 10^9 points
ROUNDS = 4  # of the Feistel network


def sobol_points(indices: IntArray, dimensions: int, seed: int) -> FloatArray:
    """Scrambled Sobol points (Owen 1998), the same as those of `scipy.stats.qmc.Sobol`.

    A scrambled Sobol sequence is affine over the two-element field in the bits of the index: x_n = x_0 XOR the sum over the
    set bits k of n of (x_(2^k) XOR x_0), so a few points, made once, give all others.
    """
    start, steps = _sobol_basis(dimensions, seed, max(1, int(indices.max(initial=0)).bit_length()))
    out = np.repeat(start[None], len(indices), axis=0)
    for k, step in enumerate(steps):
        out[(indices >> k) & 1 == 1] ^= step
    return np.asarray(out * 2.0**-BITS)


@lru_cache(maxsize=16)
def _sobol_basis(dimensions: int, seed: int, bits: int) -> tuple[Integers, list[Integers]]:
    """x_0 and x_(2^k) XOR x_0 for k < bits, as integers of BITS bits."""
    engine = qmc.Sobol(dimensions, rng=np.random.default_rng(seed), bits=BITS)

    def next_point() -> Integers:
        return np.asarray(np.rint(engine.random(1)[0] * 2.0**BITS), np.uint64)

    start, steps, place = next_point(), [], 1
    for k in range(bits):
        engine.fast_forward((1 << k) - place)
        steps.append(next_point() ^ start)
        place = (1 << k) + 1
    return start, steps


def latin_points(indices: IntArray, dimensions: int, samples: int, seed: int) -> FloatArray:
    """A Latin hypercube of `samples` points: every coordinate has one point in each of as many equal slices.

    The slices are permuted by a keyed bijection of 0 .. samples-1, so no permutation is held in memory.
    """
    out = np.empty((len(indices), dimensions))
    for column in range(dimensions):
        slices = permuted(indices.astype(np.uint64), samples, seed, column)
        out[:, column] = (slices + _uniform(indices.astype(np.uint64), seed, column)) / samples
    return out


def permuted(indices: Integers, count: int, seed: int, stream: int) -> FloatArray:
    """A pseudorandom permutation of 0 .. count-1 at some places: a Feistel network on a power of four, walked in cycles
    until the image falls below `count` (Black, Rogaway 2002)."""
    half = max(1, (int(count - 1).bit_length() + 1) // 2)
    out = _feistel(indices, half, seed, stream)
    outside = out >= count
    while outside.any():
        out[outside] = _feistel(out[outside], half, seed, stream)
        outside = out >= count
    return out.astype(float)


def _feistel(values: Integers, half: int, seed: int, stream: int) -> Integers:
    mask, shift = np.uint64((1 << half) - 1), np.uint64(half)
    left, right = values >> shift, values & mask
    for turn in range(ROUNDS):
        left, right = right, left ^ (_mixed(right, seed, stream * ROUNDS + turn) & mask)
    return (left << shift) | right


def _uniform(values: Integers, seed: int, stream: int) -> FloatArray:
    """Uniform numbers in [0, 1) from the upper 53 bits of the hash."""
    return np.asarray((_mixed(values, seed, (1 << 20) + stream) >> np.uint64(11)) * 2.0**-53)


def _mixed(values: Integers, seed: int, stream: int) -> Integers:
    """A hash of 64 bits of value, seed and stream: the finaliser of SplitMix64 (Steele, Lea, Flood 2014), twice."""
    key = np.random.SeedSequence([seed, stream]).generate_state(2, np.uint64)
    out = values.astype(np.uint64)
    for part in key:
        out = out + part
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            out = (out ^ (out >> np.uint64(shift))) * np.uint64(factor)
        out = out ^ (out >> np.uint64(31))
    return out
