"""Drop probabilities over a gain schedule: frozen, and proved while the parameter moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from analysis.drops.cells import Cells, CellUpdates, _sizes, cell_updates, curvature, ends
from analysis.drops.frozen import critical_drop_probability
from analysis.drops.mean_square import certified_drop_probability, check_mean_square, design, mean_square_schedule
from analysis.drops.modes import schedule_drop_modes
from analysis.drops.schedule import frozen_critical_probability
from analysis.errors import AnalysisError
from estimators import GainSchedule
from estimators.schedule import PlantPolynomial
from estimators.schedule.quotient import quotients
from synthesis.lmi.result import Verdict
from tests.support.schedule_content import schedule_content, with_matrix

SHIPPED = GainSchedule.shipped("corner-estimation-longitudinal")
SAMPLED = GainSchedule.from_content(
    schedule_content(update="sampled", gains=[(1.18e-3, 0.048), (8.8e-4, 0.076), (5.9e-4, 0.134), (4.2e-4, 0.217)])
)
NAMES = [
    "corner-estimation-longitudinal",
    "corner-estimation-lateral",
    "longitudinal-speed",
    "resilient-velocity-longitudinal",
    "resilient-velocity-lateral",
]


def rotating(rate: float) -> GainSchedule:
    """x' = [[-1, w], [w - 10.1, -1]] x, w in [0.1, 10], gain 0: every frozen pole at -1 +- j; unstable if w may jump."""
    content = schedule_content(gains=(0.0, 0.0), breakpoints=(0.1, 5.0, 10.0), sample_time=0.2)
    with_matrix(content, "A", [[-1, 0], [-10.1, -1]], [[0, 1], [1, 0]])
    with_matrix(content, "C", [[1, 0]])
    content["scheduling"][0] |= {"rate_min": -rate, "rate_max": rate}
    return GainSchedule.from_content(content)


@pytest.mark.parametrize("name", NAMES)
def test_frozen_value_is_the_lowest_of_a_dense_grid(name: str) -> None:
    schedule = GainSchedule.shipped(name)
    found = frozen_critical_probability(schedule, points=101)
    modes = schedule_drop_modes(schedule, np.linspace(0.0, 140.0, 561))
    dense = critical_drop_probability(modes.dropped, modes.received)
    assert found.smallest <= dense.min() + 1e-12
    assert found.smallest == pytest.approx(dense.min(), abs=1e-6)
    at = schedule_drop_modes(schedule, found.place)
    assert critical_drop_probability(at.dropped, at.received) == pytest.approx(found.smallest, abs=1e-12)
    assert found.parameter in found.message and "frozen" in found.message


def test_frozen_minimum_inside_the_range_is_found() -> None:
    """Gains that grow too fast for the kinematics: the minimum lies between two of 11 samples."""
    schedule = GainSchedule.from_content(
        schedule_content(gains=[(0.2, 20.0), (0.9, 380.0), (0.5, 60.0)], breakpoints=(0.0, 20.0, 140.0))
    )
    found = frozen_critical_probability(schedule, points=11)
    modes = schedule_drop_modes(schedule, np.linspace(0.0, 140.0, 2801))
    values = critical_drop_probability(modes.dropped, modes.received)
    assert 0 < values.argmin() < 2800
    assert found.smallest <= values.min() + 1e-12
    assert found.smallest == pytest.approx(values.min(), abs=1e-4)


def test_held_measurements_never_open_the_loop() -> None:
    assert frozen_critical_probability(SHIPPED, "hold").smallest == 1.0


@pytest.mark.parametrize("schedule", [GainSchedule.from_content(schedule_content()), SAMPLED], ids=["held", "sampled"])
def test_curvature_bounds_the_error_of_interpolation(schedule: GainSchedule) -> None:
    """Against the largest error seen on 200 points of each cell, with exponentials written out."""
    scale = np.diag([300.0, 1.0])
    cells = Cells(np.array([0.0, 31.0, 100.0]), np.array([4.0, 36.0, 120.0]))
    bound = curvature(cell_updates(schedule, cells, scale))
    P = np.array([[0.8, 0.1], [0.1, 0.3]])
    P = P / np.linalg.eigvalsh(P)[-1]
    for c in range(3):
        t = np.linspace(0.0, 1.0, 201)
        modes = schedule_drop_modes(schedule, cells.low[c] + t * (cells.high[c] - cells.low[c]))
        for k, update in enumerate((modes.dropped, modes.received)):
            phi = scale @ update @ np.linalg.inv(scale)
            value = np.swapaxes(phi, 1, 2) @ P @ phi
            chord = value[:1] + t[:, None, None] * (value[-1:] - value[:1])
            seen = np.abs(np.linalg.eigvalsh(value - chord)).max()
            assert 0.0 < seen <= bound[k, c]


