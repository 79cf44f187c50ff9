"""Kalman, extended and unscented filters: one answer on linear models, and what happens when something is missing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from estimators import EstimatorError
from estimators.filters import ExtendedKalmanFilter, FilterStep, KalmanFilter, UnscentedKalmanFilter

BATCHES = [(), (1,), (3,), (2, 4), (60,)]  # 60: the road of the unscented filter for many entries


class Linear:
    """A random linear model and the same call for three filters."""

    def __init__(self, batch: tuple[int, ...], n: int, m: int, seed: int = 0) -> None:
        draw = np.random.default_rng(seed)
        self.A = 0.9 * np.eye(n) + 0.1 * draw.normal(size=(*batch, n, n))
        self.C = draw.normal(size=(*batch, m, n))
        self.Q, self.R = 0.1 * np.eye(n), 0.3 * np.eye(m) + 0.1
        self.Q[0, 0] = 0.0  # singular
        root = draw.normal(size=(*batch, n, n))
        self.P = root @ root.swapaxes(-1, -2) + 0.1 * np.eye(n)
        self.x = draw.normal(size=(*batch, n))
        self.draw, self.batch, self.n, self.m = draw, batch, n, m

    def filters(self) -> list[Any]:
        return [kind(self.x, self.P) for kind in (KalmanFilter, ExtendedKalmanFilter, UnscentedKalmanFilter)]

    def f(self, x: np.ndarray) -> np.ndarray:
        return (self.A @ x[..., None])[..., 0]

    def h(self, x: np.ndarray) -> np.ndarray:
        return (self.C @ x[..., None])[..., 0]

    def predict(self, which: Any) -> np.ndarray:
        if isinstance(which, KalmanFilter):
            return which.predict(self.A, self.Q)
        if isinstance(which, ExtendedKalmanFilter):
            return which.predict(self.f, lambda x: self.A, self.Q)
        return which.predict(self.f, self.Q)

    def correct(self, which: Any, y: np.ndarray, gate: float | None = None) -> FilterStep:
        if isinstance(which, KalmanFilter):
            return which.correct(y, self.C, self.R, gate=gate)
        if isinstance(which, ExtendedKalmanFilter):
            return which.correct(y, self.h, lambda x: self.C, self.R, gate)
        return which.correct(y, self.h, self.R, gate)


@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 2), (8, 4), (13, 3)])  # 13: negative centre weight
def test_three_filters_agree_on_a_linear_model(batch: tuple[int, ...], n: int, m: int) -> None:
    model = Linear(batch, n, m)
    filters = model.filters()
    for _ in range(25):
        y = model.draw.normal(size=(*batch, m))
        y[model.draw.random(y.shape) < 0.2] = np.nan
        for which in filters:
            model.predict(which)
        first, *others = [model.correct(which, y, gate=0.99) for which in filters]
    scale = np.absolute(first.covariance).max()
    for other in others:
        for name in ("state", "innovation", "covariance", "innovation_covariance", "gain"):
            tolerance = 1e-11 * max(1.0, scale)
            np.testing.assert_allclose(getattr(other, name), getattr(first, name), rtol=1e-10, atol=tolerance)
        np.testing.assert_array_equal(other.used, first.used)
        np.testing.assert_array_equal(other.gated, first.gated)


def test_steady_state_solves_the_riccati_equation() -> None:
    model = Linear((), 4, 2)
    model.Q = 0.1 * np.eye(4)
    expected = solve_discrete_are(model.A.T, model.C.T, model.Q, model.R)
    for which in model.filters():
        for _ in range(400):
            model.correct(which, np.zeros(2))
            model.predict(which)
        np.testing.assert_allclose(which.covariance, expected, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("kind", range(3))
@pytest.mark.parametrize("batch", [(5,), (70,)])
def test_batch_equals_loop(kind: int, batch: tuple[int, ...]) -> None:
    model = Linear(batch, 3, 2)
    whole = model.filters()[kind]
    ys = model.draw.normal(size=(10, *batch, 2))
    ys[model.draw.random(ys.shape) < 0.3] = np.nan
    for y in ys:
        model.predict(whole)
        step = model.correct(whole, y, 0.95)
    for entry in range(0, batch[0], 7):
        single = Linear(batch, 3, 2)
        for name in ("A", "C", "P", "x"):
            setattr(single, name, getattr(model, name)[entry])
        alone = single.filters()[kind]
        for y in ys:
            single.predict(alone)
            found = single.correct(alone, y[entry], 0.95)
        for name, value in found._asdict().items():
            np.testing.assert_allclose(getattr(step, name)[entry], value, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", range(3))
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
@pytest.mark.parametrize("batch", [(), (60,)])
def test_missing_channel_is_a_deleted_row(kind: int, bad: float, batch: tuple[int, ...]) -> None:
    model, less = Linear(batch, 3, 3), Linear(batch, 3, 3)
    less.C, less.R, less.m = less.C[..., ::2, :], less.R[::2, ::2], 2
    y = model.draw.normal(size=(*batch, 3))
    y[..., 1] = bad
    step = model.correct(model.filters()[kind], y)
    expected = less.correct(less.filters()[kind], y[..., ::2])
    np.testing.assert_allclose(step.state, expected.state, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(step.covariance, expected.covariance, rtol=1e-11, atol=1e-12)
    assert np.isnan(step.innovation[..., 1]).all() and not step.used[..., 1].any() and not step.gated.any()
    assert step.used[..., ::2].all() and not step.gain[..., 1].any()


@pytest.mark.parametrize("kind", range(3))
@pytest.mark.parametrize("batch", [(), (60,)])
def test_nothing_measured_leaves_the_prediction(kind: int, batch: tuple[int, ...]) -> None:
    model = Linear(batch, 3, 2)
    which = model.filters()[kind]
    step = model.correct(which, np.full((*batch, 2), np.nan))
    np.testing.assert_allclose(step.state, model.x, atol=1e-14)
    np.testing.assert_allclose(step.covariance, model.P, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", range(3))
@pytest.mark.parametrize("batch", [(), (60,)])
def test_gate_refuses_beyond_the_quantile_and_only_there(kind: int, batch: tuple[int, ...]) -> None:
    edge = np.sqrt(3.841458820694124)  # chi-square quantile of 0.95, one degree of freedom
    for factor, gated in [(0.999, False), (1.001, True)]:
        model = Linear(batch, 3, 2)
        which = model.filters()[kind]
        total = model.C @ model.P @ np.swapaxes(model.C, -1, -2) + model.R
        y = model.h(model.x) + factor * edge * np.sqrt(np.einsum("...ii->...i", total))
        step = model.correct(which, y, gate=0.95)
        assert (step.gated == gated).all() and (step.used == (not gated)).all()
        assert np.isfinite(step.innovation).all()
        if gated:
            np.testing.assert_allclose(step.state, model.x, atol=1e-14)


@pytest.mark.parametrize("kind", range(3))
def test_covariance_stays_symmetric_and_positive_over_many_steps(kind: int) -> None:
    """Two states 1e10 apart in size, one nearly perfect sensor, a tiny process noise."""
    A = np.array([[1.0, 1e-3], [0.0, 1.0]])
    C, R, Q = np.array([[1e5, 0.0]]), np.array([[1e-12]]), np.diag([0.0, 1e-18])
    which = [KalmanFilter, ExtendedKalmanFilter, UnscentedKalmanFilter][kind](np.zeros(2), np.diag([1e10, 1.0]))
    steps = (30_000, 2_000, 4_000)[kind]
    for k in range(steps):
        if kind == 0:
            which.predict(A, Q)
            step = which.correct([0.0], C, R)
        elif kind == 1:
            which.predict(lambda x: x @ A.T, lambda x: A, Q)
            step = which.correct([0.0], lambda x: x @ C.T, lambda x: C, R)
        else:
            which.predict(lambda x: x @ A.T, Q)
            step = which.correct([0.0], lambda x: x @ C.T, R)
        if k % 1000 == 0 or k > steps - 10:
            P = step.covariance
            assert np.array_equal(P, P.T)
            scale = np.sqrt(np.diag(P))
            assert np.linalg.eigvalsh(P / scale / scale[:, None])[0] > 0


@pytest.mark.parametrize("kind", range(3))
@pytest.mark.parametrize("batch", [(4,), (60,)])
def test_prediction_that_is_not_finite_is_held_for_its_entry_alone(kind: int, batch: tuple[int, ...]) -> None:
    model, calm = Linear(batch, 3, 2), Linear(batch, 3, 2)
    model.A = model.A.copy()
    model.A[1, 0, 0] = np.nan
    which, other = model.filters()[kind], calm.filters()[kind]
    held, _ = model.predict(which), calm.predict(other)
    assert held[1] and held.sum() == 1
    np.testing.assert_allclose(which.state[1], model.x[1])
    np.testing.assert_allclose(which.covariance[1], model.P[1], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.delete(which.covariance, 1, 0), np.delete(other.covariance, 1, 0), rtol=1e-11)


@pytest.mark.parametrize("kind", range(3))
@pytest.mark.parametrize("batch", [(), (3,), (60,)])
def test_save_restore_and_reset(kind: int, batch: tuple[int, ...]) -> None:
    model = Linear(batch, 3, 2)
    which, twin = model.filters()[kind], model.filters()[kind]
    y = model.draw.normal(size=(*batch, 2))
    model.predict(which)
    model.correct(which, y)
    saved = which.save()
    twin.restore(saved)
    for each in (which, twin):
        model.predict(each)
    first, second = model.correct(which, y), model.correct(twin, y)
    for left, right in zip(first, second, strict=True):
        np.testing.assert_array_equal(left, right)
    where = np.zeros(batch, dtype=bool)
    where[...] = True
    if batch:
        where[1:] = False
    which.reset(where, state=np.ones(3), covariance=2 * np.eye(3))
    np.testing.assert_allclose(which.state[where], 1.0)
    np.testing.assert_allclose(which.covariance[where], np.broadcast_to(2 * np.eye(3), (where.sum(), 3, 3)), atol=1e-14)
    np.testing.assert_array_equal(which.state[~where], first.state[~where])
    which.reset()
    np.testing.assert_array_equal(which.state, model.x)
    np.testing.assert_allclose(which.covariance, model.P, rtol=1e-12, atol=1e-13)
    with pytest.raises(EstimatorError, match="lacks 'state'"):
        which.restore({})
    with pytest.raises(EstimatorError, match="not finite"):
        which.restore({key: np.full_like(array, np.nan) for key, array in saved.items()})
    with pytest.raises(EstimatorError, match="bool mask"):
        which.reset(np.zeros((9, 9)))


@pytest.mark.parametrize(
    ("state", "covariance", "message"),
    [
        ([0.0, 0.0], np.eye(3), "do not fit"),
        ([0.0, np.nan], np.eye(2), "state is not finite"),
        ([0.0, 0.0], np.diag([1.0, np.inf]), "covariance is not finite"),
        ([0.0, 0.0], [[1.0, 0.5], [0.0, 1.0]], "not symmetric"),
        ([0.0, 0.0], np.diag([1.0, 0.0]), "not positive definite"),
        ([0.0, 0.0], [[1.0, 2.0], [2.0, 1.0]], "not positive definite"),
        (["a", "b"], np.eye(2), "not an array of numbers"),
        (np.zeros((3, 2)), np.zeros((4, 2, 2)), "batch axes"),
    ],
)
def test_constructor_refuses(state: Any, covariance: Any, message: str) -> None:
    for kind in (KalmanFilter, ExtendedKalmanFilter, UnscentedKalmanFilter):
        with pytest.raises(EstimatorError, match=message):
            kind(state, covariance)


def test_calls_refuse() -> None:
    kalman, unscented = KalmanFilter(np.zeros(2), np.eye(2)), UnscentedKalmanFilter(np.zeros(2), np.eye(2))
    with pytest.raises(EstimatorError, match="does not fit 2 states"):
        kalman.predict(np.eye(3), np.eye(2))
    with pytest.raises(EstimatorError, match="does not fit"):
        kalman.correct([0.0], np.eye(2), np.eye(1))
    with pytest.raises(EstimatorError, match="expected \\(2,\\)"):
        kalman.correct(np.zeros(3), np.eye(2), np.eye(2))
    with pytest.raises(EstimatorError, match="probability"):
        kalman.correct(np.zeros(2), np.eye(2), np.eye(2), gate=1.5)
    with pytest.raises(EstimatorError, match="singular"):
        kalman.correct(np.zeros(2), np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(EstimatorError, match="Q is not positive semidefinite"):
        unscented.predict(lambda x: x, np.diag([1.0, -1.0]))
    with pytest.raises(EstimatorError, match="R is not positive definite"):
        unscented.correct(np.zeros(2), lambda x: x, np.diag([1.0, 0.0]))
    with pytest.raises(EstimatorError, match="transition has shape"):
        unscented.predict(lambda x: x[..., :1, None], np.eye(2))
    with pytest.raises(EstimatorError, match="epsilon"):
        UnscentedKalmanFilter(np.zeros(2), np.eye(2), epsilon=0.0)
    with pytest.raises(EstimatorError, match="batch"):
        kalman.predict(np.zeros((5, 2, 2)), np.eye(2))
