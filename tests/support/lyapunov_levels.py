"""Random Lyapunov functions, and the best level that each can prove: from the runtime's own matrices on a dense grid.

What is found on a grid is at least as good as what is true everywhere, so a level 2 % beyond it is false for this P.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import fmpq_mat
from scipy.linalg import solve_discrete_lyapunov

from estimators import GainSchedule
from synthesis.certificate.claims import Claim, ClaimChannel
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import decimal
from tests.support.random_plant import RandomPlant, few_digits
from tests.support.update_judge import Judge, Tally
from tests.support.update_run import probed

POINTS = 97


@dataclass(frozen=True)
class Places:
    """Parameters, those a sample later, and matrices of the update there: arrays over the first index."""

    p: np.ndarray
    later: np.ndarray
    received: np.ndarray
    lost: np.ndarray


def dense_places(plant: RandomPlant, schedule: GainSchedule) -> Places:
    """A grid of the range with the breakpoints in it, each with its two extreme motions and none."""
    low, high = float(plant.low), float(plant.high)
    grid = np.union1d(np.linspace(low, high, POINTS), schedule.breakpoints)
    fall, rise = (rate * plant.sample_time for rate in plant.rates)
    p = np.concatenate([grid, grid, grid])
    later = p + np.repeat([fall, 0.0, rise], len(grid))  # the proof lets p leave the range within the sample, too
    received, lost = (np.concatenate([probed(schedule, grid, gone)] * 3) for gone in (False, True))
    return Places(p, later, received, lost)


def random_lyapunov(plant: RandomPlant, places: Places, draw: np.random.Generator) -> PolynomialMatrix | None:
    """P0 + u P1 from discrete Lyapunov equations with random right-hand sides; None where it is not definite.

    Short decimals, in the states' own units: what is proved about it is about these very numbers.
    """
    size = np.array([plant.units["x1"], plant.units["x2"]])
    found = []
    count = len(places.p) // 3
    root = draw.normal(size=(2, 2))
    right = root @ root.T + 0.05 * np.eye(2)
    for k in (0, count // 2, count - 1):
        A = places.received[count + k] / size[:, None] * size
        found.append(solve_discrete_lyapunov(A.T / max(np.abs(np.linalg.eigvals(A)).max() * 1.03, 1e-3) * 0.99, right))
    P0, P1 = found[1], 0.5 * (found[2] - found[0]) * draw.choice([0.0, 0.5, 1.0])
    scale = np.abs(P0).max()
    terms = {}
    for power, matrix in ((0, P0), (1, P1)):
        rounded = [
            [few_digits(matrix[min(i, j), max(i, j)] / scale / size[i] / size[j], 6) for j in (0, 1)] for i in (0, 1)
        ]
        terms[power,] = fmpq_mat([[decimal(x) for x in row] for row in rounded])
    P = PolynomialMatrix(terms, (2, 2), 1)
    at = values(plant, P, places.later)
    return P if (np.linalg.eigvalsh(at * np.outer(size, size))[:, 0] > 1e-9).all() else None


def values(plant: RandomPlant, P: PolynomialMatrix, parameters: np.ndarray) -> np.ndarray:
    """P at parameters (g,), in floats."""
    u = (parameters - float(plant.centre)) / float(plant.half)
    total = np.zeros((len(u), 2, 2))
    for (power,), matrix in P.terms.items():
        total += np.array([[int(x.p) / int(x.q) for x in row] for row in matrix.tolist()]) * u[:, None, None] ** power
    return total


@dataclass(frozen=True)
class BestLevel:
    """A claim at the best level that its P allows on the grid; `better(share)` moves the level by a share of it."""

    claim: Claim
    better: Callable[[float], Claim]


def best_levels(plant: RandomPlant, schedule: GainSchedule, places: Places, P: PolynomialMatrix) -> list[BestLevel]:
    """Decay, gains and drop probability; what P does not prove at any level is left out."""
    size = np.array([plant.units["x1"], plant.units["x2"]])
    both = size[:, None] * size
    here, later = (values(plant, P, p) * both for p in (places.p, places.later))
    received, lost = (m / size[:, None] * size for m in (places.received, places.lost))
    fallen, coasted = (np.swapaxes(A, 1, 2) @ later @ A for A in (received, lost))
    found: list[BestLevel] = []
    kept = _largest(fallen, here)
    held = schedule.update == "held"
    if kept < 1.0:
        rate = -0.5 * np.log(kept) / plant.sample_time
        kind = "internal update" if held else "sampled error"
        found.append(_level(kind, rate, P, None, +1.0))
        gained = _largest(coasted - fallen, here - fallen)
        if gained > 1.0 / 0.97:
            found.append(_level("drop probability", 1.0 / gained, P, None, +1.0))
        channels = [("sampled gain", ClaimChannel({"process": plant.units["d1"], "noise": plant.units["d2"]}, ("x1",)))]
        channels += [("motion gain", ClaimChannel({"x2": 1.0}, ("x1",)))] if held else []
        for kind, channel in channels:
            found += _gain(plant, schedule, places, (kind, channel), (P, here, later, fallen, received))
    return found


def _gain(plant: RandomPlant, schedule: GainSchedule, places: Places, what: Any, known: Any) -> list[BestLevel]:
    (kind, channel), (P, here, later, fallen, received) = what, known
    size = np.array([plant.units["x1"], plant.units["x2"]])
    Z = np.diag([1.0, 0.0])
    weight = 1.5 * _largest(np.broadcast_to(Z, here.shape), here - fallen)
    stored = {"kind": kind, "channel": {"inputs": dict(channel.inputs), "errors": list(channel.errors)}, "level": 1.0}
    judge = Judge(plant, schedule, [], Tally())
    B = judge.input_matrix(stored, places.p) / size[:, None]
    top = (here - fallen) * weight - Z
    side = np.swapaxes(received, 1, 2) @ later @ B * weight
    corner = np.swapaxes(B, 1, 2) @ later @ B * weight
    square = np.linalg.eigvalsh(corner + np.swapaxes(side, 1, 2) @ np.linalg.solve(top, side)).max()
    if not square > 0.0:
        return []
    # z is x1 in units of its size, so the level is, too; P takes the factor.
    factor = few_digits(weight, 12) * plant.units["x1"] ** 2
    exact = P * decimal(factor)
    return [_level(kind, float(np.sqrt(square)) * plant.units["x1"], exact, channel, -1.0)]


def _level(kind: str, level: float, P: PolynomialMatrix, channel: ClaimChannel | None, sign: float) -> BestLevel:
    def better(share: float) -> Claim:
        return Claim(kind, few_digits(float(level * (1.0 + sign * share)), 12), P, channel)

    return BestLevel(better(0.0), better)


def _largest(above: np.ndarray, below: np.ndarray) -> float:
    """The largest generalised eigenvalue of above x = lambda below x, below > 0; infinite where it is not definite."""
    if not (np.linalg.eigvalsh(below)[:, 0] > 0.0).all():
        return np.inf
    root = np.linalg.inv(np.linalg.cholesky(below))
    return float(np.linalg.eigvalsh(root @ above @ np.swapaxes(root, 1, 2)).max())
