"""Regions of the poles z of an update: designs against eigenvalues, claims against closed forms, and what is refused."""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from scipy.linalg import expm

from estimators.arrays import ComplexArray
from estimators.errors import GainsmithError, ScheduleError
from studies.report.frozen_levels import frozen_levels
from studies.spec import load_spec
from synthesis.certificate.claims import Claim
from synthesis.certificate.proof import prove
from synthesis.certificate.refute import refuting_place
from synthesis.certificate.search import Search, Wish
from synthesis.certificate.verify import Names
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, design_observer
from synthesis.design.pole_regions import PoleRegions
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.sampled_regions import sampled_discs
from synthesis.design.sampled_state_feedback import design_sampled_state_feedback
from synthesis.design.state_feedback import StateFeedbackDesign, StateFeedbackGains, design_state_feedback
from synthesis.errors import ProblemError
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.from_model import plant_of
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
T, CENTRE = 0.1, 0.7
POINTS = np.linspace(0.0, 4.0, 9)
REGIONS = {
    "vertical_strip": PoleRegions(vertical_strip=(0.8, 6.0)),
    "horizontal_strip": PoleRegions(vertical_strip=(0.3, 6.0), horizontal_strip=1.0),
    "sampled_disc": PoleRegions(sampled_disc=(CENTRE, 0.25)),
}
ALL = PoleRegions(vertical_strip=(0.8, 6.0), horizontal_strip=2.5, sampled_disc=(CENTRE, 0.25))
LAW = StateFeedbackDesign((FeedbackChannel(("d1",), ("x1", "u1"), sizes=(0.3, 1.0)),))
OBSERVER = ObserverDesign((Channel(("d1", "d2", "d3"), ("x1", "x2")),))


def spring() -> LpvModel:
    """x'' = -(4 + p) x - x'/10 + u + d1, both states measured with noise."""
    return small_model(
        [[0, 1], [-4 - p, -sp.Rational(1, 10)]], sp.eye(2), (parameter("p", 0.0, 4.0, 1.0),),
        B=[[0], [1]], E=[[0, 0, 0], [1, 0, 0]], F=[[0, sp.Rational(1, 10), 0], [0, 0, sp.Rational(1, 10)]],
    )  # fmt: skip


@cache
def designed(regions: PoleRegions) -> list[ObserverGains | StateFeedbackGains]:
    law = design_sampled_state_feedback(spring(), replace(LAW, regions=regions), T)
    return [law, design_sampled_observer(spring(), replace(OBSERVER, regions=regions), T)]


def poles(gains: ObserverGains | StateFeedbackGains) -> ComplexArray:
    """z of the update with the exact matrix exponential, at standing parameters."""
    at, K = spring().on(POINTS), gains.gain(POINTS)
    wide = np.concatenate([np.concatenate([at.A, at.B], axis=2), np.zeros((len(POINTS), 1, 3))], axis=1)
    moved = expm(T * wide)[:, :2]
    Phi, Gamma = moved[:, :, :2], moved[:, :, 2:]
    return np.linalg.eigvals(Phi - K @ at.C if isinstance(gains, ObserverGains) else Phi + Gamma @ K).astype(complex)


def inside(regions: PoleRegions, z: ComplexArray) -> bool:
    s = np.log(z) / T
    near, far = regions.vertical_strip or (-np.inf, np.inf)
    strips = (near <= -s.real) & (-s.real <= far) & (np.abs(s.imag) <= (regions.horizontal_strip or np.inf))
    centre, radius = regions.sampled_disc or (0.0, np.inf)
    return bool((strips & (np.abs(z - centre) <= radius)).all())


@pytest.mark.parametrize("name", REGIONS)
def test_every_pole_of_the_update_is_inside(name: str) -> None:
    """Of a law and of an observer; without the region some pole is outside."""
    regions = REGIONS[name]
    for gains, free in zip(designed(regions), designed(replace(regions, **{name: None})), strict=True):
        assert inside(regions, poles(gains))
        assert not inside(regions, poles(free))


@pytest.fixture(scope="module")
def content() -> dict[str, Any]:
    return schedule_content(deploy(designed(ALL)[1], DeploySettings(sample_time=T)), "regions")


def test_what_was_asked_is_claimed_of_the_table(content: dict[str, Any]) -> None:
    """Every region at its level, proved; a claim a little tighter than the poles at standing parameters is refuted."""
    asked = {kind: level for kind, level, _ in ALL.of_update}
    proofs, levels = prove(content), frozen_levels(content)
    assert all(proof.proved for proof in proofs)
    assert {proof.kind: proof.level for proof in proofs if proof.kind in asked} == asked
    assert "update: radius of poles z about 0.7" in [proof.claim for proof in proofs]
    tight = set(asked) - {"sampled imaginary part"}  # here all poles are real: nothing is tighter
    tighter = copy.deepcopy(content)
    for claim, level in zip(tighter["claims"], levels, strict=True):
        assert level.slack > 0.0
        if claim["kind"] in tight:
            claim["level"] = float(level.values[level.tightest] * (1.001 if level.larger_is_better else 0.999))
    assert [proof.refuted for proof in prove(tighter)] == [proof.kind in tight for proof in proofs]


