"""Every measure against an independent check, and what becomes of designs that cannot be computed."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import expm

from analysis.drops.frozen import critical_drop_probability
from analysis.drops.mean_square import drop_radius
from analysis.drops.schedule import frozen_critical_probability
from analysis.norms.observer_error import error_hinf_norm
from analysis.observability.rank_loss_speeds import RankLossSpeeds
from analysis.sensitivity.designs import Sobol
from estimators import GainSchedule, LpvVelocityObserver
from estimators.schedule import SHIPPED, read_content, write_content
from estimators.schedule.quotient import quotients
from studies.sweeps.evaluate import INVALID, NOT_A_NUMBER, VALID, evaluate
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Batch, Gains, Observer, model_observer
from studies.sweeps.plant import polynomial_plant
from studies.sweeps.ranges import RangeSpec, parameter_ranges
from studies.sweeps.spec import MEASURES, ObserverSpec, designed_from
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, SchedulingParameter, Signal
from synthesis.models.parameter_set import load_parameter_set
from tests.support.schedule_content import schedule_content

NAME = "corner-estimation-longitudinal"
SCHEDULE = GainSchedule.shipped(NAME)
MODEL = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal")
CONTENT = schedule_content(
    update="sampled", gains=[(1.18e-3, 0.048), (8.8e-4, 0.076), (5.9e-4, 0.134), (4.2e-4, 0.217)]
)
SAMPLED = GainSchedule.from_content(CONTENT)
DESIGNS = {"sigma1": np.array([0.76, 0.65, 0.9]), "kappa": np.array([8.32, 9.5, 7.0])}


@pytest.fixture(scope="module")
def observer() -> Observer:
    return ObserverSpec(schedule=NAME, parameters="corner-estimation").build(Path())


@pytest.fixture(scope="module")
def sampled(tmp_path_factory: pytest.TempPathFactory) -> Observer:
    """The same model with gains that correct once a sample, from a file."""
    folder = tmp_path_factory.mktemp("sampled")
    write_content(folder / "own.json", CONTENT)
    return ObserverSpec(schedule="own.json", parameters="corner-estimation").build(folder)


def measure(kind: str, **options: object) -> Measure:
    return MEASURES[kind].model_validate({"id": kind, **options}).build()


def perturbed(row: int) -> LpvModel:
    """The symbolic model with the constants of one design: what one would write without any batch."""
    changed = {
        name: replace(c, value=float(DESIGNS[name][row])) if name in DESIGNS else c
        for name, c in MODEL.constants.items()
    }
    return replace(MODEL, constants=changed)


def test_margin_norm_and_radius_are_those_of_single_models(observer: Observer) -> None:
    grid = observer.grid(6)
    speeds = grid.points[:, 0]
    kinds = [
        measure("stability_margin"),
        measure("sampled_radius"),
        measure("hinf_norm", disturbances=["force_noise"], errors=["relative_velocity"]),
        measure(
            "hinf_norm", name="all", disturbances=["friction", "acceleration_error"],
            errors=["bristle_deflection", "relative_velocity"],
        ),
    ]  # fmt: skip
    batch = observer.at(DESIGNS, grid)
    margin, radius, noise, everything = (m(batch) for m in kinds)
    for row in range(3):
        model, gain = perturbed(row), SCHEDULE.gain(speeds)
        A_e, _ = model.on(speeds).error_dynamics(gain)
        np.testing.assert_allclose(margin[row], np.linalg.eigvals(A_e).real.max(axis=-1), rtol=1e-9)
        updates = [np.abs(np.linalg.eigvals(batch.coast.received[row, g])).max() for g in range(6)]
        np.testing.assert_allclose(radius[row], updates, rtol=1e-9)
        found = error_hinf_norm(model, gain, speeds, ["force_noise"], ["relative_velocity"])
        np.testing.assert_allclose(noise[row], found.norm, rtol=1e-7)
        found = error_hinf_norm(model, gain, speeds, ["friction", "acceleration_error"])
        np.testing.assert_allclose(everything[row], found.norm, rtol=1e-5)


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_updates_are_those_that_the_runtime_performs(update: str, observer: Observer, sampled: Observer) -> None:
    """One step of the real observer from unit errors, the plant at rest, with and without a measurement."""
    own, schedule = (observer, SCHEDULE) if update == "held" else (sampled, SAMPLED)
    grid = own.grid(5)
    modes = own.at({"sigma1": np.array([0.76])}, grid).coast
    for measurement, matrices in ((0.0, modes.received[0]), (np.nan, modes.dropped[0])):
        for g, speed in enumerate(grid.points[:, 0]):
            for state in range(2):
                observer = LpvVelocityObserver(schedule, batch_shape=(1,))
                observer.reset(state=np.eye(2)[state])
                step = observer.step([0.0], [measurement], [speed])
                np.testing.assert_allclose(step.estimate[0], matrices[g, :, state], rtol=1e-9, atol=1e-12)


def test_gains_that_correct_once_a_sample_are_measured_by_the_radius_of_their_update(sampled: Observer) -> None:
    """e^(TA) - K C of single models; the margin is its growth in 1/s, and there is no error equation to take a norm of."""
    grid = sampled.grid(6)
    speeds, T = grid.points[:, 0], SAMPLED.sample_time
    batch = sampled.at(DESIGNS, grid)
    radius, margin = (measure(kind)(batch) for kind in ("sampled_radius", "stability_margin"))
    critical = measure("critical_drop_probability")(batch)
    for row in range(3):
        plant = perturbed(row).on(speeds)
        dropped = expm(T * plant.A)
        received = dropped - SAMPLED.gain(speeds) @ plant.C
        expected = np.abs(np.linalg.eigvals(received)).max(axis=-1)
        np.testing.assert_allclose(radius[row], expected, rtol=1e-9)
        np.testing.assert_allclose(np.exp(T * margin[row]), expected, rtol=1e-9)
        np.testing.assert_allclose(critical[row], critical_drop_probability(dropped, received), rtol=1e-7, atol=1e-9)
        held = batch.modes("hold")
        np.testing.assert_allclose(held.dropped[row, :, :2, :2], received, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(held.dropped[row, :, :2, 2:], SAMPLED.gain(speeds), rtol=1e-12)
    assert sampled.parameters["gain_factor_relative_velocity"].unit == "1"
    norm = measure("hinf_norm", disturbances=["force_noise"], errors=["relative_velocity"])
    with pytest.raises(SpecError, match=r"correct once a sample .*no error equation.*use sampled_radius"):
        norm.check(sampled)
    with pytest.raises(SpecError, match="correct once a sample"):
        norm(batch)


def test_a_unit_may_be_written_in_any_way_and_must_be_the_same_one() -> None:
    own = replace(model_observer("mass", MASS, GAIN, 0.01), update="held")
    for unit in ("(m/s)/(m/s)", "1/s*s", "(m/s)/(1)/(m/s)"):
        (found,) = parameter_ranges(own, {"gain_position_rate": RangeSpec(range=(0.5, 0.9), unit=unit)})
        assert found.unit == own.parameters["gain_position_rate"].unit
    with pytest.raises(SpecError, match="unit 'm' is not"):
        parameter_ranges(own, {"gain_position_rate": RangeSpec(range=(0.5, 0.9), unit="m")})


def test_units_of_a_constant_gain_are_those_of_the_update() -> None:
    for update, unit in (("held", "(m/s)/(m/s)"), ("sampled", "(m)/(m/s)")):
        own = replace(model_observer("mass", MASS, GAIN, 0.01), update=update)
        assert own.parameters["gain_position_rate"].unit == unit
        grid = own.grid(2)
        modes = own.at({"mass": np.array([2.0])}, grid).coast  # three states: no closed form
        plant = MASS.on(grid.points)
        A_e = plant.A - GAIN @ plant.C
        expected = expm(0.01 * A_e) if update == "held" else expm(0.01 * plant.A) - GAIN @ plant.C
        np.testing.assert_allclose(modes.received[0], expected, rtol=1e-9, atol=1e-12)


def test_drop_measures_are_those_of_the_schedule(observer: Observer) -> None:
    frozen = frozen_critical_probability(SCHEDULE, points=29)
    grid = observer.grid(29)
    batch = observer.at({"sigma1": np.array([0.76])}, grid)
    shared = np.isin(frozen.points, grid.points[:, 0])
    np.testing.assert_allclose(
        measure("critical_drop_probability")(batch)[0], frozen.values[shared], rtol=1e-8, atol=1e-10
    )
    radius = measure("second_moment_radius", drop_probability=float(frozen.values[0]))(batch)
    assert radius[0, 0] == pytest.approx(1.0, abs=1e-6)  # at the critical probability, by its definition
    wanted = drop_radius(batch.coast.dropped, batch.coast.received, 0.3)
    np.testing.assert_allclose(measure("second_moment_radius", drop_probability=0.3)(batch), wanted)


def test_switching_bound_of_one_speed_is_its_radius(observer: Observer) -> None:
    batch = observer.at(DESIGNS, observer.grid(3))
    bound = measure("joint_spectral_radius", speeds=1, tolerance=1e-3)(batch)
    radius = measure("sampled_radius")(batch)[:, 0]
    assert bound.shape == (3,)
    assert (bound >= radius * (1.0 - 1e-9)).all() and (bound <= radius * 1.002).all()
    many = measure("joint_spectral_radius", speeds=3)(batch)
    assert (many >= measure("sampled_radius")(batch).max(axis=1) * (1.0 - 1e-9)).all()


def test_designing_again_gives_the_design_bound_of_the_schedule(observer: Observer) -> None:
    constants = {"sigma1": np.array([0.76, 0.68])}
    gamma = measure("certified_gamma")(observer.at(constants, observer.grid(2)))
    content = read_content(SHIPPED / f"{NAME}.json")
    spec = designed_from(content)
    assert spec is not None
    assert gamma[0] == pytest.approx(spec.design(MODEL).gamma, rel=1e-6)
    claimed = next(
        c["level"] for c in content["claims"] if c["kind"] == "gain" and "force_noise" in c["channel"]["inputs"]
    )
    assert 0.9 * gamma[0] < claimed < (1.0 + spec.deploy.interpolation_cost) * gamma[0]
    assert gamma[1] != pytest.approx(gamma[0], rel=1e-4)
    with pytest.raises(SpecError, match="is not one of"):
        measure("certified_gamma", channel="friction").check(observer)


def test_rank_loss_speed_of_an_observer(observer: Observer) -> None:
    found = measure("rank_loss_speed")(observer.at(DESIGNS, observer.grid(2)))
    np.testing.assert_array_equal(found, RankLossSpeeds(MODEL).lowest(DESIGNS))


def test_schedule_of_an_unknown_model_is_swept_by_its_polynomials() -> None:
    """Without a catalogue model the entries of the plant are what can be varied; the nominal design is the same."""
    plain = Observer("x", polynomial_plant(SCHEDULE), Gains(SCHEDULE.table, SCHEDULE.breakpoints), SCHEDULE.sample_time)
    grid = plain.grid(4)
    A_e = plain.at({"A_1_1": np.array([1.0, 1.2])}, grid).error[0]
    model = replace(MODEL, constants=MODEL.constants).on(grid.points[:, 0])
    np.testing.assert_allclose(A_e[0], model.error_dynamics(SCHEDULE.gain(grid.points[:, 0]))[0], rtol=1e-12)
    np.testing.assert_allclose((A_e[1] - A_e[0])[:, 0, 0], 0.2 * model.A[:, 0, 0], rtol=1e-9, atol=1e-12)
    assert set(plain.plant.parameters) >= {"A_1_1", "C_1_1", "C_1_2"} and "A_2_2" not in plain.plant.parameters


def test_a_schedule_of_a_rational_plant_is_swept_by_its_quotients() -> None:
    """The same numerators over 1 + 0.6 u: every matrix is divided by it, and a factor acts on the quotient."""
    given = SCHEDULE.polynomials
    below = given["A"]._replace(coefficients=np.array([1.0, 0.6])[:, None, None])
    rational = replace(SCHEDULE, plant=dict(quotients(given, below, ["wheel_speed"], "file")))
    plain, divided = (polynomial_plant(schedule) for schedule in (SCHEDULE, rational))
    grid = Observer("x", plain, Gains(SCHEDULE.table, SCHEDULE.breakpoints), SCHEDULE.sample_time).grid(5)
    assert set(plain.parameters) == set(divided.parameters)
    first, second = (one.at({"A_1_1": np.array([1.0, 1.2])}, grid) for one in (plain, divided))
    d = below.at(grid.points[:, 0])
    for key in "ACEF":
        np.testing.assert_allclose(getattr(second, key) * d, getattr(first, key), rtol=1e-12, atol=1e-15)


MASS = LpvModel(
    name="mass-spring",
    source="Newton",
    states=(Signal("position", "m"), Signal("velocity", "m/s"), Signal("bias", "m")),
    outputs=(Signal("measured", "m"), Signal("rate", "m/s")),
    disturbances=(Signal("force", "N"),),
    parameters=(
        SchedulingParameter("stiffness", "N/m", 10.0, 40.0, -50.0, 50.0),
        SchedulingParameter("drag", "N*s/m", 0.5, 2.0, -1.0, 1.0),
    ),
    constants={"mass": Constant(2.0, "kg", "scale"), "offset": Constant(1.0, "kg", "scale")},
    A=sp.Matrix([[0, 1, 0], [sp.sympify(0), 0, 0], [0, 0, 0]])
    + sp.Matrix([[0, 0, 0], [-sp.Symbol("stiffness"), -sp.Symbol("drag"), 0], [0, 0, 0]])
    / (sp.Symbol("mass") - sp.Symbol("offset")),
    C=sp.Matrix([[1, 0, 1], [0, 1, 0]]),
    E=sp.Matrix([0, 1 / (sp.Symbol("mass") - sp.Symbol("offset")), 0]),
)
GAIN = np.array([[4.0, 0.1], [2.0, 5.0], [3.0, -0.2]])


def test_a_models_own_sweep_over_two_scheduling_parameters(tmp_path: Path) -> None:
    """Three states, two outputs, two parameters: nothing is made for the corner models alone."""
    from studies.execution.processes import Serial
    from studies.sweeps.engine import run_sweep

    own = model_observer("mass", MASS, GAIN, 0.01)
    channel = {"disturbances": ["force"], "errors": ["position"]}
    sweep = Sweep(
        "own", [own], [measure("stability_margin"), measure("hinf_norm", name="norm", **channel)],
        [Sobol(samples=16)],
        {"mass": RangeSpec(range=(1.5, 3.0)), "gain_velocity_rate": RangeSpec(relative=0.3)}, points=4,
    )  # fmt: skip
    result = run_sweep(sweep, tmp_path / "out", Serial())
    worst = result.summary.of("mass", "norm", "worst")
    assert worst is not None and set(worst.at) == {"mass", "gain_velocity_rate", "stiffness", "drag"}
    model = replace(MASS, constants={**MASS.constants, "mass": replace(MASS.constants["mass"], value=worst.at["mass"])})
    gain = GAIN.copy()
    gain[1, 1] = worst.at["gain_velocity_rate"]
    single = error_hinf_norm(model, gain, [[worst.at["stiffness"], worst.at["drag"]]], ["force"], ["position"])
    assert worst.value == pytest.approx(single.norm[0], rel=1e-5)


def test_invalid_designs_keep_their_reason_and_touch_no_other() -> None:
    own = model_observer("mass", MASS, GAIN, 0.01)
    grid = own.grid(2)
    given = np.array([2.0, 1.0, 1.8, -1.0, 2.2])  # 1.0 divides by zero, -1.0 has another sign than the nominal mass
    found = evaluate(own, [measure("stability_margin")], grid, {"mass": given})
    assert found.outcome.tolist() == [VALID, INVALID, VALID, INVALID, VALID]
    assert "denominator" in found.reason[1] and "sign" in found.reason[3] and not found.reason[0]
    alone = evaluate(own, [measure("stability_margin")], grid, {"mass": given[[0, 2, 4]]})
    np.testing.assert_array_equal(found.worst["stability_margin"][[0, 2, 4]], alone.worst["stability_margin"])
    assert np.isnan(found.worst["stability_margin"][[1, 3]]).all()


def _holes(where: float, batch: Batch) -> np.ndarray:
    values = np.tile(batch.columns["sigma1"][:, None], (1, len(batch.grid)))
    values[batch.columns["sigma1"] > where, 0] = np.nan
    return values


def _wrong_shape(batch: Batch) -> np.ndarray:
    return np.zeros(7)


def test_nan_is_an_outcome_and_a_wrong_shape_is_refused(observer: Observer) -> None:
    holes = Measure("holes", "s/m", "larger", partial(_holes, 0.8))
    found = evaluate(observer, [holes, measure("stability_margin")], observer.grid(3), DESIGNS)
    assert found.outcome.tolist() == [VALID, VALID, NOT_A_NUMBER]
    assert found.reason[2] == "holes is not a number" and np.isnan(found.worst["holes"][2])
    assert np.isfinite(found.worst["stability_margin"]).all()
    with pytest.raises(SpecError, match="returned the shape"):
        evaluate(observer, [Measure("bad", "1", "larger", _wrong_shape)], observer.grid(2), DESIGNS)


def test_loss_is_relative_to_the_distance_from_worthlessness() -> None:
    radius, margin, critical = (
        measure("sampled_radius"),
        measure("stability_margin"),
        measure("critical_drop_probability"),
    )
    assert radius.loss(0.96, 0.97) == pytest.approx(0.25)
    assert margin.loss(-80.0, -60.0) == pytest.approx(0.25) and margin.loss(-60.0, -80.0) == pytest.approx(-1 / 3)
    assert critical.loss(0.5, 0.4) == pytest.approx(0.2)
    norm = measure("hinf_norm", disturbances=["a"], errors=["b"])
    assert norm.loss(2.0, np.inf) == np.inf and norm.loss(np.inf, 2.0) == -np.inf and norm.loss(np.inf, np.inf) == 0.0
    assert norm.loss(2.0, np.nan) == np.inf
