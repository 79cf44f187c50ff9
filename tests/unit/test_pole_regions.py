"""Regions of frozen poles: designs, inequalities against eigenvalues, claims of deployed tables, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from flint import arb_mat, fmpq_mat
from scipy.linalg import expm

from estimators.arrays import FloatArray
from estimators.errors import GainsmithError
from studies.preflight import check_before_design
from studies.report.frozen_levels import frozen_levels
from studies.spec import load_spec
from synthesis.certificate.claims import LARGER_IS_BETTER
from synthesis.certificate.poles import pole_inequality, pole_levels, pole_outside
from synthesis.certificate.proof import prove
from synthesis.certificate.verify import Balls
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.pole_regions import PoleRegions
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback
from synthesis.errors import ProblemError
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.definite import is_positive_definite
from synthesis.polynomials.enclosure import constant
from synthesis.polynomials.rational import decimal, rational
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
PERIOD = 0.1
KINDS = (
    "slowest pole", "pole radius", "damping ratio", "imaginary part", "sampled slowest pole", "sampled fastest pole",
    "sampled imaginary part", "sampled disc",
)  # fmt: skip


def exact(matrix: FloatArray) -> fmpq_mat:
    return fmpq_mat([[rational(float(x)) for x in row] for row in matrix])


def level_of(kind: str, A: FloatArray) -> FloatArray:
    return pole_levels(kind, np.asarray(np.linalg.eigvals(A)), PERIOD)


def region_matrix(A: FloatArray, inequality: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """P = V^-* V^-1 of the eigenvectors: for it the inequality of a region holds just where all poles are inside."""
    V = np.linalg.inv(np.linalg.eig(A)[1])
    return inequality(np.real(V.conj().T @ V))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_inequalities_and_refutations_say_what_eigenvalues_say(kind: str, seed: int) -> None:
    """A little looser than the poles it is proved by the P of the eigenvectors, a little tighter it is refuted."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 3)) - 3.0 * np.eye(3) + 2.0 * np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])
    A = expm(PERIOD * A) if kind.startswith("sampled") else A
    level = float(level_of(kind, A[None])[0])
    larger = kind in LARGER_IS_BETTER
    for step, inside in ((1.01, True), (0.99, False)):
        number = rational(level / step if larger else level * step)

        def holds(P: FloatArray, number: Any = number) -> Any:
            ball = constant(exact(0.5 * (P + P.T)), 0).balls()
            found = pole_inequality(kind, number, decimal(PERIOD), constant(exact(A), 0).balls(), ball, ball, Balls())
            return is_positive_definite(found.at(()))

        assert bool(region_matrix(A, holds)) == inside
        assert pole_outside(kind, number, decimal(PERIOD), arb_mat(exact(A))) == (not inside)


def spring(rate: float = 1.0) -> LpvModel:
    """x'' = -(4 + p) x - x'/10 + u + d1, both states measured with noise."""
    return small_model(
        [[0, 1], [-4 - p, -sp.Rational(1, 10)]], sp.eye(2), (parameter("p", 0.0, 4.0, rate),),
        B=[[0], [1]], E=[[0, 0, 0], [1, 0, 0]], F=[[0, sp.Rational(1, 10), 0], [0, 0, sp.Rational(1, 10)]],
    )  # fmt: skip


REGIONS = {
    "vertical_strip": PoleRegions(vertical_strip=(0.8, 2.5)),
    "horizontal_strip": PoleRegions(vertical_strip=(0.0, 1.5), horizontal_strip=1.0),
    "disc": PoleRegions(disc=2.2, damping=0.7),
    "damping": PoleRegions(disc=2.2, damping=0.95),
}


@pytest.mark.parametrize("name", REGIONS)
def test_every_frozen_pole_lies_in_the_region(name: str) -> None:
    """Of a law and of an observer; without it some pole is outside."""
    regions = REGIONS[name]
    points = np.linspace(0.0, 4.0, 21)
    m = spring().on(points)
    channel = FeedbackChannel(("d1",), ("x1", "u1"), sizes=(0.3, 1.0))
    errors = Channel(("d1", "d2", "d3"), ("x1", "x2"))
    for inside in (True, False):
        chosen = regions if inside else replace(regions, **{name: None})
        law = design_state_feedback(spring(), StateFeedbackDesign((channel,), regions=chosen))
        observer = design_observer(spring(), ObserverDesign((errors,), regions=chosen))
        loops = (m.A + m.B @ law.gain(points), m.A - observer.gain(points) @ m.C)
        kept = [
            (level <= best if kind in LARGER_IS_BETTER else best <= level).all()
            for kind, level in regions.claims.items()
            for best in (level_of(kind, A) for A in loops)
        ]
        assert all(kept) == inside


