"""Break rates of discretised observers: closed forms, Jury's conditions on an independent check, and runs of the runtime."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import cont2discrete

from analysis.errors import AnalysisError
from estimators.schedule import GainSchedule
from studies.beyond.implementability.break_rates import break_curve, first_breaks, unstable_wheel_speeds
from studies.beyond.implementability.designs import Design, printed_designs, shipped_designs
from studies.beyond.implementability.simulation import (
    RUNTIME,
    STEPS,
    growth,
    launch,
    rolling,
    run,
)
from studies.beyond.implementability.study import STUDY
from studies.beyond.implementability.updates import BREAKABLE, LASTING, UPDATES, jury_margin, spectral_radius
from studies.study import QUICK, Part
from tests.support.study_checks import check_result, check_study
from tests.support.study_reference import reference_claims

P1X, P1Y, P3X, P3S, P3Y = printed_designs()
POINTS = 29


def at(design: Design, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    A, L, C = design.matrices(np.array([speed]))
    return A[0], L[0], C[0]


@pytest.mark.parametrize("design", [P1X, P1Y, P3X, shipped_designs()[1]], ids=lambda d: d.name)
@pytest.mark.parametrize("speed", [0.0, 37.0, 140.0])
def test_updates_are_what_they_say(design: Design, speed: float) -> None:
    """Independent check: scipy's matrix exponential and its discretisations of the closed loop."""
    A, L, C = at(design, speed)
    T, closed, none = 0.004, A - L @ C, np.zeros((2, 1))
    for scheme, method in (
        ("forward Euler", "euler"),
        ("Tustin", "bilinear"),
        ("backward Euler", "backward_diff"),
        (RUNTIME, "zoh"),
    ):
        expected = cont2discrete((closed, none, np.eye(2), none), T, method)[0]
        np.testing.assert_allclose(UPDATES[scheme](A, L, C, T), expected, rtol=1e-9, atol=1e-12)
    Phi, Gamma = cont2discrete((A, L, np.eye(2), none), T, "zoh")[:2]
    np.testing.assert_allclose(UPDATES["sampled innovation"](A, L, C, T), Phi - Gamma @ C, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(UPDATES["predict, then T·L"](A, L, C, T), expm(T * A) - T * L @ C, rtol=1e-9, atol=1e-12)


def test_jury_is_the_spectral_radius() -> None:
    M = np.random.default_rng(0).normal(size=(4000, 2, 2))
    radius = np.abs(np.linalg.eigvals(M)).max(axis=-1)
    np.testing.assert_allclose(spectral_radius(M), radius, rtol=1e-9)
    assert ((jury_margin(M) > 0.0) == (radius < 1.0)).all()


@pytest.mark.parametrize("design", [P1X, P1Y, P3S], ids=lambda d: d.name)
def test_forward_euler_breaks_at_its_closed_form(design: Design) -> None:
    """T = min 2 |Re s| / |s|^2 over the poles s."""
    speeds = np.linspace(0.0, 140.0, 15)
    A, L, C = design.matrices(speeds)
    poles = np.linalg.eigvals(A - L @ C)
    expected = (2.0 * np.abs(poles.real) / np.abs(poles) ** 2).min(axis=1)
    np.testing.assert_allclose(first_breaks(design, UPDATES["forward Euler"], speeds)[0], expected, rtol=1e-10)


def test_sampled_innovation_breaks_at_a_root_of_its_closed_form() -> None:
    """At standstill A = [[0, 1], [0, 0]]: M is a polynomial in T, and stability ends where 1 + tr + det or 1 - det vanishes."""
    for design in (P1X, P3X, P1Y):
        _, L, C = at(design, 0.0)
        l1, l2, c1, c2 = L[0, 0], L[1, 0], C[0, 0], C[0, 1]
        time = first_breaks(design, UPDATES["sampled innovation"], np.array([0.0]))[0][0]
        M = np.array([[1 - time * l1 * c1 - time**2 / 2 * l2 * c1, time - time * l1 * c2 - time**2 / 2 * l2 * c2],
                      [-time * l2 * c1, 1 - time * l2 * c2]])  # fmt: skip
        assert min(abs(1 + np.trace(M) + np.linalg.det(M)), abs(1 - np.linalg.det(M))) < 1e-9


@pytest.mark.parametrize("scheme", BREAKABLE)
def test_both_sides_of_the_break(scheme: str) -> None:
    """Just above the worst rate every wheel speed is stable; just below, the worst one is not. A finer grid finds no worse."""
    for design in (P1X, P1Y, P3S, shipped_designs()[3]):
        curve = break_curve(design, scheme, POINTS)
        assert curve.connected
        A, L, C = design.matrices(design.grid(501))
        above = spectral_radius(UPDATES[scheme](A, L, C, np.full(len(A), 1.0 / (1.00002 * curve.worst_rate))))
        assert above.max() < 1.0
        A, L, C = design.matrices(np.array([curve.worst_wheel_speed]))
        assert spectral_radius(UPDATES[scheme](A, L, C, np.array([1.0 / (0.9999 * curve.worst_rate)])))[0] > 1.0


@pytest.mark.parametrize("scheme", LASTING)
def test_implicit_and_exact_updates_never_break(scheme: str) -> None:
    for design in (*printed_designs(), *shipped_designs()):
        curve = break_curve(design, scheme, 15)
        assert curve.worst_rate == 0.0 and np.isnan(curve.worst_wheel_speed)
    A, L, C = P1X.matrices(np.linspace(0.0, 140.0, 8))
    radius = spectral_radius(LASTING[RUNTIME](A, L, C, np.full(8, 0.02)))
    np.testing.assert_allclose(radius, np.exp(0.02 * np.linalg.eigvals(A - L @ C).real.max(axis=1)), rtol=1e-9)


def test_unstable_gains_are_refused() -> None:
    """Negative control: gains of the wrong sign have no break rate."""
    wrong = replace(P1X, schedule=replace(P1X.schedule, table=-P1X.schedule.table))
    with pytest.raises(AnalysisError, match="unstable already"):
        break_curve(wrong, "forward Euler", 5)


def test_edges_at_200_hertz() -> None:
    """The unstable wheel speeds end where the radius is one; P1's lateral gains survive two of the schemes."""
    for scheme in BREAKABLE:
        for low, high in unstable_wheel_speeds(P1X, scheme, 0.005):
            for edge in (low, high):
                if 0.0 < edge < 140.0:
                    assert spectral_radius(UPDATES[scheme](*(m[None] for m in at(P1X, edge)), np.array([0.005])))[
                        0
                    ] == pytest.approx(1.0, abs=1e-9)
            middle = spectral_radius(
                UPDATES[scheme](*(m[None] for m in at(P1X, 0.5 * (low + high))), np.array([0.005]))
            )[0]
            assert middle > 1.0
    assert unstable_wheel_speeds(P1Y, "forward Euler", 0.005) == ()
    assert unstable_wheel_speeds(P3X, "forward Euler", 0.005) == ((0.0, 140.0),)


@pytest.mark.shared
def test_spectral_radii_of_the_reference() -> None:
    """P3-zoh: printed longitudinal gains at 200 Hz with sampled innovation, and with T L."""
    computed = reference_claims("P3")["P3-zoh"]["computed"]
    speeds, T = np.array([0.0, 40.0, 140.0]), np.full(3, 0.005)
    for key, design, scheme in (
        ("xP3 rho innovation-hold w=0,40,140", P3X, "sampled innovation"),
        ("exp(A Ts)-Ts L C", P3X, "predict, then T·L"),
    ):
        np.testing.assert_allclose(
            spectral_radius(UPDATES[scheme](*design.matrices(speeds), T)), computed[key], atol=1e-4
        )
    first = next(value for key, value in computed.items() if key.startswith("xP1 innovation-hold"))
    assert spectral_radius(UPDATES["sampled innovation"](*P1X.matrices(speeds), T))[0] == pytest.approx(
        first[0], abs=1e-4
    )


class TestSimulation:
    @pytest.mark.parametrize("scheme", BREAKABLE)
    def test_runs_grow_and_shrink_on_their_sides(self, scheme: str) -> None:
        for design in (P1X, P3Y):
            curve = break_curve(design, scheme, POINTS)
            for factor in (0.97, 1.03):
                rate = factor * curve.worst_rate
                found = growth(design, scheme, rate, curve.worst_wheel_speed, 300)
                A, L, C = design.matrices(np.array([curve.worst_wheel_speed]))
                radius = spectral_radius(UPDATES[scheme](A, L, C, np.array([1.0 / rate])))[0]
                assert (found > 1.0) == (factor < 1.0)
                assert found == pytest.approx(radius, rel=0.01)

    def test_runtime_shrinks_where_the_others_grow(self) -> None:
        """The runtime itself, at a quarter of the papers' rate, with the gains that break first."""
        found = growth(P3X, RUNTIME, 50.0, 0.0, 12)
        assert found < 0.1
        assert growth(P3X, "forward Euler", 50.0, 0.0, 60) > 5.0

    @pytest.mark.parametrize("scheme", [*STEPS, RUNTIME])
    def test_steps_are_the_matrices(self, scheme: str) -> None:
        """One step of the error of a freely rolling wheel is M times it; for the runtime, too."""
        speed, start = 63.0, np.array([2e-4, 0.3])
        A, L, C = P1Y.matrices(np.array([speed]))
        path = run(P1Y, scheme, rolling(0.005, 2, speed), start)
        np.testing.assert_allclose(path[1], UPDATES[scheme](A, L, C, np.array([0.005]))[0] @ start, rtol=1e-9)

    def test_launch_obeys_the_model(self) -> None:
        """z' = -a z + v by differences, and the measured force belongs to the states."""
        motion = launch(P1X, 0.001, 1.0)
        z, v = motion.states.T
        decay = 8.32 * 0.33 * motion.wheel_speed
        slope = np.gradient(z, 0.001)
        np.testing.assert_allclose(slope[5:-5], (-decay * z + v)[5:-5], atol=2e-3)
        C = P1X.model.on(motion.wheel_speed).C[:, 0]
        np.testing.assert_allclose(motion.force, (C * motion.states).sum(axis=1), rtol=1e-12)
        np.testing.assert_allclose(np.diff(v), 0.001 * motion.acceleration[:-1], atol=1e-12)

    def test_only_stable_schemes_survive_a_launch(self) -> None:
        motion = launch(P3X, 0.005, 2.0)
        last = {
            scheme: abs(run(P3X, scheme, motion, np.array([0.0, 0.5]))[-1, 1] - motion.states[-1, 1])
            for scheme in (*STEPS, RUNTIME)
        }
        assert all(last[scheme] > 1e3 for scheme in BREAKABLE)
        assert all(last[scheme] < 0.05 for scheme in LASTING)


def test_printed_designs_are_the_printed_numbers() -> None:
    gains = {design.name: tuple(design.schedule.gain(np.array([50.0]))[0, :, 0]) for design in printed_designs()}
    assert gains == {"P1 longitudinal": (0.68, 183.1), "P1 lateral": (1.11, 16.7), "P3 longitudinal": (1.18, 387.0),
                     "P3 longitudinal, high slip": (0.22, 0.1), "P3 lateral": (1.21, 16.8)}  # fmt: skip
    for design in (*printed_designs(), *shipped_designs()):
        plant = design.schedule.plant_at(np.array([80.0]))
        np.testing.assert_allclose(plant.A, design.model.on(np.array([80.0])).A, rtol=1e-12)
        np.testing.assert_allclose(plant.C, design.model.on(np.array([80.0])).C, rtol=1e-12)
    assert (
        len(shipped_designs())
        == len({GainSchedule.shipped(d.name.removeprefix("schedule ")).sha256 for d in shipped_designs()})
        == 5
    )


def test_study_is_complete() -> None:
    check_study(STUDY)
    assert (STUDY.id, STUDY.paper) == ("implementability", "")


@pytest.mark.parametrize("part", [p for p in STUDY.parts if p.name != "break-rates"], ids=lambda part: part.name)
def test_parts_stand_on_their_own(part: Part) -> None:
    result = part.run(QUICK)
    check_result(result)
    if part.name == "confirmation":
        assert all(row[-1] is True for row in result.tables[0].rows)


def test_break_rate_part() -> None:
    result = next(part for part in STUDY.parts if part.name == "break-rates").run(QUICK)
    check_result(result)
    assert result.measures["break rate P1 longitudinal, forward Euler [Hz]"] == pytest.approx(270.39, abs=0.01)