def cubic(update: str) -> GainSchedule:
    content = schedule_content(update=update, gains=[(0.02, 0.1), (0.05, -0.2), (-0.03, 0.3), (0.0, 0.1)])
    second, third = [[2e-3, 0], [0, -1e-3]], [[0, 1e-8], [2e-5, 0]]
    with_matrix(content, "A", [[-20, 1], [3, -9]], [[0, 1e-3], [0.1, 0]], second, third)
    with_matrix(content, "C", [[1, 2]], [[0.01, 0]], [[0, 1e-3]], [[-1e-5, 1e-5]])
    return GainSchedule.from_content(content)


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_updates_on_a_cell_are_those_of_the_schedule(update: str) -> None:
    """The polynomials in t, summed up, beside plant and gains at the place."""
    schedule, T = cubic(update), 0.005
    scale = np.array([[3.0, 1.0], [0.5, 2.0]])
    cells = Cells(np.array([0.0, 31.0, 80.0]), np.array([30.0, 36.0, 140.0]))
    found = cell_updates(schedule, cells, scale)
    for t in (0.0, 0.3, 1.0):
        places = cells.low + t * (cells.high - cells.low)
        exponent, added = (
            np.einsum("ucdij,d->ucij", M, t ** np.arange(M.shape[2])) for M in (found.exponent, found.added)
        )
        plant = schedule.plant_at(places)
        correction = schedule.gain(places) @ plant.C
        expected = [plant.A * T, (plant.A if update == "sampled" else plant.A - correction) * T]
        np.testing.assert_allclose(exponent, scale @ np.array(expected) @ np.linalg.inv(scale), rtol=1e-11, atol=1e-13)
        jump = scale @ -correction @ np.linalg.inv(scale) if update == "sampled" else np.zeros_like(correction)
        np.testing.assert_allclose(added, [np.zeros_like(jump), jump], rtol=1e-11, atol=1e-13)


def divided(schedule: GainSchedule, disguised: bool = False) -> GainSchedule:
    """The plant over 1 + 0.6 u, u its parameter from -1 to 1; `disguised`: numerators times that, too."""

    def numerator(matrix: PlantPolynomial) -> PlantPolynomial:
        c = matrix.coefficients  # u T_0 = T_1, u T_k = (T_(k+1) + T_(k-1)) / 2
        wide, moved = np.pad(c, [(0, 1), (0, 0), (0, 0)]), np.pad(c, [(1, 0), (0, 0), (0, 0)]) / 2
        moved[1] *= 2
        moved[: len(c) - 1] += c[1:] / 2
        return matrix._replace(coefficients=wide + 0.6 * moved) if disguised else matrix

    given = schedule.polynomials
    below = given["A"]._replace(coefficients=np.array([1.0, 0.6])[:, None, None])
    plant = quotients({key: numerator(matrix) for key, matrix in given.items()}, below, ["w"], "file")
    return replace(schedule, plant=dict(plant))


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_bounds_on_cells_of_a_rational_plant(update: str) -> None:
    """Updates at the ends, and the error of interpolation between them, with exponentials written out; bounds not idle."""
    schedule, scale = divided(cubic(update)), np.array([[3.0, 1.0], [0.5, 2.0]])
    cells = Cells(np.array([0.0, 31.0, 80.0]), np.array([2.0, 34.0, 84.0]))
    updates = cell_updates(schedule, cells, scale)
    phi, bound = ends(updates), curvature(updates)
    for c in range(3):
        modes = schedule_drop_modes(schedule, np.linspace(cells.low[c], cells.high[c], 101))
        t = np.linspace(0.0, 1.0, 101)[:, None, None]
        for k, update_of in enumerate((modes.dropped, modes.received)):
            values = scale @ update_of @ np.linalg.inv(scale)
            np.testing.assert_allclose(phi[k, :, c], values[[0, -1]], rtol=1e-11, atol=1e-13)
            turned = np.swapaxes(values, 1, 2) @ values
            seen = np.abs(np.linalg.eigvalsh(turned - turned[:1] - t * (turned[-1:] - turned[:1]))).max()
            assert seen <= bound[k, c] < 30.0 * seen


