r"""Sample-time jitter of a sampled observer: how far the sample time may wander from its nominal value, in any order.

    e+ = (e^(T_k A) - K C) e,    T_k anywhere in [(1 - j) T, (1 + j) T]

From below by e'P(T)e with P polynomial in the sample time (a different one in every sample: Daafouz, Bernussou 2001), proved
on the whole interval with enclosed matrix exponentials; from above by a sequence of sample times whose product certainly has a
spectral radius of one or more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from flint import arb, arb_mat, fmpq
from numpy.typing import ArrayLike
from scipy.linalg import expm

from analysis.checks import as_stack, positive, same_size, square
from analysis.errors import AnalysisError
from analysis.switching.jsr_products import search_products
from analysis.uncertainty.jitter_loop import NAME, JitterLoop, observer_of
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.certificate.claims import Claim
from synthesis.certificate.search import Search, Wish
from synthesis.certificate.verify import Names, Verifier
from synthesis.lmi.result import Verdict
from synthesis.loop.observer import ObserverLoop
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.rational import rational
from synthesis.polynomials.stable import is_schur

MODES, DEPTH = 5, 10  # sample times that products are made of, and how long these get
POINTS = (7, 15)
BISECTIONS = 9
LARGEST = 0.999  # of the nominal sample time: no sample has no length
DIGITS, REGIONS = 15, 600


@dataclass(frozen=True, repr=False)
class Jitter(Display):
    """Stable for every sequence of sample times within +-`lower` of nominal (relative).

    The sequence `witness` (s), within +-`upper` and repeated for ever, is not stable; `upper` is inf where none was found.
    `claim` holds P(T) with which stability was proved.
    """

    shown_units: ClassVar = {
        "lower": "of the sample time", "upper": "of the sample time", "sample_time": "s", "witness": "s",
    }  # fmt: skip

    lower: float
    upper: float
    sample_time: float
    claim: Claim | None
    witness: tuple[float, ...] | None


def sample_time_jitter(A: ArrayLike, C: ArrayLike, K: ArrayLike, sample_time: float, degree: int = 2) -> Jitter:
    """The relative jitter j that xhat+ = e^(TA) xhat + .. + K (y - C xhat) stands, K fixed, as a bracket.

    A (n, n), C (p, n), K (n, p), `sample_time` in s. `degree` of P in the sample time. Raises AnalysisError for matrices that
    do not fit or are not finite, and if the observer is not stable at its nominal sample time.

    >>> found = sample_time_jitter([[0.0, 1.0], [0.0, -1.0]], [[1.0, 0.0]], [[0.4], [0.2]], 0.1)
    >>> 0.0 <= found.lower <= found.upper
    True
    """
    a, c, k = observer_matrices(A, C, K)
    period = positive("sample_time", sample_time)
    if is_schur(_update(a, c, k, rational(period))) is not True:
        raise AnalysisError(f"the observer is not stable at its sample time of {period:g} s; jitter cannot help")
    upper, witness = _refuted(a, c, k, period)
    observer = observer_of(a, c, k)
    low, high, best = 0.0, min(upper, LARGEST), None
    for number in range(BISECTIONS):
        middle = 0.999 * high if number == 0 else 0.5 * (low + high)
        claim = jitter_claim(observer, (), (1.0 - middle) * period, (1.0 + middle) * period, degree)
        if claim is not None:
            low, best = middle, claim
            if number == 0:
                break
        else:
            high = middle
    return Jitter(low, upper, period, best, witness)


def jitter_claim(
    observer: ObserverLoop,
    parameters: tuple[SchedulingParameter, ...],
    shortest: float,
    longest: float,
    degree: int = 2,
) -> Claim | None:
    """A proof that the error decays for all sequences of sample times in [shortest, longest] s, or None.

    `observer` has the update `sampled` (a deployed table, or `observer_of` matrices), `parameters` are its scheduling
    parameters; P is a polynomial in them and in the sample time. Raises AnalysisError for another update, or an interval that is
    none.
    """
    if observer.update != "sampled":
        raise AnalysisError(
            f"jitter is analysed for the update 'sampled', this observer is '{observer.update}'; design it with its sample time"
        )
    if not 0.0 < shortest < longest:
        raise AnalysisError(
            f"sample times from {shortest:g} to {longest:g} s are no interval; give 0 < shortest < longest"
        )
    loop, names = _loop_and_names(observer, shortest, longest)
    sample = SchedulingParameter(NAME, "s", shortest, longest, -np.inf, np.inf)
    # Scheduling parameters move with their rates for as long as the longest sample lasts.
    moving = tuple(
        replace(p, rate_minimum=p.rate_minimum * longest, rate_maximum=p.rate_maximum * longest) for p in parameters
    )
    for points in POINTS if not parameters else POINTS[:1]:
        search = Search(loop, names, (*moving, sample), degree, points=points, digits=DIGITS, most_regions=REGIONS)
        claim, _ = search.prove(Wish("sampled error", 0.0))
        if claim is not None:
            return claim
    return None


def holds(observer: ObserverLoop, shortest: float, longest: float, claim: Claim) -> bool:
    """Whether a claim of `jitter_claim` is proved for this observer and these sample times, without any solver."""
    loop, names = _loop_and_names(observer, shortest, longest)
    return Verifier(loop, names).prove(claim).proved


def _loop_and_names(observer: ObserverLoop, shortest: float, longest: float) -> tuple[JitterLoop, Names]:
    loop = JitterLoop(observer, rational(shortest), rational(longest))
    return loop, Names(tuple(f"x{i + 1}" for i in range(observer.plant.states)), ())


def stable_for_sample_times(A: ArrayLike, C: ArrayLike, K: ArrayLike, sample_times: Sequence[float]) -> Verdict:
    """Whether the sequence, repeated for ever, is stable: exact signs on enclosed exponentials.

    >>> print(stable_for_sample_times([[0.0]], [[1.0]], [[0.5]], [0.01, 0.02]))
    certified
    """
    a, c, k = observer_matrices(A, C, K)
    product = arb_mat(len(a), len(a), [int(i == j) for i in range(len(a)) for j in range(len(a))])
    for length in sample_times:
        product = _update(a, c, k, rational(positive("sample_time", length))) * product
    found = is_schur(product)
    return Verdict.INCONCLUSIVE if found is None else Verdict.CERTIFIED if found else Verdict.REFUTED


def _refuted(A: FloatArray, C: FloatArray, K: FloatArray, period: float) -> tuple[float, tuple[float, ...] | None]:
    """The least jitter, by bisection, at which a product of a few sample times is certainly not stable, and these."""
    low, high, upper, witness = 0.0, LARGEST, np.inf, None
    for _ in range(2 * BISECTIONS):
        middle = high if witness is None else 0.5 * (low + high)
        times = period * (1.0 + middle * np.linspace(-1.0, 1.0, MODES))
        modes = np.array([expm(A * t) - K @ C for t in times])
        found = search_products(modes, 1e-6, DEPTH)
        word = tuple(float(times[i]) for i in found.word)
        if found.rate >= 1.0 and stable_for_sample_times(A, C, K, word) is Verdict.REFUTED:
            upper = high = max(abs(t / period - 1.0) for t in word) * (1.0 + 1e-15)
            witness = word
        elif witness is None:
            return np.inf, None
        else:
            low = middle
        if high - low < 1e-4 * high:
            break
    return upper, witness


def observer_matrices(A: ArrayLike, C: ArrayLike, K: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The three of one observer as floats that fit each other."""
    a, c, k = square("A", A), as_stack("C", C), as_stack("K", K)
    if c.ndim != 2 or a.ndim != 2 or c.shape[1] != len(a):
        raise AnalysisError(f"C has the shape {c.shape}; with A {a.shape} it must be (outputs, {len(a)})")
    same_size("K", k, "C'", c.T)
    return a, c, k


def _update(A: FloatArray, C: FloatArray, K: FloatArray, period: fmpq) -> arb_mat:
    """e^(TA) - K C in balls."""
    a, c, k = (arb_mat([[arb(float(x)) for x in row] for row in matrix]) for matrix in (A, C, K))
    return (a * arb(period)).exp() - k * c
