"""The bounds of a level proof, one by one, against dense samples and 40 digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from analysis.norms.compensated import expanded
from analysis.norms.frequency_response import Systems, largest_gain
from analysis.norms.hinf import hinf_norm
from analysis.norms.invariants import Invariants, invariants
from analysis.norms.level_proof import Level, _lower_bound, _tail, level_of, level_proof
from analysis.norms.modal import modal_form

COUNT = 400


def random_level(seed: int) -> tuple[Invariants, Level]:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(COUNT, 5, 5))
    A -= (np.linalg.eigvals(A).real.max(axis=-1)[:, None, None] + 10.0 ** rng.uniform(-3, 0, (COUNT, 1, 1))) * np.eye(5)
    systems = Systems(A, rng.normal(size=(COUNT, 5, 2)), rng.normal(size=(COUNT, 3, 5)), rng.normal(size=(COUNT, 3, 2)))
    parts = invariants(modal_form(systems))
    frequency = rng.uniform(0.0, 3.0, (COUNT, 4))
    # the invariants give the gains that linear systems of equations give
    np.testing.assert_allclose(parts.gain(frequency.T).T, largest_gain(systems, 1j * frequency), rtol=1e-7)
    return parts, level_of(parts, parts.gain(frequency.T).max(axis=0) * 1.1)


def value(level: Level, frequency: np.ndarray) -> np.ndarray:
    """h at frequencies (j, g)."""
    poles = -level.parts.decay + 1j * level.parts.turn
    c = level.real + 1j * level.imag
    return level.constant + (c / (frequency[:, None] ** 2 + poles**2)).real.sum(axis=1)


def test_no_sample_of_an_interval_falls_below_its_bound() -> None:
    _, level = random_level(1)
    rng, member = np.random.default_rng(2), np.arange(COUNT)
    useful = 0
    for width in (1.0, 0.3, 0.05, 1e-3):
        for place in (0.0, 0.5, 1.0):  # of the expansion
            low = rng.uniform(0.0, 3.0, COUNT)
            high = low + width
            bound, here = _lower_bound(level, member, low, low + place * width, high)
            samples = value(level, low + np.linspace(0.0, 1.0, 301)[:, None] * width)
            scale = np.abs(samples).max(axis=0) + 1.0
            assert (bound <= samples.min(axis=0) + 1e-12 * scale)[bound != -1.0].all()
            np.testing.assert_allclose(here, value(level, (low + place * width)[None])[0], atol=1e-9 * scale.max())
            useful += int((bound > 0.0).sum())
    assert useful > 0.5 * 12 * COUNT  # and most of these intervals are proved


def test_the_tail_beyond_all_poles() -> None:
    parts, level = random_level(3)
    for reach in (8.0, 30.0):
        far = reach * np.sqrt((parts.decay**2 + parts.turn**2).max(axis=0))
        proved, lowest = _tail(level, far)
        samples = value(level, far * np.geomspace(1.0, 1e3, 400)[:, None])
        assert (samples[:, proved] > 0.0).all() and (lowest >= far).all()
    one = np.ones((1, 1))
    slow = Invariants(0.6 * one, 0.8 * one, np.zeros((2, 1)), *(np.zeros((2, 1, 1)),) * 3)
    for constant, positive in ((1e-3, False), (1.0, True)):  # h = constant - 1/(x + lambda^2), |lambda| = 1
        found, _ = _tail(Level(slow, np.array([constant]), -one, 0.0 * one, np.zeros(1), 0.0 * one), np.array([8.0]))
        assert found[0] == positive


def test_discrete_systems_have_the_gains_of_the_circle() -> None:
    rng = np.random.default_rng(6)
    radius = 1.0 - 10.0 ** rng.uniform(-6, -1, (COUNT, 2, 1, 1))
    angle = rng.uniform(0.0, np.pi, (COUNT, 2))
    A = np.zeros((COUNT, 4, 4))
    for i in range(2):
        c, s = np.cos(angle[:, i]), np.sin(angle[:, i])
        A[:, 2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = radius[:, i] * np.moveaxis(np.array([[c, s], [-s, c]]), -1, 0)
    systems = Systems(
        A, rng.normal(size=(COUNT, 4, 2)), rng.normal(size=(COUNT, 2, 4)), rng.normal(size=(COUNT, 2, 2)), True
    )
    modal = modal_form(systems)
    for theta in (
        angle,
        rng.uniform(0.0, np.pi, (COUNT, 4)),
    ):  # on the resonances, whose width is down to 1e-6, and elsewhere
        wanted = largest_gain(systems, np.exp(1j * theta))
        np.testing.assert_allclose(modal.gain(np.tan(0.5 * theta).T).T, wanted, rtol=1e-7)
        # squares of gains far below a peak are sums that cancel: right to rounding of the peak's square
        error = np.abs(invariants(modal).gain(np.tan(0.5 * theta).T).T ** 2 - wanted**2)
        assert (error <= 1e-8 * largest_gain(systems, np.exp(1j * angle)).max(axis=1, keepdims=True) ** 2).all()


def test_determinants_keep_their_digits_where_products_cancel() -> None:
    rng = np.random.default_rng(4)
    a, d = rng.normal(size=50), rng.normal(size=50)
    b = rng.normal(size=50)
    c = a * d / b  # a d - b c is rounding alone
    for one, trace in ((0, 0), (1, 1), (1, -1), (-1, 0)):
        found = expanded(a, b, c, d, one, trace)
        for i in range(50):
            with mp.workdps(60):
                p, q, r, s = (mp.mpf(float(x[i])) for x in (a, b, c, d))
                truth = one + trace * (p + s) + p * s - q * r
                assert abs(found[i] - truth) <= 1e-15 * abs(truth) + 1e-31


def test_a_peak_beyond_all_poles_speaks_against_a_level() -> None:
    """G = 1 + (b s - 1/2)/(s^2 + 1.2 s + 1): |G|^2 - 1 = (d x - 3/4)/(x^2 - 0.56 x + 1) is largest near x = 1.5/d."""
    d = 1e-3  # b^2 + 2.4 b + 1
    b = -1.2 + np.sqrt(0.44 + d)
    systems = Systems(
        np.array([[[0.0, 1.0], [-1.0, -1.2]]]), np.array([[[0.0], [1.0]]]), np.array([[[-0.5, b]]]), np.ones((1, 1, 1))
    )
    x = (0.75 + np.sqrt(0.75**2 + d**2 - 0.75 * 0.56 * d)) / d  # a root of the derivative
    above = (d * x - 0.75) / (x * x - 0.56 * x + 1.0)
    np.testing.assert_allclose(largest_gain(systems, np.array([[1j * np.sqrt(x)]]))[0, 0] ** 2 - 1.0, above, atol=1e-14)
    parts, whole = invariants(modal_form(systems)), np.array([[0.0], [np.inf]])
    assert np.sqrt(x) > 30.0  # poles have the modulus one
    found, against = level_proof(parts, np.sqrt(1.0 + 0.5 * above)[None], np.zeros(1), whole)
    assert not found[0]
    np.testing.assert_allclose(against, np.sqrt(x), rtol=0.05)
    assert level_proof(parts, np.array([1.1]), np.zeros(1), whole)[0][0]
    assert hinf_norm(systems.A, systems.B, systems.C, systems.D).norm[0] ** 2 - 1.0 == pytest.approx(above, rel=1e-6)
