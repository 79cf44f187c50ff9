"""Trials on simulated drives: what they share, their errors against known ones, and what they refuse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.plots import ErrorBars, Panel, Shade
from studies.registry import MODULES, load_study
from studies.study import PartResult, Scope
from studies.trials.accuracy import Spread, known_spread, nrms, sample_spreads, spread
from studies.trials.estimation import assumed_car, baselines, run_of, run_pipeline
from studies.trials.histories import backgrounds, dot_heights, error_dots, history
from studies.trials.simulations import LUGRE, MAGIC_FORMULA, SIMULATIONS, simulated_truth, trial_part
from studies.trials.velocities import USED, side_slip_curve
from studies.truth import PERFECT, Truth, draw, load_manoeuvre, simulate_manoeuvres
from studies.truth.record import read_truth, write_truth
from synthesis.errors import SpecError

SHORT = Scope(quick=True, seeds=2)
NAMES = ("p1-launch-split", "p1-lane-change-dry")
SECONDS = 1.5


@pytest.fixture(scope="module")
def truth() -> Truth:
    return simulated_truth(NAMES, LUGRE, SHORT, SECONDS)


def same(one: Truth, other: Truth) -> bool:
    signals = one.signals.keys() == other.signals.keys() and all(
        np.array_equal(value, other.signals[name]) for name, value in one.signals.items()
    )
    whole = np.array_equal(one.time, other.time) and np.array_equal(one.duration, other.duration)
    return signals and whole and (one.names, one.tires, one.keys) == (other.names, other.tires, other.keys)


def test_a_truth_is_read_as_it_was_written(truth: Truth, tmp_path: Path) -> None:
    write_truth(truth, tmp_path)
    assert same(read_truth(tmp_path, truth.vehicles), truth)
    np.save(tmp_path / "vx.npy", truth["vx"] + 1e-12)
    assert not same(read_truth(tmp_path, truth.vehicles), truth)


def test_a_truth_of_other_cars_or_of_no_folder_is_refused(truth: Truth, tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="no truth can be read"):
        read_truth(tmp_path, truth.vehicles)
    write_truth(truth, tmp_path)
    with pytest.raises(SpecError, match="2 runs, but 1 vehicles"):
        read_truth(tmp_path, truth.vehicles[:1])


def test_prepared_drives_are_those_that_are_driven_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other runs in the batch change nothing but round-off, which saturated tires amplify."""
    shipped = {name: Path(f"{name}.toml") for name in (*NAMES, "p3-launch-split")}
    monkeypatch.setattr("studies.trials.simulations.shipped_manoeuvres", lambda: shipped)
    monkeypatch.setattr("studies.trials.simulations.QUICK_SECONDS", SECONDS)
    folder = tmp_path / SIMULATIONS[LUGRE].name
    folder.mkdir()
    SIMULATIONS[LUGRE].run(SHORT, folder)
    scope = replace(SHORT, prepared=tmp_path)
    chosen = simulated_truth(NAMES[::-1], LUGRE, scope, 0.5)
    assert chosen.names == NAMES[::-1] and chosen.time[-1] == pytest.approx(0.5) and set(chosen.tires) == {LUGRE}
    alone = simulated_truth(NAMES[::-1], LUGRE, SHORT, 0.5)
    for name, value in alone.signals.items():
        np.testing.assert_allclose(chosen[name], value, rtol=1e-6, atol=1e-6, err_msg=name)
    with pytest.raises(SpecError, match=r"magic-formula-tires.*trial_part"):
        simulated_truth(NAMES, MAGIC_FORMULA, scope)


def test_a_full_drive_is_not_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []
    monkeypatch.setattr(
        "studies.trials.simulations.simulate_manoeuvres", lambda runs: asked.extend(m.duration for m in runs)
    )
    simulated_truth(NAMES, LUGRE, Scope(), 0.5)
    simulated_truth(NAMES, LUGRE, SHORT, 0.5)
    assert asked == [load_manoeuvre(name).duration for name in NAMES] + [0.5, 0.5]


@pytest.mark.parametrize("study", MODULES)
def test_parts_on_drives_name_their_need_and_run_on_it(study: str) -> None:
    for part in load_study(study).parts:
        for need in part.needs:
            assert SIMULATIONS[part.run.keywords["tire"]] is need  # type: ignore[attr-defined]


def test_a_part_gets_the_tire_that_it_needs() -> None:
    seen = []

    def run(scope: Scope, tire: str) -> PartResult:
        seen.append((scope, tire))
        return PartResult()

    part = trial_part("p", "P", run, 1.0, MAGIC_FORMULA)
    part.run(SHORT)
    assert seen == [(SHORT, MAGIC_FORMULA)] and part.needs == (SIMULATIONS[MAGIC_FORMULA],) and not part.quick


def test_perfect_sensors_leave_small_errors_and_biased_ones_do_not(truth: Truth) -> None:
    row, samples = run_of(truth, "p1-lane-change-dry")
    true = truth["vx"][row, samples]
    drawn = draw(truth, PERFECT, range(2))
    exact = run_pipeline(drawn, {"vx": lambda step: step.vx})["vx"][:, row, samples]
    assert nrms(exact, true).max() < 0.5
    halved = replace(drawn, signals=drawn.signals | {"wheel_speed": 0.5 * drawn.signals["wheel_speed"]})
    wrong = run_pipeline(halved, {"vx": lambda step: step.vx})["vx"][:, row, samples]
    assert nrms(wrong, true).min() > 20.0


