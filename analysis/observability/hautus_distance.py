r"""The function sigma(z) = smallest singular value of [A - z I; C], and its least value over a region of the plane.

sigma is Lipschitz with constant 1, so a value at the centre of a square bounds it on the square: subdivision gives a lower
bound. Upper bounds come from descent: with v the right singular vector at z, |(A - w I) v|^2 + |C v|^2 is least over w at the
Rayleigh quotient v*Av, or at its nearest point in the region, so that moving there never increases sigma.
"""

from __future__ import annotations

from enum import Enum

import numpy as np

from estimators.arrays import BoolArray, ComplexArray, FloatArray

DESCENTS = 200


class Region(Enum):
    """Closed sets of eigenvalues: all, those that do not decay in continuous time, those that do not in discrete time."""

    PLANE = "the plane"
    RIGHT = "the closed right half-plane"
    OUTSIDE = "outside the open unit disc"

    def nearest(self, z: ComplexArray) -> ComplexArray:
        """The nearest point of the region."""
        if self is Region.RIGHT:
            return np.asarray(np.maximum(z.real, 0.0) + 1j * z.imag)
        if self is Region.OUTSIDE:
            size = np.abs(z)
            turned = np.where(size > 0.0, z / np.where(size > 0.0, size, 1.0), 1.0)
            return np.asarray(np.where(size < 1.0, turned, z))
        return z

    def touches(self, centre: ComplexArray, half: float) -> BoolArray:
        """Whether squares of half width `half` may meet the region."""
        far = half * np.sqrt(2.0)
        if self is Region.RIGHT:
            return np.asarray(centre.real + half >= 0.0)
        if self is Region.OUTSIDE:
            return np.asarray(np.abs(centre) + far >= 1.0)
        return np.full(centre.shape, True)


def sigma(A: FloatArray, C: FloatArray, z: ComplexArray) -> FloatArray:
    """The smallest singular value of [A - z I; C] at points z (k,), as (k,)."""
    return np.asarray(np.linalg.svd(_stacked(A, C, z), compute_uv=False)[..., -1])


def least(A: FloatArray, C: FloatArray, region: Region, more: ComplexArray | None = None) -> tuple[float, complex]:
    """(sigma, z): the lowest of local minima, from eigenvalues, means of them and `more` points: an upper bound."""
    start = np.linalg.eigvals(A).astype(complex)
    further = np.zeros(0, complex) if more is None else more
    z = np.concatenate([start, [start.mean()], 0.5 * (start[:, None] + start).ravel(), further])
    return descend(A, C, region, z[z.imag >= 0.0])


def descend(A: FloatArray, C: FloatArray, region: Region, start: ComplexArray) -> tuple[float, complex]:
    """(sigma, z) where the best of the descents from points (k,), moved into the region, comes to rest."""
    # A real point is stationary along the imaginary axis, even where it is a saddle: the same points once more beside it.
    z = region.nearest(np.concatenate([start, start + 0.1j * np.linalg.norm(A, 2)]))
    best, place = np.inf, complex(z[0])
    for _ in range(DESCENTS):
        _, values, right = np.linalg.svd(_stacked(A, C, z), full_matrices=False)
        here = int(values[:, -1].argmin())
        gained = best - values[here, -1]
        if gained > 0.0:
            best, place = float(values[here, -1]), complex(z[here])
        if gained <= 1e-6 * best:
            break
        v = right[:, -1].conj()
        z = region.nearest(np.einsum("ki,ij,kj->k", v.conj(), A, v))
    return best, place


def below(
    A: FloatArray, C: FloatArray, region: Region, upper: float, gap: float, evaluations: int
) -> tuple[float, float, complex | None]:
    """(lower, upper, z): lower bound of sigma on the region by subdivision, within `gap` of the upper one if evaluations suffice.

    Beyond |z| = |A| + upper the value is above upper; conjugate points are alike. z is a better place if one was met.
    """
    reach = float(np.linalg.norm(A, 2)) + upper
    half, place = 0.5 * reach, None
    centre = np.array([-half + 1j * half, half + 1j * half])
    lower = 0.0
    while True:
        centre = centre[region.touches(centre, half)]
        evaluations -= len(centre)
        values = sigma(A, C, centre)
        inside = region.nearest(centre) == centre
        if inside.any() and values[inside].min() < upper:
            upper = float(values[inside].min())
            place = complex(centre[inside][values[inside].argmin()])
        bound = values - half * np.sqrt(2.0)
        open_ = bound < (1.0 - gap) * upper
        if not open_.any():
            return max(lower, (1.0 - gap) * upper), upper, place
        lower = max(lower, min(float(bound[open_].min()), (1.0 - gap) * upper))
        if evaluations < 4 * int(open_.sum()):
            return lower, upper, place
        half *= 0.5
        centre = (centre[open_][:, None] + half * np.array([-1 - 1j, -1 + 1j, 1 - 1j, 1 + 1j])).ravel()


def border_clear(A: FloatArray, discrete: bool, level: float, evaluations: int = 20_000) -> bool:
    """Whether sigma_min(A - z I) is surely above `level` at every z on the border of stability: the same bound along the line."""
    reach = np.pi if discrete else float(np.linalg.norm(A, 2)) + level
    half = 0.5 * reach
    centre, nothing = np.array([half]), np.zeros((0, A.shape[-1]))
    while evaluations > 0:
        evaluations -= len(centre)
        values = sigma(A, nothing, np.exp(1j * centre) if discrete else 1j * centre)
        if (values <= level).any():
            return False
        open_ = values - half <= level
        if not open_.any():
            return True
        half *= 0.5
        centre = (centre[open_][:, None] + half * np.array([-1.0, 1.0])).ravel()
    return False


def _stacked(A: FloatArray, C: FloatArray, z: ComplexArray) -> ComplexArray:
    shifted = A - z[:, None, None] * np.eye(A.shape[-1])
    return np.concatenate([shifted, np.broadcast_to(C, (len(z), *C.shape))], axis=-2)
