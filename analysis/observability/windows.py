"""Uniform detectability and stabilisability of a sampled sequence, over sliding windows of a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import positive
from analysis.errors import AnalysisError
from analysis.observability.gramians import Gramians, sliding_controllability, sliding_observability
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.lmi.result import Verdict

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

GOLDEN = 0.5 * (5.0**0.5 - 1.0)


@dataclass(frozen=True, repr=False)
class WindowTest(Display):
    r"""For which c_2 does |phi v| >= c_1 |v| imply v' V v >= c_2 v'v, window by window (P2 Definition 1)?

    `information` (..., windows) is the largest such c_2, inf where no direction lasts (|phi| < c_1); `uniform` (...) the
    smallest over the windows. CERTIFIED: above `required` (and above round-off) in every window of this record, with the
    constants stated; a statement on this record, not on every drive.
    """

    information: FloatArray
    required: float
    round_off: FloatArray
    contraction: float
    window: int
    horizon: int

    @property
    def uniform(self) -> FloatArray:
        """The smallest c_2 over the windows."""
        return np.asarray(self.information.min(axis=-1))

    @property
    def verdict(self) -> Verdict:
        """CERTIFIED, REFUTED or INCONCLUSIVE (the deciding window is within round-off of the requirement)."""
        if (self.information > self.required + self.round_off).all():
            return Verdict.CERTIFIED
        # A value that is zero to round-off means an unseen direction; against a required level above zero it refutes.
        level = max(self.required, 0.0)
        refuted = self.information + self.round_off < level if level > 0.0 else self.information <= self.round_off
        return Verdict.REFUTED if refuted.any() else Verdict.INCONCLUSIVE

    @property
    def worst(self) -> tuple[int, ...]:
        """Index of the deciding window."""
        return tuple(int(i) for i in np.unravel_index(int(np.argmin(self.information)), self.information.shape))


def uniform_detectability(
    A: ArrayLike,
    C: ArrayLike,
    window: int,
    horizon: int | None = None,
    contraction: float = 0.5,
    required: float = 0.0,
    state_scale: ArrayLike | None = None,
) -> WindowTest:
    """Definition 1 of P2 over every window of the record A (..., K, n, n), C (..., K, m, n).

    `horizon` is q of the definition (default: the window), `contraction` c_1 in (0, 1); directions that shrink by more
    need not be seen. The largest c_2 is exact by the S-lemma: max over tau >= 0 of lambda_min(V - tau (phi'phi - c_1^2 I)).
    Raises AnalysisError for constants outside their ranges and windows longer than the record.

    >>> import numpy as np
    >>> print(uniform_detectability(np.full((6, 1, 1), 1.1), np.ones((6, 1, 1)), window=2).verdict)
    certified
    """
    steps = _checked(window, horizon, contraction)
    seen = sliding_observability(A, C, window, state_scale)
    lasting = sliding_observability(A, C, steps, state_scale)
    return _test(seen, lasting, contraction, required, window, steps)


def uniform_stabilisability(
    A: ArrayLike,
    G: ArrayLike,
    window: int,
    horizon: int | None = None,
    contraction: float = 0.5,
    required: float = 0.0,
    state_scale: ArrayLike | None = None,
) -> WindowTest:
    """The dual statement with W of (A2) and G_k, Q_k = G_k G_k' (P2 Proposition 1), G (..., K, n, m).

    >>> import numpy as np
    >>> print(uniform_stabilisability(np.full((6, 1, 1), 1.1), np.ones((6, 1, 1)), window=2).verdict)
    certified
    """
    steps = _checked(window, horizon, contraction)
    reached = sliding_controllability(A, G, window, state_scale)
    lasting = sliding_controllability(A, G, steps, state_scale)
    # Windows end at the same sample: the dual definition looks back from k2.
    if steps < window:
        lasting = Gramians(lasting.factor[..., window - steps :, :, :], lasting.transition[..., window - steps :, :, :])
    elif steps > window:
        reached = Gramians(reached.factor[..., steps - window :, :, :], reached.transition[..., steps - window :, :, :])
    return _test(reached, lasting, contraction, required, window, steps)


def _checked(window: int, horizon: int | None, contraction: float) -> int:
    if not 0.0 < contraction < 1.0:
        raise AnalysisError(f"contraction = {contraction} must lie in (0, 1) (c_1 of the definition)")
    steps = window if horizon is None else horizon
    if steps < 1:
        raise AnalysisError(f"horizon = {steps} samples must be at least 1")
    return steps


def _test(
    gramians: Gramians, lasting: Gramians, contraction: float, required: float, window: int, horizon: int
) -> WindowTest:
    if required < 0.0 or not np.isfinite(required):
        raise AnalysisError(f"required = {required} must be a finite number >= 0")
    count = min(gramians.factor.shape[-3], lasting.factor.shape[-3])
    gramian = gramians.gramian[..., :count, :, :]
    phi = lasting.transition[..., :count, :, :]
    stretch = np.swapaxes(phi, -1, -2) @ phi - positive("contraction", contraction) ** 2 * np.eye(phi.shape[-1])
    size = np.linalg.norm(gramian, 2, axis=(-2, -1))
    information = _largest_bound(gramian, stretch)
    return WindowTest(information, required, 64 * np.finfo(float).eps * size, contraction, window, horizon)


def _largest_bound(gramian: FloatArray, stretch: FloatArray) -> FloatArray:
    """max over tau >= 0 of lambda_min(V - tau S): concave in tau, golden section on all windows at once."""
    values, vectors = np.linalg.eigh(stretch)
    lasting = values[..., -1] >= 0.0
    top = vectors[..., -1]
    along = np.einsum("...i,...ij,...j->...", top, gramian, top)
    # The optimum is >= 0 = the least that tau = 0 gives, and at most along - tau values[-1].
    with np.errstate(divide="ignore", invalid="ignore"):
        high = np.where(values[..., -1] > 0.0, along / values[..., -1], 0.0)
    low = np.zeros_like(high)

    def at(tau: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.eigvalsh(gramian - tau[..., None, None] * stretch)[..., 0])

    for _ in range(80):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        better = at(left) > at(right)
        high, low = np.where(better, right, high), np.where(better, low, left)
    best = np.maximum(at(0.5 * (low + high)), at(np.zeros_like(low)))
    return np.where(lasting, np.maximum(best, 0.0), np.inf)
