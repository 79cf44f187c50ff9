"""The two tires alone: closed forms of steady slip, friction circle, and the exact step of what both deflect."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from studies.truth import load_vehicle
from studies.truth.lugre import LuGreParameters, LuGreTire
from studies.truth.magic_formula import MagicFormulaParameters, MagicFormulaTire
from studies.truth.stepper import stepped_deflection
from synthesis.models.parameter_set import load_parameter_set

LOAD = 5500.0
P1 = LuGreParameters.of(load_parameter_set("corner-estimation"))


def corners(*values: float) -> np.ndarray:
    """(2, 4, 1) of x and y, or (4, 1) of one value, for all corners alike."""
    row = np.array(values)[:, None, None] * np.ones((4, 1))
    return row if len(values) == 2 else row[0]


def lugre(slide: np.ndarray, wheel: float, friction: float) -> np.ndarray:
    """F/F_z (2,) after the bristles have settled."""
    tire = LuGreTire([P1])
    surface, theta = corners(abs(wheel)), corners(friction)
    a, push = tire.rates(np.zeros_like(slide), slide, surface, surface, theta)
    z = push / a
    return (tire.forces(z, push - a * z, slide, surface, corners(LOAD), theta) / LOAD)[:, 0, 0]


def magic(kappa: float, tangent: float, friction: float = 1.0, load: float = 4000.0) -> np.ndarray:
    """F/F_z (2,) at slips that have settled, above the speed of the extra damping."""
    tire = MagicFormulaTire([MagicFormulaParameters()])
    slip = corners(kappa, tangent)
    force = tire.forces(slip, 0.0 * slip, 0.0 * slip, corners(10.0), corners(load), corners(friction))
    return (force / load)[:, 0, 0]


@pytest.mark.parametrize("slip", [0.002, 0.02, -0.1, 0.5])
def test_lugre_steady_slip(slip: float) -> None:
    """mu = sigma_0 v/a + sigma_2 v, a = kappa R w + sigma_0 |v|/(theta g(v)): P1 (18), (19) at rest, one direction."""
    rolling, theta = 15.0, 0.8
    v = slip * rolling
    g = P1.sliding + (P1.static - P1.sliding) * np.exp(-np.sqrt(abs(v) / P1.stribeck))
    for q in (0, 1):
        a = P1.kappa[q] * rolling + P1.sigma0[q] * abs(v) / (theta * g)
        expected = P1.sigma0[q] * v / a + P1.sigma2[q] * v
        slide = corners(v, 0.0) if q == 0 else corners(0.0, v)
        assert lugre(slide, rolling, theta)[q] == pytest.approx(expected, rel=1e-12)
        assert lugre(slide, rolling, theta)[1 - q] == 0.0


def test_lugre_small_slip_slopes() -> None:
    """sigma_0/kappa + sigma_2 V: 76 along and 14.1 across for the tire of P1 (P1 notes 5), at 1 m/s."""
    slope = lugre(corners(1e-7, 1e-7), 1.0, 1.0) / 1e-7
    assert slope == pytest.approx([632.1 / 8.32, 181.5 / 12.84], abs=0.01)


@pytest.mark.parametrize("friction", [1.0, 0.35, 0.2])
def test_a_locked_lugre_tire_pulls_against_its_slide_with_theta_g(friction: float) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 9)
    for angle in angles:
        v = 8.0 * np.array([np.cos(angle), np.sin(angle)])
        g = P1.sliding + (P1.static - P1.sliding) * np.exp(-np.sqrt(8.0 / P1.stribeck))
        expected = friction * g * v / 8.0 + np.array(P1.sigma2) * v
        assert lugre(corners(*v), 0.0, friction) == pytest.approx(expected, abs=1e-12)


def test_driving_takes_from_cornering() -> None:
    pure = lugre(corners(0.0, 1.5), 15.0, 1.0)[1]
    both = lugre(corners(3.0, 1.5), 15.0, 1.0)[1]
    assert 0.0 < both < 0.8 * pure
    assert 0.0 < magic(0.3, 0.1)[1] < 0.7 * magic(0.0, 0.1)[1]
    assert 0.0 < magic(0.1, 0.3)[0] < 0.7 * magic(0.1, 0.0)[0]


def test_magic_formula_slopes_and_peaks() -> None:
    """At nominal load: B C D/F_z along 21.51, across 14.95 sin(2 atan(1/2.13)); peaks 1.21 and 0.99 over 1.1."""
    h = 1e-6
    assert magic(h, 0.0)[0] / h == pytest.approx(21.51, rel=1e-4)
    assert magic(0.0, h)[1] / h == pytest.approx(14.95 * np.sin(2.0 * np.arctan(1.0 / 2.13)), rel=1e-4)
    slips = np.linspace(0.0, 0.9, 3000)
    assert max(magic(s, 0.0)[0] for s in slips) == pytest.approx(1.21 / 1.1, rel=1e-3)
    assert max(magic(0.0, s)[1] for s in slips) == pytest.approx(0.99 / 1.1, rel=1e-2)


def test_friction_scales_the_peak_and_not_the_stiffness() -> None:
    h = 1e-6
    assert magic(h, 0.0, 0.3)[0] == pytest.approx(magic(h, 0.0, 1.0)[0], rel=1e-4)
    slips = np.linspace(0.0, 0.9, 2000)
    peaks = [max(magic(s, 0.0, mu)[0] for s in slips) for mu in (1.0, 0.3)]
    assert peaks[1] == pytest.approx(0.3 * peaks[0], rel=1e-2)


def test_heavier_magic_formula_tires_use_less_of_their_load() -> None:
    assert magic(0.0, 0.5, load=8000.0)[1] < magic(0.0, 0.5, load=4000.0)[1]


@pytest.mark.parametrize(("kappa", "tangent"), [(0.05, 0.02), (-0.4, 0.3), (0.7, -0.6)])
def test_forces_oppose_slip_on_both_tires(kappa: float, tangent: float) -> None:
    for force in (magic(kappa, tangent), lugre(corners(10.0 * kappa, 10.0 * tangent), 10.0, 0.5)):
        assert (np.sign(force) == np.sign([kappa, tangent])).all()


def test_slip_lag_is_the_relaxation_length() -> None:
    """A small step of slip angle is at 1 - 1/e after the way sigma, whatever the speed."""
    tire = MagicFormulaTire([MagicFormulaParameters()])
    sigma = MagicFormulaParameters().relaxation[1]
    for speed in (5.0, 40.0):
        slide, way = corners(0.0, 1e-4 * speed), corners(speed)
        z = np.zeros((2, 4, 1))
        h = sigma / speed / 200
        for _ in range(200):
            a, push = tire.rates(z, slide, way, way, corners(1.0))
            z = stepped_deflection(z, push, a, h)[0]
        assert z[1] == pytest.approx(1e-4 * (1.0 - np.exp(-1.0)), rel=1e-3)


def test_a_sliding_tire_lets_go_within_its_elastic_travel() -> None:
    """From full slip to none the patch moves by about sigma_0 kappa_s = F_peak/C, about a centimetre, not by sigma_0."""
    tire, h = MagicFormulaTire([MagicFormulaParameters()]), 1e-5
    z, way, still = corners(-1.0, 0.0), 0.0, corners(0.0)
    slide = corners(0.1, 0.0)
    while z[0, 0, 0] < 0.0:
        a, push = tire.rates(z, slide, still, still, corners(1.0))
        z = stepped_deflection(z, push, a, h)[0]
        way += 0.1 * h
    elastic = 0.25 * 1.21 / 1.1 / 21.51
    assert elastic < way < 2.0 * elastic


@pytest.mark.parametrize("rate", [0.0, 1e-6, 0.5, 80.0, 2e4])
def test_the_held_step_is_exact(rate: float) -> None:
    z0, v, h = 2e-3, -0.4, 1e-3
    one = np.array([z0])
    after, mean, slope = stepped_deflection(one, np.array([v]), np.array([rate]), h)
    done = solve_ivp(lambda _t, y: [v - rate * y[0], y[0]], (0.0, h), [z0, 0.0], "Radau", rtol=1e-11, atol=1e-15).y[
        :, -1
    ]
    assert after == pytest.approx(done[0], rel=1e-7, abs=1e-12)
    assert mean == pytest.approx(done[1] / h, rel=1e-7, abs=1e-12)
    assert slope == pytest.approx((after - z0) / h, rel=1e-9, abs=1e-9)


def test_what_a_set_does_not_print_is_that_of_the_same_car_elsewhere() -> None:
    """P2 prints no lateral tire (P1 does), P1 and P2 no friction curve (P3 does)."""
    p2, p3 = (load_vehicle(name).lugre for name in ("longitudinal-speed", "resilient-velocity"))
    assert p2.sigma0 == (612.0, 181.5) and p2.kappa == (8.0, 12.84)
    assert (P1.sliding, P1.static, P1.stribeck) == (p3.sliding, p3.static, p3.stribeck) == (0.85, 1.1, 5.0)
