"""Proofs of positivity against polynomials whose minimum is known, in floating point and in exact rationals."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from flint import fmpq, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from synthesis.polynomials.matrix import MatrixPolynomial, constant, symmetric_block, variable
from synthesis.polynomials.positivity import prove_positive
from synthesis.polynomials.rational import bernstein, first_failure, halve, is_positive_definite, rational

SMALL = settings(deadline=None, max_examples=60)


def number(value: float, variables: int) -> MatrixPolynomial:
    return constant(np.array([[value]]), variables)


def bowl(centre: list[float], floor: float) -> MatrixPolynomial:
    """sum_i (u_i - a_i)^2 + floor: its minimum is `floor`, at `centre`."""
    v = len(centre)
    total = number(floor, v)
    for i, a in enumerate(centre):
        shifted = variable(i, v) - number(a, v)
        total = total + shifted.scaled_by(shifted)
    return total


CENTRES = [[0.3], [1.0], [-0.77, 0.2], [0.5, 0.5], [0.1, -0.9, 0.35], [1 / 3, 1 / 7, -1 / 9]]


@pytest.mark.parametrize("centre", CENTRES)
def test_known_minimum_decides(centre: list[float]) -> None:
    good = prove_positive(bowl(centre, 1e-3))
    assert good.proved
    assert not good.refuted
    assert good.smallest >= 1e-3 - 1e-12
    bad = prove_positive(bowl(centre, -1e-3))
    assert bad.refuted
    assert not bad.proved
    assert bad.smallest < 0.0
    assert np.sum((bad.place - np.array(centre)) ** 2) < 1e-3  # where it is negative indeed


def test_the_smallest_value_and_its_place_are_found_between_grid_lines() -> None:
    found = prove_positive(bowl([0.123456], 0.25))
    assert found.smallest == pytest.approx(0.25, abs=1e-4)
    assert found.place[0] == pytest.approx(0.123456, abs=1e-2)


def test_touching_zero_is_never_proved() -> None:
    for centre in CENTRES:
        assert not prove_positive(bowl(centre, 0.0), depth=8).proved


def test_a_narrow_dip_between_many_points_is_found() -> None:
    """(u - a)^2 - w^2 is positive at all of 1000 grid points and negative between two of them."""
    a, width = 0.31237, 1e-4
    dip = bowl([a], -(width**2))
    grid = np.linspace(-1.0, 1.0, 1000)[:, None]
    assert dip.at(grid).min() > 0.0
    found = prove_positive(dip)
    assert found.refuted
    assert abs(found.place[0] - a) <= width


def test_matrices_not_only_their_entries() -> None:
    """[[1, u], [u, 1 + e]] is positive on [-1, 1] iff e > 0; every diagonal entry is positive anyway."""
    u = variable(0, 1)
    for excess, expected in ((1e-6, True), (0.0, False), (-1e-6, False)):
        matrix = symmetric_block([[number(1.0, 1), u], [None, number(1.0 + excess, 1)]])
        found = prove_positive(matrix)
        assert found.proved is expected
        if excess < 0.0:
            assert found.refuted
            assert abs(found.place[0]) == pytest.approx(1.0)


def test_constant_matrices() -> None:
    assert prove_positive(constant(np.diag([1.0, 2.0]), 2)).proved
    assert prove_positive(constant(np.diag([1.0, -2.0]), 2)).refuted
    zero = prove_positive(constant(np.zeros((2, 2)), 2))
    assert not zero.proved
    assert not zero.refuted  # zero is neither positive nor negative: nothing is claimed


def test_depth_limits_the_effort_without_a_false_claim() -> None:
    hard = bowl([0.3], 1e-7)
    assert not prove_positive(hard, depth=3).proved
    assert prove_positive(hard, depth=16).proved


@SMALL
@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=3), st.floats(-12.0, -1.0), st.booleans())
def test_bowls_of_any_depth_are_never_proved_falsely(centre: list[float], exponent: float, below: bool) -> None:
    floor = 10.0**exponent * (-1.0 if below else 1.0)
    found = prove_positive(bowl(centre, floor), depth=10)
    assert not (found.proved and found.refuted)
    if below:
        assert not found.proved
    else:
        assert not found.refuted


@SMALL
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 3))
def test_proofs_agree_with_dense_sampling(seed: int, v: int, n: int) -> None:
    """Random symmetric matrix polynomials, shifted so that their sampled minimum is close to zero on either side."""
    rng = np.random.default_rng(seed)
    shape = (*rng.integers(1, 4, size=v), n, n)
    array = rng.standard_normal(shape)
    M = MatrixPolynomial((array + np.swapaxes(array, -1, -2))[..., None])
    axes = [np.linspace(-1.0, 1.0, {1: 801, 2: 41, 3: 15}[v])] * v
    points = np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)
    lowest = float(np.linalg.eigvalsh(M.at(points)[..., 0]).min())
    for shift in (-1e-9, -1e-2, 1e-2, 1.0):
        shifted = M + constant(np.eye(n) * (shift - lowest), v)
        found = prove_positive(shifted, depth=8)
        if shift <= 0.0:
            assert not found.proved
        if found.refuted:
            value = np.linalg.eigvalsh(shifted.at(found.place[None])[0, ..., 0])[0]
            assert value < 0.0  # the place is a witness, checked by itself
            assert found.smallest == pytest.approx(value, abs=1e-9)
    assert prove_positive(M + constant(np.eye(n) * (1.0 + 2.0 * np.abs(array).sum()), v)).proved


@SMALL
@given(st.lists(st.integers(-8, 8), min_size=1, max_size=5), st.integers(-4, 4))
def test_floating_point_proofs_agree_with_exact_ones(coefficients: list[int], shift: int) -> None:
    """Independent check: the same polynomial on [-1, 1], moved to [0, 1], decided in rational arithmetic."""
    whole = [coefficients[0] + shift, *coefficients[1:]]
    exact = fmpq_poly(whole)(fmpq_poly([-1, 2]))
    failure = first_failure([[exact]], depth=40)
    found = prove_positive(MatrixPolynomial(np.array(whole, float)[:, None, None, None]), depth=24)
    if found.proved:
        assert failure is None
    if failure is None:
        assert found.proved or found.smallest < 1e-6
    if found.refuted:
        assert failure is not None


# ---- exact rationals ------------------------------------------------------------------------------------------------


def test_floats_and_printed_decimals_are_read_exactly() -> None:
    assert rational(0.1) != fmpq(1, 10)  # the float is not one tenth ...
    assert rational("0.1") == fmpq(1, 10)  # ... the printed decimal is
    assert rational(0.5) == fmpq(1, 2)
    assert rational("-0.0011") == fmpq(-11, 10000)
    assert rational(" 1.25e-3 ") == fmpq(1, 800)
    assert rational("7E2") == rational(700) == fmpq(700)


def test_exact_proof_sees_a_double_root_at_one_third() -> None:
    """(3t - 1)^2 + e on [0, 1]: no binary fraction hits 1/3, so only exactness tells e = 0 from e > 0."""
    square = fmpq_poly([1, -6, 9])
    assert first_failure([[square]], depth=60) is not None
    assert first_failure([[square + fmpq(1, 10**12)]], depth=40) is None
    place = first_failure([[square - fmpq(1, 10**6)]], depth=40)
    assert place is not None
    assert square(place) <= fmpq(1, 10**6) * 2


def test_exact_proof_names_an_end_point() -> None:
    line = fmpq_poly([1, -1])  # 1 - t vanishes at t = 1
    assert first_failure([[line]]) == fmpq(1)
    assert first_failure([[fmpq_poly([0, 1])]]) == fmpq(0)


@SMALL
@given(st.lists(st.integers(-9, 9), min_size=9, max_size=9))
def test_exact_definiteness_is_that_of_the_eigenvalues(entries: list[int]) -> None:
    matrix = np.array(entries, float).reshape(3, 3)
    matrix = matrix + matrix.T + 12.0 * np.eye(3)
    lowest = np.linalg.eigvalsh(matrix)[0]
    if abs(lowest) > 1e-9:
        assert is_positive_definite([[rational(x) for x in row] for row in matrix]) is bool(lowest > 0.0)


def test_bernstein_coefficients_and_their_halves_are_values_at_the_ends() -> None:
    cubic = fmpq_poly([2, -3, 0, 5])
    points = bernstein([[cubic]], 3)
    left, right = halve(points)
    for polygon, (low, high) in ((points, (0, 1)), (left, (0, fmpq(1, 2))), (right, (fmpq(1, 2), 1))):
        assert polygon[0][0][0] == cubic(fmpq(low))
        assert polygon[-1][0][0] == cubic(fmpq(high))
    assert all(a != b for a, b in pairwise(point[0][0] for point in left))


def test_what_rounding_may_have_made_is_neither_proved_nor_refuted() -> None:
    """1 + c u with 1 - c = 2^-53; and 1e-12 where numbers of size 1e6 were added up."""
    hardly = MatrixPolynomial(np.array([1.0, 1.0 - 2.0**-53]).reshape(2, 1, 1, 1))
    found = prove_positive(hardly)
    assert not found.proved and not found.refuted and found.smallest > 0.0
    small = MatrixPolynomial(np.array([1e-12]).reshape(1, 1, 1, 1))
    assert prove_positive(small).proved
    cancelled = prove_positive(small, magnitude=1e6)
    assert not cancelled.proved and not cancelled.refuted
    assert prove_positive(MatrixPolynomial(np.array([-1.0]).reshape(1, 1, 1, 1)), magnitude=1e6).refuted
