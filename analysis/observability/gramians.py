"""Gramians of sampled sequences: what a stretch of data says of the state, and what the noise reaches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.checks import as_stack, positive, square
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, repr=False)
class Gramians(Display):
    r"""Gramians as triangular factors R (..., n, n), gramian = R'R, so that small singular values keep their digits.

    `transition` (..., n, n) is phi from the first to behind the last sample of each window. Singular values, ranks and
    condition numbers depend on the units of the states: give `state_scale` (n,), typical sizes, to the functions that
    make them, and the gramian is that of the states divided by it.
    """

    factor: FloatArray
    transition: FloatArray

    @property
    def gramian(self) -> FloatArray:
        """R'R, (..., n, n)."""
        return np.swapaxes(self.factor, -1, -2) @ self.factor

    @property
    def singular_values(self) -> FloatArray:
        """Of the gramian, descending, (..., n): squares of those of the factor."""
        return np.asarray(np.linalg.svd(self.factor, compute_uv=False) ** 2)

    @property
    def condition(self) -> FloatArray:
        """Largest over smallest singular value of the gramian, (...); inf if singular."""
        values = np.linalg.svd(self.factor, compute_uv=False)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(values[..., -1] > 0.0, values[..., 0] / values[..., -1], np.inf)
        return np.asarray(ratio**2)

    def rank(self, relative_tolerance: float = 1e-12) -> np.ndarray[Any, np.dtype[np.int_]]:
        """Number of singular values of R above the tolerance times the largest, (...): numerical, so state the tolerance.

        The gramian itself has the squares: its tolerance is relative_tolerance squared.
        """
        if not 0.0 < relative_tolerance < 1.0:
            raise AnalysisError(f"relative_tolerance = {relative_tolerance} must lie between 0 and 1")
        values = np.linalg.svd(self.factor, compute_uv=False)
        return np.asarray((values > relative_tolerance * values[..., :1]).sum(axis=-1))


