"""The exact proof of positivity against polynomials whose sign is known by construction."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from synthesis.polynomials.rational import first_failure, is_positive_definite, rational

unit = st.fractions(min_value=0, max_value=1, max_denominator=1000)
coefficient = st.fractions(min_value=-5, max_value=5, max_denominator=100)


def q(value: Fraction) -> fmpq:
    return fmpq(value.numerator, value.denominator)


@settings(max_examples=60, deadline=None)
@given(st.lists(coefficient, min_size=4, max_size=4), unit, st.fractions(min_value=Fraction(1, 100), max_value=2))
def test_gram_matrix_plus_epsilon_is_proved(entries: list[Fraction], root: Fraction, epsilon: Fraction) -> None:
    """M(t) = v(t) v(t)' + epsilon I with v touching zero inside: positive by construction, however close."""
    a, b, c, d = (q(entry) for entry in entries)
    touch = fmpq_poly([-q(root), 1])
    v = [fmpq_poly([a, b]) * touch, fmpq_poly([c, d]) * touch]
    matrix = [[x * y + (q(epsilon) if i == j else 0) for j, y in enumerate(v)] for i, x in enumerate(v)]
    assert first_failure(matrix) is None


@settings(max_examples=60, deadline=None)
@given(unit, st.fractions(min_value=Fraction(1, 50), max_value=1, max_denominator=200))
def test_dip_below_zero_is_found_where_it_is(place: Fraction, depth: Fraction) -> None:
    """(t - place)^2 - depth^2 / 16 is negative exactly within depth / 4 of its place: the failure lies there."""
    p = fmpq_poly([q(place * place - depth * depth / 16), -2 * q(place), 1])
    at = first_failure([[p]])
    assert at is not None
    assert abs(float(at) - float(place)) <= float(depth) / 4 + 1e-12


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6))
def test_definiteness_agrees_with_eigenvalues(entries: list[float]) -> None:
    a = np.array(
        [[entries[0], entries[1], entries[2]], [entries[1], entries[3], entries[4]], [entries[2], *entries[4:]]]
    )
    smallest = np.linalg.eigvalsh(a)[0]
    if abs(smallest) > 1e-9:
        assert is_positive_definite([[rational(float(x)) for x in row] for row in a]) == (smallest > 0)


@pytest.mark.parametrize(
    ("text", "value"), [("0.0038", fmpq(38, 10000)), ("-67.969", fmpq(-67969, 1000)), ("3e-4", fmpq(3, 10000))]
)
def test_printed_decimals_are_read_exactly(text: str, value: fmpq) -> None:
    assert rational(text) == value


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_are_read_bit_for_bit(value: float) -> None:
    exact = rational(value)
    assert Fraction(int(exact.p), int(exact.q)) == Fraction(value)
