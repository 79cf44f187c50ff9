"""The loop at constant parameters, in floats on a grid: bounds of what can be claimed, and where to look. No proofs."""

from __future__ import annotations

import numpy as np
from flint import fmpq

from estimators.arrays import FloatArray
from synthesis.certificate.claims import GAINS, LARGER_IS_BETTER
from synthesis.certificate.poles import pole_levels
from synthesis.certificate.refute import grid
from synthesis.loop.loop import Loop
from synthesis.loop.system import Region, System
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import as_float

BISECTIONS = 40
POWERS = 60  # of the second moment's map
DOUBLINGS = 14


def frozen_level(loop: Loop, d: FloatArray, z: FloatArray, kind: str = "sampled gain") -> float:
    """The largest level of a claim about the update while the parameters stand still, for a channel as `frozen_gain` has it."""
    if kind in GAINS:
        return frozen_gain(loop, d, z)
    A, B, C, D = _channel(loop, d, z)
    X = B @ np.swapaxes(B, 1, 2)
    for _ in range(DOUBLINGS):  # sums of the gramian's series, the next twice as long: never above it
        with np.errstate(all="ignore"):
            X, A = X + A @ X @ np.swapaxes(A, 1, 2), A @ A
    shown = C @ X @ np.swapaxes(C, 1, 2) + D @ np.swapaxes(D, 1, 2)
    if loop.sample_time is None or not np.isfinite(shown).all():
        return 0.0
    squares = np.trace(shown, axis1=1, axis2=2) if kind.endswith("H2 norm") else np.linalg.eigvalsh(shown)[:, -1]
    return float(np.sqrt(squares.max(initial=0.0) / as_float(loop.sample_time)))


def frozen_gain(loop: Loop, d: FloatArray, z: FloatArray) -> float:
    """Largest gain from d w to z e over constant parameters and a grid of frequencies: a bound from below for the update.

    d (disturbances, w) and z (errors, rows of C) are those of a channel (`channel_matrices`): the gain of z (C e + D d w).

    A constant parameter is one of the admissible motions, and every frequency bounds the gain there from below. The disturbances
    are held over a sample, as in the claims.
    """
    A, B, C, D = _channel(loop, d, z)
    if not len(A):
        return 0.0
    angles = np.concatenate([[0.0], np.geomspace(1e-4, np.pi, 41)])
    resolvent = np.exp(1j * angles)[:, None, None, None] * np.eye(A.shape[-1]) - A
    response = C @ np.linalg.solve(resolvent, np.broadcast_to(B, (len(angles), *B.shape))) + D
    return float(np.linalg.norm(response, 2, axis=(-2, -1)).max())


def _channel(loop: Loop, d: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A, B d, z C, z D of the update on a grid."""
    n, m, systems = loop.states, len(z), _systems(loop, "discrete")
    A = np.array([_numbers(system.A) for system in systems]).reshape(-1, n, n)
    B, D = (np.array([_numbers(getattr(system, key)["disturbances"]) @ d for system in systems]) for key in "BD")
    C = np.array([z @ _numbers(system.C) for system in systems]).reshape(-1, m, n)
    return A, B.reshape(-1, n, d.shape[1]), C, z @ D if len(D) else D.reshape(0, m, d.shape[1])


def frozen_update(loop: Loop) -> tuple[FloatArray, FloatArray]:
    """A of the update (g, n, n) with and without a measurement, on a grid."""
    systems = _systems(loop, "discrete")
    return np.array([_numbers(system.A) for system in systems]), np.array([_numbers(s.coasting) for s in systems])


def slowest_decay(loop: Loop) -> float:
    """The least decay rate of the update over constant parameters, 1/s; not positive where one is unstable."""
    received = np.array([_numbers(system.A) for system in _systems(loop, "discrete")])
    if not len(received) or loop.sample_time is None:
        return 0.0
    radius = np.abs(np.linalg.eigvals(received)).max()
    return float(-np.log(max(radius, 1e-12)) / as_float(loop.sample_time))


def frozen_pole_level(loop: Loop, kind: str) -> float:
    """The worst level of a claim about the poles of the update (`synthesis.certificate.poles`); NaN without a place."""
    A = np.array([_numbers(system.A) for system in _systems(loop, "discrete")])
    if not len(A) or loop.sample_time is None:
        return float("nan")
    levels = pole_levels(kind, np.linalg.eigvals(A), as_float(loop.sample_time))
    return float(levels.min() if kind in LARGER_IS_BETTER else levels.max())


def critical_probability(loop: Loop) -> float:
    """The largest drop probability with a frozen second-moment radius below one everywhere on the grid."""
    received, lost = frozen_update(loop)
    if not len(received):
        return 0.0

    def stable(p: float) -> bool:
        return bool(second_moment_radius(received, lost, p).max() < 1.0)

    if not stable(0.0):
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def second_moment_radius(received: FloatArray, lost: FloatArray, p: float) -> FloatArray:
    """Spectral radii (g,) of X -> (1-p) A X A' + p A0 X A0', from matrices (g, n, n).

    Up to three states by eigenvalues. With more the matrix of the map has n^4 entries: powers of the map, which keeps positive
    semidefinite X so, grow like the radius.
    """
    n = received.shape[-1]
    if n <= 3:
        squares = [np.einsum("gij,gkl->gikjl", m, m).reshape(len(m), n * n, n * n) for m in (received, lost)]
        return np.asarray(np.abs(np.linalg.eigvals((1.0 - p) * squares[0] + p * squares[1])).max(axis=-1))
    X = np.broadcast_to(np.eye(n), received.shape)
    growth = np.ones(len(received))
    for _ in range(POWERS):
        X = (1.0 - p) * received @ X @ np.swapaxes(received, 1, 2) + p * lost @ X @ np.swapaxes(lost, 1, 2)
        growth = np.trace(X, axis1=1, axis2=2)
        X = X / np.maximum(growth, np.finfo(float).tiny)[:, None, None]
    return growth


def _systems(loop: Loop, time: str) -> list[System]:
    found = []
    for point in dict.fromkeys(grid(loop)):
        system = loop.system(Region((*point, *(fmpq(0),) * len(point)), (fmpq(0),) * (2 * len(point))), time)  # type: ignore[arg-type]
        if system is not None:
            found.append(system)
    return found


def _numbers(matrix: PolynomialMatrix) -> FloatArray:
    entries = matrix.terms.get((0,) * matrix.variables)
    if entries is None:
        return np.zeros(matrix.shape)
    return np.array([float(x.mid()) for x in entries.entries()]).reshape(matrix.shape)