@pytest.mark.parametrize("slope", [p, 1 / (1 + p)])
def test_the_disc_of_a_loop_of_first_order(slope: sp.Expr) -> None:
    """x' = -a x + u with u = -2 x: z = e^(-aT) - 2 (1 - e^(-aT))/a, and |z - q| is largest at an end; also for a rational a."""
    model = small_model([[-slope]], [[1]], (parameter("p", 1.0, 3.0, 1.0),), E=[[1]], B=[[1]])
    loop = FeedbackLoop.constant_gain(plant_of(model), fmpq_mat([[-2]]), sample_time=fmpq(1, 2))
    search = Search(loop, Names(("x1",), ("d1",), ("x1", "y1", "u1")), model.parameters)
    for centre in (-0.4, 0.6):
        a = np.array([float(slope.subs(p, x)) for x in (1.0, 3.0)])
        furthest = np.abs(np.exp(-a / 2) - 2.0 * (1.0 - np.exp(-a / 2)) / a - centre).max()
        claim, _ = search.prove(Wish("sampled disc", furthest * (1.0 + 1e-5), centre=centre))
        assert claim is not None
        tighter = Claim("sampled disc", furthest * (1.0 - 1e-5), claim.P, centre=centre)
        assert not search.verifier.prove(tighter).proved
        assert refuting_place(search.verifier, tighter) is not None


def test_discs_lie_in_the_regions_they_stand_for() -> None:
    """Points of the unit disc in both mirror images of a disc have logarithms in the strip."""
    rng = np.random.default_rng(0)
    z = np.sqrt(rng.uniform(size=20000)) * np.exp(1j * rng.uniform(-np.pi, np.pi, 20000))
    for regions in (PoleRegions(vertical_strip=(1.0, 9.0)), PoleRegions(horizontal_strip=8.0)):
        kept = np.ones(len(z), dtype=bool)
        for w, R in sampled_discs(regions, T).values():
            kept &= (np.abs(z - w) < R) & (np.abs(z - np.conj(w)) < R)
        assert kept.sum() > 1000
        assert inside(regions, z[kept])


def test_regions_of_the_other_time_are_refused(tmp_path: Path) -> None:
    for given, words in (
        (PoleRegions(disc=1.0), "regions: disc has no image"), (PoleRegions(damping=0.7), "regions: damping has no image"),
        (PoleRegions(horizontal_strip=16.0), "too wide for samples of 0.1 s; give less than pi/2 .* 15.708 rad/s"),
    ):  # fmt: skip
        with pytest.raises(ProblemError, match=words):
            design_sampled_observer(spring(), replace(OBSERVER, regions=given), T)
        with pytest.raises(ProblemError, match=words):
            design_sampled_state_feedback(spring(), replace(LAW, regions=given), T)
    disc = PoleRegions(sampled_disc=(0.5, 0.4))
    with pytest.raises(ProblemError, match="sampled_disc is for sampled designs"):
        design_observer(spring(), replace(OBSERVER, regions=disc))
    with pytest.raises(ProblemError, match="sampled_disc is for sampled designs"):
        design_state_feedback(spring(), replace(LAW, regions=disc))
    for centre, radius in ((2.0, 0.5), (0.0, 0.0), (np.nan, 1.0)):
        with pytest.raises(ProblemError, match=r"must hold the centre and the radius"):
            PoleRegions(sampled_disc=(centre, radius))
    examples = Path(__file__).parents[2] / "studies" / "examples"
    for name, line, words in (
        ("quarter-car-observer", "{ disc = 1.0 }", "design.regions: disc has no image"),
        ("quarter-car-feedback", "{ sampled_disc = [0.5, 0.4] }", "sampled_disc is for sampled designs"),
    ):
        text = (examples / f"{name}.toml").read_text().replace("degree = 1", f"degree = 1\nregions = {line}", 1)
        (tmp_path / "spec.toml").write_text(text)
        with pytest.raises(GainsmithError, match=words):
            load_spec(tmp_path / "spec.toml")
    text = text.replace('law = "state feedback"', 'law = "sampled state feedback"')
    (tmp_path / "spec.toml").write_text(text.replace("fastest_pole = 300.0\n", ""))
    design = load_spec(tmp_path / "spec.toml")[0].feedback_design()
    assert isinstance(design, StateFeedbackDesign)
    assert design.regions == PoleRegions(sampled_disc=(0.5, 0.4))


def test_a_centre_belongs_to_a_disc_alone(content: dict[str, Any]) -> None:
    content = copy.deepcopy(content)
    disc = next(claim for claim in content["claims"] if claim["kind"] == "sampled disc")
    for kind, centre, words in (
        ("sampled disc", "0.7", r"claims\[\d\].centre"), ("sampled slowest pole", 0.7, "'sampled slowest pole' needs no centre"),
        ("sampled disc", None, "'sampled disc' needs a centre"),
    ):  # fmt: skip
        disc |= {"kind": kind, "centre": centre}
        if centre is None:
            del disc["centre"]
        with pytest.raises(ScheduleError, match=words):
            prove(content)