@dataclass(frozen=True)
class SampledSequence:
    """A model along a trajectory: A (K, n, n) and B (K, n, m) held over each sample, C (K, ny, n), E (K, n, nd) likewise."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    E: FloatArray
    sample_time: float


def sampled_sequence(model: LpvModel, trajectory: ArrayLike, sample_time: float) -> SampledSequence:
    """x_{k+1} = e^{A T} x_k + int e^{A s} ds [B u_k + E d_k] with the parameters of sample k held (P2 (20)).

    `trajectory` is (K, p), or (K,) for one parameter. Raises ModelError for values outside the model's range and
    AnalysisError for a sample time that is not positive.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> sampled_sequence(model, [10.0, 20.0, 30.0], 0.005).A.shape
    (3, 2, 2)
    """
    step = positive("sample_time [s]", sample_time)
    numeric = model.on(as_stack("trajectory", trajectory, ndim=1))
    inputs = numeric.B.shape[-1]
    transition, driven = zero_order_hold(numeric.A, np.concatenate([numeric.B, numeric.E], axis=-1), step)
    return SampledSequence(transition, driven[..., :inputs], numeric.C, driven[..., inputs:], step)


def sequence_observability(A: ArrayLike, C: ArrayLike, state_scale: ArrayLike | None = None) -> Gramians:
    r"""V(k1, k2) = sum_{k=k1}^{k2} phi_{k,k1}' C_k' C_k phi_{k,k1} over the whole sequence (P2 (A1)).

    A (..., K, n, n) and C (..., K, m, n), K = k2 - k1 + 1. Raises AnalysisError for shapes that do not fit.

    >>> import numpy as np
    >>> sequence_observability(np.full((2, 1, 1), 0.5), np.ones((2, 1, 1))).gramian.round(9).tolist()  # 1 + 1/4
    [[1.25]]
    """
    A, _ = _sequence(A, C)
    found = sliding_observability(A, C, A.shape[-3], state_scale)
    return Gramians(found.factor[..., 0, :, :], found.transition[..., 0, :, :])


def sliding_observability(A: ArrayLike, C: ArrayLike, window: int, state_scale: ArrayLike | None = None) -> Gramians:
    """V(k, k + window - 1) for every start: (..., K - window + 1, n, n), by doubling (log2(window) batched steps).

    >>> import numpy as np
    >>> sliding_observability(np.full((4, 1, 1), 0.5), np.ones((4, 1, 1)), window=2).gramian[:, 0, 0].round(9).tolist()
    [1.25, 1.25, 1.25]
    """
    A, C = _scaled(*_sequence(A, C), state_scale)
    count = A.shape[-3]
    if not 1 <= window <= count:
        raise AnalysisError(f"window = {window} samples does not fit a sequence of {count}; give 1 to {count}")
    power, length = _elements(A, C), 1
    out: Gramians | None = None
    covered = 0
    while True:
        if window & length:
            last = _cut(power, covered, count - window + 1)
            out = last if out is None else _join(_cut(out, 0, count - window + 1), last)
            covered += length
        if covered == window:
            break
        size = power.factor.shape[-3]
        power = _join(_cut(power, 0, size - length), _cut(power, length, size - length))
        length *= 2
    assert out is not None  # window >= 1 has a set bit
    return out


def growing_observability(A: ArrayLike, C: ArrayLike, state_scale: ArrayLike | None = None) -> Gramians:
    """V(0, k) for every k (P2 Fig. 1): (..., K, n, n), by a prefix scan of log2(K) batched steps.

    >>> import numpy as np
    >>> A, C = np.full((3, 1, 1), 0.5), np.ones((3, 1, 1))
    >>> growing_observability(A, C).gramian[:, 0, 0].round(9).tolist()  # 1, 1 + 1/4, 1 + 1/4 + 1/16
    [1.0, 1.25, 1.3125]
    """
    out = _elements(*_scaled(*_sequence(A, C), state_scale))
    count, distance = out.factor.shape[-3], 1
    while distance < count:
        later = _join(_cut(out, 0, count - distance), _cut(out, distance, count - distance))
        out = Gramians(
            np.concatenate([out.factor[..., :distance, :, :], later.factor], axis=-3),
            np.concatenate([out.transition[..., :distance, :, :], later.transition], axis=-3),
        )
        distance *= 2
    return out


def sequence_controllability(A: ArrayLike, G: ArrayLike, state_scale: ArrayLike | None = None) -> Gramians:
    r"""W(k1, k2-1) = sum_{k=k1}^{k2-1} phi_{k2,k+1} G_k G_k' phi_{k2,k+1}' (P2 (A2)); G (..., K, n, m).

    For a filter G_k is the factor of the process noise, Q_k = G_k G_k' (P2 prints B_k, which is the input).
    `transition` is phi_{k2,k1}'.

    >>> import numpy as np
    >>> sequence_controllability(np.full((2, 1, 1), 0.5), np.ones((2, 1, 1))).gramian.round(9).tolist()  # 1 + 1/4
    [[1.25]]
    """
    return sequence_observability(*_dual(A, G), _inverse(state_scale))


def sliding_controllability(A: ArrayLike, G: ArrayLike, window: int, state_scale: ArrayLike | None = None) -> Gramians:
    """W(k, k + window - 1) for every start, (..., K - window + 1, n, n); `transition` is transposed.

    >>> import numpy as np
    >>> sliding_controllability(np.full((4, 1, 1), 0.5), np.ones((4, 1, 1)), window=2).gramian[:, 0, 0].round(9).tolist()
    [1.25, 1.25, 1.25]
    """
    out = sliding_observability(*_dual(A, G), window, _inverse(state_scale))
    return Gramians(out.factor[..., ::-1, :, :], out.transition[..., ::-1, :, :])


def _sequence(A: ArrayLike, C: ArrayLike) -> tuple[FloatArray, FloatArray]:
    A, C = square("A", A, 3), as_stack("C", C, 3)
    if A.shape[-3] == 0 or C.shape[-3] != A.shape[-3] or C.shape[-1] != A.shape[-1]:
        raise AnalysisError(
            f"A has the shape {A.shape} and the output (or noise) matrices {C.shape}; give (..., K, n, n) and (..., K, m, n) "
            "with the same number of samples K >= 1"
        )
    try:
        lead = np.broadcast_shapes(A.shape[:-3], C.shape[:-3])
    except ValueError:
        raise AnalysisError(f"leading batch axes of A {A.shape} and C {C.shape} do not broadcast") from None
    return np.broadcast_to(A, (*lead, *A.shape[-3:])), np.broadcast_to(C, (*lead, *C.shape[-3:]))


def _dual(A: ArrayLike, G: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """The reversed transposed sequence, whose observability gramian is W."""
    A, C = _sequence(A, np.swapaxes(as_stack("G", G, 3), -1, -2))
    return np.swapaxes(A, -1, -2)[..., ::-1, :, :], C[..., ::-1, :, :]


def _scaled(A: FloatArray, C: FloatArray, state_scale: ArrayLike | None) -> tuple[FloatArray, FloatArray]:
    if state_scale is None:
        return A, C
    scale = as_stack("state_scale", state_scale, ndim=1)
    if scale.shape != A.shape[-1:] or not (scale > 0.0).all():
        raise AnalysisError(f"state_scale = {scale.tolist()} must be {A.shape[-1]} positive numbers, one a state")
    return A * scale / scale[:, None], C * scale


def _inverse(state_scale: ArrayLike | None) -> FloatArray | None:
    if state_scale is None:
        return None
    scale = as_stack("state_scale", state_scale, ndim=1)
    if not (scale > 0.0).all():
        raise AnalysisError(f"state_scale = {scale.tolist()} must be positive")
    return 1.0 / scale


def _elements(A: FloatArray, C: FloatArray) -> Gramians:
    """Windows of one sample."""
    n = A.shape[-1]
    padded = np.concatenate([C, np.zeros((*C.shape[:-2], n, n))], axis=-2)
    return Gramians(np.asarray(np.linalg.qr(padded, mode="r")), A)


def _join(first: Gramians, second: Gramians) -> Gramians:
    """V = V1 + phi1' V2 phi1 through the factors: R = qr [R1; R2 phi1]."""
    stacked = np.concatenate([first.factor, second.factor @ first.transition], axis=-2)
    return Gramians(np.asarray(np.linalg.qr(stacked, mode="r")), second.transition @ first.transition)


def _cut(windows: Gramians, start: int, length: int) -> Gramians:
    kept = slice(start, start + length)
    return Gramians(windows.factor[..., kept, :, :], windows.transition[..., kept, :, :])
