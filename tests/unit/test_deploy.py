"""From gains to a proved table: cost of interpolation, rounding, refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.schedule import read_content
from synthesis.certificate import sampled_loop
from synthesis.certificate.claims import Claim
from synthesis.certificate.frozen import critical_probability, frozen_gain, slowest_decay
from synthesis.certificate.inequalities import inequalities
from synthesis.certificate.proof import prove
from synthesis.certificate.sampled_loop import SampledLoop
from synthesis.certificate.search import Search, Wish
from synthesis.design.deploy import Deployment, claim_channel, deploy, names_of, tabulate
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import export, schedule_content
from synthesis.design.hinf_observer import (
    Channel,
    ObserverDesign,
    ObserverGains,
    channel_matrices,
    design_observer,
    to_gamma,
)
from synthesis.design.law_table import deployed_loop
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.well_posedness import well_posedness
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.models.catalogue import corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import load_parameter_set

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


@pytest.fixture(scope="module")
def deployment(gains: ObserverGains) -> Deployment:
    return deploy(gains)


@pytest.fixture(scope="module")
def sampled(model: LpvModel) -> Deployment:
    return deploy(design_sampled_observer(model, replace(WELL_POSED, fastest_pole=None), 0.005))


def claim_of(deployment: Deployment, kind: str, channel: Channel | None = None) -> Claim:
    asked = None if channel is None else claim_channel(channel)
    return next(c for c in deployment.claims if (c.kind, c.channel) == (kind, asked))


def search_of(gains: ObserverGains, segments: int) -> Search:
    loop = deployed_loop(gains, *tabulate(gains, segments, "float64", 0.005), 0.005)
    return Search(loop, names_of(gains.model), gains.model.parameters, 1, gains.design.settings)


def test_a_large_table_is_evaluated_in_parts_as_place_by_place(
    gains: ObserverGains, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cells five at a time, and places between them at once or one by one in balls: the same places, the same numbers."""
    loop = deployed_loop(gains, *tabulate(gains, 14, "float64", 0.005), 0.005)
    one, scale = SampledLoop(loop, gains.scale, "continuous"), gains.scale
    monkeypatch.setattr(sampled_loop, "MOST_BOXES", 0)
    monkeypatch.setattr(sampled_loop, "AT_ONCE", 5)
    parts = SampledLoop(loop, scale, "continuous")
    assert one.grid is not None and parts.grid is not None
    np.testing.assert_array_equal(np.sort(parts.grid, axis=0), np.sort(one.grid, axis=0))
    between = one.grid[:-1] + 0.3 * np.diff(one.grid, axis=0)
    places = np.concatenate([one.grid, between[:60]])
    monkeypatch.setattr(sampled_loop, "FEW", 1000)
    alone = one.at(places)
    monkeypatch.setattr(sampled_loop, "FEW", 1)
    together = parts.at(places)
    for mine, its in ((together.A, alone.A), (together.C, alone.C)):
        np.testing.assert_allclose(mine.values, its.values, rtol=1e-9, atol=1e-9 * np.abs(its.values).max())


