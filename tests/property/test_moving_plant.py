"""Decay, said of an update whose error follows the plant's motion: the claim that failed, what explains it, and what mends it.

With y held, e+ = e^M e + T (phi(TA) - phi(M)) x': at a frozen parameter and x+ = e^(TA) x the error tends to S x, where
S e^(TA) = e^M S + T (phi(TA) - phi(M)) A (`stall`). The update that corrects once a sample has no such term.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import expm, solve_sylvester

from estimators import GainSchedule, LpvVelocityObserver
from synthesis.certificate.proof import prove
from synthesis.design.deploy import Deployment, deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, SchedulingParameter, Signal
from tests.support.random_plant import RandomPlant
from tests.support.update_campaign import Case, searched
from tests.support.update_judge import Judge, Tally
from tests.support.update_run import Paths, Run, simulate, walks

ONES = dict.fromkeys(("x1", "x2", "u", "y", "d1", "d2"), 1.0)
SECONDS = 35.0


def double_integrator(low: str, high: str) -> RandomPlant:
    """A = [[0, 1], [p, 0]], the position measured, T = 0.05 s."""
    middle, half = (Fraction(low) + Fraction(high)) / 2, (Fraction(high) - Fraction(low)) / 2
    zero, one, small = Fraction(0), Fraction(1), Fraction("0.1")
    series = {
        "A": [[[zero, one], [middle, zero]], [[zero, zero], [half, zero]]],
        "B": [[[zero], [one]]],
        "C": [[[one, zero]]],
        "D": [[[zero]]],
        "E": [[[zero, zero], [one, zero]]],
        "F": [[[zero, small]]],
    }
    return RandomPlant(0, "by hand", low, high, (-0.1, 0.1), 0.05, 1.0, ONES, series)


def proved_case(plant: RandomPlant, update: str) -> tuple[Case, GainSchedule, list[dict[str, object]]]:
    """Gains with both poles near -1 1/s; claims found, proved and exported."""
    breakpoints = np.array([float(plant.low), float(plant.high)])
    table = []
    for value in breakpoints:
        if update == "held":
            gain = [2.1, 1.1 + value]  # s^2 + L1 s + L2 - p
        else:
            coast = expm(np.array([[0.0, 1.0], [value, 0.0]]) * plant.sample_time)
            wanted = np.poly(np.exp(-np.array([1.0, 1.1]) * plant.sample_time))
            observability = np.array([[1.0, 0.0], coast[0]])
            polynomial = coast @ coast + wanted[1] * coast + wanted[2] * np.eye(2)
            gain = (polynomial @ np.linalg.solve(observability, [0.0, 1.0])).round(6).tolist()
        table.append([[gain[0]], [gain[1]]])
    case = Case(plant, update, breakpoints, np.array(table), "placed")
    content = case.content(searched(case))
    assert all(proof.proved for proof in prove(content))
    return case, GainSchedule.from_content(content), content["claims"]


def run_of(case: Case, schedule: GainSchedule) -> Run:
    """35 s from x = (1, 0) with an estimate of zero, the parameter moving as fast as it may."""
    steps = int(SECONDS / case.plant.sample_time)
    p = walks(case.plant, steps, 4, np.random.default_rng(0))
    still = np.zeros((steps, 4))
    start = np.broadcast_to([1.0, 0.0], (4, 2))
    return simulate(case.plant, schedule, Paths(p, still, np.zeros((steps, 4, 2)), still > 0, start, 0.0 * start),
                    np.zeros(2))  # fmt: skip


@pytest.mark.parametrize(("low", "high"), [("0.3", "0.6"), ("-1.5", "-0.5")])
def test_with_held_measurements_the_error_follows_the_motion_and_the_motion_gain_says_how_far(
    low: str, high: str
) -> None:
    case, schedule, claims = proved_case(double_integrator(low, high), "held")
    rate = next(float(str(claim["level"])) for claim in claims if claim["kind"] == "internal update")
    assert rate > 0.9
    run = run_of(case, schedule)
    last = np.abs(run.e[-20:]).max(axis=(0, 2))
    assert (last > 1e9 * np.exp(-rate * SECONDS)).all()  # not at all what a decay of the error would be
    if low == "0.3":  # the plant runs away, and the error with it
        assert (np.abs(run.x[-1]).max(axis=1) > 1e6).all()
        assert (last > 1e5).all()
    else:  # the plant swings for ever, and the error with it
        assert ((last > 1e-3) & (last < 1.0)).all()
    judge = Judge(case.plant, schedule, claims, Tally())
    judge.every_step(run)  # the internal update decays as claimed: what is left is the motion
    judge.whole_run(run)  # and the error is no larger than the motion gains say
    assert not judge.tally.violations
    assert judge.tally.checks["internal update"] == run.paths.u.size
    assert judge.tally.checks["sum over a run"] == 4


@pytest.mark.parametrize(("low", "high"), [("0.3", "0.6"), ("-1.5", "-0.5")])
def test_a_correction_once_a_sample_decays_whatever_the_plant_does(low: str, high: str) -> None:
    case, schedule, claims = proved_case(double_integrator(low, high), "sampled")
    rate = next(float(str(claim["level"])) for claim in claims if claim["kind"] == "sampled error")
    assert rate > 0.9
    run = run_of(case, schedule)
    size = np.maximum.accumulate(np.abs(run.x).max(axis=2))
    assert (np.abs(run.e).max(axis=2)[-1] < 1e-12 * size[-1]).all()
    judge = Judge(case.plant, schedule, claims, Tally())
    judge.every_step(run)
    assert not judge.tally.violations


# ---- the mass-spring of the README ---------------------------------------------------------------------------------------

T = 0.01
CHANNEL = Channel(("force", "noise"), ("position",), weights=(1.0, 0.2))


def mass_spring() -> LpvModel:
    """As in the README, with an input to drive it by."""
    m, d, k = sp.symbols("mass damping stiffness")
    return LpvModel(
        name="mass-spring",
        source="Newton",
        states=(Signal("position", "m"), Signal("velocity", "m/s")),
        inputs=(Signal("drive", "N"),),
        outputs=(Signal("measured_position", "m"),),
        disturbances=(Signal("force", "N"), Signal("noise", "m")),
        parameters=(SchedulingParameter("stiffness", "N/m", 10.0, 40.0, -50.0, 50.0),),
        constants={"mass": Constant(2.0, "kg", "scale"), "damping": Constant(1.0, "N*s/m", "data sheet")},
        A=sp.Matrix([[0, 1], [-k / m, -d / m]]),
        B=sp.Matrix([[0], [1 / m]]),
        C=sp.Matrix([[1, 0]]),
        E=sp.Matrix([[0, 0], [1 / m, 0]]),
        F=sp.Matrix([[0, 1]]),
    )


@pytest.fixture(scope="module")
def held() -> Deployment:
    design = ObserverDesign((CHANNEL,), degree=1, decay_rate=2.0, fastest_pole=40.0)
    return deploy(design_observer(mass_spring(), design), DeploySettings(sample_time=T))


@pytest.fixture(scope="module")
def sampled() -> Deployment:
    design = ObserverDesign((CHANNEL,), degree=1, decay_rate=2.0)
    return deploy(design_sampled_observer(mass_spring(), design, T), DeploySettings(sample_time=T))


def errors(
    deployment: Deployment, seconds: float, frozen: bool, drive: float = 0.0, start: float = 0.0
) -> tuple[np.ndarray, ...]:
    """Errors and states (k+1, 2) and their rates (k, 2) from x = (1 m, 0) and the estimate (start, 0).

    The stiffness stays at 25 N/m, or swings between 10 and 40 at 50 N/m per second.
    """
    observer = LpvVelocityObserver(
        GainSchedule.from_content(schedule_content(deployment, "mass-spring")), (1,), "refuse"
    )
    observer.reset(state=[[start, 0.0]])
    x, e, rates = [np.array([1.0, 0.0])], [np.array([1.0 - start, 0.0])], []
    for k in range(round(seconds / T)):
        stiffness = 25.0 + (0.0 if frozen else 30.0 / np.pi * 0.999 * np.arcsin(np.sin(np.pi * 50.0 / 30.0 * k * T)))
        force = drive * np.sin(3.0 * k * T)
        step = observer.step([force], [x[-1][0]], [stiffness])
        motion = np.array([[0.0, 1.0, 0.0], [-stiffness / 2.0, -0.5, force / 2.0], [0.0, 0.0, 0.0]])
        rates.append(motion[:2] @ [*x[-1], 1.0])
        x.append((expm(T * motion) @ [*x[-1], 1.0])[:2])
        e.append(x[-1] - step.estimate[0])
    return np.array(e), np.array(x), np.array(rates)


def stall(deployment: Deployment, stiffness: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """e^(TA), e^M and S of the module docstring."""
    A, C = np.array([[0.0, 1.0], [-stiffness / 2.0, -0.5]]), np.array([[1.0, 0.0]])
    (points,) = deployment.breakpoints
    L = np.array([[np.interp(stiffness, points, deployment.table[:, i, 0])] for i in (0, 1)])
    blocks = [expm(T * np.block([[M, np.eye(2)], [np.zeros((2, 4))]])) for M in (A, A - L @ C)]
    (coast, drive), (closed, pull) = ((block[:2, :2], block[:2, 2:]) for block in blocks)
    return coast, closed, solve_sylvester(-closed, coast, (drive - pull) @ A)


def test_the_held_mass_spring_stalls_as_its_closed_form_says(held: Deployment) -> None:
    """e_k = S x_k + e^(k M) (e_0 - S x_0): at 11 s the position is off by 1e-3 m, where e^(-2.67 t) says 2e-13."""
    e, x, _ = errors(held, 11.0, frozen=True)
    coast, closed, S = stall(held, 25.0)
    for k in (1, 10, 100, 500, 1100):
        np.testing.assert_allclose(x[k], np.linalg.matrix_power(coast, k) @ x[0], rtol=1e-9, atol=1e-12)
        expected = S @ x[k] + np.linalg.matrix_power(closed, k) @ (e[0] - S @ x[0])
        np.testing.assert_allclose(e[k], expected, rtol=1e-8, atol=1e-12)
    rate = next(claim.level for claim in held.claims if claim.kind == "internal update")
    assert np.abs(e[-1, 0]) > 1e8 * np.exp(-rate * 11.0)
    assert 1e-4 < np.abs(e[-100:, 0]).max() < 3e-3


@pytest.mark.parametrize("drive", [0.0, 10.0])
def test_the_moving_mass_spring_stalls_with_held_measurements_and_converges_without(
    held: Deployment, sampled: Deployment, drive: float
) -> None:
    """Stiffness swinging at its largest rate: 6e-4 m (free) or 2e-2 m (driven) remain, against rounding."""
    off, _, _ = errors(held, 11.0, frozen=False, drive=drive)
    good, x, _ = errors(sampled, 14.0, frozen=False, drive=drive)
    assert np.abs(off[-100:, 0]).max() > 1e-4
    assert np.abs(good[-1]).max() < 1e-12
    assert np.abs(x[-300:]).max() > 1e-2  # it is not at rest
    rate = next(claim.level for claim in sampled.claims if claim.kind == "sampled error")
    for k in (100, 300, 600, 900, 1100):
        assert np.abs(good[k]).max() < 20.0 * np.exp(-rate * k * T) + 1e-14


def test_the_motion_gains_bound_the_stall_of_the_mass_spring(held: Deployment) -> None:
    """From an exact estimate: all of the error is motion, at most g_1 |x_1'| + g_2 |x_2'| in the l2 norm, and not far below."""
    e, _, rates = errors(held, 11.0, frozen=False, drive=10.0, start=1.0)
    gains = {next(iter(claim.channel.inputs)): claim.level for claim in held.claims if claim.kind == "motion gain"}  # type: ignore[union-attr]
    bound = sum(gains[name] * np.linalg.norm(rates[:, i]) for i, name in enumerate(("position", "velocity")))
    assert 0.3 * bound < np.linalg.norm(e[:-1, 0]) < bound
