"""Norms of hard matrices: upper bounds against 40 digits, stability that precision leaves open, bands, L-infinity norms."""

from __future__ import annotations

from math import inf, pi, sqrt

import mpmath as mp
import numpy as np
import pytest
from scipy.stats import ortho_group

from analysis import h2_norm, hinf_norm, linf_norm
from analysis.errors import AnalysisError
from analysis.norms.exact_peak import exact_peak
from analysis.norms.frequency_response import Systems
from analysis.norms.invariants import invariants
from analysis.norms.level_proof import level_proof
from analysis.norms.modal import modal_form
from analysis.norms.planar import planar_hinf_norm


def gain(A, B, C, D, frequency, discrete):
    """sigma_max of one system in 40 digits: the root of the largest eigenvalue of G^* G."""
    with mp.workdps(40):
        s = mp.expjpi(mp.mpf(frequency) / mp.pi) if discrete else mp.mpc(0, frequency)
        A, B, C, D = (mp.matrix(M.tolist()) for M in (A, B, C, D))
        G = C * (s * mp.eye(A.rows) - A) ** -1 * B + D
        return mp.sqrt(max(mp.eigh(G.H * G, eigvals_only=True)))


def highest(system, frequency, discrete):
    """The largest gain around a frequency by golden section and at some others, in 40 digits."""
    low, high = frequency * 0.999, frequency * 1.001 + 1e-9
    for _ in range(30):
        a, b = low + 0.381966 * (high - low), low + 0.618034 * (high - low)
        low, high = (low, b) if gain(*system, a, discrete) > gain(*system, b, discrete) else (a, high)
    others = np.linspace(0.0, pi, 12) if discrete else np.geomspace(1e-3, 1e3, 12)
    return max(gain(*system, w, discrete) for w in (low, frequency, *others))


def hard(kind, seed):
    """Rotated Jordan blocks, nearly cancelling slow modes, poles near Nyquist (or hardly damped), and states in odd units."""
    rng = np.random.default_rng(seed)
    n, discrete = 3 + seed % 2, bool(seed % 3)
    T = ortho_group.rvs(n, random_state=rng)
    if kind == "jordan":
        A = (0.9 if discrete else -0.05) * np.eye(n) + np.diag(np.ones(n - 1), 1)
    elif kind == "cancelling":
        A = np.diag(1.0 - 10.0 ** rng.uniform(-6, -1, n)) if discrete else -np.diag(10.0 ** rng.uniform(-5, 1, n))
    elif kind == "nyquist":
        angle, radius = pi - 1e-5, 1.0 - 1e-6
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) * radius
        A = np.diag(rng.uniform(-0.5, 0.5, n)) if discrete else -np.diag(rng.uniform(0.5, 5.0, n))
        A[:2, :2] = turn if discrete else [[0.0, 30.0], [-30.0, -1e-6]]
    else:
        A = rng.normal(size=(n, n))
        A = (
            0.99 * A / np.abs(np.linalg.eigvals(A)).max()
            if discrete
            else A - (np.linalg.eigvals(A).real.max() + 0.01) * np.eye(n)
        )
        T = np.diag(10.0 ** rng.uniform(-6, 6, n))
    B, C = rng.normal(size=(n, 2)), rng.normal(size=(2, n))
    if kind == "cancelling":
        C = C * np.array([1.0, *np.full(n - 1, 1e-6)])
    inverse = np.linalg.inv(T)
    return (T @ A @ inverse, T @ B, C @ inverse, rng.normal(size=(2, 2)) * (seed % 2)), discrete


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["jordan", "cancelling", "nyquist", "units"])
def test_upper_bounds_hold_in_forty_digits(kind: str, seed: int) -> None:
    system, discrete = hard(kind, seed)
    found = hinf_norm(*system, discrete)
    truth = highest(system, float(found.frequency), discrete)
    assert truth <= found.upper <= truth * (1.0 + 2e-5)
    assert abs(found.norm / truth - 1.0) < 2e-5
    # without D all gains scale by B, exactly for a power of two
    assert hinf_norm(system[0], 4.0 * system[1], system[2], 4.0 * system[3], discrete).norm == pytest.approx(
        4.0 * found.norm
    )


def test_a_defective_pole_has_the_norm_of_its_closed_form() -> None:
    """1/(s + a)^n as a rotated Jordan block: a^-n at zero; eigenvectors are dependent, so exact rationals decide."""
    for n, a in ((3, 0.5), (5, 2.0)):
        T = ortho_group.rvs(n, random_state=1)
        A = T @ (np.diag(np.ones(n - 1), 1) - a * np.eye(n)) @ T.T
        found = hinf_norm(A, T[:, -1:], T[:, :1].T)
        assert found.norm == pytest.approx(a**-n, rel=1e-9)
        assert found.norm <= found.upper <= found.norm * (1.0 + 1.1e-9)