def test_baselines_follow_their_formulas(truth: Truth) -> None:
    drawn = draw(truth, PERFECT, range(1))
    found = baselines(drawn)
    radius, ax, time = assumed_car(drawn).radius, drawn.signals["ax"], drawn.sample_time
    k = 100
    assert found["mean wheel speed"][0, 0, k] == pytest.approx(np.mean(radius * drawn.signals["wheel_speed"][0, 0, k]))
    start = np.mean(radius * drawn.signals["wheel_speed"][0, 0, 0])
    assert found["integrated acceleration"][0, 0, k] == pytest.approx(start + time * ax[0, 0, 1 : k + 1].sum())


def test_runs_of_different_cars_are_not_played_together() -> None:
    both = simulate_manoeuvres(
        [load_manoeuvre(n).model_copy(update={"duration": 0.05}) for n in ("p1-launch-split", "p4-bends-dry")]
    )
    with pytest.raises(SpecError, match="p1-launch-split, p4-bends-dry drive different cars"):
        assumed_car(draw(both, PERFECT, range(1)))
    with pytest.raises(SpecError, match="manoeuvre 'p9' was not driven"):
        run_of(both, "p9")


def test_spread_is_students_interval() -> None:
    """Four values with mean 2.5 and s = 1.2910: the half width is 3.1824 s/2."""
    found = known_spread(np.array([1.0, 2.0, 3.0, 4.0]))
    half = 3.182446305 * np.sqrt(5.0 / 3.0) / 2.0
    assert (found.mean, found.worst, found.runs) == (2.5, 4.0, 4)
    assert (found.low, found.high) == pytest.approx((2.5 - half, 2.5 + half))
    assert spread(np.full(3, np.nan)) is None
    with pytest.raises(ValueError, match="1 of 2 runs have no value"):
        spread(np.array([1.0, np.nan]))
    with pytest.raises(ValueError, match="none of 2 runs"):
        known_spread(np.full(2, np.nan))


def test_errors_per_sample_are_percents_of_the_peak() -> None:
    """P4 (13), P5 (8) by hand: 50 % and 0 in the first draw, none in the second."""
    found = sample_spreads(np.array([[1.0, 4.0], [2.0, 4.0]]) * [1.5, 0.5], np.array([2.0, 4.0]) * [1.5, 0.5])
    assert (found.mean.mean, found.mean.worst, found.deviation.worst) == pytest.approx((12.5, 25.0, 25.0))
    assert found.cells((1.0, None))[::2] == [1.0, None, 25.0] and found.measures("x") == {
        "x, mean": pytest.approx(12.5), "x, deviation": pytest.approx(12.5)
    }  # fmt: skip


def test_nrms_counts_where_the_truth_is_large() -> None:
    truth = np.array([0.5, 2.0, -4.0])
    estimate = np.array([[9.0, 2.4, -4.3]])
    assert nrms(estimate, truth, 1.0)[0] == pytest.approx(100.0 * np.sqrt((0.16 + 0.09) / 2.0) / 4.0)
    assert np.isnan(nrms(estimate, truth, 5.0)).all() and np.isnan(nrms(estimate, np.zeros(3))).all()


def test_side_slip_curve_is_that_of_a_bristle_tire() -> None:
    """mu = alpha/(c + alpha) turned round, to a few per cent of the slip angle at most; a line is far off."""
    c = 0.07
    c1, c3 = side_slip_curve(c)
    mu = np.linspace(0.1, USED, 20)
    exact = c * mu / (1.0 - mu)
    assert np.abs(c1 * mu + c3 * mu**3 - exact).max() < 0.06 * exact[-1]
    assert np.abs(c * mu - exact).max() > 0.5 * exact[-1]


def test_backgrounds_are_the_stretches_of_each_state() -> None:
    time = 0.1 * np.arange(6)
    first, second, third = backgrounds(time, np.array([1, 1, 0, 0, 2, 1]), [None, ("high", "red"), ("low", "blue")])
    assert isinstance(first, Shade) and isinstance(second, Shade) and isinstance(third, Shade)
    assert (first.low, first.high) == pytest.approx((0.0, 0.2)) and (third.low, third.high) == pytest.approx((0.5, 0.6))
    assert [mark.label for mark in (first, second, third)] == ["high", "low", ""]  # a legend names a state once


def test_dots_of_a_row_stand_in_one_order_and_missing_ones_leave_a_gap() -> None:
    looks = {"a": ("o", "red"), "b": ("s", "blue")}
    a, b = Spread(2.0, 1.0, 4.0, 5.0, 3), Spread(3.0, 3.0, 3.0, 3.0, 3)
    one, other = error_dots([{"a": a, "b": b}, {"b": b}], looks)
    assert isinstance(one, ErrorBars) and isinstance(other, ErrorBars)
    assert (np.asarray(one.x), np.asarray(one.below), np.asarray(one.above)) == (2.0, 1.0, 2.0)
    assert np.asarray(other.y) - np.asarray(one.y)[0] == pytest.approx([0.35, 1.35])
    np.testing.assert_allclose(dot_heights([0, 1], "b", looks), np.asarray(other.y))


def test_time_is_named_under_the_last_panels() -> None:
    figure = history("n", "c", "a", [Panel([], y=f"{k} [m]") for k in range(4)], (4.0, 3.0), columns=2)
    labels = [[panel.x.label for panel in row] for row in figure.rows]  # type: ignore[union-attr]
    assert labels == [["", ""], ["time [s]", "time [s]"]]
