"""Observers over two and three parameters, end to end: design, table, proof, file, runtime; and what must be refused."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat

from estimators import GainSchedule, LpvObserver
from estimators.errors import ScheduleError
from estimators.schedule import read_content
from synthesis.certificate.inequalities import Question
from synthesis.certificate.proof import certificate, prove
from synthesis.certificate.quick import _Form, quickly_proved
from synthesis.certificate.verify import Verifier
from synthesis.design import deploy as deploying
from synthesis.design.deploy import Deployment, deploy, names_of
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import export, schedule_content
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.errors import ProblemError
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.enclosure import PolynomialMatrix
from tests.support.lmi_cases import parameter, small_model

p, q, r = sp.symbols("p q r")
DESIGN = ObserverDesign((Channel(("d1", "d2"), ("x1", "x2")),), degree=1, decay_rate=0.05, fastest_pole=60.0)


def spring(count: int = 2, rate: float = 2.0) -> LpvModel:
    """A damped spring: stiffness, damping and the sensor's gain move."""
    parameters = [parameter(name, rate=rate) for name in "pqr"[:count]]
    sensor = 1 + r / 10 if count == 3 else 1
    return small_model(
        [[0, 1], [-10 - 2 * p, -(sp.Rational(1, 2) + q / 5)]], [[sensor, 0]], parameters,
        B=[[0], [1]], E=[[0, 0], [1, 0]], F=[[0, sp.Rational(1, 10)]],
    )  # fmt: skip


@pytest.fixture(scope="module")
def deployment() -> Deployment:
    return deploy(design_observer(spring(), DESIGN))


@pytest.fixture(scope="module")
def content(deployment: Deployment, tmp_path_factory: pytest.TempPathFactory) -> dict:  # type: ignore[type-arg]
    path = tmp_path_factory.mktemp("two") / "spring.json"
    export(path, schedule_content(deployment, "spring"))
    return dict(read_content(path))


def test_two_parameters_are_designed_tabulated_proved_and_written(deployment: Deployment, content: dict) -> None:  # type: ignore[type-arg]
    assert deployment.table.ndim == 4
    kinds = [claim.kind for claim in deployment.claims]
    assert kinds[:3] == ["decay rate", "fastest pole", "gain"]
    assert {"internal update", "sampled gain", "motion gain", "drop probability"} <= set(kinds)
    assert all(proof.proved for proof in certificate(content).proofs)


def test_what_is_proved_is_true_of_random_loops(deployment: Deployment) -> None:
    """Frozen poles between decay and fastest pole, and a simulated gain along random admissible motions below the level."""
    gains, rng = deployment.gains, np.random.default_rng(0)
    model, loop = gains.model, GainSchedule.from_content(schedule_content(deployment, "spring"))
    places = rng.uniform(-1.0, 1.0, (200, 2))
    A, E = model.on(places).error_dynamics(loop.gain(places))
    poles = np.linalg.eigvals(A)
    assert poles.real.max() < -0.05
    assert poles.real.min() > -60.0
    level = next(claim.level for claim in deployment.claims if claim.kind == "gain")
    frequencies = 1j * np.geomspace(0.01, 100.0, 60)
    response = np.linalg.solve(frequencies[:, None, None, None] * np.eye(2) - A, np.broadcast_to(E, (60, *E.shape)))
    peak = float(np.linalg.norm(response, 2, axis=(-2, -1)).max())
    assert 0.5 * level < peak < level  # the bound is not idle


@pytest.mark.parametrize("index", [(0, 0), (1, 1)])
def test_a_changed_gain_or_level_is_not_proved(content: dict, index: tuple[int, int]) -> None:  # type: ignore[type-arg]
    worse = copy.deepcopy({key: value for key, value in content.items() if "sha256" not in key})
    worse["gain"]["table"][index[0]][index[1]][0][0] -= 30.0
    assert not all(proof.proved for proof in prove(worse))
    better = copy.deepcopy({key: value for key, value in content.items() if "sha256" not in key})
    claim = next(claim for claim in better["claims"] if claim["kind"] == "gain")
    claim["level"] *= 0.95
    found = next(proof for proof in prove(better) if proof.kind == "gain")
    assert not found.proved


def test_the_quick_road_proves_nothing_that_balls_refuse(deployment: Deployment) -> None:
    """Both methods on the claims as they are, and on the same claims at levels that do not hold."""
    loop, names = deployment.loop, names_of(deployment.gains.model)
    for claim in deployment.claims:
        easier_up = "gain" in claim.kind or "pole" in claim.kind
        level = claim.level / 20.0 if easier_up else 0.9999 if claim.kind == "drop probability" else 300.0 * claim.level
        harder = replace(claim, level=level)
        for asked in (claim, harder):
            both = Verifier(loop, names)
            plain = Verifier(loop, names)
            plain.boxes.update(continuous=None, discrete=None)  # balls alone
            assert both.prove(asked).proved is plain.prove(asked).proved is (asked is claim)


