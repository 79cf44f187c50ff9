"""From gains to a proved table: cost of interpolation, rounding, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.schedule import read_content
from synthesis.claim_search import claim_levels
from synthesis.deploy import DeploySettings, deploy, tabulate
from synthesis.deployed_loop import frozen_gain
from synthesis.errors import ProblemError
from synthesis.export import export, sampled_radius, schedule_content
from synthesis.hinf_observer import Channel, ObserverDesign, ObserverGains, design_observer
from synthesis.lmi.result import Verdict
from synthesis.models.catalogue import corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import load_parameter_set
from synthesis.well_posedness import well_posedness

FRICTION = Channel(("friction",), ("relative_velocity",), 1.05)
NOISE = Channel(("force_noise",), ("relative_velocity",))
WELL_POSED = ObserverDesign((FRICTION, NOISE), degree=1, decay_rate=80.0, fastest_pole=600.0, backoff=0.02)
LITERAL = ObserverDesign(
    (Channel(("friction", "acceleration_error"), ("bristle_deflection", "relative_velocity")),), degree=1
)


@pytest.fixture(scope="module")
def model() -> LpvModel:
    return corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal")


@pytest.fixture(scope="module")
def gains(model: LpvModel) -> ObserverGains:
    return design_observer(model, WELL_POSED)


def test_well_posed_design_lies_in_the_published_ranges(model: LpvModel, gains: ObserverGains) -> None:
    """P1 Fig. 3: L1 in 0.4..0.9 m/s, L2 in 50..210 m/s^2 over 0..140 rad/s; what was asked holds by plain eigenvalues."""
    grid = np.linspace(0.0, 140.0, 281)
    table = gains.gain(grid)[..., 0]
    assert gains.verdict is Verdict.CERTIFIED
    assert (table > [0.4, 50.0]).all() and (table < [0.9, 210.0]).all()
    poles = np.linalg.eigvals(model.on(grid).error_dynamics(gains.gain(grid))[0])
    assert poles.real.max() < -80.0
    assert poles.real.min() > -600.0
    assert gains.gamma_lower is not None
    assert gains.gamma_lower <= gains.optimum.objective <= gains.gamma  # type: ignore[operator]


def test_friction_gain_has_the_floor_one_for_every_gain(model: LpvModel) -> None:
    """Static gain of friction to velocity error: -sigma0/(sigma0 + sigma2 a), whatever L (P1 section 6)."""
    rng = np.random.default_rng(3)
    grid = np.linspace(0.0, 140.0, 15)
    a = 8.32 * 0.33 * grid
    for _ in range(20):
        gain = np.array([[rng.uniform(0.2, 1.2)], [rng.uniform(20.0, 400.0)]])
        A_e, B_e = model.on(grid).error_dynamics(gain)
        static = np.linalg.solve(-A_e, B_e)[:, 1, 0]
        np.testing.assert_allclose(static, -632.1 / (632.1 + 0.0016 * a), rtol=1e-9)


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_literal_problem_is_reported_as_ill_posed(direction: str, degree: int) -> None:
    """P1 (30)-(32), sign corrected: infimum 1 for every degree, approached with unbounded gains."""
    literal = replace(LITERAL, degree=degree)
    posed = well_posedness(corner_velocity_model(load_parameter_set("corner-estimation"), direction), literal)
    assert posed.gamma == pytest.approx(1.0, abs=2e-5 if direction == "longitudinal" else 3e-4)
    assert posed.ill_posed
    assert "unbounded gains" in posed.message


def test_pole_band_makes_it_well_posed(model: LpvModel) -> None:
    assert not well_posedness(model, WELL_POSED).ill_posed


def test_ill_posed_gains_are_not_deployed(model: LpvModel) -> None:
    with pytest.raises(ProblemError, match="ill-posed"):
        deploy(design_observer(model, LITERAL))


def test_interpolation_costs_less_than_allowed(gains: ObserverGains) -> None:
    deployment = deploy(gains)
    assert deployment.cost < 0.01
    continuous = claim_levels(tabulate(gains, 56, "float64"), gains.design)
    for channel in gains.design.channels:
        claim = next(c for c in deployment.claims if c.name == f"gain {channel.name}")
        assert frozen_gain(deployment.loop, channel) <= claim.level <= 1.01 * continuous[channel.name]


def test_float32_table_is_rounded(gains: ObserverGains) -> None:
    table = tabulate(gains, 7, "float32").table
    assert (table == table.astype(np.float32)).all()
    assert np.abs(table / tabulate(gains, 7, "float64").table - 1.0).max() < 1e-7


def test_sampled_radius_is_that_of_the_matrix_exponential(gains: ObserverGains) -> None:
    loop = tabulate(gains, 7, "float64")
    grid = np.linspace(0.0, 140.0, 141)
    radius = max(np.abs(np.linalg.eigvals(expm(A * 0.005))).max() for A in loop.error_matrices(grid)[0])
    assert sampled_radius(loop, 0.005, 141) == pytest.approx(radius, rel=1e-9)


def test_unproved_content_is_not_written(gains: ObserverGains, tmp_path) -> None:  # type: ignore[no-untyped-def]
    content = schedule_content(deploy(gains), "spoiled")
    content["gain"]["table"][2][1][0] = -5.0
    with pytest.raises(ProblemError, match=r"is not written.*between breakpoints"):
        export(tmp_path / "spoiled.json", content)
    assert list(tmp_path.iterdir()) == []


def test_exported_content_reads_back_bit_for_bit(gains: ObserverGains, tmp_path) -> None:  # type: ignore[no-untyped-def]
    content = schedule_content(deploy(gains), "fresh", spec={"a": 1})
    export(tmp_path / "fresh.json", content)
    back = read_content(tmp_path / "fresh.json")
    assert back["gain"]["table"] == content["gain"]["table"]
    assert back["certificate"] == content["certificate"]


def test_hopeless_design_says_what_to_loosen(model: LpvModel) -> None:
    impossible = replace(WELL_POSED, decay_rate=500.0, fastest_pole=501.0)
    with pytest.raises(ProblemError, match="loosen"):
        design_observer(model, impossible)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"degree": 9}, "degree 9"),
        ({"decay_rate": -1.0}, "must not be negative"),
        ({"fastest_pole": 10.0}, "must exceed the decay rate"),
        ({"backoff": 1.5}, "backoff"),
        ({"channels": (FRICTION,)}, "exactly one channel"),
        ({"channels": (NOISE, NOISE)}, "exactly one channel"),
    ],
)
def test_bad_designs_are_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        replace(WELL_POSED, **change)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        (Channel(("frictoin",), ("relative_velocity",)), "did you mean friction"),
        (Channel(("friction",), ("velocity",)), "did you mean relative_velocity"),
        (Channel(("friction",), ("relative_velocity",), weights=(1.0, 2.0)), "2 weights for 1"),
    ],
)
def test_unknown_signals_offer_the_nearest(model: LpvModel, channel: Channel, words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        design_observer(model, ObserverDesign((channel,)))


@pytest.mark.parametrize("change", [{"sample_time": 0.0}, {"sample_time": float("nan")}, {"dtype": "float16"}])
def test_bad_deployments_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ProblemError):
        DeploySettings(**change)  # type: ignore[arg-type]


def test_table_that_only_interpolation_spoils_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The law dips at 60 rad/s, where that is harmless; 8 points spread the dip to 50 rad/s, where it destabilises."""
    lateral = corner_velocity_model(load_parameter_set("corner-estimation"), "lateral")
    base = design_observer(lateral, replace(WELL_POSED, decay_rate=2.0, fastest_pole=5e4))

    class Dipped(ObserverGains):
        def gain(self, points: np.ndarray) -> np.ndarray:
            dip = 100.0 * np.exp(-(((np.ravel(points) - 60.0) / 2.0) ** 2))
            return np.array([[1.11], [16.7]]) - dip[:, None, None] * np.array([[1.0], [0.0]])

    dipped = Dipped(**{name: getattr(base, name) for name in base.__dataclass_fields__})
    grid = np.linspace(0.0, 140.0, 1401)
    law = lateral.on(grid).error_dynamics(dipped.gain(grid))[0]
    assert np.linalg.eigvals(law).real.max() < 0.0
    coarse = tabulate(dipped, 7, "float64")
    assert np.linalg.eigvals(coarse.error_matrices(grid)[0]).real.max() > 0.0
    assert all(np.isinf(level) for level in claim_levels(coarse, WELL_POSED).values())
    monkeypatch.setattr("synthesis.deploy.SEGMENTS", (7,))
    with pytest.raises(ProblemError, match="no table with up to 7 segments"):
        deploy(dipped)
