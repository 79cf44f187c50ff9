r"""Where the largest gain of a system crosses a level: the imaginary eigenvalues of a Hamiltonian matrix.

With R = gamma^2 I - D'D > 0, gamma is a singular value of G(j omega) if and only if j omega is an eigenvalue of

    H(gamma) = [[A + B R^-1 D'C,            gamma B R^-1 B'       ],
                [-C'(I + D R^-1 D')C/gamma,  -(A + B R^-1 D'C)'   ]]

(Boyd, Balakrishnan, Kabamba 1989; the factors gamma are a similarity that balances the blocks). A discrete system is mapped
to a continuous one of the same norm by z = (1 + s)/(1 - s), which needs no inverse of A: a singular A (a pole at the origin)
is as good as any other.
"""

from __future__ import annotations

import numpy as np

from analysis.norms.frequency_response import Systems, largest_gain
from estimators.arrays import ComplexArray, FloatArray

# How near to the imaginary axis an eigenvalue must be to be looked at: far above rounding. Each one is then decided by
# evaluating the gain there, so a generous number costs time and no accuracy.
NEAR_ITSELF = 1e-5
NEAR_LARGEST = 1e-9


def hamiltonian(systems: Systems, gamma: FloatArray) -> FloatArray:
    """H(gamma) (g, 2n, 2n) of continuous systems, one level (g,) above sigma_max(D) for each."""
    n = systems.A.shape[-1]
    top, right, left = _blocks(systems, gamma)
    out = np.empty((len(top), 2 * n, 2 * n))
    out[:, :n, :n], out[:, :n, n:], out[:, n:, :n] = top, right, left
    out[:, n:, n:] = -np.swapaxes(top, -1, -2)
    return out


def _blocks(systems: Systems, gamma: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The upper left, upper right and lower left block of H(gamma)."""
    A, B, C, D = systems.A, systems.B, systems.C, systems.D
    n = A.shape[-1]
    level = np.asarray(gamma, float)[:, None, None]
    Ct, Bt = np.swapaxes(C, -1, -2), np.swapaxes(B, -1, -2)
    if not D.any():
        return A, (B / level) @ Bt, -(Ct / level) @ C
    Dt = np.swapaxes(D, -1, -2)
    solved = np.linalg.solve(level**2 * np.eye(D.shape[-1]) - Dt @ D, np.concatenate([Dt @ C, Bt], axis=-1))
    return A + B @ solved[..., :n], level * (B @ solved[..., n:]), -(Ct @ (C + D @ solved[..., :n])) / level


def near_axis(systems: Systems, gamma: FloatArray) -> FloatArray:
    """Frequencies (g, 2n) >= 0 of eigenvalues of H(gamma) on or near the imaginary axis, ascending; NaN fills up."""
    eigenvalues = np.linalg.eigvals(hamiltonian(systems, gamma))
    size = np.abs(eigenvalues)
    near = np.abs(eigenvalues.real) <= NEAR_ITSELF * size + NEAR_LARGEST * size.max(axis=-1, keepdims=True)
    return np.sort(np.where(near & (eigenvalues.imag >= 0.0), eigenvalues.imag, np.nan), axis=-1)


def between(frequencies: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The frequencies (g, k), ascending inside bands from low to high (g,), and points between neighbours, NaN where there is
    none.

    Besides the middle, which makes the convergence quadratic, some points near the ends: a level just above a plateau is
    crossed far away from the resonance that it has to find.
    """
    last = np.where(np.isfinite(high), high, np.nan)[:, None]
    frequencies = np.sort(np.concatenate([frequencies, last], axis=-1), axis=-1)  # NaN stays behind
    before = np.concatenate([low[:, None], frequencies[:, :-1]], axis=-1)
    inside = [before + share * (frequencies - before) for share in (0.02, 0.15, 0.5, 0.85, 0.98)]
    return np.concatenate([frequencies, *inside, np.sqrt(before * frequencies)], axis=-1)


def to_continuous(systems: Systems) -> Systems:
    """The continuous systems with the same gains, z = (1 + s)/(1 - s); A must have no eigenvalue -1 (stable ones do not).

    (A + I)^-1 (A - I), sqrt(2) (A + I)^-1 B, sqrt(2) C (A + I)^-1, D - C (A + I)^-1 B.
    """
    if not systems.discrete:
        return systems
    n = systems.A.shape[-1]
    eye = np.broadcast_to(np.eye(n), systems.A.shape)
    solved = np.linalg.solve(systems.A + eye, np.concatenate([systems.A - eye, systems.B, eye], axis=-1))
    m = systems.B.shape[-1]
    B, inverse = solved[..., n : n + m], solved[..., n + m :]
    return Systems(solved[..., :n], np.sqrt(2.0) * B, np.sqrt(2.0) * (systems.C @ inverse), systems.D - systems.C @ B)


def circle(frequency: FloatArray) -> ComplexArray:
    """The point z = (1 + j omega)/(1 - j omega) of the unit circle; infinite frequency is z = -1."""
    angle = 2.0 * np.arctan(frequency)
    return np.asarray(np.exp(1j * angle), np.complex128)


def gain_at(systems: Systems, frequency: FloatArray) -> FloatArray:
    """Largest gain at frequencies (g, k) of the continuous system, evaluated on the original one; NaN stays -inf."""
    known = np.isfinite(frequency)
    filled = np.where(known, frequency, 0.0)
    gain = largest_gain(systems, circle(filled) if systems.discrete else 1j * filled)
    return np.where(known, gain, -np.inf)