def test_most_cells_are_proved_on_the_quick_road(deployment: Deployment) -> None:
    """Otherwise certifying a large table takes minutes."""
    verifier = Verifier(deployment.loop, names_of(deployment.gains.model))
    seen = []

    def counted(*given: object) -> object:
        seen.append(quickly_proved(*given))  # type: ignore[arg-type]
        return seen[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("synthesis.certificate.verify.quickly_proved", counted)
        for claim in deployment.claims:
            verifier.prove(claim)
    assert np.mean(np.concatenate([done for done, _ in seen])) > 0.8


def test_the_runtime_follows_the_plant_within_the_proved_gain(content: dict) -> None:  # type: ignore[type-arg]
    """A true plant with moving parameters and a noisy sensor: the estimate comes from far away and stays near."""
    schedule = GainSchedule.from_content(content)
    observer, rng, x = LpvObserver(schedule), np.random.default_rng(1), np.array([1.0, -2.0])
    model, period = spring(), schedule.sample_time
    for k in range(3000):
        t = k * period
        place = np.array([np.sin(t), np.cos(0.7 * t)])
        push = np.array([np.sin(3.0 * t)])
        step = observer.step(push, [x[0] + 0.01 * rng.normal()], place)
        assert step.flags == 0
        at = model.on(place)
        for _ in range(5):
            x = x + period / 5 * (at.A[0] @ x + at.B[0] @ push)
    np.testing.assert_allclose(step.estimate, x, atol=0.05)


def test_three_parameters_end_to_end(tmp_path: Path) -> None:
    found = deploy(design_observer(spring(3), DESIGN), DeploySettings(interpolation_cost=0.03))
    assert found.table.ndim == 5
    assert all(proof.proved for proof in export(tmp_path / "three.json", schedule_content(found, "three")))


def test_parameters_that_jump_from_design_to_runtime(tmp_path: Path) -> None:
    """Rates are null in the file; claims hold whatever the parameters do; a P that depends on them is refused."""
    found = deploy(design_observer(spring(2, np.inf), replace(DESIGN, decay_rate=0.02)))
    content = schedule_content(found, "jumping")
    assert [entry["rate_max"] for entry in content["scheduling"]] == [None, None]
    assert all(proof.proved for proof in export(tmp_path / "jumping.json", content))
    schedule = GainSchedule.load(tmp_path / "jumping.json")
    observer = LpvObserver(schedule)
    flags = [int(observer.step([0.0], [0.0], place).flags) for place in ([-1.0, 1.0], [1.0, -1.0], [0.3, 0.9])]
    assert flags == [0, 0, 0]
    moving = copy.deepcopy(content)
    moving["claims"][0]["P"]["orders"].append([1, 0])
    moving["claims"][0]["P"]["coefficients"].append([[1e-6, 0.0], [0.0, 1e-6]])
    with pytest.raises(ScheduleError, match="depends on p, which may jump; it proves nothing"):
        prove(moving)
    half = copy.deepcopy(content)
    half["scheduling"][0]["rate_min"] = -1.0
    with pytest.raises(ScheduleError, match=r"rate_max: expected a number, got None"):
        prove(half)


def test_what_cannot_work_is_refused_before_anything_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    s = sp.Symbol("s")
    model = small_model(
        [[-2 + p / 9 + q / 9 + r / 9 + s / 9]], [[1]], [parameter(name) for name in "pqrs"], E=[[1, 0]], F=[[0, 1]]
    )
    gains = design_observer(model, ObserverDesign((Channel(("d1", "d2"), ("x1",)),), degree=0))
    monkeypatch.setattr(deploying, "Search", None)
    with pytest.raises(ProblemError, match="has 4 scheduling parameters; a table that is deployed has 1 to 3"):
        deploy(gains)


def test_products_of_two_motions_are_part_of_one_sample_later() -> None:
    """P = 1 + u1 u2 at the vertices of the rates: (u1 + d1)(u2 + d2) and not only its terms of first order."""
    own = PolynomialMatrix({(0, 0): fmpq_mat([[1]]), (1, 1): fmpq_mat([[1]])}, (1, 1), 2)
    loop = SimpleNamespace(sample_time=fmpq(1, 2))
    later = _Form(loop, Question("internal update", fmpq(1)), "discrete", own, (), False)._later([fmpq(3), fmpq(-2)])
    for u in ((fmpq(0), fmpq(0)), (fmpq(1, 3), fmpq(-1, 5))):
        assert later.at(u)[0, 0] == 1 + (u[0] + fmpq(3, 2)) * (u[1] - 1)


@pytest.mark.parametrize("kind", ["decay rate", "internal update"])
@pytest.mark.parametrize("rates", [(0, 10**6), (-(10**6), 0)])
def test_every_vertex_of_the_rates_counts_on_both_roads(
    deployment: Deployment, kind: str, rates: tuple[int, int]
) -> None:
    """A P that moves with the parameters proves nothing about ones that move as good as at once, up or down."""
    claim = next(claim for claim in deployment.claims if claim.kind == kind)
    assert any(claim.P.degrees)
    plant = deployment.loop.plant
    axes = tuple(replace(axis, rate_low=fmpq(rates[0]), rate_high=fmpq(rates[1])) for axis in plant.axes)
    loop = replace(deployment.loop, plant=replace(plant, axes=axes), _systems={})
    for balls_alone in (False, True):
        verifier = Verifier(loop, names_of(deployment.gains.model))
        if balls_alone:
            verifier.boxes.update(continuous=None, discrete=None)
        assert not verifier.prove(claim).proved
