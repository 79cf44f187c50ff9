"""Channels in other norms than the L2 gain: closed forms, mixed designs, claims of the deployed table, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov, solve_discrete_lyapunov

from analysis import hinf_norm
from analysis.simulation.amplification import amplification
from estimators.arrays import FloatArray
from studies.report.frozen_levels import frozen_levels
from synthesis.certificate.proof import prove
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.norms import Norm
from synthesis.design.output_feedback import OutputFeedback, OutputFeedbackDesign, design_output_feedback
from synthesis.design.pole_regions import PoleRegions
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.sampled_state_feedback import design_sampled_state_feedback
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback
from synthesis.design.static_feedback import design_static_feedback
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.errors import ProblemError
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
PEAK: Norm = "generalised H2"
STILL = np.array([0.0])


def spring(width: float = 1e-6, rate: float = 0.0) -> LpvModel:
    """x'' = -(4 + p) x - x'/10 + u + d1, the position measured with noise d2."""
    return small_model(
        [[0, 1], [-4 - p, -sp.Rational(1, 10)]], [[1, 0]], (parameter("p", 0.0, width, rate),),
        B=[[0], [1]], E=[[0, 0], [1, 0]], F=[[0, sp.Rational(3, 10)]],
    )  # fmt: skip


def energies(A: FloatArray, B: FloatArray, C: FloatArray, period: float = 0.0) -> dict[str, float]:
    """H2 and generalised H2 norm from the controllability gramian, of sums over samples or of integrals."""
    X = solve_discrete_lyapunov(A, B @ B.T) / period if period else solve_continuous_lyapunov(A, -B @ B.T)
    S = C @ X @ C.T
    return {"H2": float(np.sqrt(np.trace(S))), PEAK: float(np.sqrt(np.linalg.eigvalsh(S)[-1]))}


def law(norm: Norm, **more: Any) -> FeedbackChannel:
    return FeedbackChannel(("d1",), ("x1", "u1"), sizes=(0.05, 1.0), norm=norm, **more)


