"""Corner forces reconciled with m a_x: the textbook least squares, unknown corners, missing totals."""

from __future__ import annotations

import numpy as np

from estimators.forces import reconcile

LOAD = np.array([6000.0, 5000.0, 4000.0, 7000.0])
NONE = np.zeros(4, dtype=bool)


def test_it_is_the_weighted_least_squares_solution() -> None:
    rng = np.random.default_rng(1)
    force, deviation = rng.normal(0, 1000, 4), rng.uniform(50, 900, 4)
    found = reconcile(force, deviation, 2500.0, 300.0, LOAD, NONE)
    rows = np.vstack((np.diag(1 / deviation), np.ones(4) / 300.0))
    expected, *_ = np.linalg.lstsq(rows, np.append(force / deviation, 2500.0 / 300.0))
    np.testing.assert_allclose(found.force, expected)
    np.testing.assert_allclose(found.deviation, np.sqrt(np.diag(np.linalg.inv(rows.T @ rows))))
    np.testing.assert_allclose(found.innovation, 2500.0 - force.sum())


def test_unknown_corners_take_their_share_and_nothing_at_standstill() -> None:
    all_stopped = reconcile(np.full(4, -3000.0), np.full(4, 80.0), 0.0, 300.0, LOAD, ~NONE)
    np.testing.assert_allclose(all_stopped.force, 0.0)
    one = np.array([True, False, False, False])
    truth = np.array([-4200.0, -3500.0, -2800.0, -4900.0])
    found = reconcile(np.array([0.0, *truth[1:]]), np.full(4, 60.0), truth.sum(), 200.0, LOAD, one)
    np.testing.assert_allclose(found.force, truth, atol=1.0)  # all at 0.7 of their load: the share is exact
    assert found.deviation[0] < 1500.0


def test_a_missing_total_changes_nothing_and_batches_are_independent() -> None:
    rng = np.random.default_rng(2)
    force, deviation = rng.normal(0, 1000, (3, 4)), rng.uniform(50, 900, (3, 4))
    unknown = np.array([NONE, [True, False, False, False], [False, True, False, True]])
    total = np.array([1000.0, np.nan, -2000.0])
    found = reconcile(force, deviation, total, 300.0, np.broadcast_to(LOAD, (3, 4)), unknown)
    np.testing.assert_array_equal(found.force[1], force[1])
    np.testing.assert_array_equal(found.deviation[1], [LOAD[0], *deviation[1, 1:]])
    assert found.used.tolist() == [True, False, True]
    assert np.isnan(found.innovation[1])
    for i in (0, 2):
        alone = reconcile(force[i], deviation[i], total[i], 300.0, LOAD, unknown[i])
        np.testing.assert_array_equal(found.force[i], alone.force)  # on plain numbers, to the last bit
        np.testing.assert_array_equal(found.deviation[i], alone.deviation)
