"""Fig. 6 and (22): the two gains switched by a Markov chain."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat

from analysis.exact import Rational, rationals
from analysis.markov import MarkovJumpSystem, second_moment_operator
from analysis.second_moment import lifted, spectral_radius
from studies.claim import ClaimFunction, Finding, judged
from studies.papers.plain import floats
from studies.papers.resilient_velocity.setting import HIGHEST_SPEED, NO_GAIN, PRINTED, Gain, Setting
from studies.papers.verdicts import derived
from synthesis.polynomials.matrix import FloatArray

STAY_NORMAL = 0.9  # p_11 of P_dry (23)
STAYS = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
SPEEDS = np.array([1.0, 20.0, 40.0, 80.0, 140.0])
KRON_SPEED = 10.0  # rad/s, of the examples on the orientation of (22)
THIRD_GAIN: Gain = (0.68, 183.1)  # the longitudinal gain that P1 prints, as a third mode
CYCLIC = (("1/10", "8/10", "1/10"), ("1/10", "1/10", "8/10"), ("8/10", "1/10", "1/10"))


def margins(setting: Setting, stays: FloatArray, speeds: FloatArray) -> FloatArray:
    """1 - rho of (22) with P_dry (23), (stay probability, wheel speed)."""
    stays = np.asarray(stays, float)
    stay = np.full_like(stays, STAY_NORMAL)
    transition = np.stack([np.stack([stay, 1.0 - stay], -1), np.stack([1.0 - stays, stays], -1)], -2)
    modes = np.stack(
        [setting.sampled("longitudinal", speeds, g) for g in (setting.gains["longitudinal"], setting.high_slip)], axis=1
    )
    return MarkovJumpSystem(modes[None], transition[:, None]).margin


def markov_margin(setting: Setting = PRINTED) -> Finding:
    """P3-fig6: positive over the whole figure, and falling as the slow mode stays longer."""
    shown = margins(setting, STAYS, SPEEDS)
    dense = margins(setting, np.linspace(0.0, 1.0, 41), np.linspace(0.0, HIGHEST_SPEED, 71))
    stable, falling = bool((dense > 0.0).all()), bool((np.diff(dense, axis=0) < 0.0).all())
    computed = {
        "stay_probability": floats(STAYS),
        "wheel_speed_rad_per_s": floats(SPEEDS),
        "margin": [floats(row) for row in shown],
        "smallest_over_0_to_1_and_0_to_140": float(dense.min()),
        "largest_distance_from_1_minus_stay": float(np.abs(shown - (1.0 - STAYS[:, None])).max()),
    }
    return Finding(
        computed,
        judged(stable and falling),
        "Fig. 6 prints no numbers; what it shows is checked: with P_dry of (23) the switched observer is "
        "mean-square stable "
        + ("for every stay probability and wheel speed" if stable else "not everywhere")
        + f" (smallest margin {dense.min():.4f}, at 1), and the margin "
        + ("falls as high slip lasts longer" if falling else "does not fall monotonically")
        + ", close to 1 minus the probability of staying in high slip, because the normal gain takes most of "
        "the error away in one sample.",
    )


def orientation(setting: Setting = PRINTED) -> Finding:
    """P3-kron: characteristic polynomials in exact rationals, so `identical` means identical."""
    modes = [
        setting.sampled("longitudinal", KRON_SPEED, g)[0] for g in (setting.gains["longitudinal"], THIRD_GAIN, NO_GAIN)
    ]
    two = [[fmpq(9, 10), fmpq(1, 10)], [fmpq(1, 2), fmpq(1, 2)]]
    three = [[fmpq(*(int(n) for n in entry.split("/"))) for entry in row] for row in CYCLIC]
    pair = [modes[0], modes[2]]
    same_side = _polynomial(pair, two) == _polynomial(pair, two, left=False)
    same_transposed = _polynomial(pair, two) == _polynomial(pair, _transposed(two))
    three_differ = _polynomial(modes, three) != _polynomial(modes, _transposed(three))
    P2, P3 = (np.array([[int(x.p) / int(x.q) for x in row] for row in P]) for P in (two, three))
    radii = {
        "two_modes": _radius(pair, P2),
        "two_modes_transposed": _radius(pair, P2.T),
        "three_modes": _radius(modes, P3),
        "three_modes_transposed": _radius(modes, P3.T),
    }
    computed = {
        "left_and_right_identical": same_side,
        "two_modes_P_and_transpose_identical": same_transposed,
        "three_modes_P_and_transpose_differ": three_differ,
        **radii,
    }
    return Finding(
        computed,
        derived(same_side and same_transposed and three_differ),
        "The factor P' x I may stand left or right of the block matrix, and with two modes P may be transposed: "
        "the characteristic polynomials are equal in exact arithmetic, because every chain of two modes is "
        "reversible. With three modes in a cycle the transposed matrix gives another radius, so only a test with "
        "three modes can find a wrong orientation.",
    )


def _radius(modes: list[FloatArray], P: FloatArray) -> float:
    # not through MarkovJumpSystem, which refuses a transposed matrix, as it should
    return float(spectral_radius(second_moment_operator(np.stack(modes), P)))


def _transposed(P: list[list[Any]]) -> list[list[Any]]:
    return [list(column) for column in zip(*P, strict=True)]


def _polynomial(modes: list[FloatArray], P: list[list[Any]], left: bool = True) -> Any:
    """Characteristic polynomial of (P' x I) diag(S(A_i)), or with the factors swapped, in exact rationals."""
    m = len(modes)
    S = [rationals(A) for A in lifted(np.stack(modes))]
    d = S[0].nrows()

    def entry(i: int, j: int, r: int, c: int) -> Any:
        # (P' x I) D has the block P[j][i] S_j in place (i, j), D (P' x I) the block S_i P[j][i].
        return P[j][i] * (S[j] if left else S[i])[r, c]

    matrix: Rational = fmpq_mat(
        m * d, m * d, [entry(i, j, r, c) for i in range(m) for r in range(d) for j in range(m) for c in range(d)]
    )
    return matrix.charpoly()


CLAIMS: dict[str, ClaimFunction] = {"P3-fig6": markov_margin, "P3-kron": orientation}