def closed(K: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    at = spring().on(STILL)
    return at.A[0] + at.B[0] @ K, at.E[0][:, :1], np.vstack([[20.0, 0.0], K])


def test_the_least_h2_norms_are_those_of_riccati_equations() -> None:
    """LQR and the Kalman filter; the observer's largest error by energy is the root of the filter's largest eigenvalue."""
    at = spring().on(STILL)
    A, B, C = at.A[0], at.B[0], at.C[0]
    gains = design_state_feedback(spring(), StateFeedbackDesign((law("H2"),)))
    best = float(np.sqrt(solve_continuous_are(A, B, np.diag([400.0, 0.0]), np.eye(1))[1, 1]))
    assert gains.gamma_lower is not None and gains.gamma_lower == pytest.approx(best, rel=2e-3)
    assert energies(*closed(gains.gain(STILL)[0]))["H2"] <= gains.gamma < 1.02 * best
    S = solve_continuous_are(A.T, C.T, np.diag([0.0, 1.0]), 0.09 * np.eye(1))
    found: dict[Norm, float] = {"H2": float(np.sqrt(np.trace(S))), PEAK: float(np.sqrt(np.linalg.eigvalsh(S)[-1]))}
    for norm, least in found.items():
        channel = Channel(("d1", "d2"), ("x1", "x2"), norm=norm)
        observer = design_observer(spring(), ObserverDesign((channel,)))
        L = observer.gain(STILL)[0]
        assert observer.gamma_lower is not None and observer.gamma_lower == pytest.approx(least, rel=2e-3)
        assert least <= energies(A - L @ C, at.E[0] - L @ at.F[0], np.eye(2))[norm] <= observer.gamma < 1.02 * least


def noisy_law(norm: Norm, **more: Any) -> FeedbackChannel:
    return replace(law(norm, **more), disturbances=("d1", "d2"))


def closed_by(found: OutputFeedback) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The spring with a controller that has no feedthrough; x1/0.05 and u1 are looked at."""
    at, (Ak, Bk, Ck, _) = spring().on(STILL), (matrix[0] for matrix in found.controller(STILL))
    A = np.block([[at.A[0], at.B[0] @ Ck], [Bk @ at.C[0], Ak]])
    return (
        A,
        np.vstack([at.E[0], Bk @ at.F[0]]),
        np.block([[np.array([[20.0, 0.0, 0.0, 0.0]])], [np.zeros((1, 2)), Ck]]),
    )


def test_the_least_h2_norm_of_output_feedback_is_that_of_two_riccati_equations() -> None:
    """The linear quadratic Gaussian regulator; a peak below it, mixed with an L2 gain, and never below the loop's own."""
    at = spring().on(STILL)
    A, B, C, E, F = (getattr(at, key)[0] for key in "ABCEF")
    X, S = (
        solve_continuous_are(A, B, np.diag([400.0, 0.0]), np.eye(1)),
        solve_continuous_are(A.T, C.T, E @ E.T, F @ F.T),
    )
    best = float(np.sqrt(np.trace(E.T @ X @ E) + np.trace(B.T @ X @ S @ X @ B)))
    found = design_output_feedback(spring(), OutputFeedbackDesign((noisy_law("H2"),)))
    assert found.gamma_lower == pytest.approx(best, rel=1e-4)
    assert best * (1.0 - 1e-6) <= energies(*closed_by(found))["H2"] <= found.gamma < 1.02 * best
    with pytest.raises(ProblemError):  # no law is below the best
        design_output_feedback(spring(), OutputFeedbackDesign((noisy_law("H2", bound=0.98 * best), noisy_law(PEAK))))
    peak = design_output_feedback(spring(), OutputFeedbackDesign((noisy_law(PEAK),)))
    assert 0.98 * peak.gamma < energies(*closed_by(peak))[PEAK] <= peak.gamma < found.gamma
    gain = FeedbackChannel(("d1", "d2"), ("x1",), bound=9.0)
    loose, tight = (
        design_output_feedback(spring(), OutputFeedbackDesign((noisy_law("H2"), replace(gain, bound=bound))))
        for bound in (50.0, 0.45)
    )
    assert loose.gamma == pytest.approx(found.gamma, rel=2e-3)
    level = [float(hinf_norm(A, B, C[:1] / 20.0).norm) for A, B, C in map(closed_by, (found, tight))]
    assert level[1] <= 0.45 < level[0] and energies(*closed_by(tight))["H2"] <= tight.gamma < 1.4 * best


def test_output_feedback_between_strips_and_what_is_claimed_of_its_table() -> None:
    """Of a moving stiffness: poles at frozen places, every claim proved, and a lower level of a norm refuted."""
    regions = PoleRegions(vertical_strip=(1.0, 15.0), horizontal_strip=3.5)
    free, bound = (
        design_output_feedback(spring(2.0, 1.0), OutputFeedbackDesign((noisy_law(PEAK),), regions=given))
        for given in (PoleRegions(), regions)
    )
    A, *_ = closed_by(bound)
    poles, others = np.linalg.eigvals(A), np.linalg.eigvals(closed_by(free)[0])
    assert poles.real.min() > -15.0 and poles.real.max() < -1.0 and np.abs(poles.imag).max() < 3.5
    assert not (others.real.min() > -15.0 and others.real.max() < -1.0 and np.abs(others.imag).max() < 3.5)
    content = schedule_content(deploy(bound, DeploySettings(sample_time=0.02)), "strips")
    kinds = [claim["kind"] for claim in content["claims"]]
    assert {"sampled energy to peak", "sampled slowest pole", "sampled fastest pole", "sampled imaginary part"} < set(
        kinds
    )
    assert all(proof.proved for proof in prove(content))
    place = kinds.index("sampled energy to peak")
    content["claims"][place]["level"] = 0.9 * frozen_levels(content)[place].values.max()
    assert [proof.refuted for proof in prove(content)] == [i == place for i in range(len(kinds))]


@pytest.mark.parametrize("norm", [PEAK, "H2"])
def test_sampled_designs_have_levels_of_continuous_time(norm: Norm) -> None:
    """Near the level of the discretised loop, and for short samples near that of the design without samples."""
    T, at = 0.02, spring().on(STILL)
    Phi, Gamma = zero_order_hold(at.A[0], np.hstack([at.B[0], at.E[0]]), T)
    gains = design_sampled_state_feedback(spring(), StateFeedbackDesign((law(norm),)), T)
    K = gains.gain(STILL)[0]
    level = energies(Phi + Gamma[:, :1] @ K, Gamma[:, 1:], np.vstack([[20.0, 0.0], K]), T)[norm]
    assert 0.98 * gains.gamma < level <= gains.gamma
    assert design_state_feedback(spring(), StateFeedbackDesign((law(norm),))).gamma == pytest.approx(
        gains.gamma, rel=0.06
    )
    channel = Channel(("d1", "d2"), ("x1", "x2"), norm=norm)
    observer = design_sampled_observer(spring(), ObserverDesign((channel,)), T)
    K = observer.gain(STILL)[0]
    level = energies(Phi - K @ at.C[0], Gamma[:, 1:] - K @ at.F[0], np.eye(2), T)[norm]
    assert 0.98 * observer.gamma < level <= observer.gamma


def test_mixed_channels_cost_what_they_ask_for_and_no_unit_of_time_chooses() -> None:
    """A peak beside a bound on the L2 gain: loose it costs nothing, tight it holds; in microseconds the same gains come out."""
    tight = FeedbackChannel(("d1",), ("x1",), bound=0.08)
    free, loose, mixed = (
        design_state_feedback(spring(), StateFeedbackDesign(channels))
        for channels in ((law(PEAK),), (law(PEAK), replace(tight, bound=10.0)), (law(PEAK), tight))
    )
    assert loose.gamma == pytest.approx(free.gamma, rel=2e-3) and mixed.gamma > 1.003 * free.gamma
    A, B, C = closed(mixed.gain(STILL)[0])
    assert energies(A, B, C)[PEAK] <= mixed.gamma
    assert (
        float(hinf_norm(A, B, C[:1] / 20.0).norm) <= 0.08 < float(hinf_norm(*closed(free.gain(STILL)[0])).norm) / 20.0
    )
    fast = replace(
        spring(), A=sp.Matrix([[0, 10**6], [(-4 - p) * 10**6, -(10**5)]]), B=sp.Matrix([[0], [10**6]]),
        E=sp.Matrix([[0, 0], [10**6, 0]]),
    )  # fmt: skip
    again = design_state_feedback(fast, StateFeedbackDesign((law(PEAK), tight)))
    assert again.gamma == pytest.approx(1000.0 * mixed.gamma, rel=1e-3)
    np.testing.assert_allclose(again.gain(STILL), mixed.gain(STILL), rtol=2e-2)
    # The other way round: the L2 gain is minimised below a bound on the peak.
    turned = (replace(tight, bound=None), replace(law(PEAK), bound=2.3))
    gains = design_state_feedback(spring(), StateFeedbackDesign(turned))
    A, B, C = closed(gains.gain(STILL)[0])
    assert energies(A, B, C)[PEAK] <= 2.3 and float(hinf_norm(A, B, C[:1] / 20.0).norm) <= gains.gamma < 0.09


@pytest.mark.parametrize("law_of", ["states", "held", "sampled"])
def test_the_claim_is_about_the_table_and_a_lower_one_is_refuted(law_of: str) -> None:
    """A spring whose stiffness moves; no frozen place and no trajectory beats the level that is proved."""
    model, T = spring(2.0, 1.0), 0.05
    gains: Any
    if law_of == "states":
        gains = design_state_feedback(model, StateFeedbackDesign((law(PEAK), law("H2", bound=4.0)), fastest_pole=12.0))
    else:
        largest = Channel(("d1", "d2"), ("x1",), norm=PEAK)
        channels = (largest, replace(largest, norm="H2", bound=1.1))
        if law_of == "held":
            gains = design_observer(model, ObserverDesign(channels, degree=0, fastest_pole=30.0))
        else:
            gains = design_sampled_observer(model, ObserverDesign(channels, degree=0), T)
    content = schedule_content(deploy(gains, DeploySettings(sample_time=T)), "peaks")
    kinds = [claim["kind"] for claim in content["claims"]]
    assert {"sampled energy to peak", "sampled H2 norm"} < set(kinds)
    assert ("energy to peak" in kinds) == (law_of == "held")
    proofs = prove(content)
    assert all(proof.proved for proof in proofs)
    peak = next(proof for proof in proofs if proof.kind == "sampled energy to peak")
    words = {"states": "d1 -> 0.05 1 x1 + 1 1 u1"}.get(law_of, "1 1 d1 + 1 1 d2 -> x1")
    assert (peak.claim, peak.unit) == (f"update: generalised H2 norm {words}", "1/(s^0.5)")
    for level in frozen_levels(content):
        assert level.slack >= 0.0
    if law_of == "states":
        assert not any(one.beaten for one in amplification(content, runs=2, samples=60))
    place = kinds.index("sampled energy to peak")
    content["claims"][place]["level"] *= 0.8 * frozen_levels(content)[place].values.max() / peak.level
    assert [proof.refuted for proof in prove(content)] == [i == place for i in range(len(kinds))]


@pytest.mark.parametrize("norm", [PEAK, "H2"])
def test_static_output_feedback_of_all_states_comes_near_state_feedback(norm: Norm) -> None:
    """Both states measured: a level of its own loop, and hardly above the least one, whatever unit time has."""
    levels = []
    for speed in (1, 10**6) if norm == PEAK else (1,):
        model = small_model(
            [[0, speed], [(-4 - p) * speed, -sp.Rational(speed, 10)]], sp.eye(2), (parameter("p", 0.0, 1e-6, 0.0),),
            B=[[0], [speed]], E=[[0], [speed]],
        )  # fmt: skip
        found = design_static_feedback(model, StaticFeedbackDesign((law(norm),), degree=0, start=((-3.0, -3.0),)))
        A, B, C = closed(found.gain(STILL)[0])
        assert energies(A * speed, B * speed, C)[norm] <= found.gamma
        levels.append(found.gamma / np.sqrt(speed))
    least = design_state_feedback(spring(), StateFeedbackDesign((law(norm),))).gamma_lower
    assert least is not None and levels == pytest.approx([least] * len(levels), rel=0.04) and min(levels) >= least
    # Noise that the law passes on: position alone, a fastest pole in the place of a cost of the input.
    channel = FeedbackChannel(("d1", "d2"), ("x1",), weights=(1.0, 0.3), norm=norm)
    found = design_static_feedback(spring(), StaticFeedbackDesign((channel,), degree=0, fastest_pole=8.0))
    at, K = spring().on(STILL), found.gain(STILL)[0]
    A, E = at.A[0] + at.B[0] @ K @ at.C[0], (at.E[0] + at.B[0] @ K @ at.F[0]) * np.array([1.0, 0.3])
    assert 0.98 * found.gamma < energies(A, E, np.eye(1, 2))[norm] <= found.gamma
    noisy = replace(law(norm), disturbances=("d2",))
    with pytest.raises(ProblemError, match=r"by F and the law\), so its .* norm is infinite"):
        design_static_feedback(spring(), StaticFeedbackDesign((noisy,)))


def test_what_has_no_such_norm_is_refused() -> None:
    channel = replace(law(PEAK), performance=("x1", "y1"), disturbances=("d2",))
    with pytest.raises(ProblemError, match=r"'d2' acts on 'y1' at once \(F\), so its generalised H2 norm is infinite"):
        design_state_feedback(spring(), StateFeedbackDesign((channel,)))
    with pytest.raises(ProblemError, match=r"'d2' acts on 'y1' at once \(F\), so its generalised H2 norm is infinite"):
        design_output_feedback(spring(), OutputFeedbackDesign((channel,)))
    with pytest.raises(
        ProblemError, match="noise moves inputs at once, where the norm 'H2' is infinite; leave `feedthrough`"
    ):
        design_output_feedback(spring(), OutputFeedbackDesign((noisy_law("H2"),), feedthrough=True))
    wrong: Any = "H3"
    with pytest.raises(ProblemError, match="unknown norm 'H3'; known: H-infinity, H2, generalised H2"):
        ObserverDesign((Channel(("d1",), ("x1",), norm=wrong),))
