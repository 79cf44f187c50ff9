"""The study `drop-tolerance`: unbiased populations, intervals that can miss, predictions that can be refuted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from analysis.drops.schedule import frozen_critical_probability
from estimators.velocity import with_constant_gain
from studies.beyond.drop_tolerance.comparison import Interval, crossing, interval, questions, run_trial
from studies.beyond.drop_tolerance.limits import any_gain, runs_above
from studies.beyond.drop_tolerance.moving_speed import certificate, run_sweep
from studies.beyond.drop_tolerance.observers import NAMES, observer
from studies.beyond.drop_tolerance.overview import overview
from studies.beyond.drop_tolerance.population import START, resampled, simulate
from studies.beyond.drop_tolerance.prediction import (
    Norm,
    boundary,
    bursts,
    critical,
    critical_bursts,
    harmless_from,
    independent_drops,
    joined,
    log_second_moment,
    natural_norm,
    radius,
)
from studies.beyond.drop_tolerance.study import STUDY
from studies.registry import load_study
from studies.study import QUICK
from synthesis.lmi.result import Verdict

STEPS = 80
PRINTED = observer("printed-longitudinal").schedule
SHIPPED = observer("resilient-velocity-longitudinal").schedule


# --- resampling and populations -----------------------------------------------------------------------------------------


def test_resampling_repeats_in_proportion() -> None:
    rng = np.random.default_rng(0)
    weights = rng.random((3, 5, 40)) ** 4
    share = 40 * weights / weights.sum(axis=-1, keepdims=True)
    total = np.zeros_like(weights)
    for _ in range(400):
        index = resampled(weights, rng.random((5, 1)))
        counts = np.stack([np.bincount(row, minlength=40) for row in index.reshape(-1, 40)]).reshape(weights.shape)
        assert (np.abs(counts - share) < 1.0 + 1e-9).all()  # systematic: never off by a whole run
        total += counts
    np.testing.assert_allclose(total / 400, share, atol=0.12)


def test_resampling_drops_runs_of_no_weight() -> None:
    index = resampled(np.array([[0.0, 3.0, 0.0, 1.0]]), np.array([[0.5]]))
    np.testing.assert_array_equal(index, [[1, 1, 1, 3]])


CASES = joined([independent_drops(np.array([0.0, 12.0, 80.0]), np.array([0.4, 0.6, 0.5])), bursts(5.0, 0.3, 3.0)])


@pytest.mark.parametrize("kind", ["natural", "plain"])
def test_populations_are_unbiased_in_any_norm(kind: str) -> None:
    """The mean over seeds against the exact second moment, by Student's t."""
    norm = natural_norm(SHIPPED, CASES)
    if kind == "plain":
        norm = Norm(np.broadcast_to(np.diag([1e4, 1.0]), norm.P.shape).copy())
    start, end = log_second_moment(SHIPPED, CASES, norm, START, STEPS)
    seen = simulate(SHIPPED, CASES, norm, STEPS, 60, 60, np.random.default_rng(3)) - start[:, None]
    for case in range(4):
        found = interval(seen[case : case + 1], STEPS, lambda g: g[..., 0], 1e-3)
        assert found.holds(float(end[case] - start[case]) / STEPS)
        width = 0.08 if kind == "natural" else 0.2
        assert found.high - found.low < width  # an interval that says something
        assert not found.holds(float(end[case] - start[case]) / STEPS + width)


def test_the_natural_norm_grows_by_the_radius_from_the_first_sample_on() -> None:
    norm = natural_norm(PRINTED, CASES)
    start, end = log_second_moment(PRINTED, CASES, norm, START, 7)
    np.testing.assert_allclose((end - start) / 7, np.log(radius(PRINTED, CASES)), atol=1e-6)
    plain = Norm(np.broadcast_to(np.eye(2), norm.P.shape).copy())
    start, end = log_second_moment(PRINTED, CASES, plain, START, 7)
    assert (np.abs((end - start) / 7 - np.log(radius(PRINTED, CASES))) > 1e-3).any()