def test_places_that_are_only_looked_at_have_no_unknowns(gains: ObserverGains, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the level of a gain among them, too: they are many, and each would be as many times larger as there are unknowns."""
    widths: list[int] = []

    def recorded(*args: Any) -> list[tuple[str, Any]]:
        found = inequalities(*args)
        widths.extend(m.values.shape[-1] for _, m in found)
        return found

    search = search_of(gains, 14)
    asked = search._asked(Wish("gain", None, claim_channel(NOISE)))
    assert asked is not None
    monkeypatch.setattr("synthesis.certificate.search.inequalities", recorded)
    (gain,) = (family for family in asked.families if family.name == "gain")
    gain.least(np.zeros(asked.problem.decisions))
    assert set(widths) == {1}
    widths.clear()
    gain.values()  # the control: what is solved for
    assert max(widths) > 1


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
    assert gains.optimum.objective is not None
    assert gains.gamma_lower <= to_gamma(model, WELL_POSED, gains.scale, gains.optimum.objective) <= gains.gamma


def test_friction_gain_has_the_floor_one_for_every_gain(model: LpvModel) -> None:
    """Static gain of friction to velocity error: -sigma0/(sigma0 + sigma2 a), whatever L (P1 notes 6)."""
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


def test_interpolation_costs_less_than_allowed(gains: ObserverGains, deployment: Deployment) -> None:
    """Every gain of the table lies between what frozen parameters need and 1 % above that of a table eight times as fine."""
    assert deployment.cost < 0.01
    finer = search_of(gains, 56)
    for channel in gains.design.channels:
        for kind in ("gain", "sampled gain"):
            claim = claim_of(deployment, kind, channel)
            best = finer.least_gain(Wish(kind, None, claim.channel))
            assert (
                frozen_gain(deployment.loop, *channel_matrices(deployment.gains.model, channel))
                <= claim.level
                <= 1.012 * best
            )


def test_float32_table_is_rounded(gains: ObserverGains) -> None:
    _, table = tabulate(gains, 7, "float32", 0.005)
    assert (table == table.astype(np.float32)).all()
    assert np.abs(table / tabulate(gains, 7, "float64", 0.005)[1] - 1.0).max() < 1e-7


def test_gains_keep_the_digits_that_the_guarantee_needs(gains: ObserverGains) -> None:
    (points,), table = tabulate(gains, 7, "float64", 0.005)
    exact = gains.gain(points)
    largest = np.abs(exact).max(axis=0)
    assert (np.abs(table - exact) <= 0.5001e-3 * 10.0 ** np.floor(np.log10(largest))).all()
    assert all(len(repr(float(x)).replace(".", "").strip("0")) <= 4 for x in table.ravel())


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_claims_of_the_update_by_numpy_at_constant_speeds(
    deployment: Deployment, sampled: Deployment, update: str
) -> None:
    """The update written out with scipy: radius, second moment and gain at constant speeds stay inside what is claimed."""
    found = deployment if update == "held" else sampled
    (points,), model, T = found.breakpoints, found.gains.model, found.settings.sample_time
    decay = claim_of(found, "internal update" if update == "held" else "sampled error").level
    drops = claim_of(found, "drop probability").level
    assert decay <= slowest_decay(found.loop) and drops <= critical_probability(found.loop)
    for speed in np.linspace(0.0, 140.0, 29):
        plant = model.on([speed])
        A, C, E, F = plant.A[0], plant.C[0], plant.E[0], plant.F[0]
        L = np.array([[np.interp(speed, points, column)] for column in found.table[..., 0].T])
        whole = expm(T * np.block([[A, E], [np.zeros((3, 5))]]))
        lost, forced = whole[:2, :2], whole[:2, 2:]
        if update == "held":
            closed = expm(T * np.block([[A - L @ C, E - L @ F], [np.zeros((3, 5))]]))
            received, driven = closed[:2, :2], closed[:2, 2:]
        else:
            received, driven = lost - L @ C, forced - L @ F
        assert np.abs(np.linalg.eigvals(received)).max() <= np.exp(-decay * T)
        operator = (1 - drops) * np.kron(received, received) + drops * np.kron(lost, lost)
        assert np.abs(np.linalg.eigvals(operator)).max() < 1.0
        for channel, column in ((FRICTION, 0), (NOISE, 2)):
            level = claim_of(found, "sampled gain", channel).level
            for angle in np.linspace(0.0, np.pi, 25):
                response = np.linalg.solve(np.exp(1j * angle) * np.eye(2) - received, driven[:, column])
                assert abs(response[1]) <= level


def test_unproved_content_is_not_written(deployment: Deployment, tmp_path) -> None:  # type: ignore[no-untyped-def]
    content = schedule_content(deployment, "spoiled")
    content["gain"]["table"][2][1][0] = -5.0
    with pytest.raises(ProblemError, match=r"is not written.*fails at wheel_speed"):
        export(tmp_path / "spoiled.json", content)
    content = schedule_content(deployment, "spoiled")
    content["model"]["constants"]["sigma0"]["value"] = 600.0
    with pytest.raises(ProblemError, match=r"is not written.*the formula and the constants give"):
        export(tmp_path / "spoiled.json", content)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_exported_content_reads_back_bit_for_bit(
    deployment: Deployment, sampled: Deployment, update: str, tmp_path
) -> None:  # type: ignore[no-untyped-def]
    content = schedule_content(deployment if update == "held" else sampled, "fresh", spec={"a": 1})
    export(tmp_path / "fresh.json", content)
    back = read_content(tmp_path / "fresh.json")
    assert {key: back[key] for key in content} == content
    assert all(proof.proved for proof in prove(back))


def test_gains_of_one_sample_time_are_not_run_at_another(sampled: Deployment) -> None:
    with pytest.raises(ProblemError, match=r"designed for a sample time of 0.005 s are not run at 0.01 s"):
        deploy(sampled.gains, DeploySettings(sample_time=0.01))
    with pytest.raises(ProblemError, match="no fastest pole"):
        design_sampled_observer(sampled.gains.model, WELL_POSED, 0.005)


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
    (points,), table = tabulate(dipped, 7, "float64", 0.005)
    between = np.stack([np.interp(grid, points, column) for column in table[..., 0].T], axis=1)[..., None]
    assert np.linalg.eigvals(lateral.on(grid).error_dynamics(between)[0]).real.max() > 0.0
    coarse = search_of(dipped, 7)
    assert all(np.isinf(coarse.least_gain(Wish("gain", None, claim_channel(c)))) for c in WELL_POSED.channels)
    assert coarse.prove(Wish("decay rate", 0.1))[0] is None
    monkeypatch.setattr("synthesis.design.deploy.SEGMENTS", (7,))
    with pytest.raises(ProblemError, match="no table with up to 7 segments"):
        deploy(dipped)
