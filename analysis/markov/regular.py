r"""Whether a whole family of operators is without the eigenvalue 1, and which side of 1 the radius of all its members is on.

The family is (1 - x) F + x G for x in a cell [c - h, c + h], with an entrywise error of the data. Let N = I - (1 - c) F - c
G, R near N^-1 and H = t R (G - F), |t| <= h. For any member I - M = N(t) one has R N(t) = (I - H)(I - (I - H)^-1 (E + R
D)), E = I - R N and D the error of the data, so every member is regular if

    |(I - H)^-1| (|E| + |R| |D|) < 1 in norm,    |(I - H)^-1| <= prod_j (I + |H^(2^j)|) / (1 - |H^(2^J)|)

(a preconditioned Neumann series, after [Rump1994]; with powers, not powers of sizes, so that nearly defective families are not
taken for singular ones). The radius of a cone-preserving operator is an eigenvalue of it (Krein and Rutman): in a regular
family it cannot pass 1, so one member decides for all.
"""

from __future__ import annotations

import numpy as np

from analysis.exact import radius_below_one
from analysis.markov.enclosure import EPS, enclosed, verdicts
from estimators.arrays import AnyArray, BoolArray, FloatArray
from synthesis.lmi.result import Verdict

SQUARINGS = 6  # of H
EXACT = 24  # unknowns up to which one member is decided in rational arithmetic where enclosures do not decide


def regular_cells(
    first: FloatArray,
    last: FloatArray,
    first_error: FloatArray,
    last_error: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> BoolArray:
    """Cells [low, high] (c,) of x on which no member of (1 - x) first + x last has the eigenvalue 1; (d, d) or (c, d, d) each."""
    d = first.shape[-1]
    one, change, size = np.eye(d), last - first, np.abs(first) + np.abs(last)
    centre = (0.5 * (low + high))[:, None, None]
    half = (0.5 * (high - low) * (1.0 + 4.0 * EPS) + EPS)[:, None, None]
    N = one - (1.0 - centre) * first - centre * last
    safe = np.linalg.slogdet(N)[0] != 0.0
    R = np.linalg.inv(np.where(safe[:, None, None], N, one))
    gamma = 2.0 * (d + 2) * EPS
    error = first_error + last_error + gamma * ((2.0 + half) * size + one)  # both weights are at most 1
    beyond = (np.abs(one - R @ N) + np.abs(R) @ error).sum(axis=-1)
    with np.errstate(over="ignore", invalid="ignore"):
        power, slip = half * (R @ change), np.zeros(len(low))
        for _ in range(SQUARINGS):
            beyond = beyond + (np.abs(power) @ beyond[..., None])[..., 0] + (slip * beyond.max(axis=-1))[:, None]
            norm = np.abs(power).sum(axis=-1).max(axis=-1)
            slip = 2.0 * norm * slip + slip**2 + gamma * norm**2  # rounding of the square
            power = power @ power
        rest = np.abs(power).sum(axis=-1).max(axis=-1) + slip
        proved = (rest < 0.5) & (beyond.max(axis=-1) * (1.0 + 1e-9) < 1.0 - rest)
    return np.asarray(safe & proved)


def radius_verdicts(operator: FloatArray, error: FloatArray) -> Verdict | AnyArray:
    """Verdicts on radius < 1 of cone-preserving operators (..., d, d), for all within an entrywise error, as `verdicts`.

    What the enclosure of the eigenvalues leaves open is decided, if the family is regular, by the exact eigenvalues of one
    member.
    """
    found = enclosed(operator, error)
    answers = np.asarray(verdicts(found.lower, found.upper), dtype=object).reshape(-1)
    open_ = np.flatnonzero(answers == Verdict.INCONCLUSIVE)
    if operator.shape[-1] <= EXACT and len(open_):
        flat, slack = (
            np.broadcast_to(x, operator.shape).reshape(-1, *operator.shape[-2:])[open_] for x in (operator, error)
        )
        middle = np.full(len(open_), 0.5)
        regular = regular_cells(flat, flat, 0.5 * slack, 0.5 * slack, middle, middle)
        for place, matrix in zip(open_[regular], flat[regular], strict=True):
            below = radius_below_one(matrix)
            if below is not None:
                answers[place] = Verdict.CERTIFIED if below else Verdict.REFUTED
    shape = found.value.shape
    return answers.reshape(shape) if shape else Verdict(str(answers[0]))