def test_claims_about_poles_of_the_deployed_table() -> None:
    """Of an observer those that were asked for; of a law the annulus and the sector of its update. Tighter ones are refuted."""
    regions = PoleRegions(disc=4.0, damping=0.6, vertical_strip=(0.8, 3.5), horizontal_strip=2.0)
    observer = design_observer(spring(), ObserverDesign((Channel(("d1", "d2", "d3"), ("x1",)),), regions=regions))
    channel = FeedbackChannel(("d1",), ("x1", "u1"), sizes=(0.3, 1.0))
    law = design_state_feedback(spring(), StateFeedbackDesign((channel,), regions=regions))
    settings = DeploySettings(sample_time=0.05)
    for gains, kinds in ((observer, KINDS[:4]), (law, KINDS[4:7])):
        content = schedule_content(deploy(gains, settings), "regions")
        proofs = prove(content)
        assert all(proof.proved for proof in proofs)
        assert set(kinds) <= {proof.kind for proof in proofs}
        for proof, frozen in zip(proofs, frozen_levels(content), strict=True):
            assert frozen.slack >= 0.0
            if proof.kind in kinds:
                asked = regions.claims[proof.kind.removeprefix("sampled ")]
                assert proof.level == asked if gains is observer else proof.level == pytest.approx(asked, rel=0.15)
                assert proof.unit == {"damping ratio": "1"}.get(
                    proof.kind, "rad/s" if "imaginary" in proof.kind else "1/s"
                )
        for claim, frozen in zip(content["claims"], frozen_levels(content), strict=True):
            if claim["kind"] in kinds:
                claim["level"] = float(frozen.values[frozen.tightest] * (1.01 if frozen.larger_is_better else 0.99))
        assert [proof.refuted for proof in prove(content)] == [proof.kind in kinds for proof in proofs]


def test_a_disc_bounds_gains_as_a_fastest_pole_does(tmp_path: Path) -> None:
    """Without either, a law whose input no channel sees is refused; a strip of imaginary parts alone is no bound."""
    examples = Path(__file__).parents[2] / "studies" / "examples"
    (tmp_path / "quarter-car.toml").write_text((examples / "quarter-car.toml").read_text())
    text = (examples / "quarter-car-feedback.toml").read_text().replace("fastest_pole = 300.0", "regions = REGIONS")
    performance = '["measured_body_acceleration", "suspension_deflection", "tire_deflection", "strut_force"]'
    text = text.replace(performance, '["tire_deflection"]').replace("[0.5, 0.1, 0.02, 500.0]", "[0.02]")
    for given, good in (("{ disc = 300.0 }", True), ("{ horizontal_strip = 300.0 }", False)):
        (tmp_path / "law.toml").write_text(text.replace("REGIONS", given))
        spec, folder = load_spec(tmp_path / "law.toml")
        if good:
            check_before_design(spec, spec.plant(folder).model)
        else:
            with pytest.raises(GainsmithError, match="so its gains have no bound"):
                check_before_design(spec, spec.plant(folder).model)


def test_regions_that_mean_nothing_are_refused(tmp_path: Path) -> None:
    for given, words in (
        ({"vertical_strip": (3.0, 2.0)}, "two rising numbers"), ({"disc": -1.0}, "disc -1.0 1/s must be a positive"),
        ({"horizontal_strip": np.inf}, "rad/s must be a positive"), ({"damping": 1.0}, "damping ratio between 0 and 1"),
    ):  # fmt: skip
        with pytest.raises(ProblemError, match=words):
            PoleRegions(**given)
    design = ObserverDesign((Channel(("d1",), ("x1",)),), regions=PoleRegions(disc=1.0))
    with pytest.raises(ProblemError, match="regions: disc has no image"):
        design_sampled_observer(spring(), design, 0.1)
    examples = Path(__file__).parents[2] / "studies" / "examples"
    for name, line, words in (
        ("quarter-car-feedback", "{ vertical_strip = [1.0] }", "vertical_strip"),
        ("quarter-car-feedback", "{ strip = 1.0 }", "strip"),
        (
            "quarter-car-output-feedback",
            "{ sampled_disc = [0.5, 0.4] }",
            "regions: sampled_disc is for sampled designs",
        ),
        ("quarter-car-observer", "{ disc = 1.0 }", "regions: disc has no image"),
    ):
        text = (examples / f"{name}.toml").read_text().replace("degree = 1", f"degree = 1\nregions = {line}", 1)
        (tmp_path / "spec.toml").write_text(text)
        with pytest.raises(GainsmithError, match=words):
            load_spec(tmp_path / "spec.toml")