def test_no_bound_is_said_where_nothing_proves_one() -> None:
    n = 14
    T = ortho_group.rvs(n, random_state=2)
    A = T @ (np.diag(np.ones(n - 1), 1) - 1.5 * np.eye(n)) @ T.T
    found = hinf_norm(A, T[:, -1:], T[:, :1].T)
    assert found.norm == pytest.approx(1.5**-n, rel=1e-6) and found.upper == inf


@pytest.mark.parametrize("discrete", [False, True])
@pytest.mark.parametrize("n", [2, 3, 4])
def test_rotated_integrators_are_undecided_and_shifted_ones_are_not(n: int, discrete: bool) -> None:
    rng = np.random.default_rng(n)
    T = ortho_group.rvs(n, size=30, random_state=rng) * rng.uniform(0.5, 2.0, (30, 1, n))
    block = np.diag(np.ones(n - 1), 1) + (np.eye(n) if discrete else 0.0)
    inverse, shift = np.linalg.inv(T), 0.1 * np.eye(n)
    for norm in (hinf_norm, linf_norm):
        found = norm(T @ block @ inverse, np.eye(n), np.eye(n), discrete=discrete)
        assert found.undecided.all() and np.isnan(found.norm).all() and (found.upper == inf).all()
        assert np.isfinite(norm(T @ (block - shift) @ inverse, np.eye(n), np.eye(n), discrete=discrete).upper).all()
    if n == 2 and not discrete:
        assert np.isnan(planar_hinf_norm(T @ block @ inverse, np.eye(2)[:, :1], np.eye(2))[0]).all()
    assert np.isnan(h2_norm(T @ block @ inverse, np.eye(n), np.eye(n), discrete=discrete)).all()
    assert (hinf_norm(T @ (block + shift) @ inverse, np.eye(n), np.eye(n), discrete=discrete).norm == inf).all()
    assert not hinf_norm(T @ (block + shift) @ inverse, np.eye(n), np.eye(n), discrete=discrete).undecided.any()