# --- intervals and crossings --------------------------------------------------------------------------------------------


def test_crossing_of_a_parabola() -> None:
    at = np.array([0.5, 0.6, 0.7])
    for root, a in ((0.57, 0.0), (0.57, 3.0), (0.64, -2.0)):
        values = (at - root) * (1.0 + a * (at - 0.6))
        assert crossing(at, values) == pytest.approx(root, abs=1e-12)
    assert np.isnan(crossing(at, np.array([1.0, 0.5, 1.0])))  # nowhere
    assert np.isnan(crossing(at, np.array([1.0, 0.0, -1.0]) - 0.2))  # falls
    assert crossing(at, np.ones((4, 1)) * (at - 0.61)).shape == (4,)


def test_intervals_cover_and_miss_as_often_as_they_should() -> None:
    """Log-normal growths with known mean: the 90 % interval of the mean misses about 10 % of the time."""
    rng = np.random.default_rng(5)
    misses = 0
    for _ in range(400):
        logs = rng.normal(-0.02, 0.2, (1, 60))  # mean of the exponential is exp(-0.02 + 0.02)
        found = interval(logs, 10, lambda g: g[..., 0], 0.1)
        misses += not found.holds(0.0)
    assert 20 <= misses <= 64
    assert not Interval(1.0, np.nan, np.nan).holds(1.0)


# --- predictions ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_the_boundary_is_where_the_radius_is_one(name: str) -> None:
    schedule = observer(name).schedule
    loss, length = boundary(schedule, 0.0)
    assert (np.diff(loss) > 0.0).all()
    at = slice(3, None, 25)
    np.testing.assert_allclose(radius(schedule, bursts(0.0, loss[at], length[at])), 1.0, atol=1e-7)
    inner = bursts(0.0, loss[at], np.maximum(length[at] * 0.98, loss[at] / (1.0 - loss[at])))
    assert (radius(schedule, inner)[length[at] * 0.98 > loss[at] / (1.0 - loss[at])] < 1.0).all()
    (found,) = critical_bursts(schedule, 0.0, [0.5])
    assert found is not None
    low, high = radius(schedule, bursts(0.0, 0.5, np.array([found - 1e-6, found + 1e-6])))
    assert low < 1.0 < high
    # Independent drops are bursts of mean length 1/(1 - p): the critical probability lies on the boundary.
    p = float(critical(schedule, 0.0))
    assert np.interp(p, loss, length) == pytest.approx(1.0 / (1.0 - p), rel=1e-3)


def test_no_critical_burst_where_every_loss_is_survived() -> None:
    assert critical_bursts(SHIPPED, 140.0, [0.1, 0.5]) == [None, None]
    start = harmless_from(PRINTED)
    assert float(critical(PRINTED, start - 1e-6)) < 1.0 and float(critical(PRINTED, start + 1e-6)) == 1.0
    a = (
        8.1 * 0.33 * start
    )  # Table I of P3: where one received sample neither grows nor shrinks what the open loop keeps
    A_e = [[-a - 1.18 * (641 - 0.85 * a), 1 - 1.18 * 0.8516], [-387 * (641 - 0.85 * a), -387 * 0.8516]]
    A1 = expm(0.005 * np.array(A_e))
    assert abs(A1[1, 0] / a + A1[1, 1]) == pytest.approx(1.0, abs=1e-6)


def test_bursts_have_the_loss_rate_and_length_asked_for() -> None:
    channel = bursts(0.0, np.array([0.1, 0.3]), np.array([4.0, 9.0]))
    np.testing.assert_allclose(channel.loss_rate, [0.1, 0.3])
    np.testing.assert_allclose(1.0 / channel.recovery, [4.0, 9.0])
    assert independent_drops(0.0, 0.3).loss_rate[0] == pytest.approx(0.3)