@pytest.mark.parametrize("b", [0.0, 2.0, -3.0])
def test_bounds_of_a_quotient_in_closed_form(b: float) -> None:
    """(1 + b t)/(1 - t/2): changes by |b + 1/2| 2, slope |b + 1/2| 4, curvature |b + 1/2| 8, all at t = 1; 7/7 is one."""
    above, below = np.array([1.0, b]).reshape(1, 1, 2, 1, 1), np.array([[1.0, -0.5]])
    found = np.array(_sizes(above, below))[:, 0, 0]
    np.testing.assert_allclose(found, abs(b + 0.5) * np.array([2.0, 4.0, 8.0]), rtol=1e-12)
    np.testing.assert_allclose(np.array(_sizes(7.0 * above, 7.0 * below))[:, 0, 0], found, rtol=1e-12)
    one = cell_updates(divided(cubic("held")), Cells(np.array([31.0]), np.array([36.0])), np.eye(2))
    seven = CellUpdates(7.0 * one.exponent, 7.0 * one.added, 7.0 * one.below)
    np.testing.assert_allclose(curvature(seven), curvature(one), rtol=1e-12)
    vanishing = CellUpdates(one.exponent, one.added, np.array([[1.0, -1.0]]))
    assert (curvature(vanishing) == 1e100).all()  # proves nothing


def test_a_common_factor_changes_no_verdict_about_drops() -> None:
    """The same plant as polynomials and as quotients: the same P; and too many drops are refuted."""
    frozen = frozen_critical_probability(SAMPLED, points=21)
    twin = divided(SAMPLED, disguised=True)
    for share, verdict in ((0.9, Verdict.CERTIFIED), (1.02, Verdict.REFUTED)):
        first, second = (mean_square_schedule(one, share * frozen.smallest, frozen) for one in (SAMPLED, twin))
        assert first.verdict is second.verdict is verdict
        np.testing.assert_allclose(second.lyapunov, first.lyapunov, rtol=1e-5)
    other = mean_square_schedule(
        divided(SAMPLED), 0.5 * frozen_critical_probability(divided(SAMPLED), points=21).smallest
    )
    assert other.verdict is Verdict.CERTIFIED


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_curvature_is_no_larger_than_it_need_be(update: str) -> None:
    """Motion along one direction: e^(2 m t) and (1 - k c t)^2 curve by nearly what the bound says."""
    content = schedule_content(update=update, gains=(0.0, 0.01))
    slope = 0.0 if update == "sampled" else -1e-2
    with_matrix(content, "A", [[0, 0], [0, 0]], [[slope, 0], [0, slope]])
    with_matrix(content, "C", [[0, 0]], [[0, 0.1]] if update == "sampled" else [[0, 0]])
    schedule = GainSchedule.from_content(content)
    cells = Cells(np.array([0.0]), np.array([10.0]))
    bound = curvature(cell_updates(schedule, cells, np.eye(2)))[1, 0]
    modes = schedule_drop_modes(schedule, np.linspace(0.0, 10.0, 201))
    value = np.swapaxes(modes.received, 1, 2) @ modes.received
    chord = value[:1] + np.linspace(0.0, 1.0, 201)[:, None, None] * (value[-1:] - value[:1])
    seen = np.abs(np.linalg.eigvalsh(value - chord)).max()
    assert 0.99 * bound < seen <= bound


def test_a_bound_that_proves_nothing_is_large_and_finite() -> None:
    schedule = GainSchedule.from_content(schedule_content(gains=[(0.7, 180.0), (5.0, 2000.0), (1.0, 1.0), (0.0, 0.0)]))
    bound = curvature(cell_updates(schedule, Cells(np.array([0.0]), np.array([30.0])), np.eye(2)))
    assert np.isfinite(bound).all()
    assert bound[1, 0] > 1e40
    assert (
        check_mean_square(schedule, 0.0, schedule.breakpoints, np.tile(np.eye(2), (4, 1, 1)), np.eye(2)).verdict
        is Verdict.INCONCLUSIVE
    )


def test_curvature_of_a_plant_of_third_order_is_bounded() -> None:
    """Polynomials of the parameter that the shipped plants do not have, for both updates."""
    for update in ("held", "sampled"):
        test_curvature_bounds_the_error_of_interpolation(cubic(update))