@pytest.mark.parametrize("n", [2, 4])
def test_damping_above_rounding_is_decided(n: int) -> None:
    """Normal matrices with poles 1e-11 from the axis (circle), three hundred times what rounding moves them."""
    turns = ortho_group.rvs(n, size=20, random_state=n)
    swing = np.kron(np.diag(np.arange(1.0, n / 2 + 1)), [[0.0, 1.0], [-1.0, 0.0]])
    angles = np.kron(np.diag(np.ones(n // 2)), [[0.8, 0.6], [-0.6, 0.8]])
    for sign, norm in ((-1.0, 1e11), (1.0, inf)):
        for block, discrete in ((swing + sign * 1e-11 * np.eye(n), False), (angles * (1.0 + sign * 1e-11), True)):
            found = hinf_norm(turns @ block @ np.swapaxes(turns, -1, -2), np.eye(n), np.eye(n), discrete=discrete)
            assert not found.undecided.any()
            np.testing.assert_allclose(found.norm, norm, rtol=1e-3)


def test_poles_that_are_entries_are_exact() -> None:
    on_it = ([[0.0, 1.0], [0.0, 0.0]], [[0.0, 1.0], [-4.0, 0.0]], np.diag([-1.0, 0.0, -2.0]), np.diag(np.ones(3), 1))
    for A in on_it:
        found = hinf_norm(A, np.eye(len(A)), np.eye(len(A)))
        assert found.norm == inf and not found.undecided
        assert linf_norm(A, np.eye(len(A)), np.eye(len(A))).norm == inf
    near = hinf_norm(np.diag([-1.0, -1e-14, -2.0]), np.eye(3), np.eye(3))
    assert near.norm == pytest.approx(1e14) and not near.undecided
    hidden = hinf_norm([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]], np.eye(3), np.eye(3))
    assert hidden.norm == inf and not hidden.undecided


def test_l_infinity_norms_of_unstable_systems() -> None:
    assert linf_norm(2.0, 3.0, 1.0).norm == pytest.approx(1.5)  # 3/(s - 2)
    assert hinf_norm(2.0, 3.0, 1.0).norm == inf
    w, z = 5.0, -0.01  # negative damping: the same gains as positive damping
    A = [[0.0, 1.0], [-(w**2), -2.0 * z * w]]
    assert linf_norm(A, [0.0, w**2], [1.0, 0.0]).norm == pytest.approx(
        1.0 / (2.0 * abs(z) * sqrt(1.0 - z**2)), rel=1e-9
    )
    assert linf_norm(1.25, 1.0, 1.0, discrete=True).norm == pytest.approx(4.0, rel=1e-9)  # 1/(z - 1.25)
    rng = np.random.default_rng(5)
    A, B, C = rng.normal(size=(4, 4)), rng.normal(size=(4, 2)), rng.normal(size=(2, 4))
    found, mirrored = linf_norm(A, B, C), linf_norm(-A, B, -C)  # G(-s) has the gains of G(s)
    assert found.norm == pytest.approx(mirrored.norm, rel=2e-9) and found.upper >= mirrored.norm
    swept = np.linalg.svd(
        C @ np.linalg.solve(1j * np.linspace(0, 30, 4001)[:, None, None] * np.eye(4) - A, B + 0j), compute_uv=False
    )
    assert swept.max() <= found.upper and found.norm == pytest.approx(swept.max(), rel=1e-4)


@pytest.mark.parametrize("outputs", [1, 2, 3])
@pytest.mark.parametrize("n", [2, 5])
def test_bands(n: int, outputs: int) -> None:
    rng = np.random.default_rng(n)
    A = rng.normal(size=(n, n))
    A -= (np.linalg.eigvals(A).real.max() + 0.05) * np.eye(n)
    B, C = rng.normal(size=(n, 3)), rng.normal(size=(outputs, n))
    whole = hinf_norm(A, B, C)
    for low, high in ((0.0, 0.3), (0.2, 1.5), (1.0, 50.0), (2.0, inf)):
        found = hinf_norm(A, B, C, band=(low, high))
        w = np.linspace(low, min(high, 60.0), 4001)
        swept = np.linalg.svd(C @ np.linalg.solve(1j * w[:, None, None] * np.eye(n) - A, B + 0j), compute_uv=False)[
            :, 0
        ]
        assert swept.max() <= found.upper * (1.0 + 1e-12) and found.norm == pytest.approx(swept.max(), rel=1e-4)
        assert low <= found.frequency <= high and found.norm <= whole.upper
    assert hinf_norm(A, B, C, band=(0.0, inf)).norm == whole.norm


@pytest.mark.parametrize("seed", range(4))
def test_bands_far_below_poles_near_nyquist(seed: int) -> None:
    """Two states: the parabola is written around 1e10 and more, the band lies around 0.1."""
    rng = np.random.default_rng(seed)
    angle, radius = pi - 10.0 ** rng.uniform(-8, -5), 1.0 - 10.0 ** rng.uniform(-9, -6)
    T = ortho_group.rvs(2, random_state=rng)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    system = radius * T @ turn @ T.T, rng.normal(size=(2, 2)), rng.normal(size=(2, 2)), np.zeros((2, 2))
    found = hinf_norm(*system, discrete=True, band=(0.05, 0.3))
    truth = max(gain(*system, w, True) for w in np.linspace(0.05, 0.3, 21))
    assert truth <= found.upper <= truth * (1.0 + 1e-5)


@pytest.mark.parametrize("discrete", [False, True])
def test_a_band_beside_a_resonance_has_its_bound(discrete: bool) -> None:
    """Fourteen states, hardly damped at 0.3 rad/s (rad/sample), asked between 0.6 and 2."""
    n, rng = 14, np.random.default_rng(3)
    poles = np.linspace(0.3, 2.6, n // 2) * (1j - np.array([1e-9, *np.full(n // 2 - 1, 0.05)]))
    poles = np.exp(poles) if discrete else poles
    A = np.zeros((n, n))
    for i, pole in enumerate(poles):
        A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
    T = ortho_group.rvs(n, random_state=1)
    A, B, C = T @ A @ T.T, rng.normal(size=(n, 2)), rng.normal(size=(2, n))
    w = np.linspace(0.6, 2.0, 5001)[:, None, None]
    s = np.exp(1j * w) if discrete else 1j * w
    swept = np.linalg.svd(C @ np.linalg.solve(s * np.eye(n) - A, B + 0j), compute_uv=False).max()
    found = hinf_norm(A, B, C, discrete=discrete, band=(0.6, 2.0))
    assert found.norm == pytest.approx(swept, rel=1e-5) and swept <= found.upper <= 1.00001 * swept
    assert hinf_norm(A, B, C, discrete=discrete).norm > 1e6 * swept


def test_bands_of_discrete_systems_and_wrong_bands() -> None:
    pole = (0.5, 1.0, 1.0)  # |1/(e^jt - 1/2)| falls from 2 at 0 to 2/3 at pi
    for low, high in ((1.0, 2.0), (3.0, pi)):
        found = hinf_norm(*pole, discrete=True, band=(low, high))
        assert found.norm == pytest.approx(1.0 / sqrt(1.25 - np.cos(low)), rel=1e-9)
        assert found.frequency == pytest.approx(low)
    for band in ((2.0, 1.0), (-1.0, 1.0), (1.0, 4.0)):
        with pytest.raises(AnalysisError, match="must rise between 0 and pi rad/sample"):
            hinf_norm(*pole, discrete=True, band=band)
    with pytest.raises(AnalysisError, match="must be two frequencies"):
        hinf_norm(*pole, discrete=True, band=(1.0,))  # type: ignore[arg-type]


def test_a_level_below_the_peak_is_never_proved() -> None:
    rng = np.random.default_rng(9)
    A = rng.normal(size=(300, 5, 5))
    A -= (np.linalg.eigvals(A).real.max(axis=-1)[:, None, None] + 10.0 ** rng.uniform(-4, 0, (300, 1, 1))) * np.eye(5)
    systems = Systems(A, rng.normal(size=(300, 5, 2)), rng.normal(size=(300, 2, 5)), np.zeros((300, 2, 2)))
    found = hinf_norm(systems.A, systems.B, systems.C)
    parts, band = invariants(modal_form(systems)), np.array([np.zeros(300), np.full(300, inf)])
    inside = (found.frequency > 0.0) & np.isfinite(found.frequency)
    assert inside.mean() > 0.3
    for factor, proved in ((1.0 + 1e-8, True), (1.0 - 1e-8, False), (0.7, False)):
        done, against = level_proof(parts, found.norm * factor, found.frequency, band)
        assert (done[inside] == proved).all()
        assert np.isfinite(against[inside & ~done]).all()


def test_a_narrow_resonance_far_from_the_found_peak_is_not_overlooked() -> None:
    """Two resonances on one channel; the taller one is thin, and the search claims the other."""
    w, k = (2.0, 50.0), np.logspace(-7, -3, 9)
    A, count = np.zeros((9, 4, 4)), len(k)
    for i in range(2):
        A[:, 2 * i, 2 * i + 1], A[:, 2 * i + 1, 2 * i] = w[i], -w[i]
        A[:, 2 * i + 1, 2 * i + 1] = -2.0 * (k if i else 0.3) * w[i]
    B, C = np.broadcast_to([[0.0], [1.0], [0.0], [0.05]], (9, 4, 1)), np.broadcast_to([[1.0, 0.0, 1.0, 0.0]], (9, 1, 4))
    parts = invariants(modal_form(Systems(A, B, C, np.zeros((9, 1, 1)))))
    band, thin = np.array([np.zeros(count), np.full(count, inf)]), 1e-3 / (2.0 * k)
    for peak in (0.0, 2.0, 49.0):
        for share, proved in ((0.5, False), (0.99, False), (1.1, True)):
            level = np.maximum(share * thin, 1.0)  # the wide one stays below 0.9
            done, _ = level_proof(parts, level, np.full(count, peak), band)
            assert (done == (proved | (level > 1.05 * thin))).all()


def test_exact_rationals_agree_with_closed_forms() -> None:
    w, z = 3.0, 1e-3
    A, B, C = np.array([[[0.0, 1.0], [-(w**2), -2.0 * z * w]]]), np.array([[[0.0], [w**2]]]), np.array([[[1.0, 0.0]]])
    norm, frequency, upper = exact_peak(Systems(A, B, C, np.zeros((1, 1, 1))), 1.0, 0.0, (0.0, inf), 1e-12)
    assert norm == pytest.approx(1.0 / (2.0 * z * sqrt(1.0 - z**2)), rel=1e-12) and norm < upper <= norm * (
        1.0 + 1.01e-12
    )
    assert frequency == pytest.approx(w * sqrt(1.0 - 2.0 * z**2), rel=1e-7)
    pole = Systems(np.full((1, 1, 1), -0.5), *(np.ones((1, 1, 1)),) * 2, np.zeros((1, 1, 1)), True)
    norm, frequency, upper = exact_peak(pole, 0.1, 0.0, (0.0, inf), 1e-12)
    assert norm == pytest.approx(2.0, rel=1e-12) and frequency == inf and upper >= 2.0  # 1/(z + 1/2) at z = -1
