"""P3 section V: gain switching by a Markov chain, Fig. 6, Example 2 and the orientation of (22).

Values named `RECOMPUTED` are an independent recomputation of the paper's claims (Kronecker products in double precision);
`PUBLISHED` ones are what the paper prints. The tolerance of a printed number is half its last digit.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from analysis.markov.second_moment import lifted, spectral_radius
from analysis.markov.system import MarkovJumpSystem
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.parameter_set import load_parameter_set

SET = load_parameter_set("resilient-velocity")
MODEL = corner_velocity_model(SET, "longitudinal")
SAMPLE_TIME = 0.005  # s, 200 Hz (P3 notes 1)
PRINTED = SET.tire["longitudinal"].published
assert PRINTED is not None
NORMAL, HIGH_SLIP = np.array([PRINTED.gains]), np.array([PRINTED.gains_high_slip])


def modes(speeds: object, *gains: object) -> np.ndarray:
    """exp(A_e T) for speeds (g,) and gains, shape (g, m, 2, 2)."""
    numeric = MODEL.on(np.atleast_1d(np.asarray(speeds, float)))
    return np.stack(
        [expm(SAMPLE_TIME * numeric.error_dynamics(np.reshape(g, (2, 1)))[0]) for g in gains],  # type: ignore[call-overload]
        axis=1,
    )


# P3 Fig. 6, recomputed with (23): margin 1 - rho; rows gamma-bar, columns wheel speed in rad/s.
SPEEDS = (1.0, 20.0, 40.0, 80.0, 140.0)
RECOMPUTED_FIG6 = {
    0.1: (0.848, 0.870, 0.887, 0.900, 0.889),
    0.3: (0.673, 0.690, 0.698, 0.701, 0.698),
    0.5: (0.489, 0.497, 0.500, 0.501, 0.500),
    0.7: (0.297, 0.300, 0.301, 0.301, 0.301),
    0.9: (0.102, 0.103, 0.102, 0.102, 0.101),
}


def test_fig6_margins() -> None:
    stay = np.array(list(RECOMPUTED_FIG6))
    transition = np.array([[[0.9, 0.1], [1 - g, g]] for g in stay])
    margin = MarkovJumpSystem(modes(SPEEDS, NORMAL, HIGH_SLIP)[None], transition[:, None]).margin
    np.testing.assert_allclose(margin, list(RECOMPUTED_FIG6.values()), atol=6e-4)


def test_fig6_against_the_printed_operator() -> None:
    """(22) word for word, 8 x 8, to 1e-6 as the claim asks."""
    loops = modes(SPEEDS, NORMAL, HIGH_SLIP)
    for g in RECOMPUTED_FIG6:
        P = np.array([[0.9, 0.1], [1 - g, g]])
        for pair in loops:
            D = np.zeros((8, 8))
            D[:4, :4], D[4:, 4:] = (np.kron(A, A) for A in pair)
            rho = np.abs(np.linalg.eigvals(np.kron(P.T, np.eye(4)) @ D)).max()
            assert MarkovJumpSystem(pair, P).margin == pytest.approx(1 - rho, abs=1e-9)


def test_orientation_needs_three_modes() -> None:
    """Two-mode chains cannot see a transposed matrix (they are reversible); this cyclic one of three modes can."""
    loops = modes(10.0, NORMAL, (0.68, 183.1), (0.0, 0.0))[0]
    P = np.array([[0.1, 0.8, 0.1], [0.1, 0.1, 0.8], [0.8, 0.1, 0.1]])
    assert MarkovJumpSystem(loops, P).second_moment_radius() == pytest.approx(0.351207347, abs=1e-9)  # RECOMPUTED
    assert MarkovJumpSystem(loops, P.T).second_moment_radius() == pytest.approx(0.324340790, abs=1e-9)  # RECOMPUTED
    two, Q = loops[:2], np.array([[0.9, 0.1], [0.35, 0.65]])
    D = np.zeros((6, 6))
    D[:3, :3], D[3:, 3:] = lifted(two)
    radii = [np.abs(np.linalg.eigvals(np.kron(M, np.eye(3)) @ D)).max() for M in (Q.T, Q)]
    assert radii[0] == pytest.approx(radii[1], rel=1e-12)


def test_example_2_arbitrary_switching_is_the_square_of_the_slow_mode() -> None:
    """PUBLISHED 0.9960: the second-moment radius of mode 2 at 7.94..9.78 rad/s; its own radius never has that value."""
    published = 0.9960

    def second_moment(speed: float) -> float:
        return float(spectral_radius(lifted(modes(speed, HIGH_SLIP)[0, 0])))

    low, high = (
        brentq(lambda w, level=level: second_moment(w) - level, 1.0, 30.0)
        for level in (published - 5e-5, published + 5e-5)
    )
    assert (low, high) == pytest.approx((7.94, 9.78), abs=6e-3)  # RECOMPUTED
    assert second_moment(9.0) == pytest.approx(0.99600809, abs=1e-8)  # RECOMPUTED
    radius = spectral_radius(modes(np.linspace(0, 140, 141), HIGH_SLIP)[:, 0])
    assert (np.abs(radius - published) > 5e-5).all()
    assert radius.min() > 0.9977 and radius.max() < 0.9993
