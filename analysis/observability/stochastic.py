r"""Stochastic observability: does a Kalman filter forget an initial covariance of which nothing is known?

P_0 = psi I with psi -> inf gives P_k = psi M_k + N_k + O(1/psi) (P2 (26)). Test 1: M_k = 0 after finitely many samples;
test 2: N_k stays bounded afterwards (P2 Lemma 1). Both follow here from one recursion, derived as follows. With
M = G G', Xi' Xi = R + C N C', Sigma = G' C' Xi^{-1}, W = (Sigma'Sigma)^+ and Pi = I - Sigma'Sigma W the innovation
covariance is Xi'(I + psi Sigma'Sigma) Xi, whose inverse is Xi^{-1} (Pi + W/psi + O(1/psi^2)) Xi^{-T}. Hence

    K    = lim P C'(C P C' + R)^{-1} = (G Sigma W + N C' Xi^{-1} Pi) Xi^{-T}
    M^+  = A G (I - Sigma W Sigma') G' A'                                      (P2 (A6), (A7) with phi_{k+1,0})
    N^+  = A [(I - K C) N (I - K C)' + K R K'] A' + Q

the last because the Joseph form is stationary at the optimal gain, so that the O(1/psi) error of K does not enter. It
holds before and after test 1; multiplied out it gives P2 (27) once Sigma = 0, and (A6) at the start.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.checks import as_stack, positive_definite, positive_semidefinite, square
from analysis.errors import AnalysisError
from analysis.observability.gramians import sampled_sequence
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.models.lpv import LpvModel

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, repr=False)
class StochasticObservability(Display):
    r"""Step by step for k = 0..K: predicted covariance psi M_k + N_k + O(1/psi) before sample k is used.

    M, N (K+1, n, n); `directions` (K+1,) the rank of M_k, by construction and not by a threshold on M. A direction of
    the state is taken as seen if its part in the normalised output exceeds `rank_tolerance`: this decides the look of
    both tests where data is nearly silent, so it is reported.
    """

    M: FloatArray
    N: FloatArray
    directions: np.ndarray[Any, np.dtype[np.int_]]
    rank_tolerance: float

    @property
    def largest_unknown(self) -> FloatArray:
        """Test 1 by step: lambda_max(M_k), (K+1,)."""
        return np.asarray(np.linalg.eigvalsh(self.M)[:, -1])

    @property
    def largest_known(self) -> FloatArray:
        """Test 2 by step: lambda_max(N_k), (K+1,)."""
        return np.asarray(np.linalg.eigvalsh(self.N)[:, -1])

    @property
    def samples_needed(self) -> int | None:
        """Samples after which M_k = 0 (test 1 met); None if not on this record."""
        met = np.flatnonzero(self.directions == 0)
        return int(met[0]) if len(met) else None


def stochastic_observability(
    A: ArrayLike, C: ArrayLike, Q: ArrayLike, R: ArrayLike, rank_tolerance: float = RANK_TOLERANCE
) -> StochasticObservability:
    """Both tests along A (K, n, n), C (K, m, n), with Q (n, n) or (K, n, n) >= 0 and R (m, m) or (K, m, m) > 0.

    Raises AnalysisError for shapes that do not fit, values that are not finite, a negative Q and a singular R.

    >>> import numpy as np
    >>> one = np.ones((3, 1, 1))
    >>> stochastic_observability(0.5 * one, one, [[1.0]], [[1.0]]).samples_needed
    1
    """
    A, C = square("A", A, 3), as_stack("C", C, 3)
    if A.ndim != 3 or C.ndim != 3 or len(A) != len(C) or C.shape[-1] != A.shape[-1] or not len(A):
        raise AnalysisError(f"A has the shape {A.shape} and C {C.shape}; give (K, n, n) and (K, m, n), K >= 1")
    if not 0.0 < rank_tolerance < 1.0:
        raise AnalysisError(f"rank_tolerance = {rank_tolerance} must lie between 0 and 1")
    count, n, m = len(A), A.shape[-1], C.shape[-2]
    values, vectors = np.linalg.eigh(_covariance("Q", positive_semidefinite("Q", Q), count, n))
    Q_root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]  # Q = Q_root Q_root', singular Q allowed
    R_root = np.linalg.cholesky(_covariance("R", positive_definite("R", R), count, m))
    M, N = np.zeros((count + 1, n, n)), np.zeros((count + 1, n, n))
    directions = np.zeros(count + 1, dtype=int)
    G, round_off = np.eye(n), np.zeros(n)
    T = np.zeros((n, n))  # N = T'T: with data that is nearly silent N spans more decades than double precision
    M[0], directions[0] = np.eye(n), n
    for k in range(count):
        with np.errstate(over="ignore", invalid="ignore"):
            gain, G_left = _limit_gain(G, T, C[k], R_root[k], rank_tolerance, round_off)
            # Errors of G obey the plant too: a direction that decays sinks below the round-off of one that does not.
            size = np.abs(G).max(axis=1, initial=0.0)
            round_off = np.abs(A[k]) @ (round_off + n * np.finfo(float).eps * size)
            G = A[k] @ G_left
            rest = A[k] @ (np.eye(n) - gain @ C[k])
            stacked = np.concatenate([T @ rest.T, R_root[k].T @ gain.T @ A[k].T, Q_root[k].T])
            if not np.isfinite(stacked).all():
                raise AnalysisError(_overflow(k + 1))
            T = np.asarray(np.linalg.qr(stacked, mode="r"))
            M[k + 1], N[k + 1], directions[k + 1] = G @ G.T, T.T @ T, G.shape[1]
        if not (np.isfinite(N[k + 1]).all() and np.isfinite(M[k + 1]).all()):
            raise AnalysisError(_overflow(k + 1))
    return StochasticObservability(M, N, directions, rank_tolerance)


def stochastic_observability_along(
    model: LpvModel,
    trajectory: ArrayLike,
    sample_time: float,
    Q: ArrayLike,
    R: ArrayLike,
    rank_tolerance: float = RANK_TOLERANCE,
) -> StochasticObservability:
    """Both tests along parameter values (K, p), each held over one sample (P2 (20)); parameters in the model's order.

    >>> import numpy as np
    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> stochastic_observability_along(model, np.linspace(10.0, 60.0, 20), 0.005, 1e-4 * np.eye(2), [[1e-2]]).samples_needed
    2
    """
    sequence = sampled_sequence(model, trajectory, sample_time)
    return stochastic_observability(sequence.A, sequence.C, Q, R, rank_tolerance)


def _limit_gain(
    G: FloatArray, T: FloatArray, C: FloatArray, R_root: FloatArray, tolerance: float, round_off: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(K, G X) of one measurement: X spans the directions of G that it did not see, an orthonormal kernel of Sigma'."""
    output = T @ C.T
    Xi = np.asarray(np.linalg.qr(np.concatenate([R_root.T, output]), mode="r"))  # Xi' Xi = R + C N C'
    normalised = np.linalg.solve(Xi.T, C)  # Xi^{-T} C
    seen = normalised @ G  # Sigma', (m, r)
    left, values, right = np.linalg.svd(seen, full_matrices=True)
    # Relative to what the columns of G could show at most, so that units of the state do not decide.
    possible = np.abs(normalised) @ np.abs(G)
    threshold = tolerance * possible.max(initial=0.0) + (np.abs(normalised) @ round_off).max()
    rank = int((values > threshold).sum())
    inverse = right[:rank].T / values[:rank] @ left[:, :rank].T  # Sigma W, the pseudo-inverse of Sigma'
    unseen_outputs = left[:, rank:] @ left[:, rank:].T  # Pi
    known = T.T @ np.linalg.solve(Xi.T, output.T).T  # N C' Xi^{-1}
    gain = np.linalg.solve(Xi, (G @ inverse + known @ unseen_outputs).T).T
    return gain, G @ right[rank:].T


def _overflow(sample: int) -> str:
    return (
        f"the covariance overflows at sample {sample}: a growing direction is not seen (not detectable); shorten the "
        "record or add a sensor"
    )


def _covariance(name: str, matrix: FloatArray, count: int, size: int) -> FloatArray:
    if matrix.shape[-2:] != (size, size) or matrix.ndim > 3 or (matrix.ndim == 3 and len(matrix) not in (1, count)):
        raise AnalysisError(f"{name} has the shape {matrix.shape}; give ({size}, {size}) or ({count}, {size}, {size})")
    return np.broadcast_to(matrix, (count, size, size))