# --- prediction against the runtime ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["printed-longitudinal", "resilient-velocity-lateral"])
def test_the_runtime_observer_agrees_with_its_prediction(name: str) -> None:
    trial = run_trial(observer(name).schedule, QUICK, NAMES.index(name))
    assert len(trial.rows) >= 5 and trial.agreeing == len(trial.rows)
    for row in trial.of("drop"):
        assert row.expected == pytest.approx(row.question.predicted, abs=2e-4)  # the parabola is no source of error
        assert row.found.high - row.found.low < 0.06
    for row in trial.of("burst"):
        assert row.expected == pytest.approx(row.question.predicted, rel=5e-3)


def test_a_wrong_prediction_is_refuted() -> None:
    """The printed gain judged by the prediction for the shipped schedule, and for one whose second gain is 15 % smaller."""
    trial = run_trial(PRINTED, QUICK, 0, compared=SHIPPED)
    assert 2 * trial.agreeing <= len(trial.rows)
    assert not trial.of("growth")[0].agrees  # although it is below 1: agreement is not stability
    weaker = with_constant_gain(SHIPPED, (1.18, 0.85 * 387.0))
    trial = run_trial(PRINTED, QUICK, 0, compared=weaker)
    assert trial.agreeing < len(trial.rows)


def test_questions_follow_the_prediction() -> None:
    asked = questions(PRINTED, quick=False)
    assert [q.kind for q in asked] == ["drop"] * 3 + ["growth"] + ["burst"] * 3
    for q in asked[:3]:
        assert q.predicted == pytest.approx(float(critical(PRINTED, q.place)), abs=1e-12)
        assert (radius(PRINTED, q.channel)[[0, 2]] < 1.0).tolist() == [True, False]


# --- wheel speed in motion, and limits ------------------------------------------------------------------------------------


def test_the_certified_energy_falls_on_the_sweep_and_the_runtime_follows_it() -> None:
    frozen = frozen_critical_probability(SHIPPED)
    proof = certificate(SHIPPED, frozen, (0.85,))
    assert proof.verdict is Verdict.CERTIFIED
    sweep = run_sweep(SHIPPED, proof, QUICK, 3)
    assert (np.abs(np.diff(sweep.speed)) <= 800.0 * SHIPPED.sample_time + 1e-9).all()
    assert sweep.speed.min() == 0.0 and sweep.speed[0] == sweep.speed[-1] == 140.0
    assert (np.diff(sweep.exact) < 0.0).all() and sweep.holds.all()
    # negative control: the same energy does not fall with more drops than any speed survives, and the runtime then misses it
    worse = run_sweep(SHIPPED, replace(proof, drop_probability=0.99), QUICK, 3)
    assert (np.diff(worse.exact) > 0.0).any()
    assert not (np.abs(worse.seen - sweep.exact[worse.at]) <= worse.half).all()
    assert certificate(SHIPPED, frozen, (1.05,)).verdict is Verdict.REFUTED


def test_beyond_the_critical_probability_the_middle_run_still_falls() -> None:
    runs = runs_above(PRINTED, 0.7, 400, 1)
    middle, mean = np.median(runs, axis=1), np.sqrt((runs**2).mean(axis=1))
    assert middle[-1] < 1e-6 and mean[40] > 1.5
    channel = independent_drops(0.0, 0.7)
    assert radius(PRINTED, channel)[0] > 1.0


def test_parts_and_their_results() -> None:
    assert load_study("drop-tolerance") is STUDY
    names = [part.name for part in STUDY.parts]
    assert len(set(names)) == len(names) == 2 * len(NAMES) + 3
    table = overview(QUICK).tables[0]
    found = {row[0]: row for row in table.rows}
    assert len(found) == len(NAMES) and all(len(row) == len(table.columns) for row in table.rows)
    printed = found[observer("printed-longitudinal").title]
    assert printed[1] == pytest.approx(0.5770491452, abs=1e-9) and printed[3] == pytest.approx(27.96837, abs=1e-4)
    assert all(row[4] == 1.0 for row in table.rows)  # holding the last force never opens the loop
    limits = any_gain(QUICK)
    assert limits.measures["agreeing"] == limits.measures["comparisons"] == 20.0