@pytest.mark.parametrize(("schedule", "p"), [(SHIPPED, 0.6), (SAMPLED, 0.3)], ids=["held", "sampled"])
def test_certificate_survives_a_dense_check_written_out(schedule: GainSchedule, p: float) -> None:
    """Every pair (w, w+) within the rate on a grid that the proof does not use."""
    found = mean_square_schedule(schedule, p)
    assert found.verdict is Verdict.CERTIFIED, found.message
    draw = np.random.default_rng(1)
    reach = 800.0 * schedule.sample_time
    for w in draw.uniform(0.0, 140.0, 300):
        after = np.clip(w + draw.choice([-1.0, 1.0, draw.uniform(-1, 1)]) * reach, 0.0, 140.0)
        now, later = (
            np.array([[np.interp(x, found.nodes, found.lyapunov[:, i, j]) for j in (0, 1)] for i in (0, 1)])
            for x in (w, after)
        )
        plant, gain = schedule.plant_at(w), schedule.gain(w)
        open_ = expm(schedule.sample_time * plant.A)
        held = expm(schedule.sample_time * (plant.A - gain @ plant.C))
        closed = held if schedule is SHIPPED else open_ - gain @ plant.C
        slack = now - p * open_.T @ later @ open_ - (1.0 - p) * closed.T @ later @ closed
        size = np.sqrt(np.diag(now))
        assert np.linalg.eigvalsh(slack / np.outer(size, size))[0] > 0.0


@pytest.mark.parametrize("schedule", [SHIPPED, SAMPLED], ids=["held", "sampled"])
def test_certified_below_and_refuted_above_the_frozen_value(schedule: GainSchedule) -> None:
    frozen = frozen_critical_probability(schedule)
    assert mean_square_schedule(schedule, 0.97 * frozen.smallest, frozen).verdict is Verdict.CERTIFIED
    refuted = mean_square_schedule(schedule, frozen.smallest + 1e-3, frozen)
    assert refuted.verdict is Verdict.REFUTED
    assert f"{frozen.place:.6g} rad/s" in refuted.message


def test_spoiled_matrices_are_refused() -> None:
    nodes, P, scale = design(SHIPPED, 0.6, 1)
    assert check_mean_square(SHIPPED, 0.6, nodes, P, scale).verdict is Verdict.CERTIFIED
    for spoiled in (P * np.where(np.arange(len(P)) == 3, 0.1, 1.0)[:, None, None], -P, 0.0 * P):
        assert check_mean_square(SHIPPED, 0.6, nodes, spoiled, scale).verdict is Verdict.INCONCLUSIVE
    # The same matrices do not prove more drops than there is room for.
    assert check_mean_square(SHIPPED, 0.74, nodes, P, scale).verdict is Verdict.INCONCLUSIVE


def test_frozen_stability_is_not_taken_for_stability_in_motion() -> None:
    """All frozen values are stable, yet alternating between the ends grows: slow motion is proved, fast motion is not."""
    fast = rotating(1e3)
    ends = schedule_drop_modes(fast, np.array([0.1, 10.0])).received
    frozen = np.abs(np.linalg.eigvals(schedule_drop_modes(fast, np.linspace(0.1, 10, 50)).received)).max()
    assert frozen < 0.85
    burst = np.linalg.matrix_power(ends[0], 2) @ np.linalg.matrix_power(ends[1], 2)
    assert np.abs(np.linalg.eigvals(burst)).max() > 1.0
    assert frozen_critical_probability(fast).smallest == 1.0
    assert mean_square_schedule(fast, 0.5).verdict is Verdict.INCONCLUSIVE
    assert mean_square_schedule(rotating(0.05), 0.5).verdict is Verdict.CERTIFIED


def test_bracket_of_the_certified_probability() -> None:
    best, upper = certified_drop_probability(SHIPPED, tolerance=0.02)
    frozen = frozen_critical_probability(SHIPPED).smallest
    assert best.verdict is Verdict.CERTIFIED
    assert best.drop_probability < upper <= frozen
    assert upper - best.drop_probability <= 0.02
    assert best.drop_probability > 0.7


def test_bad_questions_are_refused() -> None:
    for p in (-0.1, 1.5, np.nan):
        with pytest.raises(AnalysisError):
            mean_square_schedule(SHIPPED, p)
    with pytest.raises(AnalysisError, match="points = 1"):
        frozen_critical_probability(SHIPPED, points=1)
    with pytest.raises(AnalysisError, match="tolerance"):
        certified_drop_probability(SHIPPED, tolerance=0.0)
    unstable = replace(SHIPPED, table=-SHIPPED.table)
    assert frozen_critical_probability(unstable).smallest == 0.0
    assert mean_square_schedule(unstable, 0.0).verdict is Verdict.REFUTED
