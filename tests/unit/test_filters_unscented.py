"""The unscented filter beside a textbook implementation, and on functions whose moments are known."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.filters import KalmanFilter, SigmaWeights, UnscentedKalmanFilter
from estimators.filters.affine import Affine
from estimators.filters.triangular import FEW, left_divide, lower_factor, right_divide, summed_factor


def f(x: np.ndarray) -> np.ndarray:
    return x + 0.1 * np.sin(2 * x[..., ::-1]) + 0.05 * x**2


def h(x: np.ndarray) -> np.ndarray:
    return np.stack((np.hypot(x[..., 0], 1 + x[..., -1]), np.exp(0.3 * x[..., 0])), axis=-1)


class Textbook:
    """Sigma points and weighted outer products as they are printed, drawn anew before the measurement."""

    def __init__(self, x: np.ndarray, P: np.ndarray) -> None:
        self.x, self.P, n = x, P, len(x)
        self.epsilon = np.sqrt(3 / n)
        self.eta = self.epsilon**2 * n - n
        self.n = n

    def transform(self, function: object) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        n, eta = self.n, self.eta
        S = np.linalg.cholesky(self.P)
        points = np.array(
            [self.x]
            + [self.x + np.sqrt(n + eta) * S[:, i] for i in range(n)]
            + [self.x - np.sqrt(n + eta) * S[:, i] for i in range(n)]
        )
        wm = np.full(2 * n + 1, 1 / (2 * (n + eta)))
        wc = wm.copy()
        wm[0], wc[0] = eta / (n + eta), eta / (n + eta) + 1 - self.epsilon**2 + 2
        values = np.array([function(point) for point in points])  # type: ignore[operator]
        mean = wm @ values
        return points, wc, values, mean

    def predict(self, Q: np.ndarray) -> None:
        _, wc, values, mean = self.transform(f)
        self.x, self.P = mean, (values - mean).T * wc @ (values - mean) + Q

    def correct(self, y: np.ndarray, R: np.ndarray) -> None:
        points, wc, values, mean = self.transform(h)
        total = (values - mean).T * wc @ (values - mean) + R
        K = (points - self.x).T * wc @ (values - mean) @ np.linalg.inv(total)
        self.x, self.P = self.x + K @ (y - mean), self.P - K @ total @ K.T


@pytest.mark.parametrize("count", [3, FEW + 2])
@pytest.mark.parametrize("n", [2, 3, 8, 14])
def test_equals_the_textbook(n: int, count: int) -> None:
    draw = np.random.default_rng(n)
    root = 0.2 * draw.normal(size=(count, n, n))
    P, x = root @ root.swapaxes(1, 2) + 0.05 * np.eye(n), draw.normal(size=(count, n))
    Q, R = 0.02 * np.eye(n), np.array([[0.1, 0.02], [0.02, 0.2]])
    books = [Textbook(x[k], P[k]) for k in range(count)]
    unscented = UnscentedKalmanFilter(x, P)
    for _ in range(5):
        y = draw.normal(1, 0.2, size=(count, 2))
        unscented.predict(f, Q)
        step = unscented.correct(y, h, R)
        for book, value in zip(books, y, strict=True):
            book.predict(Q)
            book.correct(value, R)
    np.testing.assert_allclose(step.state, [book.x for book in books], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(step.covariance, [book.P for book in books], rtol=1e-8, atol=1e-10)


def test_weights_of_the_papers() -> None:
    three, eight = SigmaWeights.scaled(3), SigmaWeights.scaled(8)
    np.testing.assert_allclose(three, (np.sqrt(3), 0.0, 2.0), atol=1e-15)
    np.testing.assert_allclose(eight, (np.sqrt(3), -5 / 3, -5 / 3 + 3 - 3 / 8), atol=1e-15)
    assert eight.centre_spread > 0 > SigmaWeights.scaled(12).centre_spread


@pytest.mark.parametrize("count", [1, FEW + 2])
def test_square_of_a_gaussian(count: int) -> None:
    """E x^2 = m^2 + p exactly; var x^2 = 4 m^2 p + 2 p^2 with one state, epsilon = sqrt(3), beta = 2."""
    mean, variance = 0.7, 0.4
    unscented = UnscentedKalmanFilter(np.full((count, 1), mean), [[variance]])
    unscented.predict(lambda x: x**2, [[0.0]])
    np.testing.assert_allclose(unscented.state, mean**2 + variance)
    weight = SigmaWeights.scaled(1)
    even = variance**2 * (2 / (2 * weight.tau**2) * (weight.tau**2 - 1) ** 2 + weight.centre_spread)
    np.testing.assert_allclose(unscented.covariance, 4 * mean**2 * variance + even)
    assert abs(even - 2 * variance**2) < 1e-12


@pytest.mark.parametrize("count", [2, FEW + 2])
def test_negative_centre_weight_never_breaks_positive_definiteness(count: int) -> None:
    """A pure even function with a negative centre weight has a weighted covariance that is not positive definite."""
    n = 14
    unscented = UnscentedKalmanFilter(np.zeros((count, n)), np.eye(n), beta=-5.0)
    for _ in range(3):
        unscented.predict(lambda x: x**2, 1e-6 * np.eye(n))
        P = unscented.covariance
        scale = np.sqrt(np.einsum("bii->bi", P))
        assert np.isfinite(P).all()
        assert (np.linalg.eigvalsh(P / scale[:, None] / scale[..., None])[:, 0] > 0).all()
        unscented.correct(np.zeros((count, 2)), lambda x: x[..., :2] ** 2, 1e-9 * np.eye(2))
        assert (np.linalg.eigvalsh(unscented.covariance)[:, 0] > -1e-18).all()


@pytest.mark.parametrize("count", [3, FEW + 2])
@pytest.mark.parametrize(("n", "k"), [(3, 0), (3, 1), (8, 3), (14, 5), (8, 8)])
def test_affine_states_need_no_points(n: int, k: int, count: int) -> None:
    """Functions that are affine from state k on, with slopes that depend on the states before: the same to round-off."""
    draw = np.random.default_rng(n + k)
    root, mix = 0.2 * draw.normal(size=(count, n, n)), draw.normal(size=(n, n))
    P, x = root @ root.swapaxes(1, 2) + 0.05 * np.eye(n), draw.normal(size=(count, n))

    def bent(x: np.ndarray) -> np.ndarray:
        slope = np.cos(x[..., :k]).sum(axis=-1, keepdims=True)
        return 0.3 * x @ mix + np.concatenate((np.sin(x[..., :k]), 0.1 * slope * x[..., k:] + 1.0), axis=-1)

    def slope(x: np.ndarray, d: np.ndarray) -> np.ndarray:
        assert not d[..., :k].any()
        bend = 0.1 * np.cos(x[..., :k]).sum(axis=-1, keepdims=True)
        return 0.3 * d @ mix + np.concatenate((d[..., :k], bend * d[..., k:]), axis=-1)

    full, short = UnscentedKalmanFilter(x, P), UnscentedKalmanFilter(x, P)
    for _ in range(3):
        y = draw.normal(size=(count, 2))
        y[0, 1] = np.nan
        full.predict(bent, 0.1 * np.eye(n))
        short.predict(bent, 0.1 * np.eye(n), Affine(k, slope))
        a = full.correct(y, lambda x: bent(x)[..., -2:], 0.2 * np.eye(2), 0.999)
        lower = Affine(k, lambda x, d: slope(x, d)[..., -2:])
        b = short.correct(y, lambda x: bent(x)[..., -2:], 0.2 * np.eye(2), 0.999, lower)
        for name in a._fields:
            np.testing.assert_allclose(getattr(b, name), getattr(a, name), rtol=1e-8, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("count", [3, FEW + 2])
@pytest.mark.parametrize("affine", [False, True])
def test_functions_may_return_what_they_are_given(count: int, affine: bool) -> None:
    """The points themselves, or some of their columns, as views: nothing is overwritten while it is read."""
    draw = np.random.default_rng(6)
    P, x = np.eye(4) + 0.3, draw.normal(size=(count, 4))
    unscented, kalman = UnscentedKalmanFilter(x, P), KalmanFilter(x, P)
    for _ in range(3):
        y = draw.normal(size=(count, 2))
        unscented.predict(lambda x: x, 0.1 * np.eye(4), Affine(0, lambda x, d: d) if affine else None)
        kalman.predict(np.eye(4), 0.1 * np.eye(4))
        slope = Affine(0, lambda x, d: d[..., 1:3]) if affine else None
        a = unscented.correct(y, lambda x: x[..., 1:3], np.eye(2), affine=slope)
        b = kalman.correct(y, np.eye(4)[1:3], np.eye(2))
        for name in a._fields:
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-9, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("count", [2, FEW + 2])
@pytest.mark.parametrize("accuracy", [1.0, 1e-3, 1e-9, 1e-14])
def test_an_accurate_sensor_costs_no_digits(accuracy: float, count: int, known: bool) -> None:
    """A sensor far better than the prediction: the difference P - W W' loses digits there, the filter must not.

    In information form: P+^-1 = P-^-1 + C' C / r, whose smallest eigenvalue is that of what is not measured.
    """
    draw = np.random.default_rng(11)
    C = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, -1.0]])
    stay, whole = (Affine(0, lambda x, d: d), Affine(0, lambda x, d: d @ C.T)) if known else (None, None)
    unscented, kalman = UnscentedKalmanFilter(np.zeros((count, 3)), np.eye(3)), KalmanFilter(np.zeros(3), np.eye(3))
    for _ in range(4):
        y = draw.normal(size=2)
        unscented.predict(lambda x: x, 0.3 * np.eye(3), stay)
        kalman.predict(np.eye(3), 0.3 * np.eye(3))
        inverse = np.linalg.inv(unscented.covariance[0]) if accuracy > 1e-5 else None
        a = unscented.correct(np.tile(y, (count, 1)), lambda x: x @ C.T, accuracy * np.eye(2), affine=whole)
        b = kalman.correct(y, C, accuracy * np.eye(2))
        np.testing.assert_allclose(a.state, np.tile(b.state, (count, 1)), rtol=1e-7, atol=1e-7)
        measured = np.einsum("mi,bij,nj->bmn", C, a.covariance, C)
        np.testing.assert_allclose(measured[:, [0, 1], [0, 1]], accuracy, 1e-2 if accuracy < 0.1 else 1.0, 1e-15)
        assert (np.linalg.eigvalsh(a.covariance) > 0.0).all()
        if inverse is not None:
            expected = np.linalg.inv(inverse + C.T @ C / accuracy)
            np.testing.assert_allclose(a.covariance[0], expected, rtol=1e-8, atol=1e-12)


def test_slopes_that_are_not_finite_are_missing_channels() -> None:
    count, C = FEW + 2, np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]])
    given = Affine(0, lambda x, d: np.where(np.arange(count)[:, None] == 3, [np.nan, 1.0], 1.0) * (d @ C.T))
    unscented, kalman = UnscentedKalmanFilter(np.zeros((count, 3)), np.eye(3)), KalmanFilter(np.zeros(3), np.eye(3))
    unscented.predict(lambda x: x, 0.1 * np.eye(3))
    kalman.predict(np.eye(3), 0.1 * np.eye(3))
    step = unscented.correct(np.ones((count, 2)), lambda x: x @ C.T, np.eye(2), affine=given)
    one = kalman.correct([np.nan, 1.0], C, np.eye(2))
    np.testing.assert_allclose(step.state[3], one.state, atol=1e-12)
    np.testing.assert_allclose(step.covariance[3], one.covariance, atol=1e-12)
    assert step.used[3].tolist() == [False, True] and step.used[4].all()
    assert np.isnan(step.innovation[3, 0]) and np.isfinite(step.state).all()


def test_a_state_that_is_not_there_is_refused() -> None:
    unscented = UnscentedKalmanFilter(np.zeros((2, 3)), np.eye(3))
    for bad in (-1, 4):
        with pytest.raises(EstimatorError, match=f"affine.start = {bad} must be the index of a state, 0 to 2, or 3"):
            unscented.predict(lambda x: x, np.eye(3), Affine(bad, lambda x, d: d))


def test_factors() -> None:
    draw = np.random.default_rng(1)
    base = np.tril(draw.normal(size=(7, 5, 5))).transpose(1, 2, 0).copy()
    columns = draw.normal(size=(5, 3, 7))
    total = np.einsum("ikb,jkb->ijb", base, base) + np.einsum("ikb,jkb->ijb", columns, columns)
    matrix = np.einsum("ikb,jkb->ijb", base, base)
    for lower in (lower_factor(base, columns.copy()), summed_factor(matrix, base, columns.copy())):
        np.testing.assert_allclose(np.einsum("ikb,jkb->ijb", lower, lower), total, atol=1e-12)
        assert not lower[np.triu_indices(5, 1)].any()
        rows = draw.normal(size=(4, 5, 7))
        np.testing.assert_allclose(np.einsum("rkb,kjb->rjb", right_divide(rows.copy(), lower), lower), rows, atol=1e-10)
        tall = draw.normal(size=(5, 2, 7))
        np.testing.assert_allclose(np.einsum("ikb,kjb->ijb", lower, left_divide(lower, tall)), tall, atol=1e-10)


def test_ill_conditioned_sum_falls_back_to_the_orthogonal_road() -> None:
    """Two nearly equal columns: the product loses their difference, the triangularisation does not."""
    columns = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]])[:, :, None] * np.ones(3)
    zero = np.zeros((2, 2, 3))
    lower = summed_factor(zero, zero, columns)
    np.testing.assert_allclose(np.absolute(lower[1, 1]), 1e-9 / np.sqrt(2), rtol=1e-6)
